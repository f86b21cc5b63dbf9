"""Laws of the support polygon and of the stability margin."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from shapely import MultiPoint, Point

from drake_quad.common import FloatArray
from drake_quad.stability.support_polygon import (
    stability_margin,
    stability_margins,
    support_polygon,
)

coordinate = st.floats(-1.0, 1.0, allow_nan=False).map(lambda x: round(x, 6))
points = arrays(np.float64, st.tuples(st.integers(1, 6), st.just(2)), elements=coordinate)
point = arrays(np.float64, 2, elements=coordinate)
angle = st.floats(-np.pi, np.pi)


def shapely_margin(p: FloatArray, feet: FloatArray) -> float:
    """The same margin by another library's hull and distances."""
    hull = MultiPoint(feet).convex_hull
    inside = hull.geom_type == "Polygon" and hull.covers(Point(p))
    return float(hull.exterior.distance(Point(p)) if inside else -hull.distance(Point(p)))


def random_stances() -> list[tuple[FloatArray, FloatArray]]:
    rng = np.random.default_rng(4)
    cases = [(rng.normal(size=2), rng.normal(size=(rng.integers(1, 7), 2))) for _ in range(1000)]
    line = np.outer([0.0, 0.25, 0.5, 1.0], [2.0, 1.0])
    one = np.tile([0.3, -0.2], (4, 1))
    twice = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    for feet in (line, line[:2], line[::-1], one, one[:1], twice, twice[:3]):
        cases += [(rng.normal(size=2), feet) for _ in range(30)]
        cases += [(feet.mean(axis=0), feet), (feet[0], feet), (feet[-1] * 3.0, feet)]
    return cases


def test_margin_equals_an_independent_computation() -> None:
    """On random and degenerate stances the margin is shapely's to 1e-9."""
    for p, feet in random_stances():
        assert stability_margin(p, feet) == pytest.approx(shapely_margin(p, feet), abs=1e-9)


def test_vectorised_margins_are_the_scalar_ones_for_any_standing_feet() -> None:
    """Over one to four standing feet, degenerate or not, both computations agree to 1e-12."""
    cases = [(p, feet) for p, feet in random_stances() if len(feet) >= 4]
    p = np.array([case[0] for case in cases])
    feet = np.array([case[1][:4] for case in cases])
    rng = np.random.default_rng(5)
    standing = rng.random((len(p), 4)) < 0.75
    standing[:30] = False
    margins = stability_margins(p, feet, standing)
    assert np.isneginf(margins[~standing.any(axis=1)]).all()
    for k in np.flatnonzero(standing.any(axis=1)):
        expected = stability_margin(p[k], feet[k][standing[k]])
        assert margins[k] == pytest.approx(expected, abs=1e-12)


def test_no_feet_hold_nothing() -> None:
    """Without feet the polygon is empty and the margin -inf."""
    assert support_polygon(np.zeros((0, 2))).shape == (0, 2)
    assert stability_margin((0.0, 0.0), []) == -np.inf


@given(points)
def test_polygon_is_the_counterclockwise_hull(feet: FloatArray) -> None:
    """Its corners are feet, it turns left at each, and no foot is outside of it."""
    hull = support_polygon(feet)
    assert all(any((corner == foot).all() for foot in feet) for corner in hull)
    assert len({tuple(corner) for corner in hull}) == len(hull)
    if len(hull) > 2:
        a, b, c = hull, np.roll(hull, -1, axis=0), np.roll(hull, -2, axis=0)
        u, v = b - a, c - b
        assert (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0).all()
    assert all(stability_margin(foot, hull) >= -1e-12 for foot in feet)


def test_polygon_of_collinear_feet_is_their_two_ends_and_of_coincident_feet_one_point() -> None:
    """Degenerate stances lose their inner points and their duplicates."""
    feet = np.array([[0.5, 0.5], [0.0, 0.0], [1.0, 1.0], [0.25, 0.25]])
    assert support_polygon(feet).tolist() == [[0.0, 0.0], [1.0, 1.0]]
    assert support_polygon(feet[[1, 1, 1]]).tolist() == [[0.0, 0.0]]
    with pytest.raises(ValueError, match="read-only"):
        support_polygon(feet)[0] = 1.0


@given(point, points, angle, point)
def test_margin_is_invariant_under_rigid_motions_and_mirrors(
    p: FloatArray, feet: FloatArray, turn: float, offset: FloatArray
) -> None:
    """Turning, moving and mirroring the whole picture changes nothing."""
    c, s = np.cos(turn), np.sin(turn)
    for matrix in (np.array([[c, -s], [s, c]]), np.array([[c, s], [s, -c]])):
        moved = stability_margin(matrix @ p + offset, feet @ matrix.T + offset)
        assert moved == pytest.approx(stability_margin(p, feet), abs=1e-9)


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=4), st.floats(-2.0, 2.0), angle, point)
def test_feet_in_line_hold_nothing_however_rounding_bends_the_line(
    places: list[float], at: float, turn: float, offset: FloatArray
) -> None:
    """Along a line in any direction the margin is minus the distance from the feet's ends."""
    direction = np.array([np.cos(turn), np.sin(turn)])
    feet = np.outer(places, direction) + offset
    p = at * direction + offset
    expected = -max(min(places) - at, at - max(places), 0.0)
    assert stability_margin(p, feet) == pytest.approx(expected, abs=1e-9)
    four = np.resize(feet, (1, 4, 2))
    vectorised = stability_margins(p[None], four, np.ones((1, 4), dtype=np.bool_))
    assert vectorised[0] == pytest.approx(expected, abs=1e-9)


@given(point, points, point)
def test_another_foot_never_lowers_the_margin(
    p: FloatArray, feet: FloatArray, foot: FloatArray
) -> None:
    """The support polygon only grows with feet."""
    more = np.vstack([feet, foot])
    assert stability_margin(p, more) >= stability_margin(p, feet) - 1e-12


@given(point, point, points)
def test_margin_changes_no_faster_than_the_point_moves(
    p: FloatArray, q: FloatArray, feet: FloatArray
) -> None:
    """The margin is 1-Lipschitz in the point, also across the border."""
    change = abs(stability_margin(p, feet) - stability_margin(q, feet))
    assert change <= np.hypot(*(p - q)) + 1e-12


@given(point, points)
@settings(max_examples=50)
def test_order_of_the_feet_does_not_matter(p: FloatArray, feet: FloatArray) -> None:
    """The margin is a function of the set of feet."""
    assert stability_margin(p, feet[::-1]) == pytest.approx(stability_margin(p, feet), abs=1e-12)


def test_margin_of_a_square() -> None:
    """In a square of side 2 the centre has 1, a corner 0, a point 1 beyond a side -1."""
    square = [(1, 1), (-1, -1), (1, -1), (-1, 1)]
    assert stability_margin((0, 0), square) == 1.0
    assert stability_margin((1, 1), square) == 0.0
    assert stability_margin((2, 0), square) == -1.0
    assert stability_margin((4, 5), square) == -5.0
