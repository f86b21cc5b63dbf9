"""Compiled: clearances of legs and trunk in one pose of a candidate gait.

Each clearance function returns min(`least`, its own clearance), so pairs that cannot lower it are
skipped: a cheap lower bound shows that most are far apart.
"""

from math import cos, sin, sqrt

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait_design.pose_kernels import Pose
from drake_quad.jit import jit
from drake_quad.math.distance import line_with_ends, point_to_box
from drake_quad.math.ground_distance import line_over_nosings, line_to_stairs, point_to_stairs
from drake_quad.robot.kinematics import LegConstants
from drake_quad.robot.model import CLEARANCE_WEIGHTS, SHANK_POINTS

SHANK, THIGH = len(SHANK_POINTS), 3  # points of a leg that are looked at


@jit
def place_points(
    leg: LegConstants,
    q: FloatArray,
    pose: Pose,
    foot: FloatArray,
    offsets: FloatArray,
    points: FloatArray,
) -> None:
    """Writes points of the shank from the knee on, then of the thigh, in W (SHANK + THIGH, 3)."""
    cp, sp = pose.cosine, pose.sine
    sa, ca = sin(q[0]), cos(q[0])
    x, z = -leg.thigh * sin(q[1]), -leg.thigh * cos(q[1])
    knee_x, knee_y, knee_z = _from_hip(leg, x, z + leg.raised, pose, ca, sa)
    hip_x, hip_y, hip_z = _from_hip(leg, 0.0, leg.raised, pose, ca, sa)
    c, s = cos(q[1] + q[2]), sin(q[1] + q[2])
    ax, ay, az = cp * c - sp * ca * s, sa * s, -sp * c - cp * ca * s  # the shank's x in W
    for i in range(SHANK):
        share = SHANK_POINTS[i]
        points[i, 0] = knee_x + share * (foot[0] - knee_x) + offsets[i] * ax
        points[i, 1] = knee_y + share * (foot[1] - knee_y) + offsets[i] * ay
        points[i, 2] = knee_z + share * (foot[2] - knee_z) + offsets[i] * az
    for i in range(THIGH):
        share = (i + 1.0) / (THIGH + 1.0)
        points[SHANK + i, 0] = knee_x + share * (hip_x - knee_x)
        points[SHANK + i, 1] = knee_y + share * (hip_y - knee_y)
        points[SHANK + i, 2] = knee_z + share * (hip_z - knee_z)


@jit
def _from_hip(
    leg: LegConstants, x: float, z: float, pose: Pose, ca: float, sa: float
) -> tuple[float, float, float]:
    """A point of a leg's plane in W [m], x ahead of the hip and z above it, abducted by ca, sa."""
    bx = leg.x + x
    by = leg.y + ca * leg.offset - sa * z
    bz = leg.z + sa * leg.offset + ca * z
    return (
        pose.x + pose.cosine * bx + pose.sine * bz,
        pose.y + by,
        pose.z - pose.sine * bx + pose.cosine * bz,
    )


SURE = 1e-9  # [m] by which a bound may be wrong, for rounding


@jit
def pose_leg_clearance(
    points: FloatArray, radii: FloatArray, rise: float, run: float, least: float
) -> float:
    """Between a shank's points (SHANK, 3), with the lines between them, and the stairs [m].

    Args:
        points: Points of the shank in W [m].
        radii: Radii of the shank at the points (SHANK,) [m].
        rise: Rise of the staircase [m].
        run: Run of the staircase [m].
        least: Clearance found elsewhere [m], weighted by CLEARANCE_WEIGHTS as this is.
    """
    before = 0.0
    for i in range(SHANK):
        x, z, radius, weight = points[i, 0], points[i, 2], radii[i], CLEARANCE_WEIGHTS[i]
        bound = min(line_over_nosings(x, z, rise, run), run) - SURE
        if (bound - radius) * weight < least:
            least = min(least, (point_to_stairs(x, z, rise, run) - radius) * weight)
        if i > 0:
            thick = min(radius, radii[i - 1])
            if (min(bound, before) - thick) * weight < least:
                line = line_to_stairs(points[i - 1], points[i], rise, run)
                least = min(least, (line - thick) * weight)
        before = bound
    return least


@jit
def pose_trunk_clearance(
    points: FloatArray, radii: FloatArray, boxes: FloatArray, least: float
) -> float:
    """Between a shank's points (SHANK, 3) in B, with their lines, and the trunk [m].

    Args:
        points: Points of the shank in B [m].
        radii: Radii of the shank at the points (SHANK,) [m].
        boxes: The trunk's boxes: one about all the others, then these (1 + K, 2, 3) [m].
        least: Clearance found elsewhere [m].
    """
    low_x, low_y, low_z = points[0, 0], points[0, 1], points[0, 2]
    high_x, high_y, high_z, widest = low_x, low_y, low_z, radii[0]
    for i in range(1, SHANK):
        low_x, high_x = min(low_x, points[i, 0]), max(high_x, points[i, 0])
        low_y, high_y = min(low_y, points[i, 1]), max(high_y, points[i, 1])
        low_z, high_z = min(low_z, points[i, 2]), max(high_z, points[i, 2])
        widest = max(widest, radii[i])
    for k in range(len(boxes)):
        x = max(max(boxes[k, 0, 0] - high_x, low_x - boxes[k, 1, 0]), 0.0)
        y = max(max(boxes[k, 0, 1] - high_y, low_y - boxes[k, 1, 1]), 0.0)
        z = max(max(boxes[k, 0, 2] - high_z, low_z - boxes[k, 1, 2]), 0.0)
        square = x * x + y * y + z * z
        if square > 0.0 and sqrt(square) - SURE - widest >= least:
            if k == 0:
                return least  # no nearer to those within
            continue
        if k == 0:
            continue
        lower, upper, before = boxes[k, 0], boxes[k, 1], 0.0
        for i in range(SHANK):
            here = point_to_box(points[i], lower, upper)
            least = min(least, here - radii[i])
            if i > 0:
                thick = min(radii[i], radii[i - 1])
                line = line_with_ends(
                    points[i - 1], points[i], before, here, lower, upper, least + thick
                )
                least = min(least, line - thick)
            before = here
    return least


@jit
def clearance_between_legs(
    front: FloatArray,
    rear: FloatArray,
    front_radii: FloatArray,
    rear_radii: FloatArray,
    least: float,
) -> float:
    """Between a front leg and the rear leg of its side, (SHANK + THIGH, 3) points in W each [m]."""
    low, high = np.inf, -np.inf
    for i in range(SHANK + THIGH):
        low = min(low, front[i, 0] - front_radii[i if i < SHANK else 0])
        high = max(high, rear[i, 0] + rear_radii[i if i < SHANK else 0])
    if low - high - SURE >= least:
        return least
    for i in range(SHANK + THIGH):
        for j in range(SHANK + THIGH):
            x, y = front[i, 0] - rear[j, 0], front[i, 1] - rear[j, 1]
            z = front[i, 2] - rear[j, 2]
            thick = front_radii[i if i < SHANK else 0] + rear_radii[j if j < SHANK else 0]
            square, most = x * x + y * y + z * z, least + thick + SURE
            if most > 0.0 and square < most * most:  # most of them are farther, without a root
                least = min(least, sqrt(square) - thick)
    return least


@jit
def clearance_under_line(points: FloatArray, rise: float, run: float, least: float) -> float:
    """Between points under the trunk (M, 3) in W, in a line, and the stairs, the line too [m]."""
    last = len(points) - 1
    bound = line_over_nosings(points[0, 0], points[0, 2], rise, run)
    bound = min(bound, line_over_nosings(points[last, 0], points[last, 2], rise, run))
    if min(bound, run) - SURE >= least:
        return least
    for i in range(len(points)):
        least = min(least, point_to_stairs(points[i, 0], points[i, 2], rise, run))
        if i > 0:
            least = min(least, line_to_stairs(points[i - 1], points[i], rise, run))
    return least
