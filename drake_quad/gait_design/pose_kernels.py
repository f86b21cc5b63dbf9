"""Compiled: joint angles, centre of mass, sway, loads and torques of a candidate gait's pose."""

from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.jit import jit
from drake_quad.robot.kinematics import LegConstants, leg_row, solve_leg


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
