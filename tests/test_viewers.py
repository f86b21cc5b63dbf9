"""Live viewers, over channels of their own: nothing leaves the process."""

import gc

import pytest
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.analysis import Simulator

from drake_quad.diagram import stair_climb_of
from drake_quad.scenario import load_scenario
from drake_quad.simulation import prepare
from drake_quad.viewers import MakeMeldisViewer, MakeMeshcatViewer, Together


@pytest.fixture(scope="module")
def meshcat() -> Meshcat:
    return Meshcat(MeshcatParams(host="127.0.0.1", port=None))


def test_both_viewers_see_the_robot_on_its_course(meshcat: Meshcat) -> None:
    """With both viewers the simulation runs, and Meshcat holds the robot and the floor."""
    climb = stair_climb_of(
        prepare(load_scenario("flat_walk")),
        visualize=Together(MakeMeshcatViewer(meshcat), MakeMeldisViewer("memq://")),
    )
    gc.collect()  # a bus that nobody owned would be gone now
    Simulator(climb.diagram).AdvanceTo(0.1)
    assert meshcat.HasPath("/drake/visualizer/paper_quadruped/FL_shank")
    assert meshcat.HasPath("/drake/contact_forces")
