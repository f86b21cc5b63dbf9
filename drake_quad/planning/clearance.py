"""Clearances of a plan's shanks, thighs and trunk from the course and from each other."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.jit import jit
from drake_quad.math.distance import PAIRS, distance_between_legs, points_to_boxes
from drake_quad.math.ground_distance import profile_distance
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import PlanSamples, calc_feet_in_body
from drake_quad.planning.problem import Task
from drake_quad.planning.thigh_trunk import CUTOFF, thigh_trunk_clearance, thighs_in_body
from drake_quad.robot.kinematics import calc_knees
from drake_quad.robot.legs import LEGS
from drake_quad.robot.model import CLEARANCE_WEIGHTS, SHANK_POINTS, LinkOutline, RobotModel
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane


def from_ground(lane: Lane, points: FloatArray) -> FloatArray:
    """Signed distance of points (..., 3) in W from a lane's ground [m], negative inside it.

    Along the lane and upwards; the ground goes on beyond the lane's ends.
    """
    return from_course(lane, points[..., None, :])[..., 0]


def from_nosings(lane: Lane, points: FloatArray) -> FloatArray:
    """Signed distance of lines that join points (..., M, 3) in W from nosings (..., M - 1) [m]."""
    return from_course(lane, points)[..., points.shape[-2] :]


def from_course(lane: Lane, points: FloatArray) -> FloatArray:
    """Both of points (..., M, 3) in W: `from_ground`, then `from_nosings`, (..., 2 M - 1) [m]."""
    ends = np.concatenate([[-np.inf], np.array(lane.breaks)[1:-1], [np.inf]])
    # Copies: kernels are compiled anew for arrays that are read-only.
    origin, heading, begins, heights, gradients = (
        np.array(values, dtype=float)
        for values in (lane.p_WL, lane.heading, lane.breaks[:-1], lane.heights, lane.gradients)
    )
    rows = np.array(points, order="C").reshape(-1, *points.shape[-2:])
    found = profile_distance(rows, origin, heading, ends, begins, heights, gradients)
    return found.reshape(*points.shape[:-2], found.shape[1])


FAR = 0.1  # [m] from which on a clearance need not be exact
# Weights of the clearances that `shank_clearance` returns.
WEIGHTS = np.concatenate([CLEARANCE_WEIGHTS, CLEARANCE_WEIGHTS[1:]])


def shank_clearance(
    robot: RobotModel, lane: Lane, body: FloatArray, feet: FloatArray, q: FloatArray
) -> FloatArray:
    """Between knees and shanks and a lane's ground, negative inside (N, 4, 15) [m].

    At SHANK_POINTS, then between nosings and the seven lines that join these.

    Args:
        robot: The robot.
        lane: The lane.
        body: (N, 5) poses in W.
        feet: (N, 4, 3) in W [m].
        q: (N, 4, 3) the joints' angles there [rad].
    """
    R = rotations(body)
    knees = body[:, None, :3] + np.einsum("nij,nlj->nli", R, calc_knees(robot.geometry, q))
    across = np.einsum("nij,nlj->nli", R, knee_axes(q))
    middles = shank_middles(robot.shank_offsets, knees, feet, across)
    radii = robot.shank_radii
    thick = np.concatenate([radii, np.minimum(radii[:, :-1], radii[:, 1:])], axis=1)
    return from_course(lane, middles) - thick


def trunk_clearance(
    robot: RobotModel, p_BF: FloatArray, q: FloatArray, *, cutoff: float = FAR
) -> FloatArray:
    """Between knees and shanks and the trunk's boxes, negative inside (N, 4, 15) [m].

    At SHANK_POINTS, then of the seven lines that join these.

    Args:
        robot: The robot.
        p_BF: (N, 4, 3) feet in B [m].
        q: (N, 4, 3) the joints' angles there [rad].
        cutoff: Larger clearances need only be at least this [m].
    """
    knees = calc_knees(robot.geometry, q)
    middles = shank_middles(robot.shank_offsets, knees, p_BF, knee_axes(q))
    rows = np.ascontiguousarray(middles.reshape(-1, *middles.shape[-2:]))
    radii = robot.shank_radii
    apart = points_to_boxes(rows, robot.trunk_boxes, cutoff + float(radii.max()))
    thick = np.concatenate([radii, np.minimum(radii[:, :-1], radii[:, 1:])], axis=1)
    return np.asarray(apart.reshape(*middles.shape[:-2], -1) - thick)


def shank_middles(
    offsets: FloatArray, knees: FloatArray, feet: FloatArray, across: FloatArray
) -> FloatArray:
    """The middles of all shanks' outlines at SHANK_POINTS (..., 4, 8, 3) [m].

    Args:
        offsets: How far ahead of the lines from knee to foot they are (4, 8) [m].
        knees: (..., 4, 3) [m].
        feet: (..., 4, 3) [m], in the same frame.
        across: Unit vectors of the knees' axes, to the left (..., 4, 3).
    """
    shape = knees.shape
    flat = [np.ascontiguousarray(p.reshape(-1, *shape[-2:])) for p in (knees, feet, across)]
    return _middles(offsets, *flat).reshape(*shape[:-1], len(SHANK_POINTS), 3)


@jit
def _middles(
    offsets: FloatArray, knees: FloatArray, feet: FloatArray, across: FloatArray
) -> FloatArray:
    found = np.empty((*knees.shape[:2], len(SHANK_POINTS), 3))
    for n in range(found.shape[0]):
        for leg in range(found.shape[1]):
            p, y = knees[n, leg], across[n, leg]
            x0, x1, x2 = feet[n, leg, 0] - p[0], feet[n, leg, 1] - p[1], feet[n, leg, 2] - p[2]
            a0, a1, a2 = x1 * y[2] - x2 * y[1], x2 * y[0] - x0 * y[2], x0 * y[1] - x1 * y[0]
            length = sqrt(a0 * a0 + a1 * a1 + a2 * a2)
            for k in range(len(SHANK_POINTS)):
                share, ahead = SHANK_POINTS[k], offsets[leg, k] / length
                found[n, leg, k, 0] = p[0] + share * x0 + ahead * a0
                found[n, leg, k, 1] = p[1] + share * x1 + ahead * a1
                found[n, leg, k, 2] = p[2] + share * x2 + ahead * a2
    return found


def knee_axes(q: FloatArray) -> FloatArray:
    """Unit vectors of the knees' axes in B (..., 4, 3), of the joints' angles (..., 4, 3) [rad]."""
    a = q[..., 0]
    return np.stack([np.zeros_like(a), np.cos(a), np.sin(a)], axis=-1)


def thigh_clearance(robot: RobotModel, lane: Lane, body: FloatArray, q: FloatArray) -> FloatArray:
    """Between thighs and a lane's ground, negative inside (N, 4) [m].

    Args:
        robot: The robot.
        lane: The lane.
        body: (N, 5) poses in W.
        q: (N, 4, 3) the joints' angles there [rad].
    """
    p_W = body[:, None, None, None, :3] + np.einsum(
        "nij,nlkmj->nlkmi", rotations(body), thighs_in_body(robot, q, robot.thigh_points)
    )
    nearest = from_course(lane, p_W).min(axis=-1)
    return np.asarray((nearest - robot.thigh_radii).min(axis=-1))


def leg_clearance(robot: RobotModel, p_BF: FloatArray, q: FloatArray) -> FloatArray:
    """Clearance of each of PAIRS of legs (N, 6), at most CUTOFF, negative where they touch [m].

    Args:
        robot: The robot.
        p_BF: (N, 4, 3) feet in B [m].
        q: (N, 4, 3) the joints' angles there [rad].
    """
    knees = calc_knees(robot.geometry, q)
    middles = shank_middles(robot.shank_offsets, knees, p_BF, knee_axes(q))
    hips = np.broadcast_to(robot.geometry.p_BH, knees.shape)[:, :, None]
    points = np.concatenate([hips, middles], axis=2)
    return distance_between_legs(points, robot.shank_radii, CUTOFF)


TRUNK_POINTS = 7


@dataclass(frozen=True)
class Clearance:
    """The least clearance of a plan, and where it is.

    Attributes:
        weighted: The distance times its weight, see WEIGHTS [m].
        distance: Distance between a part of the robot and the course [m], negative inside it.
        part: Which, for people.
        task: The task's name.
        time: Time in the task [s].
    """

    weighted: float
    distance: float
    part: str
    task: str
    time: float


def find_clearance(
    robot: RobotModel,
    shape: LinkOutline,
    course: Course,
    tasks: Sequence[Task],
    samples: Sequence[PlanSamples],
) -> Clearance:
    """The least clearance over all samples of a mission's plans."""
    least = Clearance(np.inf, np.inf, "", "", 0.0)
    for task, s in zip(tasks, samples, strict=True):
        lane, body = course.lanes[task.lane], s.body[:, 0]
        R = rotations(body)
        x = np.linspace(shape.trunk_lower[0], shape.trunk_upper[0], TRUNK_POINTS)
        under = np.column_stack([x, np.zeros(len(x)), np.full(len(x), shape.trunk_lower[2])])
        trunk = body[:, None, :3] + np.einsum("nij,kj->nki", R, under)
        legs = shank_clearance(robot, lane, body, s.feet, s.q)
        parts = [(f"the knee or shank of {leg.short}", legs[:, leg.row], WEIGHTS) for leg in LEGS]
        parts.append(("the trunk", from_course(lane, trunk), np.ones(2 * TRUNK_POINTS - 1)))
        for part, away, weight in parts:
            k, point = np.unravel_index(np.argmin(away * weight), away.shape)
            here = float(away[k, point])
            weighted = float(here * weight[point])
            if weighted < least.weighted:
                least = Clearance(weighted, here, part, task.name, float(s.times[k]))
    return least


FEET_APART = 0.005  # [m] between two feet: as exactly as plans are followed, and more
LEGS_APART, FOOTPRINTS_APART = ("apart",), ("apart", "footprints_apart")  # of an error's figures
NAMES = tuple(leg.short for leg in LEGS)
PAIRED = tuple(" and ".join(NAMES[row] for row in pair) for pair in PAIRS)


def check_self_collision(robot: RobotModel, task: Task, samples: PlanSamples) -> None:
    """Refuses a plan in which a shank or thigh comes into the trunk, or legs into each other.

    Raises:
        PlanningError: With which, where and how far. Its figures have `apart`, and, where it is
            the feet that are too near each other, `footprints_apart` as well.
    """
    body = samples.body[:, 0]
    p_BF = calc_feet_in_body(body, samples.feet)
    shanks = trunk_clearance(robot, p_BF, samples.q).min(axis=-1)
    first, second = (p_BF[:, rows] for rows in PAIRS.T)
    feet = np.linalg.norm(first - second, axis=-1) - 2.0 * robot.foot_radius - FEET_APART
    legs = leg_clearance(robot, p_BF, samples.q)
    thighs = thigh_trunk_clearance(robot, samples.q)
    for clearance, names, words, figures in (
        (shanks, NAMES, "the shank of {} would be {:.3f} m inside the trunk", LEGS_APART),
        (thighs, NAMES, "the thigh of {} would be {:.3f} m inside the trunk", LEGS_APART),
        (feet, PAIRED, "the feet {} would be {:.3f} m too near each other", FOOTPRINTS_APART),
        (legs, PAIRED, "the legs {} would be {:.3f} m inside each other", LEGS_APART),
    ):
        _refuse(clearance, names, words, samples, task, figures)


def check_shanks(robot: RobotModel, course: Course, task: Task, samples: PlanSamples) -> None:
    """Refuses a task's plan in which a knee or shank comes into the ground.

    Raises:
        PlanningError: With which, where and how far.
    """
    lane, body = course.lanes[task.lane], samples.body[:, 0]
    clearance = shank_clearance(robot, lane, body, samples.feet, samples.q).min(axis=-1)
    words = "the knee or shank of {} would be {:.3f} m inside the stairs"
    _refuse(clearance, NAMES, words, samples, task, ("room",))


def check_thighs(robot: RobotModel, course: Course, task: Task, samples: PlanSamples) -> None:
    """Refuses a task's plan in which a thigh comes into the ground.

    Raises:
        PlanningError: With which, where and how far.
    """
    clearance = thigh_clearance(robot, course.lanes[task.lane], samples.body[:, 0], samples.q)
    words = "the thigh of {} would be {:.3f} m inside the stairs"
    _refuse(clearance, NAMES, words, samples, task, ("room",))


def _refuse(
    clearance: FloatArray, names: Sequence[str], words: str, samples: PlanSamples, task: Task,
    figures: Sequence[str],
) -> None:  # fmt: skip
    """Refuses a plan if a clearance (N, K), at N samples between K named parts, is not positive.

    `figures` are the names that the clearance has among the error's figures.
    """
    n, k = np.unravel_index(np.argmin(clearance), clearance.shape)
    least = float(clearance[n, k])
    if least <= 0.0:
        what = words.format(names[int(k)], -least)
        when = f"{samples.times[n]:.1f} s of '{task.name}'"
        raise PlanningError(f"{what} at {when}", **dict.fromkeys(figures, least))
