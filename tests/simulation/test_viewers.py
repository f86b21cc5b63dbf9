"""Live viewers, over channels of their own: nothing leaves the process."""

import gc
from typing import cast

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.viewers import (
    CAMERA_OFFSET,
    CAMERA_PERIOD,
    CameraFollower,
    MakeMeldisViewer,
    MakeMeshcatViewer,
    Together,
)


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


class Seen:
    """A Meshcat that notes where its camera is put."""

    def __init__(self) -> None:
        self.poses: list[tuple[list[float], list[float]]] = []
        self.targets: list[list[float]] = []

    def SetCameraPose(self, camera: np.ndarray, target: np.ndarray) -> None:  # noqa: D102
        self.poses.append((camera.tolist(), target.tolist()))

    def SetCameraTarget(self, target: np.ndarray) -> None:  # noqa: D102
        self.targets.append(target.tolist())


def test_the_camera_goes_with_the_robot() -> None:
    """Its target at every look; itself only after metres, for people may have turned it."""
    seen = Seen()
    follower = CameraFollower(cast(Meshcat, seen), base=1)
    simulator = Simulator(follower)
    context = simulator.get_mutable_context()
    port = follower.GetInputPort("body_poses")
    for k in range(41):
        robot = RigidTransform(np.array([0.1 * k, 0.5, 0.3]))
        port.FixValue(context, AbstractValue.Make([RigidTransform(), robot]))
        simulator.AdvanceTo(CAMERA_PERIOD * k + 0.01)
    at = [pose[1] for pose in seen.poses]
    np.testing.assert_allclose(np.array(at)[:, 0], [0.0, 2.1], atol=1e-9)
    for camera, target in seen.poses:
        np.testing.assert_allclose(np.array(camera) - target, CAMERA_OFFSET)
    assert len(seen.targets) == 39 and seen.targets[-1] == pytest.approx([4.0, 0.5, 0.3])


@pytest.mark.parametrize("follow", [True, False])
def test_a_camera_may_stay_where_it_is(meshcat: Meshcat, follow: bool) -> None:
    """Only with `follow` is there what moves it; the run is the same to the bit either way."""
    prepared = prepare(load_scenario("flat_walk"))
    bare = stair_climb_of(prepared)
    shown = stair_climb_of(prepared, visualize=MakeMeshcatViewer(meshcat, follow=follow))
    assert shown.diagram.HasSubsystemNamed("camera") == follow
    states = []
    for made in (bare, shown):
        simulator = Simulator(made.diagram)
        simulator.AdvanceTo(0.11)
        inner = made.plant.GetMyContextFromRoot(simulator.get_context())
        states.append(np.array(made.plant.GetPositionsAndVelocities(inner)))
    assert np.array_equal(states[0], states[1])
