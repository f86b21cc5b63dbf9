"""Where the body best stands for one lift."""

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import linprog

from drake_quad.common import FloatArray
from drake_quad.gait.transition_search import LiftRules, best_point
from drake_quad.gait.workspace import PAPER_WORKSPACE
from drake_quad.stability.support_polygon import (
    nearest_on_segment,
    stability_margin,
    support_polygon,
)

coordinate = st.floats(-1.0, 1.0).map(lambda x: round(x, 4))
triangles = arrays(np.float64, (3, 2), elements=coordinate)
points = arrays(np.float64, 2, elements=coordinate)
reach = st.floats(0.0, 0.5)
CENTRES = tuple((x, y) for x, y in PAPER_WORKSPACE.centres.tolist())


def as_floats(feet: FloatArray) -> list[tuple[float, float]]:
    return [(x, y) for x, y in feet.tolist()]


def rules(max_shift: float, workspace: bool = True) -> LiftRules:
    places = (CENTRES[0], CENTRES[1], CENTRES[2], CENTRES[3])
    return LiftRules(
        com=(0.0, 0.0),
        max_shift=max_shift,
        start=places,
        goal=places,
        goal_shift=(0.0, 0.0),
        workspace=PAPER_WORKSPACE if workspace else None,
    )


@given(triangles, points, reach, reach)
@settings(max_examples=50)
def test_best_point_solves_the_linear_program(
    feet: FloatArray, centre: FloatArray, dx: float, dy: float
) -> None:
    """No point of the rectangle has a larger margin: a linear program says the same."""
    hull = support_polygon(feet)
    assume(len(hull) == 3)
    sides = np.roll(hull, -1, axis=0) - hull
    lengths = np.hypot(*sides.T)
    u, v = sides[0], sides[1]
    assume(u[0] * v[1] - u[1] * v[0] > 1e-3)
    outward = np.column_stack([sides[:, 1], -sides[:, 0]]) / lengths[:, None]
    low, high = centre - np.array([dx, dy]), centre + np.array([dx, dy])
    solution = linprog(
        [0.0, 0.0, -1.0],
        A_ub=np.column_stack([outward, np.ones(3)]),
        b_ub=(outward * hull).sum(axis=1),
        bounds=[*zip(low, high, strict=True), (None, None)],
    )
    x, y = best_point(
        as_floats(feet), (low[0], low[1]), (high[0], high[1]), near=(centre[0], centre[1])
    )
    value = ((outward * hull).sum(axis=1) - outward @ (x, y)).min()
    assert value == pytest.approx(-solution.fun, abs=1e-7)
    assert (low - 1e-12 <= (x, y)).all() and ((x, y) <= high + 1e-12).all()
    if value > 0.0:
        assert stability_margin((x, y), feet) == pytest.approx(value, abs=1e-9)


def test_of_equally_good_points_the_nearest_is_taken() -> None:
    """Along a side that bounds the margin alone, the body shifts no farther than it has to."""
    feet = [(-9.0, 0.0), (9.0, 0.0), (0.0, 20.0)]
    for near in (-0.3, 0.0, 0.2):
        best = best_point(feet, (-0.5, -0.5), (0.5, 0.5), near=(near, 0.0))
        assert best == pytest.approx((near, 0.5))


def test_a_still_body_has_the_margin_where_it_is() -> None:
    """Without shifts a lift is as stable as the three other feet hold the centre of mass."""
    feet = (CENTRES[0], (0.5, -0.2), CENTRES[2], CENTRES[3])
    lift = rules(0.0).lift(2, feet, CENTRES[2])
    assert lift.shift == (0.0, 0.0)
    assert lift.margin == stability_margin((0.0, 0.0), [feet[0], feet[1], feet[3]])


@given(st.integers(0, 3), st.floats(0.001, 0.3), st.floats(0.001, 0.3))
def test_more_room_never_makes_a_lift_less_stable(row: int, a: float, b: float) -> None:
    """The margin grows with the shift allowed."""
    few, many = (rules(s).lift(row, CENTRES, CENTRES[row]) for s in sorted((a, b)))  # type: ignore[arg-type]
    assert few.margin <= many.margin + 1e-9
    assert max(map(abs, few.shift)) <= min(a, b) + 1e-12


@given(st.integers(0, 3), arrays(np.float64, (5, 2), elements=st.floats(-1.0, 1.0)))
def test_shifts_keep_every_foot_in_its_workspace(row: int, offsets: FloatArray) -> None:
    """The boxes move with the body, and hold the standing feet, the lifted foot and its goal."""
    half = PAPER_WORKSPACE.half_size
    feet = as_floats(PAPER_WORKSPACE.centres + offsets[:4] * half)
    target = as_floats(PAPER_WORKSPACE.centres[[row]] + offsets[4] * half)[0]
    lift = rules(0.3).lift(row, (feet[0], feet[1], feet[2], feet[3]), target)
    for place, k in [*zip(feet, range(4), strict=True), (target, row)]:
        beyond = np.abs(np.array(place) - lift.shift - PAPER_WORKSPACE.centres[k]) - half
        assert (beyond <= 1e-9).all()


def test_no_admissible_shift_is_no_margin() -> None:
    """Feet that no place of the body can reach at once make the lift impossible."""
    feet = (CENTRES[0], CENTRES[1], CENTRES[2], (CENTRES[3][0] - 0.5, CENTRES[3][1]))
    lift = rules(0.1).lift(0, feet, CENTRES[0])
    assert lift.margin == -np.inf
    assert rules(0.1, workspace=False).lift(0, feet, CENTRES[0]).margin > 0.0


def test_a_foot_that_begins_outside_its_box_does_not_forbid_to_begin() -> None:
    """A stance as measured may be a little out of the boxes: the body may stay where it is."""
    start = ((0.4 + 0.4, 0.27), CENTRES[1], CENTRES[2], CENTRES[3])
    outside = LiftRules((0.0, 0.0), 0.1, start, (*CENTRES,), (0.0, 0.0), PAPER_WORKSPACE)  # type: ignore[arg-type]
    assert outside.lift(0, start, CENTRES[0]).margin > 0.0


@given(points, points, points)
def test_nearest_point_of_a_segment(p: FloatArray, a: FloatArray, b: FloatArray) -> None:
    """It is on the segment, and its distance is the margin over two feet."""
    x, y = nearest_on_segment((p[0], p[1]), (a[0], a[1]), (b[0], b[1]))
    assert np.hypot(x - p[0], y - p[1]) == pytest.approx(-stability_margin(p, [a, b]), abs=1e-9)
    assert stability_margin((x, y), [a, b]) == pytest.approx(0.0, abs=1e-9)
