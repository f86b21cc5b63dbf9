"""How far it is level beyond the last nosing, seen by an ideal camera and by a D435."""

from collections.abc import Sequence

import numpy as np
import pytest

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotation_exp
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_noise import (
    IDEAL_DEPTH,
    STEREO_NOISE,
    StereoNoise,
    add_noise,
    draw_camera_errors,
)
from drake_quad.perception.level_beyond import (
    AROUND,
    Level,
    image_sides,
    level_beyond,
    steps_below_view,
    turning_place,
)
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_tracker import CameraPose

MODEL = D435.model.decimated(2)
HEIGHT, PITCH = 1.08, 30.0
RISE, RUN, FIRST = 0.14, 0.4, 0.9
LANDING = 2.0  # [m] that is told


def seen_level(
    count: int,
    told: int,
    *,
    noise: StereoNoise,
    landing: float = 2.0,
    sides: tuple[float, float] = (0.8, 0.8),
    beside: Sequence[Sequence[float]] = (),
    holes: Sequence[tuple[float, float]] = (),
    off: float = 0.0,
) -> Level:
    """What is seen beyond nosing `told` of a flight of `count` steps, the last one a landing.

    Of the ground between each two of `holes`, from side to side, there is no pixel. Nosings are
    told `off` farther than they are [m].
    """
    places = FIRST + RUN * np.arange(count, dtype=np.float64)
    heights = RISE * np.arange(count + 1, dtype=np.float64)
    boxes = build_boxes(places, heights, left=sides[0], right=sides[1], beyond=landing)
    boxes = np.vstack([boxes, np.array(beside).reshape(-1, 6)])
    scene = Scene("up", places, heights, 0.0, 0.0, (0.8, 0.8), boxes)
    generator = np.random.default_rng(3)
    errors = draw_camera_errors(noise, D435, MODEL, generator)
    R_LC = level_rotation(pitch=np.radians(PITCH))
    exact = render(scene, MODEL, R_LC @ rotation_exp(*errors.tilt), HEIGHT)
    depth = add_noise(
        exact, noise=noise, errors=errors, camera=D435, model=MODEL, generator=generator
    )
    pose = CameraPose(R_LC, np.array([0.0, 0.0, HEIGHT]))
    p_W = MODEL.deproject(depth) @ R_LC.T + pose.p_WC
    for right, left in holes:
        depth[(p_W[..., 0] > places[-1]) & (p_W[..., 1] > right) & (p_W[..., 1] < left)] = 0.0
    told_of = belief_of(places[:told] + off, heights[: told + 1])
    return level_beyond(depth, MODEL, pose, told_of, landing=LANDING)


def belief_of(places: FloatArray, heights: FloatArray) -> StairBelief:
    n = len(places)
    return StairBelief(
        stamp=0.0, origin=np.zeros(2), passed=0, places=places, heights=heights, yaw=0.0,
        overhang=0.0, rise=RISE, run=RUN, covariance=1e-4 * np.eye(2 * n + 5), count_least=n,
        count_most=None, is_open=False, right=-0.8, left=0.8,
    )  # fmt: skip


@pytest.mark.parametrize("noise", [IDEAL_DEPTH, STEREO_NOISE])
@pytest.mark.parametrize("landing", [1.0, 2.0])
def test_a_landing_is_as_long_as_it_is(noise: StereoNoise, landing: float) -> None:
    """To 0.15 m, with a camera's errors or without; and the flight ends there."""
    found = seen_level(4, 4, noise=noise, landing=landing)
    assert found.length == pytest.approx(landing, abs=0.15) and found.ends_flight


@pytest.mark.parametrize("noise", [IDEAL_DEPTH, STEREO_NOISE])
@pytest.mark.parametrize("told", [2, 3, 4])
def test_a_riser_that_the_fit_missed_is_no_landing(noise: StereoNoise, told: int) -> None:
    """Where one more step follows it is level to its riser at most: no end is claimed."""
    found = seen_level(told + 1, told, noise=noise)
    assert found.length <= RUN + 0.1 and not found.ends_flight


@pytest.mark.parametrize("off", [-0.18, -0.1, 0.1])
def test_a_flight_ends_or_goes_on_wherever_its_last_nosing_is_told(off: float) -> None:
    """Told too near by nearly half a run, a landing is one, and a riser that was missed is none."""
    assert seen_level(4, 4, noise=IDEAL_DEPTH, off=off).ends_flight
    assert not seen_level(5, 4, noise=IDEAL_DEPTH, off=off).ends_flight


def test_steps_below_the_image_are_counted() -> None:
    """Of nosings from 0.2 m on those are below the view that no row shows, seen by their place."""
    R_WC = level_rotation(pitch=np.radians(PITCH))
    pose = CameraPose(R_WC, np.array([0.0, 0.0, HEIGHT]))
    steepest = np.radians(PITCH) + np.arctan((MODEL.height - 1 - MODEL.cy) / MODEL.fy)
    heights = RISE * np.arange(5.0)
    for first in (0.2, 0.45, 0.52, 0.6, 1.0):
        places = first + 0.3 * np.arange(4.0)
        nearest = (HEIGHT - heights[1:]) / np.tan(steepest)
        found = steps_below_view(MODEL, pose, belief_of(places, heights))
        assert found == np.count_nonzero(places < nearest)


def test_nothing_is_claimed_of_what_nobody_sees() -> None:
    """A last tread above the camera shows no ground beyond its nosing."""
    assert seen_level(9, 9, noise=IDEAL_DEPTH)[:2] == (0.0, False)


@pytest.mark.parametrize("noise", [IDEAL_DEPTH, STEREO_NOISE])
@pytest.mark.parametrize("sides", [(0.8, 0.8), (1.1, 0.6), (0.45, 1.0)])
def test_the_ground_to_turn_on_is_as_wide_as_it_is(
    noise: StereoNoise, sides: tuple[float, float]
) -> None:
    """Never wider than it is by half a cell, nor narrower than by two; left is left."""
    found = seen_level(3, 3, noise=noise, sides=sides)
    assert sides[0] - 0.2 <= found.left <= sides[0] + 0.05
    assert sides[1] - 0.2 <= -found.right <= sides[1] + 0.05


def test_what_stands_beside_the_place_to_turn_on_ends_it() -> None:
    """A block 0.3 m high, beyond the treads told, on the left is no ground; the right is as was."""
    n, left, sides = 3, 0.85, (1.2, 0.8)
    middle = FIRST + (n - 1) * RUN + turning_place(belief_of(np.ones(n), np.ones(n + 1)), LANDING)
    top = n * RISE + 0.3
    block = (middle - AROUND, left, 0.0, middle + AROUND, sides[0], top)
    free, blocked = (
        seen_level(n, n, noise=IDEAL_DEPTH, sides=sides, beside=beside) for beside in ((), (block,))
    )
    assert blocked.left <= left + 0.05 < free.left
    assert blocked.right == free.right


@pytest.mark.parametrize("noise", [IDEAL_DEPTH, STEREO_NOISE])
def test_a_hole_of_the_image_does_not_end_the_ground_and_a_wider_one_does(
    noise: StereoNoise,
) -> None:
    """Without pixels over 0.1 m the ground is as wide as it was; over 0.25 m it ends there."""
    whole, pierced, torn = (
        seen_level(3, 3, noise=noise, sides=(0.8, 0.8), holes=holes)
        for holes in ((), ((0.3, 0.4), (-0.4, -0.3)), ((0.28, 0.53),))
    )
    assert (pierced.right, pierced.left) == (whole.right, whole.left)
    assert torn.left < 0.3 and torn.right == whole.right


def test_ground_to_turn_on_that_nobody_sees_has_no_width() -> None:
    """Where the landing ends before it, and where a last tread is above the camera."""
    assert seen_level(3, 3, noise=IDEAL_DEPTH, landing=0.6)[3:5] == (0.0, 0.0)
    assert seen_level(9, 9, noise=IDEAL_DEPTH)[3:5] == (0.0, 0.0)


@pytest.mark.parametrize("pitch", [-20.0, 0.0, 35.0])
@pytest.mark.parametrize("yaw", [-0.2, 0.0, 0.1])
def test_the_image_ends_where_the_last_nosing_leaves_it(pitch: float, yaw: float) -> None:
    """Both ends of the nosing in view project onto the first and the last column."""
    told = belief_of(FIRST + RUN * np.arange(2.0), RISE * np.arange(3.0))
    c, s = np.cos(yaw), np.sin(yaw)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    pose = CameraPose(turned @ level_rotation(pitch=np.radians(pitch)), np.array([0.1, 0.05, 0.5]))
    right, left = image_sides(MODEL, pose, told)
    assert right < 0.05 < left
    for end, column in ((right, MODEL.width - 1), (left, 0)):
        point = np.array([told.places[-1], end, told.heights[-1]])
        x, _, z = (point - pose.p_WC) @ pose.R_WC
        assert MODEL.cx + MODEL.fx * x / z == pytest.approx(column)


def test_treads_are_cut_by_the_image_where_they_are_seen_to_its_sides() -> None:
    """An image taken 0.5 m before its last nosing is narrower than it; not one from 4 m."""
    told = belief_of(FIRST + RUN * np.arange(2.0), RISE * np.arange(3.0))
    depth = np.zeros((MODEL.height, MODEL.width))
    for ahead, cut in ((0.8, True), (-2.7, False)):
        pose = CameraPose(level_rotation(pitch=np.radians(20.0)), np.array([ahead, 0.0, 0.5]))
        level = level_beyond(depth, MODEL, pose, told, landing=LANDING)
        assert level.cut_right == level.cut_left == cut


def test_each_step_is_looked_at_for_its_ends() -> None:
    """A flight 0.4 m wide to the right and 0.6 m to the left of the climb's line."""
    found = seen_level(4, 4, noise=IDEAL_DEPTH, sides=(0.6, 0.4))
    assert found.ends is not None and found.ends.shape == (4, 2)
    assert found.ends[1:] == pytest.approx(np.tile([-0.4, 0.6], (3, 1)), abs=0.1)
