"""Plans one task from the stance that the robot is in."""

import numpy as np

from drake_quad.planning.body_path import Route, plan_body
from drake_quad.planning.body_spline import BodySpline, knot_count
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import MotionPlan, Segment, Stance
from drake_quad.planning.plan_spin import lay_spin
from drake_quad.planning.plan_walk import lay_walk
from drake_quad.planning.settings import PlanSettings
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Course

KNOT = 0.2  # [s]


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
    lay = lay_walk if task.kind == "walk" else lay_spin
    contacts, route, segments = lay(robot, course, settings, task, stance)
    body, margin = plan_body(robot, contacts, route, settings)
    return MotionPlan(index, contacts, body, segments, margin)


__all__ = ["Route", "plan_task"]
