"""The stair estimator alone, through its ports and its own Context."""

import numpy as np
from growing_rig import FIRST, RISE, RUN, first_map
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from rig import fix_inputs

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.common import read_only
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import stereo_accuracy
from drake_quad.perception.growing_map import match_look
from drake_quad.perception.sight import MapRevision
from drake_quad.systems.depth_camera import DepthImage
from drake_quad.systems.stair_estimator import StairEstimator, pose_at_capture

MODEL = D435.model.decimated(2)
R_BC = level_rotation(pitch=np.radians(35.0))
FEET = np.array([0.1, 0.2, 1.0, 0.1, -0.2, 1.0, -0.6, 0.2, 1.0, -0.6, -0.2, 1.0])


def test_without_tracking_each_image_is_searched_anew() -> None:
    """Of the same image twice it says the same twice; tracked, the second answer is another one."""
    places, heights = 0.9 + 0.3 * np.arange(4.0), 0.15 * np.arange(5.0)
    scene = Scene("up", places, heights, 0.0, 0.0, (0.8, 0.8), build_boxes(places, heights))
    depth = render(scene, MODEL, R_BC, 0.95)
    pose = read_only(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.75]))
    found = {}
    for tracking in (True, False):
        estimator = StairEstimator(
            model=MODEL, R_BC=R_BC, p_BC=np.array([0.0, 0.0, 0.2]), tracking=tracking,
            accuracy=stereo_accuracy(D435.disparity_scale()),
        )  # fmt: skip
        simulator = Simulator(estimator)
        context = simulator.get_mutable_context()
        estimator.GetInputPort("feet").FixValue(context, FEET - np.tile([0.0, 0.0, 1.0], 4))
        estimator.GetInputPort("contacts").FixValue(context, np.ones(4))
        told = []
        for stamp in (0.0, 0.1):
            image = DepthImage(stamp, read_only(np.where(np.isfinite(depth), depth, 0.0)), pose)
            estimator.GetInputPort("depth_measured").FixValue(context, AbstractValue.Make(image))
            simulator.AdvanceTo(stamp + 0.01)
            belief = estimator.GetOutputPort("stairs").Eval(context).belief
            assert belief is not None and belief.stamp == stamp
            told.append(belief.places)
        found[tracking] = told
    assert np.array_equal(*found[False])
    assert not np.array_equal(*found[True])


def test_stairs_in_an_image_become_a_belief_in_the_world() -> None:
    """A base turned left and raised by 1 m sees the flight ahead of it, at its place in W."""
    places, heights = 0.9 + 0.3 * np.arange(4), 0.15 * np.arange(5)
    scene = Scene("up", places, heights, 0.0, 0.0, (0.8, 0.8), build_boxes(places, heights))
    depth = render(scene, MODEL, R_BC, 0.95)
    turn = np.radians(60.0)
    pose = np.array([np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2), 2.0, 3.0, 1.75])
    estimator = StairEstimator(
        model=MODEL, R_BC=R_BC, p_BC=np.array([0.0, 0.0, 0.2]),
        accuracy=stereo_accuracy(D435.disparity_scale()),
    )  # fmt: skip
    simulator = Simulator(estimator)
    context = simulator.get_mutable_context()
    port = estimator.GetOutputPort("stairs")
    assert port.Eval(context).belief is None
    image = DepthImage(0.0, read_only(np.where(np.isfinite(depth), depth, 0.0)), read_only(pose))
    estimator.GetInputPort("depth_measured").FixValue(context, AbstractValue.Make(image))
    estimator.GetInputPort("feet").FixValue(context, FEET)
    estimator.GetInputPort("contacts").FixValue(context, np.ones(4))
    simulator.AdvanceTo(0.01)
    seen = port.Eval(context)
    assert seen.stamp == 0.0 and seen.belief is not None
    assert np.allclose(seen.belief.origin, [2.0, 3.0])
    assert abs(seen.belief.yaw - turn) < np.radians(0.3)
    assert abs(seen.belief.places[0] - 0.9) < 0.006
    assert abs(seen.belief.heights[1] - 1.15) < 0.004
    blank = DepthImage(0.0, read_only(np.zeros_like(depth)), read_only(pose))
    estimator.GetInputPort("depth_measured").FixValue(context, AbstractValue.Make(blank))
    simulator.AdvanceTo(0.11)  # an image of the same time is no news: nobody looks at it
    assert port.Eval(context).belief is not None
    late = DepthImage(0.1, blank.depth, read_only(pose))
    estimator.GetInputPort("depth_measured").FixValue(context, AbstractValue.Make(late))
    simulator.AdvanceTo(0.21)
    assert port.Eval(context).belief is None and port.Eval(context).stamp == 0.1


def test_the_cameras_pose_is_known_as_well_as_the_bases() -> None:
    """A turn of the base moves a camera 0.6 m ahead and 0.2 m above, each axis by its lever."""
    turn, place = np.array([2e-3, 3e-3, 1e-3]), np.array([4e-3, 5e-3, 6e-3])
    base = read_only(np.array([1.0, 0.0, 0.0, 0.0, 2.0, 3.0, 0.75]))
    image = DepthImage(0.0, read_only(np.zeros((1, 1))), base, np.concatenate([turn, place]))
    pose = pose_at_capture(image, R_BC, np.array([0.6, 0.0, 0.2]))
    assert np.array_equal(pose.turn_sigmas, turn) and pose.tilt_sigma == 3e-3
    moved = [0.2 * turn[1], np.hypot(0.2 * turn[0], 0.6 * turn[2]), 0.6 * turn[1]]
    assert np.allclose(pose.place_sigmas, np.hypot(place, moved))
    told = pose_at_capture(DepthImage(0.0, image.depth, base), R_BC, np.array([0.6, 0.0, 0.2]))
    assert not np.any(told.turn_sigmas) and not np.any(told.place_sigmas)


def test_on_a_known_flight_steps_are_matched_with_the_map() -> None:
    """A base on a tread, which sees the last of a flight's steps and the landing, tells those.

    Its own feet are two treads below the first step in view: without the map nothing is told.
    """
    places, heights = 0.45 + 0.3 * np.arange(4.0), 0.16 * np.arange(5.0)
    scene = Scene("up", places, heights, 0.0, 0.0, (0.8, 0.8), build_boxes(places, heights))
    depth = render(scene, MODEL, R_BC, 0.95)
    below = 3  # steps that the camera has passed
    base = np.array([FIRST + 3 * RUN - 0.45, 0.0, below * RISE + 0.75])
    image = DepthImage(0.0, read_only(np.where(np.isfinite(depth), depth, 0.0)),
                       read_only(np.array([1.0, 0.0, 0.0, 0.0, *base])))  # fmt: skip
    feet = np.array([[x, y, RISE * k] for x, y, k in (
        (2.45, 0.3, 1), (2.45, -0.3, 1), (2.0, 0.3, 0), (2.0, -0.3, 0))])  # fmt: skip
    told = []
    for known in (None, MapRevision(0, 0.0, None, None, first_map(5))):
        estimator = StairEstimator(
            model=MODEL, R_BC=R_BC, p_BC=np.array([0.0, 0.0, 0.2]), tracking=False, landing=2.0,
            accuracy=stereo_accuracy(D435.disparity_scale()),
        )  # fmt: skip
        simulator = Simulator(estimator)
        fix_inputs(
            estimator, simulator.get_mutable_context(), depth_measured=image, feet=feet.ravel(),
            contacts=np.ones(4), **({} if known is None else {"map_known": known}),
        )  # fmt: skip
        simulator.AdvanceTo(0.01)
        told.append(estimator.GetOutputPort("stairs").Eval(simulator.get_context()))
    alone, again = told
    assert again.belief is not None and again.level is not None
    found = match_look(first_map(5), again.belief, again.level, offset=0.0, reach=0.0)
    assert found.first == below and len(found.places) == 4
    np.testing.assert_allclose(found.places, FIRST + RUN * np.arange(3, 7), atol=0.02)
    np.testing.assert_allclose(found.heights, RISE * np.arange(4, 8), atol=0.01)
    assert alone.belief is None or np.abs(alone.belief.heights[0] - below * RISE) > 0.05
