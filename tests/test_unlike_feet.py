"""Feet that are not alike, as one of a file's may be a few millimetres thicker than the others."""

from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_quad.diagram import stair_climb_of
from drake_quad.preparation import prepare
from drake_quad.robot.load_robot import load_robot
from drake_quad.scenario import parse_scenario

THIN = 0.005  # [m] of one foot; the others have 0.008


@pytest.fixture
def model(tmp_path: Path) -> str:
    text = Path(str(resources.files("drake_quad_models") / "paper_quadruped.urdf")).read_text()
    foot = '<collision name="FR_foot"><origin xyz="0 0 -0.7"/><geometry><sphere radius="{}"/>'
    assert foot.format(0.008) in text
    file = tmp_path / "unlike.urdf"
    file.write_text(text.replace(foot.format(0.008), foot.format(THIN)))
    return str(file)


def test_each_foot_knows_how_much_smaller_it_is(model: str) -> None:
    """The thickest foot's radius is the robot's; of the others what they lack is known."""
    robot = load_robot(model)
    assert robot.foot_radius == pytest.approx(0.008)
    assert sorted(robot.foot_smaller) == pytest.approx([0.0, 0.0, 0.0, 0.003])


def test_all_feet_are_on_the_ground_from_the_first(model: str) -> None:
    """Nothing is dropped: as physics begins, every foot bears within a few milliseconds."""
    text = f"robot: {{model: {model}}}\ncourse: [{{kind: floor, length: 4.0}}]\n"
    text += "design: given\nmission: [{kind: stand, duration: 1.0}]"
    climb = stair_climb_of(prepare(parse_scenario(text, source="test"), source="test"))
    simulator = Simulator(climb.diagram)
    simulator.AdvanceTo(0.01)
    context = climb.plant.GetMyContextFromRoot(simulator.get_context())
    results = climb.plant.get_contact_results_output_port().Eval(context)
    assert results.num_point_pair_contacts() == 4
    forces = [results.point_pair_contact_info(i).contact_force()[2] for i in range(4)]
    assert np.all(np.abs(forces) > 50.0)
