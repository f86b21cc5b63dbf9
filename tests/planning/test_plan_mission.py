"""A mission's plans follow one another from rest to rest; what the robot cannot do is refused."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rig import course_of, flat_course, paper_robot, stairs_course, stance_at

from drake_quad.certificate.failure import check_joins
from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.planning.body_reference import robot_stance
from drake_quad.planning.contact_forces import find_overload, torque_ratio
from drake_quad.planning.mission import (
    HELD_BY_FRICTION,
    MissionPlan,
    check_lift_offs,
    check_mission,
    check_slopes,
    check_torques,
    initial_stance,
    join_plans,
    plan_mission,
)
from drake_quad.planning.motion_plan import evaluate
from drake_quad.planning.problem import END_CLEARANCE, PlanSettings, Task, derive_mission
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element

DEFAULT = PlanSettings()


@cache
def turning_course(turn_deg: float, rise: float = 0.13) -> Course:
    """Up three stairs, a turn, down three."""
    return course_of(
        Element("floor", length=3.0),
        Element("stairs", going="up", rise=rise, run=0.5, count=3),
        Element("landing", length=3.5, turn_deg=turn_deg),
        Element("stairs", going="down", rise=rise, run=0.5, count=3),
        Element("floor", length=3.0),
    )


@cache
def mission_on(turn_deg: float) -> tuple[tuple[Task, ...], MissionPlan]:
    course = turning_course(turn_deg)
    tasks = derive_mission(course, DEFAULT)
    stance = initial_stance(paper_robot(), course, DEFAULT, start=1.25)
    return tasks, plan_mission(paper_robot(), course, DEFAULT, tasks, stance)


def climb(rise: float, settings: PlanSettings = DEFAULT) -> MissionPlan:
    course = stairs_course("up", rise=rise)
    task = Task(kind="walk", name="climb", lane=0, goal=6.25)
    stance = stance_at(course, settings)
    return plan_mission(paper_robot(), course, settings, [task], stance)


def test_derived_mission_follows_the_course() -> None:
    """Stand, walk each lane, turn where it turns, and stand at the end."""
    course = turning_course(90.0)
    tasks, _ = mission_on(90.0)
    assert [t.kind for t in tasks] == ["stand", "walk", "spin", "walk", "stand"]
    assert [t.lane for t in tasks] == [0, 0, 0, 1, 1]
    assert tasks[1].goal == course.lanes[0].length
    assert tasks[2].angle == pytest.approx(np.pi / 2)
    foremost = tasks[3].goal + 0.5 * DEFAULT.workspace.P_x + 0.25 * DEFAULT.stride
    assert foremost == pytest.approx(course.lanes[1].length - END_CLEARANCE)


def test_each_plan_begins_where_the_one_before_ends() -> None:
    """Body and feet never jump between tasks, and the clock adds up."""
    _, mission = mission_on(90.0)
    for before, after in zip(mission.plans[:-1], mission.plans[1:], strict=True):
        np.testing.assert_array_equal(after.contacts.feet, before.end.feet)
        np.testing.assert_allclose(after.sample(0.0).body[0], before.end.body, atol=2e-3)
    durations = [p.duration for p in mission.plans]
    np.testing.assert_allclose(mission.starts, np.concatenate([[0.0], np.cumsum(durations)[:-1]]))
    assert mission.duration == pytest.approx(sum(durations))
    assert [p.index for p in mission.plans] == list(range(5))


def test_mission_ends_at_its_goal_heading_along_the_last_lane() -> None:
    """Up, round the corner and down: over the last lane, at the height of its floor."""
    course, (tasks, mission) = turning_course(90.0), mission_on(90.0)
    end = mission.plans[-1].end
    np.testing.assert_allclose(end.body[:2], course.lanes[1].point(tasks[3].goal), atol=5e-3)
    assert end.body[2] == pytest.approx(DEFAULT.body_height, abs=1e-3)
    assert end.body[4] == pytest.approx(np.pi / 2, abs=1e-3)
    np.testing.assert_allclose(end.feet[:, 2], paper_robot().foot_radius)


def test_checked_mission_has_margin_reach_and_limits_throughout() -> None:
    """What `check_mission` returns is what it looked at: nothing negative, nothing out of reach."""
    robot, (_, mission) = paper_robot(), mission_on(90.0)
    samples = check_mission(robot, mission)
    assert len(samples) == len(mission.plans)
    for s, plan in zip(samples, mission.plans, strict=True):
        assert s.times[0] == 0.0 and s.times[-1] == plan.duration
        assert s.margin.min() > 0.05 and s.reach_excess.max() == 0.0
        q = s.q.reshape(-1, 12)
        assert np.all(q >= robot.q_lower) and np.all(q <= robot.q_upper)


def footprints(mission: MissionPlan, task: int) -> FloatArray:
    return np.array([s.swing.p_end for s in mission.plans[task].contacts.steps])


def test_course_that_turns_right_is_walked_to_the_mirrored_goal() -> None:
    """The walk before the turn is the same; every task ends in the mirrored place, with margin.

    The plans themselves are no mirror images: leg 1 lifts first in either sense, as in the paper,
    so the transitions differ.
    """
    (_, left), (_, right) = mission_on(90.0), mission_on(-90.0)
    np.testing.assert_array_equal(footprints(left, 1), footprints(right, 1))
    for a, b in zip(left.plans, right.plans, strict=True):
        assert a.end.body * [1.0, -1.0, 1.0, 1.0, -1.0] == pytest.approx(b.end.body, abs=1e-2)
        gaits = [[s for s in p.segments if s.kind in ("wave", "spin")] for p in (a, b)]
        for one, other in zip(*gaits, strict=True):
            assert one.kind == other.kind
            assert one.end - one.start == pytest.approx(other.end - other.start)
    assert min(right.plans[k].margin for k in (1, 2, 3)) > 0.05


def test_first_stance_stands_on_the_ground_around_the_start() -> None:
    """Feet at their places about the body's centre, the body at its height over them."""
    stance = initial_stance(paper_robot(), flat_course(), DEFAULT, start=1.5)
    np.testing.assert_allclose(stance.feet[:, :2] - [1.5, 0.0], robot_stance(DEFAULT))
    np.testing.assert_allclose(stance.feet[:, 2], paper_robot().foot_radius)
    np.testing.assert_allclose(stance.body, [1.5, 0.0, DEFAULT.body_height, 0.0, 0.0])


def test_steps_out_of_reach_are_refused_with_the_leg_and_by_how_much() -> None:
    """A rise that the legs are too short for: the error's data name the foot and the excess."""
    with pytest.raises(PlanningError) as caught:
        check_mission(paper_robot(), climb(0.55))
    data = caught.value.data
    assert "too short" in caught.value.reason or "beyond its limits" in caught.value.reason
    assert data["excess"] > 0.0
    assert len(data["body"]) == 5 and len(data["foot"]) == 3


def test_joint_limits_are_checked() -> None:
    """The same walk with a knee that may not bend so far is refused, naming the joint."""
    robot, mission = paper_robot(), climb(0.13)
    check_mission(robot, mission)
    q = evaluate(robot, mission.plans[0], np.linspace(0, mission.duration, 500)).q.reshape(-1, 12)
    lower = np.array(robot.q_lower)
    lower[5] = q[:, 5].min() + 0.05
    with pytest.raises(PlanningError, match="FR_knee") as caught:
        check_mission(replace(robot, q_lower=lower), mission)
    assert caught.value.data["excess"] == pytest.approx(0.05, abs=0.02)


def test_joint_speeds_are_checked() -> None:
    """The same walk with slow motors is refused, naming the joint and the speed it would need."""
    robot, mission = paper_robot(), climb(0.13)
    with pytest.raises(PlanningError, match="rad/s") as caught:
        check_mission(replace(robot, speed=0.1 * robot.speed), mission)
    assert caught.value.data["speed"] > 0.1 * robot.speed.min()
    assert caught.value.data["joint"] in robot.joint_names


def test_a_plan_without_margin_is_refused_unless_it_is_the_papers() -> None:
    """A body that does not sway at β = 0.75 has none; only asked for by name does it pass."""
    settings = replace(DEFAULT, duty_factor=0.75, uniform_body=True)
    mission = climb(0.13, settings)
    with pytest.raises(PlanningError, match="margin") as caught:
        check_mission(paper_robot(), mission)
    assert caught.value.data["margin"] <= 0.0
    check_mission(paper_robot(), mission, uniform_body=True)


QUICK = replace(DEFAULT, dynamic=True, duty_factor=0.77, cycle_time=1.88, switch_wait=0.06)


def test_dynamic_mission_is_checked_for_its_zero_moment_point() -> None:
    """A negative static margin passes; a zero-moment point outside of the feet does not."""
    robot, mission = paper_robot(), climb(0.13, QUICK)
    samples = check_mission(robot, mission)
    assert min(s.margin.min() for s in samples) < 0.0
    with pytest.raises(PlanningError, match="static margin"):
        check_mission(robot, replace(mission, dynamic=False))
    late = []  # the body a third of a second behind its feet
    for plan in mission.plans:
        control = np.array(plan.body.control)
        control[4:] = control[:-4]
        late.append(replace(plan, body=replace(plan.body, control=control)))
    with pytest.raises(PlanningError, match="zero-moment point") as caught:
        check_mission(robot, replace(mission, plans=tuple(late)))
    assert caught.value.data["margin"] <= 0.0


def test_planning_is_quick_and_says_how_long_it_took() -> None:
    """A whole mission is planned in a second even on a busy machine."""
    _, mission = mission_on(90.0)
    assert 0.0 < mission.planning_time < 5.0


TILTED = replace(DEFAULT, pitch_along_slope=0.6)
SHORT = replace(TILTED, cycle_time=7.3, shift_time=1.17)  # no whole number of knots


@pytest.mark.parametrize("settings", [TILTED, SHORT, replace(DEFAULT, dynamic=True)])
def test_plans_are_continuous_to_the_acceleration_where_the_stairs_begin_early(
    settings: PlanSettings,
) -> None:
    """A walk's ground slopes already where its body begins, level as it stood; it joins in time.

    Height and pitch are then functions of the place; and every task ends at rest, however long.
    """
    course = course_of(
        Element("floor", length=1.5),
        Element("stairs", going="up", rise=0.13, run=0.5, count=3),
        Element("landing", length=3.5, turn_deg=90.0),
        Element("floor", length=2.0),
    )
    tasks = derive_mission(course, settings)[:3]
    stance = initial_stance(paper_robot(), course, settings, start=1.0)
    plans = plan_mission(paper_robot(), course, settings, tasks, stance).plans
    joins = check_joins(plans)
    assert joins.failure is None
    assert joins.body[0].max() < 1e-12 and joins.feet < 1e-12
    walk = plans[1]
    assert walk.segments[1].start < walk.joined < walk.segments[1].start + 2.0
    path = walk.body.samples(np.linspace(0.0, walk.joined, 200))
    assert path[0, 0, 3] == 0.0 and np.abs(path[:, 2, 2:4]).max() < 0.5
    if settings.pitch_along_slope > 0.0:
        assert path[-1, 0, 3] < -0.005


def test_a_plan_with_less_margin_than_the_clock_asks_for_is_refused() -> None:
    """The clock would stop at a lift-off; with just what there is, it is a plan."""
    mission = mission_on(90.0)[1]
    samples = check_mission(paper_robot(), mission)
    least = min(float(s.margin.min()) for s in samples)
    lower = 0
    for plan, s in zip(mission.plans, samples, strict=True):
        check_lift_offs(plan, s, least)
        if not plan.contacts.steps:
            check_lift_offs(plan, s, 1.0)  # a robot that stands lifts nothing
        elif s.margin.min() <= least:
            lower += 1
            with pytest.raises(PlanningError, match=r"controller\.lift_off_margin = "):
                check_lift_offs(plan, s, least + 1e-6)
    assert lower == 1


def test_joints_that_cannot_hold_the_robot_refuse_its_plan() -> None:
    """However the feet share the weight: a little less than the least forces take may do."""
    robot, mission = paper_robot(), mission_on(90.0)[1]
    plan, s = mission.plans[1], check_mission(robot, mission)[1]
    ratio = float(torque_ratio(robot, s).max())
    assert ratio < 1.0 and find_overload(robot, s) is None
    check_torques(replace(robot, effort=0.99 * ratio * robot.effort), plan, s)  # shared otherwise
    with pytest.raises(PlanningError, match="of its torque to stand still") as refused:
        check_torques(replace(robot, effort=0.6 * ratio * robot.effort), plan, s)
    assert refused.value.data["torque"] > 1.2


@pytest.mark.parametrize(
    ("start", "match"), [(0.2, "there is no ground"), (2.61, "from a riser"), (2.63, "its radius")]
)
def test_a_robot_does_not_begin_in_a_riser_or_beyond_the_ground(start: float, match: str) -> None:
    """A start whose feet have no place is refused, with the foot and what is the least."""
    with pytest.raises(PlanningError, match=match) as caught:
        initial_stance(paper_robot(), stairs_course("up"), DEFAULT, start=start)
    assert f"start.distance = {start:g}" in caught.value.reason and "foot " in caught.value.reason


def test_a_joint_beyond_its_limits_is_told_with_the_segment_that_it_happens_in() -> None:
    """The worst moment is in the walk, not in the transition that comes first."""
    robot, plan = paper_robot(), climb(0.13).plans[0]
    samples = evaluate(robot, plan, np.arange(0.0, plan.duration, 0.05))
    q = samples.q.reshape(-1, 12)
    first = samples.times < plan.segments[0].end
    over = q[~first].max(axis=0) - q[first].max(axis=0)
    j = int(np.argmax(over))
    upper = robot.q_upper.copy()
    upper[j] = 0.5 * (q[~first, j].max() + q[first, j].max())
    when = float(samples.times[int(np.argmax(q[:, j]))])
    short = replace(robot, q_upper=upper)
    with pytest.raises(PlanningError, match=f"of '{plan.segment_name(when)}'"):
        check_mission(short, join_plans([plan], 0.0))
    assert plan.segment_name(when) != plan.segments[0].name


def test_a_plan_that_the_clock_would_stop_is_refused() -> None:
    """What the clock demands at any time counts as what it demands at a lift-off does."""
    mission = mission_on(90.0)[1]
    samples = check_mission(paper_robot(), mission)
    plan, s = min(
        ((p, s) for p, s in zip(mission.plans, samples, strict=True) if p.contacts.steps),
        key=lambda pair: float(pair[1].margin.min()),
    )
    least = float(s.margin.min())
    check_lift_offs(plan, s, 0.0, demanded=least)
    with pytest.raises(PlanningError, match=r"controller\.margin_demanded = "):
        check_lift_offs(plan, s, 0.0, demanded=least + 1e-6)


@pytest.mark.parametrize("going", ["up", "down"])
def test_no_foot_stands_on_more_slope_than_friction_holds(going: str) -> None:
    """A tenth of what the controller counts on is for moving; on level ground none is needed."""
    course = course_of(
        Element("floor", length=2.0),
        Element("slope", going=going, height=0.45, length=1.5),
        Element("floor", length=3.0),
    )
    task = Task(kind="walk", name="over it", lane=0, goal=4.25)
    (plan,) = plan_mission(paper_robot(), course, DEFAULT, [task], stance_at(course, DEFAULT)).plans
    check_slopes(course, plan, 0.3 / HELD_BY_FRICTION + 1e-9)
    with pytest.raises(PlanningError, match=r"slope of 0\.30 .* set that to 0\.34 or more"):
        check_slopes(course, plan, 0.3 / HELD_BY_FRICTION - 1e-6)
    check_slopes(stairs_course("up"), climb(0.13).plans[0], 1e-9)
