"""The body's path that begins with another plan's path."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rig import flat_course, paper_robot, stairs_course, stance_at, walk_plan

from drake_quad.common import FloatArray
from drake_quad.planning import body_qp, plan_body as module, task as task_module
from drake_quad.planning.body_path import BodyPathOptimizer
from drake_quad.planning.body_qp import LONG
from drake_quad.planning.body_reference import BodyReference
from drake_quad.planning.contact_plan import ContactPlan, sample_times
from drake_quad.planning.leg_limits import reach_left
from drake_quad.planning.mission import plan_tasks
from drake_quad.planning.motion_plan import MotionPlan, pose_robot
from drake_quad.planning.plan_body import plan_body
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.walk_footsteps import plan_walk_footsteps
from drake_quad.robot.model import RobotModel

SETTINGS = PlanSettings(body_height=0.70)
TASK = Task(kind="walk", name="walk", lane=0, goal=6.25)


def _laid(settings: PlanSettings) -> tuple[ContactPlan, BodyReference]:
    course = stairs_course()
    contacts, route, _ = plan_walk_footsteps(
        paper_robot(), course, settings, TASK, stance_at(course, settings)
    )
    return contacts, route


def test_a_long_way_keeps_as_much_margin_as_a_short_one() -> None:
    """The same gait on level ground: 160 steps leave what 40 do, and not two fifths of it."""
    settings = replace(
        PlanSettings(), cycle_time=4.0, duty_factor=0.82, switch_wait=0.1, margin_desired=0.3
    )
    short, long = (
        walk_plan(flat_course(goal + 4.0), goal=goal, settings=settings) for goal in (10.0, 40.0)
    )
    assert len(long.contacts.steps) == 4 * len(short.contacts.steps) == 160
    assert 0.05 < short.margin < 0.1  # it costs something to have it
    assert long.margin >= 0.9 * short.margin


@pytest.mark.parametrize("dynamic", [False, True])
def test_only_static_plans_of_many_steps_pay_less_for_their_way(
    dynamic: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Up to LONG steps they pay in full, and so does a plan that is balanced by its motion."""
    settings = replace(SETTINGS, dynamic=dynamic)
    contacts, route = _laid(settings)
    rolled = np.zeros((4, 2))
    search = BodyPathOptimizer(paper_robot(), contacts, route, settings, None, rolled)
    problem = search._problem()
    costs = []
    for steps in (1e9, LONG, len(contacts.steps), len(contacts.steps) / 2):
        monkeypatch.setattr(body_qp, "LONG", steps)
        frame = body_qp.make_frame(problem)
        costs.append((frame.P.toarray()[: -problem.scalars], frame.c))
    assert len(contacts.steps) < LONG
    for k, share in enumerate((1.0, 1.0, 1.0, 1.0 if dynamic else 0.5)):
        np.testing.assert_allclose(costs[k][0], share * costs[0][0], rtol=1e-9)
        np.testing.assert_allclose(
            costs[k][1][: -problem.scalars], share * costs[0][1][: -problem.scalars], rtol=1e-9
        )
        np.testing.assert_array_equal(costs[k][1][-problem.scalars :], body_qp.PRICES)


def _planned(
    robot: RobotModel, settings: PlanSettings, warm_start: MotionPlan | None = None
) -> MotionPlan:
    path, contacts, margin = plan_body(robot, *_laid(settings), settings, warm_start=warm_start)
    return MotionPlan(0, contacts, path, (), margin)


def _knees(robot: RobotModel, plan: MotionPlan) -> tuple[float, FloatArray]:
    """What is left of the legs' reach and limits [m], and the knees' angles [rad]."""
    times = sample_times(plan.contacts)
    feet, _ = plan.contacts.feet_at(times)
    body = plan.body.samples(times)[:, 0]
    q, _, _ = pose_robot(robot, body, feet)
    return float(reach_left(robot, body, feet).min()), q[..., 2]


@pytest.fixture(scope="module")
def stiff() -> RobotModel:
    """A robot whose knees may not bend as far as they would: the body has to rise for them."""
    robot = paper_robot()
    _, knees = _knees(robot, _planned(robot, SETTINGS))
    most = float(np.abs(knees).max()) - 0.05
    bent = np.sort(robot.geometry.knee_sign[:, None] * np.array([0.0, most]), axis=1)
    lower, upper = np.array(robot.q_lower), np.array(robot.q_upper)
    lower[2::3], upper[2::3] = bent[:, 0], bent[:, 1]
    return replace(robot, q_lower=lower, q_upper=upper)


def test_a_path_that_begins_with_another_plans_keeps_limits_and_margin(
    stiff: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same steps at other times: it has the margin of one found anew, by fewer programs."""
    solved = []
    solve = BodyPathOptimizer.solve

    def counted(self: BodyPathOptimizer, **given: Any) -> FloatArray:
        solved.append(given)
        return solve(self, **given)

    monkeypatch.setattr(BodyPathOptimizer, "solve", counted)
    quick = replace(SETTINGS, cycle_time=6.5)
    other = _planned(stiff, SETTINGS)
    solved.clear()
    anew = _planned(stiff, quick)
    many = len(solved)
    solved.clear()
    like = _planned(stiff, quick, other)
    assert 1 <= len(solved) < many
    assert like.duration == anew.duration < other.duration
    assert _knees(stiff, like)[0] >= 0.0
    assert like.margin == pytest.approx(anew.margin, abs=4e-3)


def test_another_plan_is_of_no_use_where_its_legs_were_free_or_its_steps_differ(
    stiff: RobotModel,
) -> None:
    """The path is then the one found anew, to the bit."""
    robot, quick = paper_robot(), replace(SETTINGS, cycle_time=6.5)
    free = _planned(robot, SETTINGS)
    assert np.array_equal(
        _planned(robot, quick, free).body.control, _planned(robot, quick).body.control
    )
    bent = _planned(stiff, SETTINGS)
    fewer = replace(bent, contacts=ContactPlan(bent.contacts.feet, (), bent.duration))
    assert np.array_equal(
        _planned(stiff, quick, fewer).body.control, _planned(stiff, quick).body.control
    )


def test_where_another_plans_path_leads_nowhere_one_is_found_anew(
    stiff: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is the same to the bit as without the other plan."""
    other, quick = _planned(stiff, SETTINGS), replace(SETTINGS, cycle_time=6.5)
    anew = _planned(stiff, quick)
    monkeypatch.setattr(module, "keep_limits_from", lambda _: False)
    assert np.array_equal(_planned(stiff, quick, other).body.control, anew.body.control)


def test_no_control_point_leaves_the_trust_region(stiff: RobotModel) -> None:
    """Whether the path before lifts and tilts or not; but for the ends, which are given."""
    contacts, route = _laid(SETTINGS)
    search = BodyPathOptimizer(stiff, contacts, route, SETTINGS, None, np.zeros((4, 2)))
    search.follow(search.solve(broken=1e-6))
    assert search.find_limits() > 0.0
    radius = np.linspace(0.001, 0.006, len(search.control))
    for _ in range(3):
        before = np.zeros((len(radius), 4))
        before[:, : search.control.shape[1]] = search.control
        free = search.solve(broken=1e-6)
        path = search.solve(broken=1e-6, radius=radius)
        moved = np.abs(path - before)[3:-3].max(axis=1)
        assert np.all(moved <= radius[3:-3] + 1e-6)
        assert np.abs(free - before)[3:-3].max() > 0.006  # it would go farther
        search.follow(path)
        search.find_limits()


def test_limits_of_a_path_are_told_near_where_they_are(stiff: RobotModel) -> None:
    """Of each control point that has to do with the path there, four of them at least."""
    contacts, route = _laid(SETTINGS)
    search = BodyPathOptimizer(stiff, contacts, route, SETTINGS, None, np.zeros((4, 2)))
    search.follow(search.solve(broken=1e-6))
    search.find_limits()
    times, knot = search._times, search._knot
    body = search.spline.samples(times)[:, 0]
    feet, _ = search.contacts.feet_at(times)
    short = 10.0 * np.maximum(-reach_left(stiff, body, feet).min(axis=(1, 2)), 0.0)
    k = int(np.argmax(short))
    first = min(int(times[k] / knot), len(search.control) - 4)
    np.testing.assert_allclose(search.beyond[first : first + 4].max(), short[k])
    assert np.all(search.beyond[first : first + 4] >= short[k] - 1e-9)
    assert search.beyond.max() == pytest.approx(short.max())
    assert (search.beyond == 0.0).any()


def test_each_task_of_a_mission_has_the_warm_start_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And leaves its plan for the next time."""
    course = stairs_course()
    stance, tasks = stance_at(course, SETTINGS), [TASK, replace(TASK, name="on", goal=6.75)]
    given: list[MotionPlan | None] = []

    def spy(*args: Any, warm_start: MotionPlan | None = None, **more: Any) -> Any:
        given.append(warm_start)
        return plan_body(*args, warm_start=warm_start, **more)

    monkeypatch.setattr(task_module, "plan_body", spy)
    known: dict[int, MotionPlan] = {}
    first = list(plan_tasks(paper_robot(), course, SETTINGS, tasks, stance, known))
    assert given[0] is None and known == dict(enumerate(first))
    given.clear()
    list(plan_tasks(paper_robot(), course, SETTINGS, tasks, stance, known))
    assert given[0] is first[0] and any(plan is first[1] for plan in given)


def test_a_path_that_is_followed_from_another_plan_is_held_within_limits(stiff: RobotModel) -> None:
    """It may keep them all as it is: the next path would not, if it knew of none."""
    plan = _planned(stiff, SETTINGS)
    search = BodyPathOptimizer(stiff, *_laid(SETTINGS), SETTINGS, None, np.zeros((4, 2)))
    assert search.follow_plan(plan)
    assert search.find_limits() == 0.0 and search._limits is not None
    np.testing.assert_allclose(search.spline.control[3:-3], plan.body.control[3:-3], atol=1e-6)


def test_a_walk_from_other_footprints_begins_with_its_first_path(
    stiff: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Feet that roll farther than was thought are set down elsewhere, by some millimetres."""
    plan, begun = _planned(stiff, SETTINGS), []
    gaps = iter([(0.0, 0.02), (1.0, 0.0)])

    def finish(*_: object, warm_start: MotionPlan | None) -> MotionPlan:
        begun.append(warm_start)
        return plan

    monkeypatch.setattr(task_module, "riser_gap", lambda *_: next(gaps))
    lane = stairs_course().lanes[0]
    task_module._off_risers(lane, 0.03, SETTINGS, lambda _: _laid(SETTINGS), finish, None)  # type: ignore[arg-type,return-value]
    assert begun == [None, plan]
