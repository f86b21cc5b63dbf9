"""Doubts about a gait before it is planned: moments of its walks at which no pose of the body does.

A gait is good on endless stairs; where a flight begins or ends its legs may be short all the same.
A plan finds that out in seconds, and poses without a path between them in some tenths of one.
Doubts put a gait off: it is planned when no other will do.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.planning.body_reference import level_pose, robot_stance
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.pose_search import PoseSearch
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.task import initial_setback
from drake_quad.planning.walk_footsteps import plan_walk_footsteps
from drake_quad.robot.model import RobotModel
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane

LEGS = 0.01  # of a leg: what may be short at a moment, for the search of poses is not exact
NOT_ROLLED: FloatArray = np.zeros((4, 2))


def find_doubt(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    mission: Sequence[Task],
    *,
    start: float,
    margin: float,
    shanks: float,
) -> PlanningError | None:
    """Why a gait will hardly have a good plan on a course; None if nothing speaks against it.

    Walks over flights are looked at, each from rest at its lane's beginning.

    Args:
        robot: The robot.
        course: The ground.
        settings: The gait.
        mission: What is to be done.
        start: Where the first walk begins along its lane [m].
        margin: Static margin that a plan is to keep [m].
        shanks: What may be short of the clearance that shanks are to have [m].
    """
    if settings.dynamic or settings.uniform_body or settings.margin != HULL:
        return None
    setback = max(settings.riser_setback, initial_setback(robot.foot_radius))
    settings = replace(settings, riser_setback=setback)
    begin = start
    for task in mission:
        lane = course.lanes[task.lane]
        if task.kind != "walk":
            continue
        begin, at = 0.0, begin
        if not lane.flights:
            continue
        stance = _stand(robot, lane, settings, at)
        try:
            contacts, route, _ = plan_walk_footsteps(robot, course, settings, task, stance)
            poses = PoseSearch(robot, contacts, route, settings, None, NOT_ROLLED)
            short = poses.shortage(margin)
        except PlanningError as error:
            return error
        if short.legs > LEGS * float(robot.geometry.reach.mean()):
            return PlanningError(
                f"legs would be {short.legs:.3f} m beyond their limits in '{task.name}', "
                "wherever the body is",
                excess=short.legs,
            )
        if short.shanks > shanks:
            return PlanningError(
                f"a knee or shank would be {short.shanks:.3f} m nearer to the stairs or the trunk "
                f"than it may be in '{task.name}', wherever the body is",
                room=-short.shanks,
            )
    return None


def _stand(robot: RobotModel, lane: Lane, settings: PlanSettings, s: float) -> Stance:
    """The robot at rest at `s` [m] along a lane, as it is before a walk begins."""
    stance = robot_stance(settings)
    heights = lane.height(s + stance[:, 0])
    feet = np.column_stack([lane.point(s + stance[:, 0], stance[:, 1]), heights])
    feet[:, 2] += robot.foot_radius
    return Stance(level_pose(lane.point(s), lane.yaw, float(np.mean(heights)), settings), feet)
