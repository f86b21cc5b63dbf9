"""Where a flight's side is: where the share of pixels that show it falls."""

import numpy as np
from hypothesis import given, strategies as st

from drake_quad.common import FloatArray
from drake_quad.perception.flight_sides import CELL, FlightSides, find_side
from drake_quad.perception.stair_belief import StairBelief

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
