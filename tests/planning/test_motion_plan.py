"""Laws of a motion plan: its margins, its feet, and that one time is all times at once."""

import copy
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from rig import flat_walk, paper_robot, rotations, spin_plan, stairs_walk, stand_plan

from drake_quad.common import FloatArray
from drake_quad.math.curves import quintic
from drake_quad.planning.contact_plan import LET_GO
from drake_quad.planning.motion_plan import (
    SEGMENT_KINDS,
    MotionPlan,
    PlanSamples,
    evaluate,
    pose_robot,
)
from drake_quad.robot.kinematics import calc_feet, leg_array, pose_legs
from drake_quad.stability.support_polygon import stability_margin

PLANS = ("level", "up", "down", "spin", "stand")
MOVING = PLANS[:-1]


@cache
def plan_of(name: str) -> MotionPlan:
    makers: dict[str, Callable[[], MotionPlan]] = {
        "level": flat_walk,
        "up": lambda: stairs_walk("up"),
        "down": lambda: stairs_walk("down"),
        "spin": lambda: spin_plan(np.pi / 2),
        "stand": stand_plan,
    }
    return makers[name]()


def grid(plan: MotionPlan, count: int = 3000) -> FloatArray:
    return np.linspace(0.0, plan.duration, count)


@cache
def samples(name: str) -> PlanSamples:
    return evaluate(paper_robot(), plan_of(name), grid(plan_of(name)))


def rolled(plan: MotionPlan, t: float) -> FloatArray:
    """By how much feet are off where they were set down, or swing to (4, 3)."""
    assert plan.contacts.roll is not None
    offset, step = plan.contacts.roll.at(np.array([t]))[0], plan.contacts.phase(t).step
    if step is not None:
        lifted = plan.contacts.roll.at(np.array([step.lift_off]))[0, step.leg.row]
        s = (t - step.lift_off) / (step.touchdown - step.lift_off)
        offset[step.leg.row] = (1.0 - quintic(min(LET_GO * s, 1.0))) * lifted
    return np.column_stack([offset, np.zeros(4)])


@pytest.mark.parametrize("name", MOVING)
def test_margin_is_kept_at_any_time(name: str) -> None:
    """Between the times that the program looked at it is at most 3 mm less than claimed."""
    plan = plan_of(name)
    assert plan.margin > 0.05
    assert samples(name).margin.min() >= plan.margin - 3e-3


@pytest.mark.parametrize("name", PLANS)
def test_robot_can_follow(name: str) -> None:
    """All feet are within reach, all joints within their limits and speeds."""
    robot, s = paper_robot(), samples(name)
    q = s.q.reshape(-1, 12)
    assert s.reach_excess.max() == 0.0
    assert np.all(q > robot.q_lower) and np.all(q < robot.q_upper)
    assert np.all(np.abs(np.diff(q, axis=0)) <= robot.speed * np.diff(s.times)[:, None])


@pytest.mark.parametrize("name", PLANS)
def test_angles_and_centre_of_mass_are_those_of_the_pose(name: str) -> None:
    """The joint angles put the feet where they are planned, seen from the body."""
    s = samples(name)
    R, p_WB = rotations(s.body[:, 0]), s.body[:, 0, :3]
    p_BF = calc_feet(paper_robot().geometry, s.q)
    feet = p_WB[:, None] + np.einsum("nij,nlj->nli", R, p_BF)
    np.testing.assert_allclose(feet, s.feet, atol=1e-9)
    q, excess, com = pose_robot(paper_robot(), s.body[:, 0], s.feet)
    np.testing.assert_array_equal(q, s.q)
    np.testing.assert_array_equal(com, s.com)
    np.testing.assert_array_equal(excess, s.reach_excess)
    body, legs = np.array(s.body[:, 0]), leg_array(paper_robot().geometry)
    np.testing.assert_array_equal(pose_legs(legs, body, np.array(s.feet)), q)
    alone = pose_legs(legs[2:3], body, np.array(s.feet[:, 2:3]))
    np.testing.assert_array_equal(alone[:, 0], q[:, 2])


@pytest.mark.parametrize("name", PLANS)
def test_margin_of_a_sample_is_the_margin_over_its_standing_feet(name: str) -> None:
    """It is `gait.support`'s own, of the whole robot's centre of mass."""
    s = samples(name)
    for k in range(0, len(s.times), 97):
        expected = stability_margin(s.com[k, :2], s.feet[k, s.standing[k], :2])
        assert s.margin[k] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("name", PLANS)
def test_standing_feet_do_not_move_and_no_foot_jumps(name: str) -> None:
    """A foot that stands at two times and in between is in one place, or rolls; others swing."""
    plan, s = plan_of(name), samples(name)
    phase = np.array([plan.contacts.phase_index(t) for t in s.times])
    same = np.diff(phase) == 0
    still = s.standing[1:] & s.standing[:-1] & same[:, None]
    moved = np.linalg.norm(np.diff(s.feet, axis=0), axis=-1)
    assert moved[still].max() <= 0.02 * np.diff(s.times).max()  # rolling by 2 cm/s at most
    assert moved.max() <= 2.5 * np.diff(s.times).max()  # no foot is faster than 2.5 m/s


@pytest.mark.parametrize("name", PLANS)
def test_one_time_is_many_times_at_once(name: str) -> None:
    """`sample` and `evaluate` agree but for the rolling; velocities are the places' derivatives."""
    plan, s, h = plan_of(name), samples(name), 1e-5
    for k in range(1, len(s.times) - 1, 61):
        t = float(s.times[k])
        one = plan.sample(t)
        np.testing.assert_allclose(one.body, s.body[k], atol=1e-9)
        np.testing.assert_allclose(one.feet + rolled(plan, t), s.feet[k], atol=1e-12)
        np.testing.assert_array_equal(one.standing, s.standing[k])
        assert np.isnan(one.swing_phase) == bool(np.all(one.standing))
        if plan.contacts.phase_index(t - h) == plan.contacts.phase_index(t + h):
            difference = (plan.sample(t + h).feet - plan.sample(t - h).feet) / (2 * h)
            np.testing.assert_allclose(one.feet_velocity, difference, atol=1e-4)


@pytest.mark.parametrize("name", PLANS)
def test_swing_phase_goes_from_0_to_1(name: str) -> None:
    """It is linear in time over each step, and not a number on four feet."""
    plan = plan_of(name)
    for phase in plan.contacts.phases:
        middle = plan.sample(0.5 * (phase.start + phase.end)).swing_phase
        if phase.step is None:
            assert np.isnan(middle)
        else:
            assert plan.sample(phase.start).swing_phase == pytest.approx(0.0)
            assert middle == pytest.approx(0.5)


@pytest.mark.parametrize("name", PLANS)
def test_segments_follow_one_another_without_gaps(name: str) -> None:
    """From 0 to the end, each of a known kind; `segment_index` finds the one under way."""
    plan = plan_of(name)
    edges = [plan.segments[0].start, *(s.end for s in plan.segments)]
    assert edges[0] == 0.0 and edges[-1] == pytest.approx(plan.duration)
    assert [s.start for s in plan.segments] == pytest.approx(edges[:-1])
    for k, segment in enumerate(plan.segments):
        assert segment.kind in SEGMENT_KINDS and segment.name
        assert plan.segment_index(0.5 * (segment.start + segment.end)) == k
    assert plan.segment_index(plan.duration + 1.0) == len(plan.segments) - 1


@pytest.mark.parametrize("name", PLANS)
def test_plan_ends_in_its_end_stance(name: str) -> None:
    """`end` is where the last sample is, rolled feet too; the plan stays there afterwards."""
    plan = plan_of(name)
    last, later = plan.sample(plan.duration), plan.sample(plan.duration + 5.0)
    np.testing.assert_array_equal(plan.end.body, last.body[0])
    np.testing.assert_allclose(plan.end.feet, last.feet, atol=1e-12)
    np.testing.assert_allclose(plan.end.roll, rolled(plan, plan.duration)[:, :2], atol=1e-12)
    np.testing.assert_allclose(later.feet, last.feet, atol=1e-12)
    np.testing.assert_allclose(later.body[0], last.body[0], atol=1e-3)
    np.testing.assert_allclose(later.body[1:], 0.0, atol=1e-9)


def test_a_copy_of_a_plan_is_the_plan() -> None:
    """Drake may copy a Context that holds a plan: nothing is copied, nothing can change."""
    plan = flat_walk()
    assert copy.deepcopy(plan) is plan
    assert AbstractValue.Make(plan).Clone().get_value() is plan
    with pytest.raises(AttributeError):
        plan.index = 3  # type: ignore[misc]
    for array in (plan.body.control, plan.contacts.feet, plan.contacts.phases[0].feet):
        assert not array.flags.writeable


def test_a_stand_stands() -> None:
    """Four feet, one segment, and a body that does not move."""
    s = samples("stand")
    assert np.all(s.standing) and len(plan_of("stand").segments) == 1
    np.testing.assert_allclose(s.body[:, 1:], 0.0, atol=1e-9)
    np.testing.assert_allclose(s.body[:, 0], plan_of("stand").end.body[None].repeat(3000, 0))


def test_rotations_turn_by_yaw_then_pitch() -> None:
    """R_WB takes B's axes to where a body of this yaw and pitch has them."""
    body = np.array([[0.0, 0.0, 0.0, 0.3, 0.7]])
    R = rotations(body)[0]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-15)
    c, s = np.cos, np.sin
    np.testing.assert_allclose(R[:, 0], [c(0.7) * c(0.3), s(0.7) * c(0.3), -s(0.3)])
    np.testing.assert_allclose(R[:, 1], [-s(0.7), c(0.7), 0.0])
