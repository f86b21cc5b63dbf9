"""The body program's half-planes for the legs: joint limits, shanks off the stairs and the trunk.

The body's program knows the legs as boxes about the feet. Where that lets a leg stretch or fold
too far, a joint come to its limit, or a shank too near to the stairs, the distance that is left is
linear enough in how the body shifts, rises and pitches that a path solved once more, within these
sides, leaves it (sequential linearisation).
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from drake_quad.common import BoolArray, FloatArray, IntArray
from drake_quad.planning.clearance import (
    WEIGHTS,
    shank_clearance,
    trunk_clearance,
)
from drake_quad.planning.motion_plan import calc_feet_in_body
from drake_quad.planning.thigh_trunk import CUTOFF, thigh_trunk_clearance
from drake_quad.robot.kinematics import leg_array, pose_legs, solve_legs
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.lane import Lane

# Shares of a leg's length, but for TRUNK_SHARE.
SAFE = 0.015  # distance that the sides keep from limits, for what is between the samples
NEAR = 0.12  # distance from which on a limit has no side
SHANK_NEAR = 0.03  # distance from which on a shank's clearance has no side
TRUNK_SHARE = 0.5  # shanks' clearance from the trunk, as a share of that from the stairs
THIGH_NEAR = 0.01  # distance from which on the one between a thigh and the trunk has no side
SHANK_SAFE = 0.002  # distance that the sides keep from the clearance between shanks and stairs
LIMITS = 6  # of a leg: see `reach_left`
STEP = 1e-5  # [m] of the differences
WEIGHT = 0.5  # of a leg's length, that a radian counts as
STEEP = 10.0  # [m] that a distance may change by for each that the body moves


@dataclass(frozen=True, eq=False)
class LegLimits:
    """Sides n · (x, y, lift, tilt) >= offset, (K,) of them; see BodyProblem for lift and tilt.

    Attributes:
        sample: Index of the sampled time (K,).
        normal: (K, 4); not of unit length.
        offset: (K,) [m].
        shank: Whether the side is for the clearance of a shank, or of a thigh from the trunk; else
            it is for a leg's limits (K,).
        short: Violation of the limits by the path that the sides were made for: the sum of the
            worst of either kind, that of the legs' limits counting tenfold [m].
        beyond: The same sum of the worst of either kind at each time that was looked at, (N,) [m].
    """

    sample: IntArray
    normal: FloatArray
    offset: FloatArray
    shank: BoolArray
    short: float
    beyond: FloatArray


@dataclass(frozen=True, eq=False)
class Shanks:
    """The clearance that shanks are to have.

    Attributes:
        lane: The ground; None: it is level, and only the trunk can be in their way.
        clearance: Clearance from the ground [m], weighted by CLEARANCE_WEIGHTS; the clearance from
            the trunk is to be TRUNK_SHARE of it.
    """

    lane: Lane | None
    clearance: float


def reach_left(robot: RobotModel, body: FloatArray, feet: FloatArray) -> FloatArray:
    """Distance of every leg from each of its limits, negative beyond it, (N, 4, 6) [m].

    From its most stretched and most folded; from the ends of abduction and of hip pitch, a radian
    counting as WEIGHT of a leg.

    Args:
        robot: The robot.
        body: (N, 5) poses in W.
        feet: (N, 4, 3) in W [m].
    """
    return _reach_left(robot, calc_feet_in_body(body, feet))


def _reach_left(robot: RobotModel, p_BF: FloatArray) -> FloatArray:
    """See `reach_left`; the feet are in B."""
    g = robot.geometry
    q, _ = solve_legs(g, p_BF)
    v = p_BF - g.p_BH
    plane = v[..., 1] ** 2 + v[..., 2] ** 2 - g.offset**2
    higher = g.raised * (g.raised + 2.0 * np.sqrt(np.maximum(plane, 0.0)))
    distance = np.sqrt(np.maximum(v[..., 0] ** 2 + plane + higher, 0.0))
    lower, upper = robot.q_lower.reshape(-1, 3), robot.q_upper.reshape(-1, 3)
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
    """The length that turns a tilt [rad] into [m], the unit of all else in the body's program."""
    return float(np.mean(robot.geometry.reach))


def find_limits(
    robot: RobotModel,
    body: FloatArray,
    feet: FloatArray,
    rise: FloatArray,
    path: FloatArray,
    shanks: Shanks | None = None,
    *,
    pitch: FloatArray | None = None,
    always: bool = False,
) -> LegLimits | None:
    """The sides for a body path that takes some leg beyond a limit; None if it takes none there.

    Args:
        robot: The robot.
        body: (N, 5) poses in W at the sampled times.
        feet: (N, 4, 3) in W [m].
        rise: (N, 2) how much the body rises by a shift along x and y of W.
        path: (N, 4) x, y, lift and tilt [m] of the path at the times that the sides will be of.
        shanks: The clearance that shanks are to have; None: they are not looked at.
        pitch: (N, 2) how much the body pitches by a shift along x and y [rad/m]; None: not at all.
        always: Whether there are sides also for a path that keeps all limits.
    """
    reach = robot.geometry.reach
    # From the middle of a shank; nothing beyond it has a side.
    far = SHANK_NEAR * float(reach.max()) + STEP + float(robot.shank_radii.max())
    distance = limit_distances(robot, body, feet, shanks, far)
    if distance.min() >= 0.0 and not always:
        return None
    near = np.full(distance.shape[2], SHANK_NEAR)
    near[:LIMITS] = NEAR
    if shanks is not None and not robot.thigh_stops.empty:
        near[-1] = THIGH_NEAR  # a thigh is near to the trunk much of the time
    k, leg, which = np.nonzero(distance < reach[:, None] * near)
    gradient = np.empty((len(k), 4))
    for mine in np.unique(leg).tolist():  # where one is near to a limit most others are not
        near_mine = np.flatnonzero(leg == mine)
        rows, at = np.unique(k[near_mine], return_inverse=True)
        alone = _only_leg(robot, mine)
        for axis in range(4):
            moved = np.array(body[rows])
            if axis < 2:
                moved[:, axis] += STEP
                moved[:, 2] += STEP * rise[rows, axis]
                moved[:, 3] += 0.0 if pitch is None else STEP * pitch[rows, axis]
            elif axis == 2:
                moved[:, 2] += STEP
            else:
                moved[:, 3] += STEP / tilt_arm(robot)
            there = limit_distances(alone, moved, feet[rows, mine : mine + 1], shanks, far)
            gradient[near_mine, axis] = there[at, 0, which[near_mine]]
    gradient = (gradient - distance[k, leg, which][:, None]) / STEP
    smooth = np.abs(gradient).max(axis=1) <= STEEP  # where two shapes take turns there is none
    k, leg, which, gradient = k[smooth], leg[smooth], which[smooth], gradient[smooth]
    here = np.einsum("ij,ij->i", gradient, path[k])
    shank = which >= LIMITS
    keep = np.where(shank, SHANK_SAFE, SAFE) * reach[leg]
    legs = -np.minimum(distance[..., :LIMITS].min(axis=(1, 2)), 0.0)
    shanks_near = -np.minimum(distance[..., LIMITS:].min(axis=(1, 2), initial=0.0), 0.0)
    short = 10.0 * float(legs.max()) + float(shanks_near.max())
    beyond = 10.0 * legs + shanks_near
    return LegLimits(k, gradient, keep - distance[k, leg, which] + here, shank, short, beyond)


def limit_distances(
    robot: RobotModel, poses: FloatArray, feet: FloatArray, shanks: Shanks | None, far: float
) -> FloatArray:
    """Distance beyond what is to be kept (N, L, 6), with shanks (N, L, 21 or 36) [m].

    With shanks it is one column more, of the thigh and the trunk, if the robot's may touch.

    Args:
        robot: The robot, or one of its legs alone.
        poses: (N, 5) in W.
        feet: (N, L, 3) in W [m].
        shanks: The clearance that shanks are to have; None: they are not looked at.
        far: Distance of a shank's middle from the trunk, beyond what is to be kept, from which on
            it need not be exact [m].
    """
    p_BF = calc_feet_in_body(poses, feet)
    parts = [_reach_left(robot, p_BF)]
    if shanks is None:
        return parts[0]
    q = pose_legs(leg_array(robot.geometry), np.array(poses, order="C"), np.array(feet, order="C"))
    if shanks.lane is not None:
        clear = shank_clearance(robot, shanks.lane, poses, feet, q)
        parts.append(clear * WEIGHTS - shanks.clearance)
    keep = TRUNK_SHARE * shanks.clearance
    cutoff = keep + far - float(robot.shank_radii.max())
    parts.append(trunk_clearance(robot, p_BF, q, cutoff=cutoff) - keep)
    if not robot.thigh_stops.empty:
        thighs = thigh_trunk_clearance(robot, q)
        parts.append(np.where(thighs < CUTOFF, thighs - keep, max(far, 1.0))[..., None])
    return np.concatenate(parts, axis=-1)


def _only_leg(robot: RobotModel, leg: int) -> RobotModel:
    """The robot with one leg, as far as `limit_distances` asks."""
    g, one = robot.geometry, slice(leg, leg + 1)
    lengths = {f.name: getattr(g, f.name)[one] for f in fields(g)}
    joints = slice(3 * leg, 3 * leg + 3)
    return replace(
        robot,
        geometry=replace(g, **lengths),
        q_lower=robot.q_lower[joints],
        q_upper=robot.q_upper[joints],
        shank_offsets=robot.shank_offsets[one],
        shank_radii=robot.shank_radii[one],
        thigh_stops=replace(
            robot.thigh_stops,
            paths=robot.thigh_stops.paths[one],
            radii=robot.thigh_stops.radii[one],
        ),
    )
