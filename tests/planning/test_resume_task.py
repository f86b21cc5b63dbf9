"""Planning anew: from the feet as they really stand, back into the plan, and to the same goal."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings, strategies as st
from rig import (
    course_of,
    flat_course,
    flat_walk,
    paper_robot,
    spin_plan,
    stairs_course,
    stairs_walk,
    stance_at,
    stand_plan,
    walk_plan,
)

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.planning import replan
from drake_quad.planning.motion_plan import MotionPlan, PlanSamples, Stance, evaluate, pose_robot
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.remaining_plan import remaining_plan
from drake_quad.planning.replan import TOLERANCE, in_place, replan_task
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.planning.task import plan_task
from drake_quad.stability.support_polygon import stability_margins
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element

DEFAULT = PlanSettings()
ROBOT = paper_robot()
KINDS = ("level", "up", "down", "spin", "stand")


@cache
def case(kind: str) -> tuple[MotionPlan, Course]:
    """A plan of each kind of task, and its course."""
    if kind == "level":
        return flat_walk(), flat_course()
    if kind == "spin":
        return spin_plan(np.pi / 2), flat_course()
    if kind == "stand":
        return stand_plan(), flat_course()
    return stairs_walk(kind), stairs_course(kind)


def stance_in(
    plan: MotionPlan, course: Course, t: float, *, feet: FloatArray | float = 0.0
) -> Stance:
    """The plan's stance at `t`, its feet moved by `feet` (4, 2) and put on the ground."""
    sample = plan.sample(t)
    p = np.array(sample.feet)
    p[:, :2] += feet
    p[:, 2] = course.height(p[:, 0], p[:, 1]) + ROBOT.foot_radius
    return Stance(sample.body[0], p)


def is_held(stance: Stance) -> bool:
    """Whether a robot can stand so: legs long enough, and its centre of mass well within."""
    if np.any(np.isnan(stance.feet)):
        return False
    q, excess, com = pose_robot(ROBOT, stance.body[None], stance.feet[None])
    standing = np.ones((1, 4), dtype=bool)
    margin = stability_margins(com[:, :2], stance.feet[None, :, :2], standing)[0]
    angles = q.reshape(12)
    limits = np.all((angles > ROBOT.q_lower) & (angles < ROBOT.q_upper))
    return bool(excess.max() == 0.0 and margin > 0.03 and limits)


def sampled(plan: MotionPlan, period: float = 0.05) -> PlanSamples:
    """The plan at many times."""
    return evaluate(ROBOT, plan, np.linspace(0.0, plan.duration, int(plan.duration / period) + 2))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("fraction", [0.0, 0.13, 0.4, 0.71, 0.97, 1.0])
def test_a_robot_that_stands_as_planned_takes_no_step_but_those_left(
    kind: str, fraction: float
) -> None:
    """Nothing done is done again, and what is left keeps its places and its rhythm."""
    plan, course = case(kind)
    t = fraction * plan.duration
    if (step := plan.contacts.phase(t).step) is not None:
        t = step.touchdown  # four feet where they should be
    resumed = replan_task(ROBOT, course, DEFAULT, plan, t, stance_in(plan, course, t))
    left = [s for s in plan.contacts.steps if s.lift_off >= t - 1e-9]
    assert [s.leg for s in resumed.contacts.steps] == [s.leg for s in left]
    if left:
        shift = [a.lift_off - b.lift_off for a, b in zip(resumed.contacts.steps, left, strict=True)]
        assert np.ptp(shift) < 1e-9
        assert resumed.duration - plan.duration == pytest.approx(shift[0])
    # The last steps are the same; how far feet roll after them depends on the path.
    np.testing.assert_allclose(resumed.contacts.final_feet, plan.contacts.final_feet, atol=1e-3)
    names = [s.name for s in resumed.segments]
    assert names == ["recovery"] + [s.name for s in plan.segments if s.end > t + 1e-9]
    assert resumed.revision == 1 and resumed.index == plan.index


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("fraction", [0.02, 0.35, 0.6, 0.95])
def test_body_goes_on_from_where_it_was_told_to_be_and_ends_at_the_goal(
    kind: str, fraction: float
) -> None:
    """No jump in the body's pose wherever it is told to be, at rest there; the goal is the goal."""
    plan, course = case(kind)
    t = fraction * plan.duration
    stance = stance_in(plan, course, t)
    moved = Stance(np.add(stance.body, [0.02, -0.03, 0.015, 0.02, 0.04]), stance.feet)
    resumed = replan_task(ROBOT, course, DEFAULT, plan, t, moved)
    body = resumed.body.sample(0.0)
    np.testing.assert_allclose(body[0], moved.body, atol=1e-6)
    np.testing.assert_allclose(body[1:], 0.0, atol=1e-5)
    np.testing.assert_allclose(resumed.end.body, plan.end.body, atol=5e-3)
    assert np.array_equal(resumed.contacts.feet, moved.feet)


@settings(max_examples=25, suppress_health_check=[HealthCheck.filter_too_much])
@given(
    st.sampled_from(KINDS),
    st.floats(0.0, 1.0),
    st.lists(st.floats(-0.06, 0.06), min_size=8, max_size=8),
)
def test_wherever_the_feet_are_the_way_back_is_one_that_the_robot_can_go(
    kind: str, fraction: float, moves: list[float]
) -> None:
    """From feet centimetres off: stable throughout, every leg long enough, the goal reached."""
    plan, course = case(kind)
    t = fraction * plan.duration
    stance = stance_in(plan, course, t, feet=np.reshape(moves, (4, 2)))
    assume(is_held(stance))
    resumed = replan_task(ROBOT, course, DEFAULT, plan, t, stance)
    samples = sampled(resumed)
    assert resumed.margin > 0.0
    assert samples.margin.min() > -2e-3  # between the samples of the program
    assert samples.reach_excess.max() < 1e-3
    np.testing.assert_allclose(resumed.end.body, plan.end.body, atol=5e-3)
    off = np.linalg.norm(resumed.contacts.final_feet - plan.contacts.final_feet, axis=1)
    assert off.max() <= TOLERANCE * 1.5


@pytest.mark.parametrize("going", ["up", "down"])
@pytest.mark.parametrize("phase", [0.1, 0.4, 0.6, 0.9])
def test_an_interrupted_swing_is_finished_from_wherever_its_foot_came_down(
    going: str, phase: float
) -> None:
    """At any step of a flight, wherever on the way: one step more takes the foot to its place."""
    plan, course = case(going)
    lane = course.lanes[0]
    nosings = lane.nosings()[:, 0]
    for step in plan.contacts.steps:
        t = step.lift_off + phase * (step.touchdown - step.lift_off)
        stance = stance_in(plan, course, t)
        foot = stance.feet[step.leg.row]
        if np.min(np.abs(nosings - foot[0])) < ROBOT.foot_radius:
            continue  # inside the riser: it would stand elsewhere
        resumed = replan_task(ROBOT, course, DEFAULT, plan, t, stance)
        rest = remaining_plan(plan, t)
        extra = len(resumed.contacts.steps) - len(rest.steps)
        left = np.linalg.norm(foot[:2] - rest.feet[step.leg.row, :2])
        assert extra <= 2 and (extra >= 1 or left <= TOLERANCE)
        assert all(s.leg == step.leg for s in resumed.contacts.steps[:extra])
        after = resumed.contacts.phase(resumed.segments[0].end + 1e-6).feet
        assert np.linalg.norm(after - rest.feet, axis=1).max() <= TOLERANCE


@pytest.mark.parametrize("going", ["up", "down"])
def test_no_leg_of_a_resumed_walk_scrapes_the_stairs(going: str) -> None:
    """Feet that start elsewhere clear every nosing on their way by as much as any other."""
    plan, course = case(going)
    lane = course.lanes[0]
    rng = np.random.default_rng(3)
    for fraction in (0.3, 0.45, 0.6):
        t = fraction * plan.duration
        stance = stance_in(plan, course, t, feet=rng.uniform(-0.08, 0.08, (4, 2)))
        resumed = replan_task(ROBOT, course, DEFAULT, plan, t, stance)
        for step in resumed.contacts.steps:
            p = step.swing.positions(np.linspace(0.0, step.swing.duration, 200))
            s, _ = lane.coordinates(p[:, :2])
            assert np.min(p[:, 2] - lane.height(s)) >= ROBOT.foot_radius - 1e-6
            low, high = sorted((s[0], s[-1]))
            for a, z in lane.nosings():
                if low + 0.08 < a < high - 0.08:
                    near = np.hypot(s - a, p[:, 2] - z).min()
                    assert near >= ROBOT.foot_radius + DEFAULT.swing_clearance - 1e-4


@pytest.mark.parametrize("short", [0.245, 0.26, 0.3])
def test_a_foot_on_the_tread_below_is_put_up_to_its_place(short: float) -> None:
    """Also from right before the riser, or over the edge: that leg alone steps, back if need be."""
    plan, course = case("up")
    step = next(s for s in plan.contacts.steps if s.swing.p_end[2] > 0.2)
    t = step.touchdown
    off = np.zeros((4, 2))
    off[step.leg.row, 0] = -short
    stance = stance_in(plan, course, t, feet=off)
    resumed = replan_task(ROBOT, course, DEFAULT, plan, t, stance)
    back = [s for s in resumed.contacts.steps if s.touchdown < resumed.segments[0].end]
    assert {s.leg for s in back} == {step.leg}
    assert len(back) <= 2
    np.testing.assert_allclose(back[-1].swing.p_end, step.swing.p_end, atol=1e-9)


@pytest.mark.parametrize("kind", ["level", "up", "down", "spin"])
def test_every_step_begins_where_its_foot_really_stands(kind: str) -> None:
    """Also that of a foot left where it stands, near its place: no foot ever jumps."""
    plan, course = case(kind)
    rng = np.random.default_rng(5)
    for fraction in (0.1, 0.35, 0.6):
        t = fraction * plan.duration
        stance = stance_in(plan, course, t, feet=rng.uniform(-0.02, 0.02, (4, 2)))
        resumed = replan_task(ROBOT, course, DEFAULT, plan, t, stance)
        feet = np.array(stance.feet)
        for step in resumed.contacts.steps:
            assert np.array_equal(step.swing.p_start, feet[step.leg.row])
            feet[step.leg.row] = step.swing.p_end


def test_a_foot_that_slipped_off_the_end_of_the_ground_comes_back() -> None:
    """Its swing is one that a leg can make, though the map says nothing of where it stands."""
    feet = np.array(stance_at(flat_course(), DEFAULT).feet)
    feet[2] = [-0.02, 0.33, 0.001]
    builder = StepBuilder(flat_course().lanes[0], feet, foot_radius=0.008, clearance=0.02)
    swing = builder.swing(feet[2], np.array([0.4, 0.33]), 1.0)
    assert np.array_equal(swing.p_start, feet[2])
    assert 0.02 <= swing.apex_z <= 0.1


def test_a_foot_near_its_place_but_across_a_riser_is_not_in_it() -> None:
    """Nor is one whose sphere stands over the edge; one as near on the same tread is."""
    lane = stairs_course("up").lanes[0]
    goal = np.tile([3.02, 0.2, 0.138], (4, 1))
    off = [[-0.025, 0.0, -0.13], [-0.015, 0.0, 0.0], [0.025, 0.0, 0.0], [0.0, 0.04, 0.0]]
    feet = np.add(goal, off)
    stays = in_place(lane, feet, goal, tolerance=TOLERANCE, foot_radius=ROBOT.foot_radius)
    assert stays.tolist() == [False, False, True, False]


@pytest.mark.parametrize("kind", KINDS)
def test_a_resumed_plan_can_be_resumed(kind: str) -> None:
    """Pushed again on the way back: still one recovery, and still to the same goal."""
    plan, course = case(kind)
    t = 0.5 * plan.duration
    off = np.array([[0.06, 0.0], [0.0, 0.05], [0.0, 0.0], [-0.05, 0.02]])
    first = replan_task(ROBOT, course, DEFAULT, plan, t, stance_in(plan, course, t, feet=off))
    again = 0.6 * first.segments[0].end
    stance = stance_in(first, course, again, feet=-0.5 * off)
    second = replan_task(ROBOT, course, DEFAULT, first, again, stance)
    assert second.revision == 2
    assert [s.kind for s in second.segments if s.name == "recovery"] == ["transition"]
    assert [s.name for s in second.segments] == [s.name for s in first.segments]
    np.testing.assert_allclose(second.end.body, plan.end.body, atol=5e-3)
    assert sampled(second).margin.min() > 0.0


@pytest.mark.parametrize("kind", ["level", "up", "spin"])
def test_segments_follow_one_another_and_hold_their_own_steps(kind: str) -> None:
    """Gapless in time, each listed step within its segment and one of the plan's."""
    plan, course = case(kind)
    for fraction in (0.05, 0.3, 0.8):
        t = fraction * plan.duration
        off = np.tile([0.05, 0.0], (4, 1))
        resumed = replan_task(ROBOT, course, DEFAULT, plan, t, stance_in(plan, course, t, feet=off))
        ends = [0.0] + [s.end for s in resumed.segments]
        assert [s.start for s in resumed.segments] == pytest.approx(ends[:-1])
        assert ends[-1] == pytest.approx(resumed.duration)
        lifts = [round(s.lift_off, 6) for s in resumed.contacts.steps]
        for segment in resumed.segments:
            for step in segment.details.get("steps", []):
                assert segment.start - 1e-9 <= step["start"] < step["end"] <= segment.end + 1e-9
                assert round(step["start"], 6) in lifts


def test_on_a_lane_that_heads_elsewhere_the_resumed_walk_is_the_walk_turned() -> None:
    """Nothing of it depends on where in the world the lane is, or which way it heads."""
    turned = course_of(
        Element("floor", length=1.0),
        Element("landing", length=5.0, turn_deg=90.0),
        Element("floor", length=3.0),
    )
    lane = turned.lanes[1]
    straight = walk_plan(flat_course(), goal=3.25)
    at = stance_at(flat_course(), DEFAULT)
    feet = np.column_stack([lane.point(at.feet[:, 0] - 1.25, at.feet[:, 1]), at.feet[:, 2]])
    body = np.array([*lane.point(0.0), at.body[2], 0.0, lane.yaw])
    task = Task(kind="walk", name="walk", lane=1, goal=2.0)
    there = plan_task(ROBOT, turned, DEFAULT, task, Stance(body, feet), index=0)
    off = np.array([[0.05, 0.0], [0.0, -0.05], [0.03, 0.03], [0.0, 0.0]])
    c, s = lane.heading
    t = 0.4 * straight.duration
    here = stance_in(straight, flat_course(), t, feet=off)
    gone = stance_in(there, turned, t, feet=off @ np.array([[c, s], [-s, c]]))
    a = replan_task(ROBOT, flat_course(), DEFAULT, straight, t, here)
    b = replan_task(ROBOT, turned, DEFAULT, there, t, gone)
    assert [x.leg for x in a.contacts.steps] == [x.leg for x in b.contacts.steps]
    for x, y in zip(a.contacts.steps, b.contacts.steps, strict=True):
        along = lane.point(x.swing.p_end[0] - 1.25, x.swing.p_end[1])
        np.testing.assert_allclose(y.swing.p_end[:2], along, atol=1e-6)
    assert a.margin == pytest.approx(b.margin, abs=2e-3)


def test_resuming_is_the_same_to_the_bit_each_time() -> None:
    """Same plan, same stance: same body and same steps."""
    plan, course = case("up")
    off = np.array([[0.05, 0.0], [0.0, -0.05], [0.03, 0.03], [0.0, 0.0]])
    t = 0.5 * plan.duration
    stance = stance_in(plan, course, t, feet=off)
    a, b = (replan_task(ROBOT, course, DEFAULT, plan, t, stance) for _ in range(2))
    assert np.array_equal(a.body.control, b.body.control)
    assert [x.lift_off for x in a.contacts.steps] == [x.lift_off for x in b.contacts.steps]


def test_a_robot_that_is_over_its_edge_has_no_way_back() -> None:
    """With the centre of mass outside of its four feet the refusal says what is wrong."""
    plan, course = case("level")
    stance = stance_in(plan, course, 0.0)
    over = Stance(np.add(stance.body, [0.0, 0.45, -0.2, 0.0, 0.0]), stance.feet)
    with pytest.raises(PlanningError):
        replan_task(ROBOT, course, DEFAULT, plan, 0.0, over)


@pytest.mark.parametrize("own", [0.012, 0.0199, 0.03])
def test_no_way_back_of_negative_margin_is_taken(
    own: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plan of little margin has a way back of a margin above zero, or none at all."""
    plan, course = case("level")
    stance, tried = stance_in(plan, course, 0.0), list[float]()
    found = [-0.0075, -0.001, 0.002, 0.02, 0.05, 0.05, 0.05, 0.05]

    def resume(*_: object) -> tuple[float, MotionPlan]:
        tried.append(found[len(tried)])
        return tried[-1], plan

    monkeypatch.setattr(replan, "_resume", resume)
    thin = replace(plan, margin=own)
    assert replan_task(ROBOT, course, DEFAULT, thin, 0.0, stance) is plan
    assert tried[-1] > 0.0 and len(tried) >= 3
    tried.clear()
    found[:] = [-0.001] * 8
    with pytest.raises(PlanningError, match="best way back"):
        replan_task(ROBOT, course, DEFAULT, thin, 0.0, stance)
