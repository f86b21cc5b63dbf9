"""Where a foot is put down to catch a fall: on ground that bears it, and where it helps most."""

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings, strategies as st
from rig import (
    course_of,
    flat_course,
    flat_walk,
    paper_robot,
    rotations,
    stairs_course,
    stairs_walk,
)

from drake_quad.common import FloatArray
from drake_quad.planning.motion_plan import MotionPlan, pose_robot
from drake_quad.planning.recovery_step import (
    APART,
    MARGIN_ENOUGH,
    PRICE,
    SHORTEST,
    SPEED,
    RecoveryStep,
    StepTargetMap,
    choose_recovery_step,
)
from drake_quad.robot.kinematics import solve_legs
from drake_quad.robot.legs import LEGS, Leg
from drake_quad.stability.capture_point import FallingPendulum, nearest_support
from drake_quad.stability.support_polygon import stability_margin
from drake_quad.terrain.elements import Element

ROBOT = paper_robot()
OMEGA = float(np.sqrt(9.81 / 0.8))
WIDE = course_of(Element("floor", length=8.0, width=8.0))
MIRROR = np.array([1, 0, 3, 2])
PUSH = st.tuples(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2)).map(np.array)


GROUNDS = {
    "up": StepTargetMap(stairs_course("up"), ROBOT.foot_radius),
    "down": StepTargetMap(stairs_course("down"), ROBOT.foot_radius),
    "level": StepTargetMap(flat_course(), ROBOT.foot_radius),
    "wide": StepTargetMap(WIDE, ROBOT.foot_radius),
}


def pushed(plan: MotionPlan, t: float, velocity: FloatArray) -> tuple[FallingPendulum, int | None]:
    """The robot as planned at `t`, its body struck to move at `velocity` (2,) [m/s]."""
    s = plan.sample(t)
    body = np.array(s.body[0])
    com = pose_robot(ROBOT, body[None], s.feet[None])[2][0, :2]
    swing = None if s.standing.all() else int(np.argmin(s.standing))
    state = FallingPendulum(np.array(s.feet), np.array(s.standing), body[:3], float(body[4]), com,
                        com + velocity / OMEGA, OMEGA)  # fmt: skip
    return state, swing


def placed(state: FallingPendulum, *, turn: float, to: FloatArray) -> FallingPendulum:
    """The same, turned about the world's origin and then moved."""
    R = rotations(np.array([0.0, 0.0, 0.0, 0.0, turn]))
    move = np.array([*to, 0.0])
    return FallingPendulum(state.feet @ R.T + move, state.standing, R @ state.p_WB + move,
                       state.yaw + turn, R[:2, :2] @ state.com + to,
                       R[:2, :2] @ state.capture + to, state.omega)  # fmt: skip


def mirrored(state: FallingPendulum) -> FallingPendulum:
    """The same, left and right exchanged about the lane's middle."""
    flip = np.array([1.0, -1.0, 1.0])
    return FallingPendulum(state.feet[MIRROR] * flip, state.standing[MIRROR], state.p_WB * flip,
                       -state.yaw, state.com * flip[:2], state.capture * flip[:2],
                       state.omega)  # fmt: skip


def margin_at(state: FallingPendulum, row: int, p: FloatArray, duration: float) -> float:
    """Of the capture point once leg `row` stands at `p`: the pendulum's equation, stepped."""
    bears = np.array(state.standing)
    bears[row] = False
    pivot = nearest_support(state.capture, state.feet[bears, :2])
    xi, steps = np.array(state.capture), 4000
    for _ in range(steps):  # the implicit midpoint rule on dξ/dt = ω (ξ - z)
        h = 0.5 * state.omega * duration / steps
        xi = pivot + (xi - pivot) * (1 + h) / (1 - h)
    feet = np.array(state.feet[:, :2])
    feet[row] = p[:2]
    bears[row] = True
    return stability_margin(xi, feet[bears])


@settings(max_examples=60, suppress_health_check=[HealthCheck.filter_too_much])
@given(st.sampled_from(["up", "down"]), st.floats(0.0, 1.0), PUSH)
def test_a_catch_on_stairs_is_on_ground_that_bears_it_and_within_reach(
    going: str, fraction: float, push: FloatArray
) -> None:
    """Whole on a tread, off every nosing, no foot on another, the leg long enough, in time."""
    plan, course = stairs_walk(going), stairs_course(going)
    state, swing = pushed(plan, fraction * plan.duration, push)
    catch = choose_recovery_step(ROBOT, GROUNDS[going], state, swing=swing)
    assume(catch is not None)
    assert catch is not None
    room = ROBOT.foot_radius + 0.01
    x, y, z = catch.p_W
    angle = np.linspace(0.0, 2 * np.pi, 73)
    around = course.height(x + room * np.cos(angle), y + room * np.sin(angle))
    np.testing.assert_allclose(around + ROBOT.foot_radius, z, atol=1e-9)  # nan: off the course
    for right, left in course.nosings()[:, :, :2]:
        along = (left - right) / np.linalg.norm(left - right)
        d = catch.p_W[:2] - right
        assert abs(d[0] * along[1] - d[1] * along[0]) >= room
    others = np.delete(state.feet, catch.leg.row, axis=0)
    assert np.min(np.linalg.norm(others[:, :2] - catch.p_W[:2], axis=1)) >= APART - 1e-9
    feet = np.array(state.feet)
    feet[catch.leg.row] = catch.p_W
    R = rotations(np.array([0.0, 0.0, 0.0, 0.0, state.yaw]))
    q, excess = solve_legs(ROBOT.geometry, (feet - state.p_WB) @ R)
    row = catch.leg.row
    assert excess[row] == 0.0
    assert np.all(q[row] >= ROBOT.q_lower.reshape(4, 3)[row])
    assert np.all(q[row] <= ROBOT.q_upper.reshape(4, 3)[row])
    way = float(np.linalg.norm(catch.p_W - state.feet[row]))
    assert catch.duration >= max(SHORTEST, way / SPEED) - 1e-9


@settings(max_examples=60)
@given(st.sampled_from(["up", "down"]), st.floats(0.0, 1.0), PUSH)
def test_no_foot_is_swung_through_a_riser(going: str, fraction: float, push: FloatArray) -> None:
    """Whatever is on the straight way is below the foot, or is the foot's own ground."""
    plan, course = stairs_walk(going), stairs_course(going)
    state, swing = pushed(plan, fraction * plan.duration, push)
    catch = choose_recovery_step(ROBOT, GROUNDS[going], state, swing=swing)
    if catch is None:
        return
    foot = state.feet[catch.leg.row]
    points = foot[:2] + np.linspace(0, 1, 101)[:, None] * (catch.p_W[:2] - foot[:2])
    heights = course.height(points[:, 0], points[:, 1])
    own = float(heights[0])
    assert np.nanmax(heights) <= max(own, foot[2] - ROBOT.foot_radius) + 1e-6


@settings(max_examples=60)
@given(st.sampled_from(["up", "down", "level"]), st.floats(0.0, 1.0), PUSH)
def test_left_and_right_are_alike(going: str, fraction: float, push: FloatArray) -> None:
    """The mirrored robot, pushed the mirrored way, does the mirrored thing.

    One that is its own mirror image has two best legs: there the same leg is taken each time.
    """
    plan = flat_walk() if going == "level" else stairs_walk(going)
    ground = GROUNDS[going]
    state, swing = pushed(plan, fraction * plan.duration, push)
    a = choose_recovery_step(ROBOT, ground, state, swing=swing)
    other = mirrored(state)
    b = choose_recovery_step(ROBOT, ground, other,
                     swing=None if swing is None else int(MIRROR[swing]))  # fmt: skip
    assert (a is None) == (b is None)
    if a is None or b is None:
        return
    assert a.margin == pytest.approx(b.margin, abs=1e-6)
    if np.allclose(state.feet, other.feet) and np.allclose(state.capture, other.capture):
        assert b.leg == a.leg
        return
    assert b.leg == a.leg.mirrored
    np.testing.assert_allclose(b.p_W * [1.0, -1.0, 1.0], a.p_W, atol=1e-6)


@settings(max_examples=60)
@given(st.floats(0.0, 1.0), PUSH, st.floats(-np.pi, np.pi), st.floats(2.5, 5.5), st.floats(-1, 1))
def test_on_level_ground_only_the_push_matters_not_the_place_nor_the_heading(
    fraction: float, push: FloatArray, turn: float, x: float, y: float
) -> None:
    """Turned and moved, robot and push: the catch is turned and moved."""
    plan = flat_walk()
    start = plan.body.sample(fraction * plan.duration)[0, :2]
    state, swing = pushed(plan, fraction * plan.duration, push)
    middle = placed(state, turn=0.0, to=np.array([4.0, 0.0]) - start)
    R = rotations(np.array([0.0, 0.0, 0.0, 0.0, turn]))[:2, :2]
    to = np.array([x, y]) - R @ np.array([4.0, 0.0])
    a = choose_recovery_step(ROBOT, GROUNDS["wide"], middle, swing=swing)
    b = choose_recovery_step(ROBOT, GROUNDS["wide"], placed(middle, turn=turn, to=to), swing=swing)
    assert (a is None) == (b is None)
    if a is None or b is None:
        return
    assert a.leg == b.leg
    assert a.margin == pytest.approx(b.margin, abs=1e-6)
    np.testing.assert_allclose(R @ a.p_W[:2] + to, b.p_W[:2], atol=1e-6)


def in_air(leg: Leg) -> tuple[FallingPendulum, int]:
    """The level walk, half-way through a swing of `leg`, not pushed."""
    plan = flat_walk()
    step = [s for s in plan.contacts.steps if s.leg == leg][1]
    state, swing = pushed(plan, 0.5 * (step.lift_off + step.touchdown), np.zeros(2))
    assert swing == leg.row
    return state, leg.row


def struck(state: FallingPendulum, velocity: FloatArray) -> FallingPendulum:
    """The same, but for the body's velocity [m/s]."""
    return FallingPendulum(state.feet, state.standing, state.p_WB, state.yaw, state.com,
                       state.com + velocity / state.omega, state.omega)  # fmt: skip


@pytest.mark.parametrize("leg", LEGS)
def test_with_no_push_the_foot_goes_straight_down(leg: Leg) -> None:
    """What the three others hold with margin needs no catch."""
    state, swing = in_air(leg)
    middle = state.feet[state.standing, :2].mean(axis=0)
    calm = FallingPendulum(state.feet, state.standing, state.p_WB, state.yaw, middle, middle, OMEGA)
    ground = GROUNDS["level"]
    assert stability_margin(middle, state.feet[state.standing, :2]) > MARGIN_ENOUGH
    catch = choose_recovery_step(
        ROBOT, ground, calm, swing=swing, touchdown=state.feet[swing] + 0.1
    )
    assert catch is not None
    np.testing.assert_allclose(catch.p_W[:2], state.feet[swing, :2])
    assert catch.p_W[2] == pytest.approx(ROBOT.foot_radius)


@pytest.mark.parametrize("leg", LEGS)
@pytest.mark.parametrize("speed", [1.5, 1.7, 1.9])
def test_a_push_to_the_swing_legs_side_is_caught_on_that_side(leg: Leg, speed: float) -> None:
    """The foot goes outward, and with it the capture point is held by more."""
    state, swing = in_air(leg)
    side = 1.0 if leg.short[1] == "L" else -1.0
    toward = 0.35 if leg.short[0] == "F" else -0.35  # somewhat to that leg's end, too
    falling = struck(state, speed * np.array([toward, side]))
    ground = GROUNDS["level"]
    catch = choose_recovery_step(ROBOT, ground, falling, swing=swing)
    assert catch is not None and catch.leg == leg
    assert side * (catch.p_W[1] - state.feet[swing, 1]) >= 0.05
    down = margin_at(falling, swing, state.feet[swing], SHORTEST)
    assert catch.margin > down


@settings(max_examples=50)
@given(st.sampled_from(LEGS), PUSH)
def test_the_margin_is_what_the_pendulum_has_and_no_worse_than_straight_down(
    leg: Leg, push: FloatArray
) -> None:
    """The margin said is that of a pendulum stepped in time; straight down was always possible."""
    state, swing = in_air(leg)
    falling = struck(state, 1.5 * push)
    catch = choose_recovery_step(ROBOT, GROUNDS["wide"], falling, swing=swing)
    assert catch is not None
    said = margin_at(falling, swing, catch.p_W, catch.duration)
    assert catch.margin == pytest.approx(said, abs=1e-5)
    fall = abs(state.feet[swing, 2] - ROBOT.foot_radius)
    down = margin_at(falling, swing, state.feet[swing], max(SHORTEST, fall / SPEED))
    way = float(np.linalg.norm(catch.p_W[:2] - state.feet[swing, :2]))
    assert min(catch.margin, MARGIN_ENOUGH) - PRICE * way >= min(down, MARGIN_ENOUGH) - 1e-6


def test_the_planned_touchdown_is_taken_where_it_is_best() -> None:
    """Of places that hold enough, one off the fan is taken only if it was planned."""
    state, swing = in_air(Leg.FRONT_LEFT)
    ground = GROUNDS["level"]
    falling = struck(state, np.array([0.0, 1.0]))
    fan = choose_recovery_step(ROBOT, ground, falling, swing=swing)
    assert fan is not None
    better = np.add(fan.p_W, [0.004, 0.012, 0.0])
    planned = choose_recovery_step(ROBOT, ground, falling, swing=swing, touchdown=better)
    assert planned is not None
    chosen = [c.margin - PRICE * np.linalg.norm((c.p_W - state.feet[swing])[:2])
              for c in (fan, planned)]  # fmt: skip
    assert chosen[1] >= chosen[0] - 1e-9
    assert np.allclose(planned.p_W, better) == (chosen[1] > chosen[0] + 1e-8)


def standing() -> FallingPendulum:
    """On four feet before the level walk, in the middle of wide ground."""
    state, swing = pushed(flat_walk(), 0.0, np.zeros(2))
    assert swing is None
    return placed(state, turn=0.0, to=np.array([4.0, 0.0]) - state.com)


def catch_of(velocity: FloatArray) -> RecoveryStep | None:
    """What a robot on four feet does about a push."""
    return choose_recovery_step(ROBOT, GROUNDS["wide"], struck(standing(), velocity))


@given(PUSH)
def test_on_four_feet_nothing_is_done_while_they_hold_the_capture_point(push: FloatArray) -> None:
    """And never is a step worse than none."""
    falling = struck(standing(), 1.5 * push)
    catch = choose_recovery_step(ROBOT, GROUNDS["wide"], falling)
    held = stability_margin(falling.capture, falling.feet[:, :2])
    if held >= 0.0:
        assert catch is None
    elif catch is not None:
        edge = nearest_support(falling.capture, falling.feet[:, :2])
        idle = edge + np.exp(OMEGA * catch.duration) * (falling.capture - edge)
        assert catch.margin > stability_margin(idle, falling.feet[:, :2])
        said = margin_at(falling, catch.leg.row, catch.p_W, catch.duration)
        assert catch.margin == pytest.approx(said, abs=1e-5)  # on three feet meanwhile


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_on_four_feet_a_foot_of_the_side_pushed_to_is_lifted_and_put_farther_out(
    side: float,
) -> None:
    """A push to the left is caught by a left foot, to the left of where it stood."""
    catch = catch_of(np.array([0.0, side * 1.3]))
    assert catch is not None
    assert catch.leg.short[1] == ("L" if side > 0 else "R")
    assert side * (catch.p_W[1] - standing().feet[catch.leg.row, 1]) > 0.05


@given(
    st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=4),
    st.tuples(st.floats(-2, 2), st.floats(-2, 2)).map(np.array),
)
def test_nearest_support_is_as_near_as_any_point_of_the_feet(
    points: list[tuple[float, float]], p: FloatArray
) -> None:
    """No convex combination of the feet is nearer; what it returns is itself supported."""
    feet = np.array(points)
    near = nearest_support(p, feet)
    assert stability_margin(near, feet) >= -1e-9
    weights = np.random.default_rng(0).dirichlet(0.3 * np.ones(len(feet)), 300)
    others = weights @ feet
    nearest = np.linalg.norm(others - p, axis=1).min()
    assert np.linalg.norm(near - p) <= nearest + 1e-9


def test_off_the_course_there_is_nowhere_to_step() -> None:
    """A robot beside the course has no catch, rather than one in the air."""
    state, swing = in_air(Leg.FRONT_LEFT)
    beside = placed(state, turn=0.0, to=np.array([0.0, 20.0]))
    assert choose_recovery_step(ROBOT, GROUNDS["wide"], beside, swing=swing) is None
