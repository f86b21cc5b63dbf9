"""The compiled objective of a candidate gait, pose by pose.

Each clearance function returns min(`least`, its own clearance), so pairs that cannot lower it are
skipped: a cheap lower bound shows that most are far apart.
"""

from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.gait_design.candidates import Cycle, Staircase
from drake_quad.jit import copy_vector, jit
from drake_quad.math.distance import line_with_ends, point_to_box
from drake_quad.math.ground_distance import line_over_nosings, line_to_stairs, point_to_stairs
from drake_quad.robot.kinematics import LegConstants, leg_row, solve_leg
from drake_quad.robot.model import CLEARANCE_WEIGHTS, SHANK_POINTS


class RobotTables(NamedTuple):
    """A robot as the search sees it.

    Attributes:
        foot_radius: Radius of the foot spheres [m].
        legs: Leg lengths (4, 8), see `robot.kinematics.leg_array`.
        limits: Least angles, greatest angles [rad] and torque limits [Nm] of the joints (3, 12).
        masses: Masses of the trunk, then of the links leg by leg (13,) [kg].
        coms: Centres of mass of these, in B and in the links' frames (13, 3) [m].
        trunk: Least and greatest x, y, z in B of the trunk, then of each of its parts (1 + K, 2, 3)
            [m].
        shanks: Offset of the middle ahead of the line from knee to foot, and radius, at the
            points of each shank from the knee on (2, 4, SHANK) [m].
        widest: Greatest sway to either side [m].
    """

    foot_radius: float
    legs: FloatArray
    limits: FloatArray
    masses: FloatArray
    coms: FloatArray
    trunk: FloatArray
    shanks: FloatArray
    widest: float


class Pose(NamedTuple):
    """A body pose without yaw: origin in W [m], pitch [rad], and the pitch's sine and cosine."""

    x: float
    y: float
    z: float
    pitch: float
    sine: float
    cosine: float


@jit
def pose_of(b: FloatArray, sway: float) -> Pose:
    """The pose of a body (5,) that sways to its left [m]."""
    return Pose(b[0], b[1] + sway, b[2], b[3], sin(b[3]), cos(b[3]))


@jit
def shank_tilt(pose: Pose, q: FloatArray) -> float:
    """How far a shank leans ahead [rad]."""
    return pose.pitch + q[1] + q[2]


SWAYS = 9  # that are tried, evenly from side to side
LEAST_AREA = 1e-9


@jit
def _others(air: int, k: int) -> tuple[int, int]:
    """The other two of three feet that stand."""
    i, j = -1, -1
    for m in range(4):
        if m != air and m != k:
            if i < 0:
                i = m
            else:
                j = m
    return i, j


@jit
def best_sway(
    com: FloatArray, feet: FloatArray, air: int, widest: float, wanted: float
) -> tuple[float, float]:
    """The least sway that gives the margin wanted, or that of the best margin; and the margin.

    A margin is the distance from the sides of three feet's triangle, inside positive [m].
    """
    margins = np.full(SWAYS, np.inf)
    for k in range(4):
        if k == air:
            continue
        i, j = _others(air, k)  # the side between them, and which way is in
        ex, ey = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
        length = max(sqrt(ex * ex + ey * ey), 1e-9)
        inward = ex * (feet[k, 1] - feet[i, 1]) - ey * (feet[k, 0] - feet[i, 0])
        for s in range(SWAYS):
            y = com[1] + (-1.0 + 2.0 * s / (SWAYS - 1)) * widest
            here = (ex * (y - feet[i, 1]) - ey * (com[0] - feet[i, 0])) / length
            margins[s] = min(margins[s], here if inward > 0.0 else -here)
    best, best_value, best_margin = 0.0, -np.inf, -np.inf
    for s in range(SWAYS):
        share = -1.0 + 2.0 * s / (SWAYS - 1)
        value = min(margins[s], wanted) - 1e-3 * abs(share)
        if value > best_value:
            best, best_value, best_margin = share * widest, value, margins[s]
    return best, best_margin


@jit
def static_foot_loads(
    x: float, y: float, feet: FloatArray, air: int, weight: float, forces: FloatArray
) -> None:
    """Writes the vertical forces (4,) of three feet that carry the weight at x, y [N]."""
    for k in range(4):
        forces[k] = 0.0
        if k == air:
            continue
        i, j = _others(air, k)
        ax, ay = feet[i, 0] - x, feet[i, 1] - y
        bx, by = feet[j, 0] - x, feet[j, 1] - y
        cx, cy = feet[k, 0] - feet[i, 0], feet[k, 1] - feet[i, 1]
        ex, ey = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
        whole = ex * cy - ey * cx
        area = ax * by - ay * bx
        forces[k] = weight * area / (whole if abs(whole) > LEAST_AREA else LEAST_AREA)


@jit
def torque_used(
    leg: LegConstants, q: FloatArray, force: float, pose: Pose, effort: FloatArray
) -> float:
    """The greatest share of its limit that a joint needs for a vertical force at the foot [N]."""
    sa, ca = sin(q[0]), cos(q[0])
    both = q[1] + q[2]
    xk, zk = -leg.shank * sin(both), -leg.shank * cos(both)
    x, z = -leg.thigh * sin(q[1]) + xk, -leg.thigh * cos(q[1]) + zk
    y_up = ca * leg.offset - sa * (z + leg.raised)
    fx, fz = pose.sine * force, -pose.cosine * force  # what the foot pushes down with, in B
    t0 = y_up * fz
    t1 = z * fx - ca * x * fz
    t2 = zk * fx - ca * xk * fz
    return max(abs(t0) / effort[0], max(abs(t1) / effort[1], abs(t2) / effort[2]))


SHANK, THIGH = len(SHANK_POINTS), 3  # points of a leg that are looked at


@jit
def to_body(points: FloatArray, pose: Pose, into: FloatArray) -> None:
    """Writes points of W (M, 3) in B."""
    for i in range(len(into)):
        dx, dz = points[i, 0] - pose.x, points[i, 2] - pose.z
        into[i, 0] = pose.cosine * dx - pose.sine * dz
        into[i, 2] = pose.sine * dx + pose.cosine * dz
        into[i, 1] = points[i, 1] - pose.y


@jit
def joint_angles(leg: LegConstants, pose: Pose, foot: FloatArray, q: FloatArray) -> float:
    """Writes a leg's angles; returns by how much it is short of its reach's ends [m]."""
    dx, dz = foot[0] - pose.x, foot[2] - pose.z
    x, z = pose.cosine * dx - pose.sine * dz, pose.sine * dx + pose.cosine * dz
    y = foot[1] - pose.y
    q[0], q[1], q[2] = solve_leg(leg, x, y, z)
    x, y, z = x - leg.x, y - leg.y, z - leg.z
    across = y * y + z * z - leg.offset * leg.offset
    down = -sqrt(max(across, 1e-12)) - leg.raised
    distance = sqrt(x * x + down * down)
    slack = min(leg.thigh + leg.shank - distance, distance - abs(leg.thigh - leg.shank))
    return slack if across > 0.0 else min(slack, -sqrt(-across))


@jit
def centre_of_mass(pose: Pose, q: FloatArray, robot: RobotTables, com: FloatArray) -> None:
    """Writes the whole robot's centre of mass in W (3,) [m]."""
    masses, coms = robot.masses, robot.coms
    total, mx, my = masses[0], masses[0] * coms[0, 0], masses[0] * coms[0, 1]
    mz = masses[0] * coms[0, 2]
    for k in range(4):
        leg = leg_row(robot.legs, k)
        ca, sa = cos(q[k, 0]), sin(q[k, 0])
        for j in range(3):
            m, p = masses[1 + 3 * k + j], coms[1 + 3 * k + j]
            if j == 0:
                x, y, z = p[0], p[1], p[2]
            else:
                angle = q[k, 1] + (q[k, 2] if j == 2 else 0.0)
                c, s = cos(angle), sin(angle)
                x, z = c * p[0] + s * p[2], -s * p[0] + c * p[2] + leg.raised
                y = leg.offset + p[1]
                if j == 2:
                    x -= leg.thigh * sin(q[k, 1])
                    z -= leg.thigh * cos(q[k, 1])
            mx += m * (leg.x + x)
            my += m * (leg.y + ca * y - sa * z)
            mz += m * (leg.z + sa * y + ca * z)
            total += m
    mx, my, mz = mx / total, my / total, mz / total
    com[0], com[1] = pose.x + pose.cosine * mx + pose.sine * mz, pose.y + my
    com[2] = pose.z - pose.sine * mx + pose.cosine * mz


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


UNDER = 7  # points under the trunk that are looked at
STRIDE = 7  # between moments looked at in turn: unlike ones sooner show what is in the way
# Weight of the smallest slack in `objective_of_slacks`; the rest is that of their mean.
LEAST_SHARE = 0.7
# Columns of the result.
REACH, JOINTS, TORQUE, MARGIN, LEGS, APART, TRUNK = range(7)
COLUMNS = 7


@jit
def objective_of_slacks(row: FloatArray, wanted: FloatArray) -> float:
    """Objective of slacks (COLUMNS,): less is better, and it only grows as slacks get smaller.

    It is mostly the least ratio of a slack to its target, and a little their mean.
    """
    least, mean = np.inf, 0.0
    for i in range(COLUMNS):
        share = min(row[i] / wanted[i], 1.0)
        least = min(least, share)
        mean += share / COLUMNS
    return -(LEAST_SHARE * least + (1.0 - LEAST_SHARE) * mean)


@jit
def objectives_of_slacks(rows: FloatArray, wanted: FloatArray) -> FloatArray:
    """See `objective_of_slacks`, for slacks in rows (C, COLUMNS): (C,)."""
    lacks = np.empty(len(rows))
    for c in range(len(rows)):
        lacks[c] = objective_of_slacks(rows[c], wanted)
    return lacks


@jit
def slacks(
    cycle: Cycle,
    stairs: Staircase,
    robot: RobotTables,
    wanted: FloatArray,
    found: FloatArray,
    enough: FloatArray,
) -> None:
    """The least slacks of each candidate over its moments, (C, COLUMNS), into `found`.

    Args:
        cycle: Bodies and feet of the candidates.
        stairs: The staircase.
        robot: The robot.
        wanted: Slacks that are enough (COLUMNS,); no sway is added for more margin.
        found: Result; what it holds already (of other stairs) counts.
        enough: What a candidate may lack to be of interest (C,), see `objective_of_slacks`. Where
            one lacks more, no further moments are looked at.
    """
    body, feet, landed, radii = cycle.body, cycle.feet, cycle.landed, robot.shanks[1]
    q, points = np.empty((4, 3)), np.empty((4, SHANK + THIGH, 3))
    in_body, under = np.empty((SHANK, 3)), np.zeros((UNDER, 3))
    f, tilts = np.empty((4, 3)), np.empty((body.shape[1], 4))
    forces, com = np.zeros(4), np.empty(3)
    weight, whole, limits = robot.masses.sum() * GRAVITY, robot.trunk[0], robot.limits
    for c in range(body.shape[0]):
        row = found[c]
        for n in range(body.shape[1]):
            for k in range(4):
                if landed[n, k] == n:
                    still = pose_of(body[c, n], 0.0)
                    joint_angles(leg_row(robot.legs, k), still, feet[c, n, k], q[k])
                    tilts[n, k] = shank_tilt(still, q[k])
        for moment in range(body.shape[1]):
            n = moment * STRIDE % body.shape[1]
            still, air = pose_of(body[c, n], 0.0), int(cycle.swing[n])
            for k in range(4):
                # A foot is a ball, which its shank rolls on.
                joint_angles(leg_row(robot.legs, k), still, feet[c, n, k], q[k])
                copy_vector(f[k], feet[c, n, k])
                if k != air:
                    f[k, 0] += robot.foot_radius * (
                        shank_tilt(still, q[k]) - tilts[landed[n, k], k]
                    )
            centre_of_mass(still, q, robot, com)
            sway, margin = best_sway(com, f, air, robot.widest, wanted[MARGIN])
            row[MARGIN] = min(row[MARGIN], margin)
            static_foot_loads(com[0], com[1] + sway, f, air, weight, forces)
            pose = pose_of(body[c, n], sway)
            for k in range(4):
                leg = leg_row(robot.legs, k)
                row[REACH] = min(row[REACH], joint_angles(leg, pose, f[k], q[k]))
                for j in range(3):
                    i = 3 * k + j
                    slack = min(q[k, j] - limits[0, i], limits[1, i] - q[k, j])
                    row[JOINTS] = min(row[JOINTS], slack)
                used = torque_used(leg, q[k], forces[k], pose, limits[2, 3 * k : 3 * k + 3])
                row[TORQUE] = min(row[TORQUE], 1.0 - used)
            if objective_of_slacks(row, wanted) > enough[c]:
                break  # before what takes longest
            for k in range(4):
                place_points(
                    leg_row(robot.legs, k), q[k], pose, f[k], robot.shanks[0, k], points[k]
                )
                row[LEGS] = pose_leg_clearance(
                    points[k], radii[k], stairs.rise, stairs.run, row[LEGS]
                )
                to_body(points[k], pose, in_body)
                row[APART] = pose_trunk_clearance(in_body, radii[k], robot.trunk, row[APART])
            for k in range(2):
                row[APART] = clearance_between_legs(
                    points[k], points[2 + k], radii[k], radii[2 + k], row[APART]
                )
            for i in range(UNDER):
                x, low = whole[0, 0] + i / (UNDER - 1.0) * (whole[1, 0] - whole[0, 0]), whole[0, 2]
                under[i, 0] = pose.x + pose.cosine * x + pose.sine * low
                under[i, 2] = pose.z - pose.sine * x + pose.cosine * low
            row[TRUNK] = clearance_under_line(under, stairs.rise, stairs.run, row[TRUNK])
            if objective_of_slacks(row, wanted) > enough[c]:
                break
