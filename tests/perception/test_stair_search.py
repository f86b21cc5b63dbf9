"""What a search makes of badly known attitudes, of open risers, and of walls beside the stairs."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotation_exp
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import DepthFrame, prepare_frame, stereo_accuracy
from drake_quad.perception.see import scaled_by, see_stairs
from drake_quad.perception.stair_candidates import candidate_levels
from drake_quad.perception.stair_fit import StairPriors
from drake_quad.perception.stair_profile import PITCH
from drake_quad.perception.stair_search import find_stairs, levelled

MODEL = D435.model.decimated(2)
HEIGHT, DOWN = 0.95, np.radians(35.0)
PRIORS = replace(StairPriors(), floor=(-HEIGHT, 0.01))


def frame_of(boxes: FloatArray, *, pitch: float = DOWN, off: float = 0.0, tilt: float = 0.004,
             yaw: float = 0.0) -> DepthFrame:  # fmt: skip
    """The image of boxes by a camera whose pitch is told as `off` [rad] more than it is."""
    scene = Scene("up", np.zeros(0), np.zeros(1), yaw, 0.0, (0.8, 0.8), boxes)
    depth = render(scene, MODEL, level_rotation(pitch=pitch), HEIGHT)
    accuracy = stereo_accuracy(D435.disparity_scale(), tilt=tilt)
    return prepare_frame(depth, MODEL, level_rotation(pitch=pitch + off), accuracy)


def flight(rise: float, count: int, *, is_open: bool = False) -> FloatArray:
    places = 0.8 + 0.29 * np.arange(count)
    return build_boxes(places, rise * np.arange(count + 1), is_open=is_open)


@pytest.mark.parametrize("off", [-4.0, 0.0, 4.0])
def test_level_surfaces_tell_what_level_is(off: float) -> None:
    """Of an attitude known to 2 degrees, the treads' normals give the error to 0.3 degrees."""
    frame = frame_of(flight(0.16, 5), off=np.radians(off), tilt=np.radians(2.0))
    believed, told = candidate_levels(frame)
    assert believed == (0.0, 0.0)
    assert np.degrees(told) == pytest.approx((0.0, -off), abs=0.3)
    normal = levelled(frame, told).row_step * MODEL.fy
    true = rotation_exp(0.0, 0.0, 0.0) @ level_rotation(pitch=DOWN)[:, 1]
    assert np.allclose(normal / np.linalg.norm(normal), true, atol=0.006)


def test_an_attitude_that_is_known_is_not_looked_for() -> None:
    """Of a calibrated camera there is one attitude to search by."""
    assert candidate_levels(frame_of(flight(0.16, 5))) == [(0.0, 0.0)]


def test_stairs_are_found_with_the_tilt_that_the_camera_has_wrong() -> None:
    """A pitch that is 4 degrees off, and known to 2, comes out with the stairs."""
    off = np.radians(4.0)
    frame = frame_of(flight(0.16, 5), off=off, tilt=np.radians(2.0))
    found = find_stairs(frame, PRIORS, np.random.default_rng(0))
    assert found is not None and found.fit.shape.up
    assert found.fit.other(PITCH) == pytest.approx(-off, abs=np.radians(0.4))
    assert np.diff(found.fit.heights)[:3] == pytest.approx(0.16, abs=0.006)


@pytest.mark.parametrize("is_open", [False, True])
def test_open_risers_are_told_from_closed_ones(is_open: bool) -> None:
    """The same treads with and without something between them."""
    frame = frame_of(flight(0.16, 5, is_open=is_open))
    found = find_stairs(frame, PRIORS, np.random.default_rng(0))
    assert found is not None and found.fit.shape.is_open == is_open


@pytest.mark.parametrize("off", [0.0, 2.0, 3.0])
def test_a_floor_out_of_view_makes_no_step_of_what_is_in_view(off: float) -> None:
    """Where nobody tells the floor's height, and the tilt is off: three steps are no four.

    The floor in view was taken for a first tread, and the floor itself for below the image.
    """
    places, heights = 0.8 + 0.3 * np.arange(3), 0.16 * np.arange(4)
    scene = Scene("up", places, heights, 0.0, 0.0, (0.8, 0.8), build_boxes(places, heights))
    depth = render(scene, MODEL, level_rotation(pitch=DOWN), HEIGHT)
    depth = np.where(np.isfinite(depth), np.round(depth, 3), 0.0)
    seen = see_stairs(depth, MODEL, pitch=float(DOWN + np.radians(off)))
    assert seen.belief is not None and seen.belief.count_least == 3
    assert seen.belief.places[0] == pytest.approx(0.8, abs=0.02)


def test_a_wall_beside_the_stairs_is_left_out() -> None:
    """A flight down along a wall has all of its near steps, within what the wall leaves."""
    places, heights = 0.57 + 0.29 * np.arange(7), -0.128 * np.arange(8)
    boxes = build_boxes(places, heights, left=0.51, right=0.72)
    boxes = np.vstack([boxes, (-3.0, 0.53, -6.0, 10.0, 0.63, 4.0)])
    frame = frame_of(boxes, pitch=np.radians(45.0), yaw=np.radians(7.3))
    found = find_stairs(frame, PRIORS, np.random.default_rng(0))
    assert found is not None and not found.fit.shape.up
    assert 3 <= found.fit.shape.steps <= 7 and found.left <= 0.56
    assert np.abs(np.diff(found.fit.heights)[:3] + 0.128).max() < 0.006


def test_a_camera_that_nobody_calibrated_may_have_all_lengths_too_long() -> None:
    """Its depths' factor, known to 1 %, is in the intervals of rise and run, and not in yaw's."""
    boxes = flight(0.16, 5)
    scene = Scene("up", np.zeros(0), np.zeros(1), 0.0, 0.0, (0.8, 0.8), boxes)
    depth = render(scene, MODEL, level_rotation(pitch=DOWN), HEIGHT)
    belief = see_stairs(depth, MODEL, pitch=DOWN).belief
    assert belief is not None
    wider = scaled_by(belief, 0.01)
    for name in ("rise", "run"):
        added = wider.sigma(name) ** 2 - belief.sigma(name) ** 2
        assert added == pytest.approx((0.01 * getattr(belief, name)) ** 2)
        assert belief.sigma(name) > 0.01 * getattr(belief, name)
    assert wider.sigma("yaw") == belief.sigma("yaw")
