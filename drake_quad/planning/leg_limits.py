"""How near legs come to their limits along a body path, as sides that the path is to stay within.

The body's program knows the legs as boxes about the feet. Where that lets a leg stretch or fold
too far, a joint come to its limit, or a shank too near to the stairs, the room that is left is
linear enough in how the body shifts, rises and pitches that a path solved once more, within these
sides, leaves it (sequential linearisation).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.motion_plan import pose_robot, rotations
from drake_quad.planning.shank_room import WORTH, shank_room, trunk_room
from drake_quad.robot.leg_kinematics import solve_legs
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Lane

SAFE = 0.015  # of a leg's length: room that the sides keep, for what is between the samples
NEAR = 0.12  # of a leg's length: limits that are farther away are let be
SHANK_NEAR = 0.03  # the same of shanks' room
TRUNK_SHARE = 0.5  # of the room between shanks and stairs, that there is to be to the trunk
SHANK_SAFE = 0.002  # the same of the room between shanks and stairs
LIMITS = 6  # of a leg: see `leg_room`
STEP = 1e-5  # [m] of the differences
WEIGHT = 0.5  # of a leg's length, that a radian counts as


@dataclass(frozen=True, eq=False)
class LegLimits:
    """Sides n · (x, y, lift, tilt) >= offset, (K,) of them; see BodyProblem for lift and tilt.

    Attributes:
        sample: Index of the sampled time (K,).
        normal: (K, 4); not of unit length.
        offset: (K,) [m].
        shank: Whether the side is for a shank's room; else it is for a leg's limits (K,).
        short: By how much the path that they are of falls short of all room, legs' limits first:
            the sum of the worst of either kind, that of the legs counting tenfold [m].
    """

    sample: NDArray[np.intp]
    normal: FloatArray
    offset: FloatArray
    shank: BoolArray
    short: float


@dataclass(frozen=True, eq=False)
class Shanks:
    """The room that shanks are to have.

    Attributes:
        lane: The ground; None: it is level, and only the trunk can be in their way.
        room: Between them and it, at their ends as ROOM_WORTH has it; half of that between them
            and the trunk [m].
    """

    lane: Lane | None
    room: float


def leg_room(robot: RobotModel, body: FloatArray, feet: FloatArray) -> FloatArray:
    """Room of every leg to each of its limits, negative beyond it, (N, 4, 6) [m].

    To its most stretched and most folded; to the ends of abduction and of hip pitch, a radian
    counting as WEIGHT of a leg.

    Args:
        robot: The robot.
        body: (N, 5) poses in W.
        feet: (N, 4, 3) in W [m].
    """
    g = robot.geometry
    p_BF = np.einsum("nji,nlj->nli", rotations(body), feet - body[:, None, :3])
    q, _ = solve_legs(g, p_BF)
    v = p_BF - g.p_BH
    plane = v[..., 1] ** 2 + v[..., 2] ** 2 - g.offset**2
    higher = g.raised * (g.raised + 2.0 * np.sqrt(np.maximum(plane, 0.0)))
    distance = np.sqrt(np.maximum(v[..., 0] ** 2 + plane + higher, 0.0))
    lower, upper = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)
    knees = np.stack([lower[:, 2], upper[:, 2]]) * g.knee_sign  # bent that much, if positive
    least, most = np.maximum(knees.min(axis=0), 0.0), np.minimum(knees.max(axis=0), np.pi)
    longest, shortest = (
        np.sqrt(g.thigh**2 + g.shank**2 + 2.0 * g.thigh * g.shank * np.cos(bend))
        for bend in (least, most)
    )
    scale = WEIGHT * g.reach[:, None]
    angles = np.concatenate(
        [scale * (q[..., :2] - lower[:, :2]), scale * (upper[:, :2] - q[..., :2])], axis=-1
    )
    ends = np.stack([longest - distance, distance - shortest], axis=-1)
    return np.concatenate([ends, angles], axis=-1)


def tilt_arm(robot: RobotModel) -> float:
    """By which a tilt [rad] is a length, as all else in the body's program is [m]."""
    return float(np.mean(robot.geometry.reach))


def find_limits(
    robot: RobotModel,
    body: FloatArray,
    feet: FloatArray,
    rise: FloatArray,
    path: FloatArray,
    shanks: Shanks | None = None,
) -> LegLimits | None:
    """The sides for a body path that takes some leg beyond a limit; None if it takes none there.

    Args:
        robot: The robot.
        body: (N, 5) poses in W at the sampled times.
        feet: (N, 4, 3) in W [m].
        rise: (N, 2) how much the body rises by a shift along x and y of W.
        path: (N, 4) x, y, lift and tilt [m] of the path at the times that the sides will be of.
        shanks: The room that shanks are to have; None: they are let be.
    """

    def room_at(poses: FloatArray, feet: FloatArray) -> FloatArray:
        """Room beyond what is to be kept (N, 4, 6), or with the shanks' (N, 4, 21 or 36) [m]."""
        room = [leg_room(robot, poses, feet)]
        if shanks is None:
            return room[0]
        q, _, _ = pose_robot(robot, poses, feet)
        if shanks.lane is not None:
            clear = shank_room(robot, shanks.lane, poses, feet, q)
            room.append(clear * WORTH - shanks.room)
        p_BF = np.einsum("nji,nlj->nli", rotations(poses), feet - poses[:, None, :3])
        keep = TRUNK_SHARE * shanks.room
        far = keep + SHANK_NEAR * float(reach.max()) + STEP  # what is farther off is let be
        room.append(trunk_room(robot, p_BF, q, enough=far) - keep)
        return np.concatenate(room, axis=-1)

    reach = robot.geometry.reach
    room = room_at(body, feet)
    if room.min() >= 0.0:
        return None
    near = np.full(room.shape[2], SHANK_NEAR)
    near[:LIMITS] = NEAR
    k, leg, which = np.nonzero(room < reach[:, None] * near)
    rows, at = np.unique(k, return_inverse=True)
    gradient = np.empty((len(k), 4))
    for axis in range(4):
        moved = np.array(body[rows])
        if axis < 2:
            moved[:, axis] += STEP
            moved[:, 2] += STEP * rise[rows, axis]
        elif axis == 2:
            moved[:, 2] += STEP
        else:
            moved[:, 3] += STEP / tilt_arm(robot)
        there = room_at(moved, feet[rows])[at, leg, which]
        gradient[:, axis] = (there - room[k, leg, which]) / STEP
    here = np.einsum("ij,ij->i", gradient, path[k])
    shank = which >= LIMITS
    keep = np.where(shank, SHANK_SAFE, SAFE) * reach[leg]
    worst = np.minimum(room.min(axis=(0, 1)), 0.0)
    short = -10.0 * float(worst[:LIMITS].min()) - float(np.min(worst[LIMITS:], initial=0.0))
    return LegLimits(k, gradient, keep - room[k, leg, which] + here, shank, short)
