"""Room between a planned robot's knees, shanks and trunk and the course that it is planned on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.design.shape import Shape
from drake_quad.gait.legs import LEGS
from drake_quad.planning.lane_distance import from_ground, from_nosings
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import PlanSamples, rotations
from drake_quad.planning.shank_room import WORTH, shank_room
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Course

TRUNK_POINTS = 7


@dataclass(frozen=True)
class Room:
    """The least room of a plan, and where it is.

    Attributes:
        worth: The distance as it is weighed against the room wanted: at a shank's end more than it
            is, see `shank_room.WORTH` [m].
        distance: Between a part of the robot and the course [m], negative inside it.
        part: Which, for people.
        task: The task's name.
        time: In the task [s].
    """

    worth: float
    distance: float
    part: str
    task: str
    time: float


def find_room(
    robot: RobotModel,
    shape: Shape,
    course: Course,
    tasks: Sequence[Task],
    samples: Sequence[PlanSamples],
) -> Room:
    """The least room over all samples of a mission's plans."""
    least = Room(np.inf, np.inf, "", "", 0.0)
    for task, s in zip(tasks, samples, strict=True):
        lane, body = course.lanes[task.lane], s.body[:, 0]
        R = rotations(body)
        x = np.linspace(shape.trunk_lower[0], shape.trunk_upper[0], TRUNK_POINTS)
        under = np.column_stack([x, np.zeros(len(x)), np.full(len(x), shape.trunk_lower[2])])
        trunk = body[:, None, :3] + np.einsum("nij,kj->nki", R, under)
        legs = shank_room(robot, lane, body, s.feet, s.q)
        parts = [(f"the knee or shank of {leg.short}", legs[:, leg.row], WORTH) for leg in LEGS]
        below = np.concatenate([from_ground(lane, trunk), from_nosings(lane, trunk)], axis=-1)
        parts.append(("the trunk", below, np.ones(2 * TRUNK_POINTS - 1)))
        for part, away, weight in parts:
            k, point = np.unravel_index(np.argmin(away * weight), away.shape)
            here = float(away[k, point])
            worth = float(here * weight[point])
            if worth < least.worth:
                least = Room(worth, here, part, task.name, float(s.times[k]))
    return least
