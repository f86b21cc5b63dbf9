"""Where a flight's side is: where the share of pixels that show it falls."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.common import FloatArray
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.flight_sides import (
    CELL,
    WIDE_CELL,
    FlightSides,
    find_side,
    step_ends,
)
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_tracker import CameraPose

CELLS = 100


def counts(end: int, *, pixels: int = 20, inside: float = 1.0, beyond: float = 0.0) -> FloatArray:
    """Cells from the inside outwards: of so many pixels each, shares that show the flight."""
    share = np.where(np.arange(CELLS) < end, inside, beyond)
    return np.column_stack([np.full(CELLS, float(pixels)), pixels * share])


@given(st.integers(25, 75), st.floats(0.75, 1.0), st.floats(0.0, 0.25))
def test_a_side_is_found_where_the_flight_ends(end: int, inside: float, beyond: float) -> None:
    """Holes inside and stray pixels beyond, up to a quarter, change nothing."""
    assert find_side(counts(end, inside=inside, beyond=beyond)) == end


def test_a_side_that_the_image_does_not_show_is_not_guessed() -> None:
    """Too few pixels, a flight that goes on to the image's edge, and one that is not there."""
    assert find_side(counts(50, pixels=1)) is None
    assert find_side(counts(CELLS)) is None
    assert find_side(counts(0)) is None
    assert find_side(counts(50, inside=0.6, beyond=0.4)) is None
    few = counts(50)
    few[50:] = 0.0  # the image ends with the flight
    assert find_side(few) is None


def test_two_sides_tell_more_than_one() -> None:
    """What makes the flight seem wider on both sides does not move its middle."""
    expected = StairBelief(
        stamp=0.0, origin=np.zeros(2), passed=0, places=np.ones(1), heights=np.zeros(2), yaw=0.0,
        overhang=0.0, rise=0.1, run=0.3, covariance=np.eye(7), count_least=1, count_most=1,
        is_open=False, right=-0.8, left=0.6,
    )  # fmt: skip
    both = FlightSides(-0.8 - CELL + 0.02, 0.6 + CELL + 0.02, 1.5)
    right = FlightSides(-0.8 - CELL + 0.02, np.nan, 1.5)
    assert abs(both.off(expected) - 0.02) < 1e-12
    assert abs(right.off(expected) - 0.02) > 0.9 * CELL
    assert both.sigma < right.sigma


PLACES, HEIGHTS = np.linspace(1.0, 1.9, 4), np.linspace(0.0, 0.6, 5)
CAMERA = CameraPose(level_rotation(pitch=float(np.radians(35.0))), np.array([0.0, 0.0, 0.95]))
MODEL = D435.model.decimated(2)


def image_of(lefts: list[float], right: float = 2.5) -> FloatArray:
    """A flight whose steps end at `lefts`, as an exact camera sees it, and ground around it."""
    boxes = build_boxes(PLACES, HEIGHTS, left=2.5, right=right)
    boxes[1:, 4] = lefts
    scene = Scene("up", PLACES, HEIGHTS, 0.0, 0.0, (2.5, right), boxes)
    return render(scene, MODEL, CAMERA.R_WC, 0.95)


def believed() -> StairBelief:
    return StairBelief(
        stamp=0.0, origin=np.zeros(2), passed=0, places=PLACES, heights=HEIGHTS, yaw=0.0,
        overhang=0.0, rise=0.15, run=0.3, covariance=np.eye(13), count_least=4, count_most=None,
        is_open=False, right=-0.6, left=0.6,
    )  # fmt: skip


def test_each_step_ends_where_it_is_seen_to_end() -> None:
    """A flight whose left side comes nearer by 0.15 m a step: each end is told to a cell."""
    lefts = [0.85, 0.70, 0.55, 0.40]
    ends = step_ends(image_of(lefts), MODEL, CAMERA, believed())
    assert ends.shape == (4, 2)
    assert np.all(np.abs(ends[:, 1] - lefts) <= WIDE_CELL)


@pytest.mark.parametrize("right", [2.5, 0.5])
def test_no_end_is_told_where_the_image_ends(right: float) -> None:
    """Of a flight wider than the image nothing is known there; the other side is told by itself."""
    ends = step_ends(image_of([2.5] * 4, right=right), MODEL, CAMERA, believed())
    assert np.all(np.isinf(ends[:, 1]))
    if right > 1.6:
        assert np.all(np.isinf(ends[:, 0]))
    else:
        assert np.all(np.abs(ends[:, 0] + right) <= WIDE_CELL)


def test_holes_and_things_before_a_step_are_no_end() -> None:
    """What is missing over less than two cells, and a leg in view, end no step."""
    depth = image_of([2.5] * 4)
    depth[:, 230:236] = 0.0  # columns of some 4 cm
    depth[:, 150:200] = 0.3
    assert np.all(np.isinf(step_ends(depth, MODEL, CAMERA, believed())))
