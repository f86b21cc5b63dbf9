"""Feet that are not alike, one a few millimetres thicker than the others, or named alike."""

import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from drake_quad.robot.legs import SHORT_NAMES, SIGNS
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.diagram import StairClimb, stair_climb_of
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.run import simulate

STAND = (
    "design: given\ncourse: [{kind: floor, length: 4.0}]\nmission: [{kind: stand, duration: 1.0}]"
)
RADIUS, THIN = 0.02, 0.017  # [m] of the shipped feet, and of one that is thinner


def shipped() -> str:
    """The text of the shipped robot's file."""
    return Path(str(resources.files("drake_quad_models") / "paper_quadruped.urdf")).read_text()


def begin(model: Path) -> tuple[StairClimb, Context]:
    """A standing robot, 10 ms on."""
    text = f"robot: {{model: {model}}}\n{STAND}"
    climb = stair_climb_of(prepare(parse_scenario(text, source="test"), source="test"))
    simulator = Simulator(climb.diagram)
    simulator.AdvanceTo(0.01)
    return climb, simulator.get_context()


@pytest.fixture
def model(tmp_path: Path) -> Path:
    text, file = shipped(), tmp_path / "unlike.urdf"
    foot = '<collision name="FR_foot"><origin xyz="0 0 -0.7"/><geometry><sphere radius="{}"/>'
    assert foot.format(RADIUS) in text
    file.write_text(text.replace(foot.format(RADIUS), foot.format(THIN)))
    return file


def test_each_foot_knows_how_much_smaller_it_is(model: Path) -> None:
    """The thickest foot's radius is the robot's; of the others what they lack is known."""
    robot = load_robot(str(model))
    assert robot.foot_radius == pytest.approx(RADIUS)
    np.testing.assert_allclose(robot.foot_smaller, [0.0, RADIUS - THIN, 0.0, 0.0], atol=1e-12)


def test_a_smaller_foot_is_in_a_ball_like_the_others(model: Path) -> None:
    """Its leg ends in a ball of the others' radius that holds the foot and touches its end."""
    robot, shipped_one = load_robot(str(model)), load_robot("paper_quadruped")
    nearer = shipped_one.geometry.shank - robot.geometry.shank
    np.testing.assert_allclose(nearer, robot.foot_smaller, atol=1e-12)
    ends = robot.geometry.shank + robot.foot_radius
    np.testing.assert_allclose(
        ends, shipped_one.geometry.shank + np.array([RADIUS, THIN, RADIUS, RADIUS]), atol=1e-12
    )


@pytest.mark.long
def test_all_feet_land_when_they_are_to(tmp_path: Path) -> None:
    """One foot is 4 mm thicker than the others, and is set down when they are.

    Planned for one radius of all, a foot that much thicker met the ground by a fifth of a swing
    before its time, and stood 20 mm aside of its foothold.
    """
    text, file = shipped(), tmp_path / "thick.urdf"
    sphere = '<collision name="{}_foot"><origin xyz="0 0 -0.7"/><geometry><sphere radius="{}"/>'
    for leg in ("FR", "RL", "RR"):
        assert sphere.format(leg, RADIUS) in text
        text = text.replace(sphere.format(leg, RADIUS), sphere.format(leg, 0.016))
    file.write_text(text)
    result = simulate(
        parse_scenario(
            f"robot: {{model: {file}}}\ndesign: given\ncourse: [{{kind: floor, length: 6.0}}]\n"
            "mission: [{kind: walk, distance: 0.3}]",
            source="test",
        )
    )
    assert result.outcome == "goal_reached"
    log_period = float(np.median(np.diff(result.table["t"].to_numpy())))
    for leg in SHORT_NAMES:
        bears, stands = (
            result.table[f"{leg}_{name}"].to_numpy().astype(bool)
            for name in ("bearing", "standing_planned")
        )
        landed, planned = (np.flatnonzero(~v[:-1] & v[1:]) for v in (bears, stands))
        apart = planned - landed[np.searchsorted(landed, planned, side="right") - 1]
        assert len(planned) > 0
        # Feet that are alike come 0.11 s early; with one radius for all, the thick one did by 0.18.
        assert np.all(apart * log_period < 0.15), leg
        assert np.all(apart > 0), leg  # as sensed; by the plan it would be at once


def test_all_feet_are_on_the_ground_from_the_first(model: Path) -> None:
    """Nothing is dropped: as physics begins, every foot bears within a few milliseconds."""
    climb, root = begin(model)
    context = climb.plant.GetMyContextFromRoot(root)
    results = climb.plant.get_contact_results_output_port().Eval(context)
    assert results.num_point_pair_contacts() == 4
    forces = [results.point_pair_contact_info(i).contact_force()[2] for i in range(4)]
    assert np.all(np.abs(forces) > 50.0)


def test_feet_are_told_apart_by_their_legs(tmp_path: Path) -> None:
    """A file may call all feet the same, and their pictures, too: each still has its own sensor."""
    text = re.sub(r'name="[FR][LR]_foot"', 'name="sole"', shipped())
    text = text.replace('visual name="foot"', 'visual name="sole"')
    assert text.count('name="sole"') >= 8
    file = tmp_path / "soles.urdf"
    file.write_text(text)
    climb, root = begin(file)
    monitor = climb.diagram.GetSubsystemByName("contact_monitor")
    context = monitor.GetMyContextFromRoot(root)
    bearing = monitor.GetOutputPort("contact_state_measured").Eval(context)
    np.testing.assert_array_equal(bearing, np.ones(4))
    places = monitor.GetOutputPort("foot_contact_position").Eval(context).reshape(4, 3)
    np.testing.assert_array_equal(
        np.sign(places[:, :2] - places[:, :2].mean(axis=0)), SIGNS[:, :2].astype(float)
    )
