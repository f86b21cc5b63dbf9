"""Room between a planned robot's knees, shanks and trunk and the course that it is planned on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.design.shape import Shape, shank_middles
from drake_quad.gait.legs import LEGS, FloatArray
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import PlanSamples, rotations
from drake_quad.robot.leg_kinematics import calc_knees
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Course, Lane

TRUNK_POINTS = 7


@dataclass(frozen=True)
class Room:
    """The least room of a plan, and where it is.

    Attributes:
        distance: Between a part of the robot and the course [m], negative inside it.
        part: Which, for people.
        task: The task's name.
        time: In the task [s].
    """

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
    least = Room(np.inf, "", "", 0.0)
    for task, s in zip(tasks, samples, strict=True):
        lane, body = course.lanes[task.lane], s.body[:, 0]
        R = rotations(body)
        knees = body[:, None, :3] + np.einsum("nij,nlj->nli", R, calc_knees(robot.geometry, s.q))
        across = np.einsum("nij,nlj->nli", R, knee_axes(s.q))
        shanks = shank_middles(shape, knees, s.feet, across)
        x = np.linspace(shape.trunk_lower[0], shape.trunk_upper[0], TRUNK_POINTS)
        under = np.column_stack([x, np.zeros(len(x)), np.full(len(x), shape.trunk_lower[2])])
        trunk = body[:, None, :3] + np.einsum("nij,kj->nki", R, under)
        legs = (distance(lane, shanks) - shape.shank_radii).min(axis=-1)
        for row in range(4):
            k = int(np.argmin(legs[:, row]))
            name = f"the knee or shank of {LEGS[row].short}"
            least = min(
                least, Room(float(legs[k, row]), name, task.name, float(s.times[k])),
                key=lambda r: r.distance,
            )  # fmt: skip
        below = distance(lane, trunk).min(axis=-1)
        k = int(np.argmin(below))
        least = min(
            least, Room(float(below[k]), "the trunk", task.name, float(s.times[k])),
            key=lambda r: r.distance,
        )  # fmt: skip
    return least


def knee_axes(q: FloatArray) -> FloatArray:
    """Unit vectors of the knees' axes in B (..., 4, 3), of the joints' angles (..., 4, 3) [rad]."""
    a = q[..., 0]
    return np.stack([np.zeros_like(a), np.cos(a), np.sin(a)], axis=-1)


def distance(lane: Lane, points: FloatArray) -> FloatArray:
    """Signed distance of points (..., 3) in W from a lane's ground [m], negative inside it.

    Along the lane and upwards; the ground goes on beyond the lane's ends.
    """
    s, _ = lane.coordinates(points[..., :2])
    z, breaks = points[..., 2], np.array(lane.breaks)
    ends = np.concatenate([[-np.inf], breaks[1:-1], [np.inf]])
    best = np.full(s.shape, np.inf)
    for low, high, height in zip(ends[:-1], ends[1:], lane.heights, strict=True):
        beside = np.maximum(low - s, s - high)
        above = z - height
        outside = np.hypot(np.maximum(beside, 0.0), np.maximum(above, 0.0))
        best = np.minimum(best, outside + np.minimum(np.maximum(beside, above), 0.0))
    return best
