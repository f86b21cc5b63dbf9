"""Where a candidate's links are in one pose: angles, centre of mass, points along its legs."""

from math import acos, atan2, cos, pi, sin, sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.design.kernel_distance import SHANK, THIGH
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.shank_outline import SHANK_POINTS


@compiled
def tilt(leg: FloatArray, b: FloatArray, foot: FloatArray, q: FloatArray) -> float:
    """How far a shank leans ahead [rad], the body not swaying; writes its leg's angles."""
    angles(leg, b, foot, 0.0, cos(b[3]), sin(b[3]), q)
    return b[3] + q[1] + q[2]


@compiled
def angles(
    leg: FloatArray, b: FloatArray, foot: FloatArray, sway: float, cp: float, sp: float,
    q: FloatArray,
) -> float:  # fmt: skip
    """Writes a leg's angles; returns by how much it is short of its reach's ends [m]."""
    dx, dz = foot[0] - b[0], foot[2] - b[2]
    x = cp * dx - sp * dz - leg[0]
    y = foot[1] - b[1] - sway - leg[1]
    z = sp * dx + cp * dz - leg[2]
    d, l1, l2 = leg[3], leg[4], leg[5]
    across = y * y + z * z - d * d
    down = -sqrt(max(across, 1e-12))
    a = atan2(z, y) - atan2(down, d)
    q[0] = (a + pi) % (2.0 * pi) - pi
    down -= leg[7]
    distance = sqrt(x * x + down * down)
    room = min(l1 + l2 - distance, distance - abs(l1 - l2))
    reach = min(max(distance, abs(l1 - l2) + 1e-6), l1 + l2 - 1e-6)
    bend = (reach * reach - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
    q[2] = leg[6] * acos(min(max(bend, -1.0), 1.0))
    q[1] = atan2(-x, -down) - atan2(l2 * sin(q[2]), l1 + l2 * cos(q[2]))
    return room if across > 0.0 else min(room, -sqrt(-across))


@compiled
def centre(
    b: FloatArray, q: FloatArray, legs: FloatArray, masses: FloatArray, coms: FloatArray,
    cp: float, sp: float, com: FloatArray,
) -> None:  # fmt: skip
    """Writes the whole robot's centre of mass in W (3,) [m]."""
    total, mx, my, mz = masses[0], masses[0] * coms[0, 0], masses[0] * coms[0, 1], 0.0
    mz = masses[0] * coms[0, 2]
    for k in range(4):
        leg = legs[k]
        ca, sa = cos(q[k, 0]), sin(q[k, 0])
        for j in range(3):
            m, p = masses[1 + 3 * k + j], coms[1 + 3 * k + j]
            if j == 0:
                x, y, z = p[0], p[1], p[2]
            else:
                angle = q[k, 1] + (q[k, 2] if j == 2 else 0.0)
                c, s = cos(angle), sin(angle)
                x, y, z = c * p[0] + s * p[2], leg[3] + p[1], -s * p[0] + c * p[2] + leg[7]
                if j == 2:
                    x -= leg[4] * sin(q[k, 1])
                    z -= leg[4] * cos(q[k, 1])
            mx += m * (leg[0] + x)
            my += m * (leg[1] + ca * y - sa * z)
            mz += m * (leg[2] + sa * y + ca * z)
            total += m
    mx, my, mz = mx / total, my / total, mz / total
    com[0], com[1], com[2] = b[0] + cp * mx + sp * mz, b[1] + my, b[2] - sp * mx + cp * mz


@compiled
def place_points(
    leg: FloatArray, q: FloatArray, b: FloatArray, sway: float, cp: float, sp: float,
    foot: FloatArray, offsets: FloatArray, points: FloatArray,
) -> None:  # fmt: skip
    """Writes points of the shank from the knee on, then of the thigh, in W (SHANK + THIGH, 3)."""
    sa, ca = sin(q[0]), cos(q[0])
    x, z = -leg[4] * sin(q[1]), -leg[4] * cos(q[1])
    knee, hip = np.empty(3), np.empty(3)
    for part in range(2):
        px, pz = (x, z + leg[7]) if part == 0 else (0.0, leg[7])
        bx = leg[0] + px
        by = leg[1] + ca * leg[3] - sa * pz
        bz = leg[2] + sa * leg[3] + ca * pz
        into = knee if part == 0 else hip
        into[0], into[1] = b[0] + cp * bx + sp * bz, b[1] + sway + by
        into[2] = b[2] - sp * bx + cp * bz
    c, s = cos(q[1] + q[2]), sin(q[1] + q[2])
    ax, ay, az = cp * c - sp * ca * s, sa * s, -sp * c - cp * ca * s  # the shank's x in W
    for i in range(SHANK):
        for j in range(3):
            points[i, j] = knee[j] + SHANK_POINTS[i] * (foot[j] - knee[j])
        points[i, 0] += offsets[i] * ax
        points[i, 1] += offsets[i] * ay
        points[i, 2] += offsets[i] * az
    for i in range(THIGH):
        share = (i + 1.0) / (THIGH + 1.0)
        for j in range(3):
            points[SHANK + i, j] = knee[j] + share * (hip[j] - knee[j])
