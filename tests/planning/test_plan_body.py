"""The body's path that begins with another plan's path."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rig import paper_robot, stairs_course, stance_at

from drake_quad.common import FloatArray
from drake_quad.planning import plan_body as module
from drake_quad.planning.body_path import BodyPathOptimizer
from drake_quad.planning.body_reference import BodyReference
from drake_quad.planning.contact_plan import ContactPlan, sample_times
from drake_quad.planning.leg_limits import reach_left
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


def _planned(
    robot: RobotModel, settings: PlanSettings, like: MotionPlan | None = None
) -> MotionPlan:
    path, contacts, margin = plan_body(robot, *_laid(settings), settings, like=like)
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
