"""Live viewers, over channels of their own: nothing leaves the process."""

import gc

import pytest
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.analysis import Simulator

from drake_quad.diagram import MakeStairClimb
from drake_quad.scenario import control_settings, load_scenario
from drake_quad.simulation import prepare
from drake_quad.viewers import MakeMeldisViewer, MakeMeshcatViewer, Together


@pytest.fixture(scope="module")
def meshcat() -> Meshcat:
    return Meshcat(MeshcatParams(host="127.0.0.1", port=None))


def test_both_viewers_see_the_robot_on_its_course(meshcat: Meshcat) -> None:
    """With both viewers the simulation runs, and Meshcat holds the robot and the floor."""
    scenario = load_scenario("flat_walk")
    p = prepare(scenario)
    climb = MakeStairClimb(
        robot=p.robot,
        course=p.course,
        settings=p.settings,
        mission=p.tasks,
        control=control_settings(scenario),
        stance=p.stance,
        plant_config=scenario.simulation.plant,
        friction=scenario.simulation.friction,
        log_period=scenario.simulation.log_period,
        visualize=Together(MakeMeshcatViewer(meshcat), MakeMeldisViewer("memq://")),
    )
    gc.collect()  # a bus that nobody owned would be gone now
    Simulator(climb.diagram).AdvanceTo(0.1)
    assert meshcat.HasPath("/drake/visualizer/paper_quadruped/FL_shank")
    assert meshcat.HasPath("/drake/contact_forces")
