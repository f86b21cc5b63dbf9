"""Room between a planned robot's knees, shanks and trunk and the course that it is planned on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.design.shape import Shape
from drake_quad.errors import PlanningError
from drake_quad.gait.legs import LEGS
from drake_quad.planning.leg_distance import PAIRS, room_between_legs
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import PlanSamples, rotations
from drake_quad.planning.shank_room import (
    WORTH,
    distance,
    from_nosings,
    shank_room,
    trunk_room,
)
from drake_quad.planning.thigh_room import thigh_room
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Course

TRUNK_POINTS = 7

FEET_APART = 0.005  # [m] between two feet: as exactly as plans are followed, and more


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
        below = np.concatenate([distance(lane, trunk), from_nosings(lane, trunk)], axis=-1)
        parts.append(("the trunk", below, np.ones(2 * TRUNK_POINTS - 1)))
        for part, away, weight in parts:
            k, point = np.unravel_index(np.argmin(away * weight), away.shape)
            here = float(away[k, point])
            worth = float(here * weight[point])
            if worth < least.worth:
                least = Room(worth, here, part, task.name, float(s.times[k]))
    return least


def refuse_touching(robot: RobotModel, task: Task, samples: PlanSamples) -> None:
    """Refuses a task's plan in which a shank comes into the trunk, or two legs into each other.

    Raises:
        PlanningError: With which, where and how far.
    """
    body = samples.body[:, 0]
    p_BF = np.einsum("nji,nlj->nli", rotations(body), samples.feet - body[:, None, :3])
    room = trunk_room(robot, p_BF, samples.q).min(axis=-1)
    k, row = np.unravel_index(np.argmin(room), room.shape)
    what = f"the shank of {LEGS[row].short} would be {{:.3f}} m inside the trunk"
    _refuse(float(room[k, row]), what, float(samples.times[k]), task)
    one, two = PAIRS.T
    room = (
        np.linalg.norm(p_BF[:, one] - p_BF[:, two], axis=-1) - 2.0 * robot.foot_radius - FEET_APART
    )
    k, pair = np.unravel_index(np.argmin(room), room.shape)
    names = [LEGS[row].short for row in PAIRS[pair]]
    what = f"the feet {names[0]} and {names[1]} would be {{:.3f}} m too near each other"
    _refuse(float(room[k, pair]), what, float(samples.times[k]), task)
    room = room_between_legs(robot, p_BF, samples.q)
    k, pair = np.unravel_index(np.argmin(room), room.shape)
    one, two = (LEGS[row].short for row in PAIRS[pair])
    what = f"the legs {one} and {two} would be {{:.3f}} m inside each other"
    _refuse(float(room[k, pair]), what, float(samples.times[k]), task)


def refuse_thighs(robot: RobotModel, course: Course, task: Task, samples: PlanSamples) -> None:
    """Refuses a task's plan in which a thigh comes into the ground.

    Raises:
        PlanningError: With which, where and how far.
    """
    room = thigh_room(robot, course.lanes[task.lane], samples.body[:, 0], samples.q)
    k, row = np.unravel_index(np.argmin(room), room.shape)
    what = f"the thigh of {LEGS[row].short} would be {{:.3f}} m inside the stairs"
    _refuse(float(room[k, row]), what, float(samples.times[k]), task)


def _refuse(room: float, what: str, time: float, task: Task) -> None:
    if room <= 0.0:
        raise PlanningError(f"{what.format(-room)} at {time:.1f} s of '{task.name}'", apart=room)
