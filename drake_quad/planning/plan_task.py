"""Plans one task from the stance that the robot is in."""

from dataclasses import replace

import numpy as np

from drake_quad.planning.body_path import plan_body
from drake_quad.planning.body_spline import BodySpline, knot_count
from drake_quad.planning.body_zmp import ZmpSamples, sample_zmp
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import MotionPlan, Segment, Stance
from drake_quad.planning.plan_spin import lay_spin
from drake_quad.planning.plan_walk import lay_walk
from drake_quad.planning.settings import PlanSettings
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Course

KNOT = 0.2  # [s]
ZMP_PERIOD = 0.01  # [s]
MARGIN_ENOUGH = 0.05  # [m] below which another way is tried


def plan_task(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    task: Task,
    stance: Stance,
    *,
    index: int,
) -> MotionPlan:
    """Plans `task` from `stance` on.

    Args:
        robot: The robot.
        course: The ground.
        settings: Gait and body parameters.
        task: What to do.
        stance: Where body and feet are, at rest.
        index: The task's place in the mission.

    Raises:
        PlanningError: If there is no plan, with the reason.
    """
    if task.kind == "stand":
        contacts = ContactPlan(stance.feet, (), task.duration)
        control = np.tile(stance.body, (knot_count(task.duration, KNOT), 1))
        segment = Segment(task.name, "stand", 0.0, task.duration)
        spline = BodySpline(KNOT, control)
        return MotionPlan(index, contacts, spline, (segment,), float("nan"))
    plan = _plan_gait(robot, course, settings, task, stance, index)
    if plan.margin < MARGIN_ENOUGH and not (settings.via_centres or settings.uniform_body):
        # The fewest steps leave little margin: the paper's way, through the centres, takes more
        # steps and may leave more.
        by_centres = replace(settings, via_centres=True)
        other = _plan_gait(robot, course, by_centres, task, stance, index)
        plan = max(plan, other, key=lambda p: p.margin)
    return plan


def _plan_gait(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    task: Task,
    stance: Stance,
    index: int,
) -> MotionPlan:
    lay = lay_walk if task.kind == "walk" else lay_spin
    contacts, route, segments = lay(robot, course, settings, task, stance)
    body, margin = plan_body(robot, contacts, route, settings)
    if settings.dynamic:
        segments = _with_zmp(segments, sample_zmp(robot, contacts, body, ZMP_PERIOD))
    return MotionPlan(index, contacts, body, segments, margin)


def _with_zmp(segments: tuple[Segment, ...], zmp: ZmpSamples) -> tuple[Segment, ...]:
    """The segments, each with the smallest margin of its zero-moment point [m] in its details."""
    found = []
    for segment in segments:
        mine = (zmp.times >= segment.start - 1e-9) & (zmp.times <= segment.end + 1e-9)
        margin = float(zmp.margin[mine].min()) if np.any(mine) else None
        found.append(replace(segment, details={**segment.details, "zmp_margin_min": margin}))
    return tuple(found)
