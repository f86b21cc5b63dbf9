"""Refuses plans in which a robot's parts come into each other, or its thighs into the ground."""

from collections.abc import Sequence

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import LEGS, FloatArray
from drake_quad.planning.leg_distance import PAIRS, room_between_legs
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import PlanSamples, rotations
from drake_quad.planning.shank_room import trunk_room
from drake_quad.planning.thigh_room import thigh_room
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Course

FEET_APART = 0.005  # [m] between two feet: as exactly as plans are followed, and more
NAMES = tuple(leg.short for leg in LEGS)
PAIRED = tuple(" and ".join(NAMES[row] for row in pair) for pair in PAIRS)


def refuse_touching(robot: RobotModel, task: Task, samples: PlanSamples) -> None:
    """Refuses a task's plan in which a shank comes into the trunk, or two legs into each other.

    Raises:
        PlanningError: With which, where and how far.
    """
    body = samples.body[:, 0]
    p_BF = np.einsum("nji,nlj->nli", rotations(body), samples.feet - body[:, None, :3])
    shanks = trunk_room(robot, p_BF, samples.q).min(axis=-1)
    first, second = (p_BF[:, rows] for rows in PAIRS.T)
    feet = np.linalg.norm(first - second, axis=-1) - 2.0 * robot.foot_radius - FEET_APART
    legs = room_between_legs(robot, p_BF, samples.q)
    for room, names, words in (
        (shanks, NAMES, "the shank of {} would be {:.3f} m inside the trunk"),
        (feet, PAIRED, "the feet {} would be {:.3f} m too near each other"),
        (legs, PAIRED, "the legs {} would be {:.3f} m inside each other"),
    ):
        _refuse(room, names, words, samples, task)


def refuse_thighs(robot: RobotModel, course: Course, task: Task, samples: PlanSamples) -> None:
    """Refuses a task's plan in which a thigh comes into the ground.

    Raises:
        PlanningError: With which, where and how far.
    """
    room = thigh_room(robot, course.lanes[task.lane], samples.body[:, 0], samples.q)
    _refuse(room, NAMES, "the thigh of {} would be {:.3f} m inside the stairs", samples, task)


def _refuse(
    room: FloatArray, names: Sequence[str], words: str, samples: PlanSamples, task: Task
) -> None:
    """Refuses a plan whose least room (N, K) at its N samples, of K that have names, is none."""
    n, k = np.unravel_index(np.argmin(room), room.shape)
    least = float(room[n, k])
    if least <= 0.0:
        what = words.format(names[int(k)], -least)
        raise PlanningError(f"{what} at {samples.times[n]:.1f} s of '{task.name}'", apart=least)
