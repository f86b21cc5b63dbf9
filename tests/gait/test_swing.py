"""Laws of the swing leg's trajectory; the paper's numbers."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from shapely import LineString, Point

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait.swing import Swing, paper_swing, plan_swing
from drake_quad.planning.contact_plan import ContactPlan, Step
from drake_quad.planning.phase_table import phase_table, sample_feet
from drake_quad.robot.legs import Leg

H, W, DELTA_H = 0.13, 0.5, 0.02
RADIUS, CLEARANCE = 0.02, 0.04

place = arrays(np.float64, 3, elements=st.floats(-1.0, 1.0))
swings = st.builds(
    lambda a, b, duration, share, z: Swing(a, b, duration, share * duration, z),
    place,
    place,
    st.floats(0.3, 3.0),
    st.floats(0.2, 0.8),
    st.floats(-1.0, 1.5),
)


def stairs(risers: list[tuple[float, float]], length: float) -> tuple[FloatArray, FloatArray]:
    """The profile of risers (distance, rise) under a swing."""
    d, z = [0.0], [0.0]
    for distance, rise in risers:
        d += [distance, distance]
        z += [z[-1], z[-1] + rise]
    return np.array([*d, length]), np.array([*z, z[-1]])


def turned_around(
    profile: tuple[FloatArray, FloatArray], length: float
) -> tuple[FloatArray, FloatArray]:
    return length - profile[0][::-1], profile[1][::-1]


def climb(profile: tuple[FloatArray, FloatArray], length: float) -> Swing:
    d, z = profile
    return plan_swing(
        [0.0, 0.0, z[0] + RADIUS],
        [length, 0.0, z[-1] + RADIUS],
        duration=2.0,
        profile=(d, z),
        clearance=CLEARANCE,
        foot_radius=RADIUS,
    )


def path(swing: Swing) -> FloatArray:
    """The swing in the plane of its profile, finely sampled."""
    p = swing.positions(np.linspace(0.0, swing.duration, 4001))
    return np.column_stack([np.hypot(*(p - p[0])[:, :2].T), p[:, 2]])


@given(swings)
def test_foot_rests_at_both_ends(swing: Swing) -> None:
    """It lifts off and touches down without velocity or acceleration."""
    for t, end in ((0.0, swing.p_start), (swing.duration, swing.p_end)):
        p, v, a = swing.sample(t)
        assert p == pytest.approx(end, abs=1e-12)
        assert v == pytest.approx(np.zeros(3), abs=1e-12)
        assert a == pytest.approx(np.zeros(3), abs=1e-9)


@given(swings, st.floats(0.0, 1.0))
def test_samples_are_derivatives_of_one_another(swing: Swing, share: float) -> None:
    """Velocity and acceleration are those of the position."""
    h = 1e-4 * swing.duration
    t = h + share * (swing.duration - 2.0 * h)
    (p0, v0, _), (_, v, a), (p1, v1, _) = (swing.sample(t + k * h) for k in (-1, 0, 1))
    assert v == pytest.approx((p1 - p0) / (2.0 * h), abs=1e-3)
    assert a == pytest.approx((v1 - v0) / (2.0 * h), abs=0.5)


@given(swings)
def test_motion_is_twice_continuously_differentiable_at_the_apex(swing: Swing) -> None:
    """The two vertical quintics meet at the apex at rest, at the height asked for."""
    before, after = (swing.sample(np.nextafter(swing.apex_time, side)) for side in (0.0, 9.0))
    for left, right in zip(before, after, strict=True):
        assert left == pytest.approx(right, abs=1e-9)
    p, v, a = swing.sample(swing.apex_time)
    assert (p[2], v[2], a[2]) == pytest.approx((swing.apex_z, 0.0, 0.0), abs=1e-9)


@given(swings, st.floats(-0.5, 1.5))
def test_vectorised_positions_are_the_sampled_ones(swing: Swing, share: float) -> None:
    """One formula, two ways; outside of the swing the foot rests at its ends."""
    t = share * swing.duration
    assert swing.positions([t])[0] == pytest.approx(swing.sample(t)[0], abs=1e-12)
    if not 0.0 < share < 1.0:
        assert swing.sample(t)[0] == pytest.approx(swing.p_end if share > 0 else swing.p_start)


def test_times_out_of_order_are_refused() -> None:
    """The apex is inside the swing, and ends are points in space."""
    with pytest.raises(ValueError, match="apex_time"):
        Swing(np.zeros(3), np.ones(3), 1.0, 1.0, 1.0)
    with pytest.raises(ValueError, match="points in space"):
        Swing(np.zeros(2), np.ones(3), 1.0, 0.5, 1.0)


def test_papers_swing_satisfies_equations_one_to_three_and_clears_the_other_riser() -> None:
    """Up two risers at 0.25 and 0.75 m of 1 m the first is cleared by 0.042 m, down the last."""
    up = paper_swing(x_f=2 * W, z_f=2 * H, duration=2.0, d_s=0.75, h_s=2 * H, delta_h=DELTA_H)
    down = paper_swing(x_f=2 * W, z_f=-2 * H, duration=2.0, d_s=0.25, h_s=0.0, delta_h=DELTA_H)
    for swing, d_s, h_s, other, tread in ((up, 0.75, 2 * H, 0.25, H), (down, 0.25, 0.0, 0.75, -H)):
        x, _, z = swing.sample(swing.apex_time)[0]
        assert (x, z) == pytest.approx((d_s, h_s + DELTA_H))
        at = path(swing)
        height = np.interp(other, at[:, 0], at[:, 1])
        assert height - tread == pytest.approx(0.042, abs=5e-4)


def test_descent_is_the_ascent_run_backwards() -> None:
    """Climbing down mirrors climbing up in time."""
    up = paper_swing(x_f=2 * W, z_f=2 * H, duration=2.0, d_s=0.75, h_s=2 * H, delta_h=DELTA_H)
    down = paper_swing(x_f=2 * W, z_f=-2 * H, duration=2.0, d_s=0.25, h_s=0.0, delta_h=DELTA_H)
    t = np.linspace(0.0, 2.0, 101)
    backwards = np.array([2 * W, 0.0, 2 * H]) + down.positions(2.0 - t) * np.array([-1, 1, 1])
    assert up.positions(t) == pytest.approx(backwards, abs=1e-12)


def test_planned_swing_is_the_papers_where_that_clears_everything() -> None:
    """On Table I's stairs, from tread centre to tread centre, the plan is equations (1) to (3)."""
    profile = stairs([(0.25, H), (0.75, H)], 2 * W)
    for planned, d_s, h_s, z_f in (
        (climb(profile, 1.0), 0.75, 2 * H, 2 * H),
        (climb(turned_around(profile, 1.0), 1.0), 0.25, 0.0, -2 * H),
    ):
        paper = paper_swing(x_f=1.0, z_f=z_f, duration=2.0, d_s=d_s, h_s=h_s, delta_h=DELTA_H)
        assert planned.apex_time == pytest.approx(paper.apex_time)
        assert planned.apex_z - planned.p_start[2] == pytest.approx(paper.apex_z)


def test_on_flat_ground_the_apex_is_at_mid_swing() -> None:
    """Without nosings the foot peaks half-way, delta_h above the higher end or as asked."""
    for z in (0.0, 0.4):
        flat = ([0.0, 1.0], [z, z])
        swing = climb((np.array(flat[0]), np.array(flat[1])), 1.0)
        assert (swing.apex_time, swing.apex_z) == pytest.approx((1.0, z + CLEARANCE))
        high = plan_swing(
            [0, 0, z], [0.3, 0, z + 0.1], duration=1.0, profile=flat,
            clearance=CLEARANCE, foot_radius=RADIUS, lift=0.07,
        )  # fmt: skip
        assert (high.apex_time, high.apex_z) == pytest.approx((0.5, z + 0.17))


@st.composite
def flights(draw: st.DrawFn) -> tuple[tuple[FloatArray, FloatArray], float]:
    """One or two uneven steps up or down under a swing, feet near the middle of their treads."""
    runs = draw(st.lists(st.floats(0.25, 0.6), min_size=2, max_size=3))
    rises = [draw(st.floats(0.04, 0.2)) for _ in runs[1:]]
    start, end = draw(st.floats(0.35, 0.65)), draw(st.floats(0.35, 0.65))
    risers = np.cumsum([start * runs[0], *runs[1:-1]])
    length = float(risers[-1] + end * runs[-1])
    profile = stairs(list(zip(risers.tolist(), rises, strict=True)), length)
    return (turned_around(profile, length) if draw(st.booleans()) else profile), length


@given(flights())
def test_planned_swings_clear_random_stairs(
    flight: tuple[tuple[FloatArray, FloatArray], float],
) -> None:
    """The foot's centre keeps its clearance from every nosing, its radius from every tread."""
    profile, length = flight
    swing = climb(profile, length)
    line = path(swing)
    d, z = profile
    corners = [
        (x, max(a, b)) for x, y, a, b in zip(d, d[1:], z, z[1:], strict=False) if x == y and a != b
    ]
    assert corners
    for corner in corners:
        assert LineString(line).distance(Point(corner)) >= CLEARANCE - 1e-4
    ground = LineString(np.column_stack([d, z]))
    assert LineString(line).distance(ground) >= RADIUS - 1e-4
    assert (line[:, 1] >= np.interp(line[:, 0], d, z) + RADIUS - 1e-4)[
        np.abs(line[:, :1] - d).min(axis=1) > 1e-6
    ].all()


@given(flights())
@settings(max_examples=50)
def test_planned_swings_do_not_depend_on_the_direction_of_time(
    flight: tuple[tuple[FloatArray, FloatArray], float],
) -> None:
    """The swing back is the swing there, run backwards."""
    profile, length = flight
    there, back = climb(profile, length), climb(turned_around(profile, length), length)
    assert back.apex_time == pytest.approx(2.0 - there.apex_time, abs=1e-9)
    assert back.apex_z == pytest.approx(there.apex_z, abs=5e-5)


@given(flights())
@settings(max_examples=50)
def test_planned_swings_are_no_higher_than_they_have_to_be(
    flight: tuple[tuple[FloatArray, FloatArray], float],
) -> None:
    """Either the apex is as low as on flat ground, or a lower one would miss the clearance."""
    profile, length = flight
    swing = climb(profile, length)
    lowest = max(swing.p_start[2], swing.p_end[2]) + CLEARANCE - RADIUS
    assert swing.apex_z >= lowest - 1e-12
    if swing.apex_z > lowest + 2e-3:
        lower = Swing(swing.p_start, swing.p_end, 2.0, swing.apex_time, swing.apex_z - 2e-3)
        line = path(lower)
        d, z = profile
        tops = [(x, max(a, b)) for x, y, a, b in zip(d, d[1:], z, z[1:], strict=False) if x == y]
        closest = min(LineString(line).distance(Point(top)) for top in tops)
        over = line[:, 1] - np.interp(line[:, 0], d, z)
        between = (line[:, 0] > tops[0][0]) & (line[:, 0] < tops[-1][0])
        assert closest < CLEARANCE or over.min() < RADIUS or over[between].min() < CLEARANCE


@given(flights(), st.floats(-3.0, 3.0))
@settings(max_examples=50)
def test_planned_swings_turn_with_the_course(
    flight: tuple[tuple[FloatArray, FloatArray], float], yaw: float
) -> None:
    """Only the profile along the way matters, not the direction of the way in W."""
    profile, length = flight
    straight = climb(profile, length)
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    turned = plan_swing(
        turn @ straight.p_start,
        turn @ straight.p_end,
        duration=2.0,
        profile=(profile[0], profile[1]),
        clearance=CLEARANCE,
        foot_radius=RADIUS,
    )
    t = np.linspace(0.0, 2.0, 21)
    assert turned.positions(t) == pytest.approx(straight.positions(t) @ turn.T, abs=1e-4)


def test_a_foothold_against_a_riser_is_an_error_that_carries_the_best_swing() -> None:
    """A foot that stands inside a riser cannot be lifted past it: the error says by how much."""
    profile = stairs([(0.5 * RADIUS, 0.17), (0.31, 0.17)], 0.6)
    with pytest.raises(PlanningError, match="too close to a riser") as raised:
        climb(profile, 0.6)
    best = raised.value.data["swing"]
    assert isinstance(best, Swing) and raised.value.data["shortfall"] > 0.0
    assert (best.p_start[0], best.p_end[0]) == (0.0, 0.6)


def test_a_foot_on_the_edge_of_its_tread_is_still_lifted() -> None:
    """Beside a nosing closer than the clearance the foot keeps the distance that it has there."""
    d, z = stairs([(0.01, -0.1)], 0.5)
    swing = climb((d, z), 0.5)
    distance = LineString(path(swing)).distance(Point(0.01, 0.0))
    assert distance == pytest.approx(np.hypot(0.01, RADIUS), abs=1e-4)


def test_a_profile_that_ends_early_is_refused() -> None:
    """The terrain has to be known all the way."""
    with pytest.raises(ValueError, match="profile"):
        climb((np.array([0.0, 0.9]), np.zeros(2)), 1.0)


@st.composite
def arcs(draw: st.DrawFn) -> Swing:
    """A swing round a pivot, to a place up to twice as far from there."""
    start, pivot = draw(place), draw(arrays(np.float64, 2, elements=st.floats(-1.0, 1.0)))
    start[:2] += pivot + np.array([1.5, 0.0])  # never at the pivot itself
    angle, farther = draw(st.floats(0.05, 3.0)), draw(st.floats(0.5, 2.0))
    angle *= draw(st.sampled_from([-1.0, 1.0]))
    c, s = np.cos(angle), np.sin(angle)
    end = np.append(pivot + farther * np.array([[c, -s], [s, c]]) @ (start[:2] - pivot), 0.1)
    return Swing(start, end, 2.0, 0.9, start[2] + 0.3, pivot=pivot, turn=angle)


@given(arcs(), st.floats(0.02, 0.98))
def test_an_arc_goes_round_its_pivot(swing: Swing, s: float) -> None:
    """Its angle and its distance grow by the paper's quintic, from rest to rest."""
    assert swing.pivot is not None
    q = np.polyval([6.0, -15.0, 10.0, 0.0, 0.0, 0.0], s)
    away = [p[:2] - swing.pivot for p in (swing.p_start, swing.positions([2.0 * s])[0])]
    near, far = np.hypot(*away[0]), np.hypot(*(swing.p_end[:2] - swing.pivot))
    assert np.hypot(*away[1]) == pytest.approx(near + (far - near) * q, abs=1e-9)
    (ax, ay), (bx, by) = away
    turned = np.arctan2(ax * by - ay * bx, ax * bx + ay * by)
    assert turned == pytest.approx(swing.turn * q, abs=1e-9)
    for t, end in ((0.0, swing.p_start), (2.0, swing.p_end)):
        place, velocity, acceleration = swing.sample(t)
        np.testing.assert_allclose(place, end, atol=1e-9)
        np.testing.assert_allclose([velocity, acceleration], 0.0, atol=1e-9)


@given(arcs(), st.floats(0.1, 1.9))
def test_an_arc_is_the_same_to_all_who_sample_it(swing: Swing, t: float) -> None:
    """One sample, many, and the control loop's kernel agree, and rates are what differences say."""
    place, velocity, acceleration = swing.sample(t)
    np.testing.assert_allclose(swing.positions([t])[0], place, atol=1e-12)
    feet = np.tile(swing.p_start, (4, 1))
    plan = ContactPlan(feet, (Step(Leg(3), 0.5, 2.5, swing),), 3.0)
    found = sample_feet(phase_table(plan), 0.5 + t)
    for part, expected in zip(found[:3], (place, velocity, acceleration), strict=True):
        np.testing.assert_allclose(part[2], expected, atol=1e-9)
    h = 1e-5
    if abs(t - swing.apex_time) > 2 * h:
        before, after = (swing.sample(t + d) for d in (-h, h))
        np.testing.assert_allclose((after[0] - before[0]) / (2 * h), velocity, atol=1e-6)
        np.testing.assert_allclose((after[1] - before[1]) / (2 * h), acceleration, atol=1e-5)


def test_an_arc_that_does_not_lead_there_is_refused() -> None:
    """The turn and both ends have to belong together."""
    start, end = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    assert Swing(start, end, 1.0, 0.5, 0.1, pivot=np.zeros(2), turn=np.pi / 2).arc[2] > 1.5
    for turn in (0.0, -np.pi / 2, 1.0):
        with pytest.raises(ValueError, match="turn"):
            Swing(start, end, 1.0, 0.5, 0.1, pivot=np.zeros(2), turn=turn)
