"""Where a foot may rest in between."""

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from drake_quad.common import FloatArray
from drake_quad.gait.transition_detour import Triple, best_place, clip, places_with_margin
from drake_quad.stability.support_polygon import Point, stability_margin

BOX: list[Point] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
coordinate = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
point = st.tuples(coordinate, coordinate)
near_middle = st.tuples(*(st.floats(-0.2, 0.2).map(lambda x: round(x, 3)),) * 2)
triples = st.tuples(near_middle, point, point)


def inside(polygon: list[Point], q: Point, tol: float) -> bool:
    return bool(polygon) and stability_margin(q, polygon) >= -tol


@given(triples, arrays(np.float64, (200, 2), elements=st.floats(-1.0, 1.0)), st.floats(0.005, 0.2))
@settings(max_examples=50)
def test_admissible_places_are_exactly_those_with_the_margin(
    triple: Triple, places: FloatArray, margin: float
) -> None:
    """A place is in the polygon if and only if the three feet hold the margin."""
    com, a, b = triple
    polygon = places_with_margin([triple], BOX, margin)
    for q in places.tolist():
        value = stability_margin(com, [a, b, q])
        if abs(value - margin) > 1e-6:
            assert inside(polygon, (q[0], q[1]), 1e-7) == (value > margin)


@given(st.lists(triples, min_size=1, max_size=3), point)
@settings(max_examples=50)
def test_best_place_is_attained_and_not_beaten(some: list[Triple], near: Point) -> None:
    """The margin returned is the place's own, and no place of a grid has a larger one."""

    def worst(q: Point) -> float:
        return min(stability_margin(com, [a, b, q]) for com, a, b in some)

    assume(all(abs(stability_margin(com, [a, b, a])) > 1e-3 for com, a, b in some))
    found = best_place(some, BOX, floor=0.0, near=near)
    grid = [(x, y) for x in np.linspace(-1, 1, 15) for y in np.linspace(-1, 1, 15)]
    best_of_grid = max(worst(q) for q in grid)
    if found is None:
        assert best_of_grid < 1e-6
    else:
        assert worst(found[1]) >= found[0] - 1e-7
        assert best_of_grid <= found[0] + 1e-6


def test_two_opposite_lifts_leave_a_ray() -> None:
    """While two legs of one diagonal are lifted in turn, a third foot has to be on the other one.

    It is the paper's case: exactly on that diagonal, beyond the centre of mass.
    """
    com, front, hind = (0.0, 0.0), (0.525, -0.27), (-0.525, -0.27)
    some = [(com, (0.4, 0.27), front), (com, front, hind)]
    found = best_place(some, BOX, floor=0.0, near=(-0.4, 0.27))
    assert found is not None
    margin, (x, y) = found
    assert margin == pytest.approx(0.0, abs=1e-9)
    assert x * front[1] - y * front[0] == pytest.approx(0.0, abs=1e-8) and x < 0.0
    assert best_place(some, BOX, floor=1e-3, near=(-0.4, 0.27)) is None


def test_of_equally_good_places_the_nearest_is_taken() -> None:
    """A foot that can rest where it began, at no loss, does."""
    some = [((0.0, 0.0), (-0.5, -0.1), (0.5, -0.1))]
    found = best_place(some, BOX, floor=0.0, near=(0.0, 0.9))
    assert found is not None and found[1] == (0.0, 0.9)
    assert found[0] == pytest.approx(0.1)


@given(point, st.floats(-np.pi, np.pi), st.floats(-1.0, 1.0), point)
def test_clipping_keeps_exactly_the_half_plane(
    q: Point, angle: float, offset: float, other: Point
) -> None:
    """A point of the polygon survives if and only if it satisfies the inequality."""
    plane = (float(np.cos(angle)), float(np.sin(angle)), offset)
    clipped = clip(BOX, plane)
    excess = plane[0] * q[0] + plane[1] * q[1] - offset
    assume(abs(excess) > 1e-8)
    assert inside(clipped, q, 1e-8) == (excess < 0.0)
