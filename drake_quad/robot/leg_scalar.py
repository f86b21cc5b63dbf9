"""The same leg as in `leg_kinematics`, one at a time in plain floats: for the control loop.

With three numbers a leg, plain floats beat numpy's call overhead several times, and the loop runs
hundreds of times a second. The array versions define the leg; a test holds the two equal.
"""

from math import acos, atan2, cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.leg_kinematics import LegGeometry

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]  # rows


class LegConstants(NamedTuple):
    """One leg's lengths; see LegGeometry."""

    x: float
    y: float
    z: float
    offset: float
    thigh: float
    shank: float
    knee_sign: float
    raised: float


def leg_constants(geometry: LegGeometry) -> tuple[LegConstants, ...]:
    """The four legs' lengths as plain floats."""
    return tuple(
        LegConstants(p[0], p[1], p[2], float(d), float(a), float(b), float(s), float(h))
        for p, d, a, b, s, h in zip(
            geometry.p_BH.tolist(),
            geometry.offset,
            geometry.thigh,
            geometry.shank,
            geometry.knee_sign,
            geometry.raised,
            strict=True,
        )
    )


def leg_array(geometry: LegGeometry) -> FloatArray:
    """The legs' lengths as (4, 8) rows in the order of LegConstants, as all kernels take them."""
    g = geometry
    lengths = [g.p_BH, g.offset, g.thigh, g.shank, g.knee_sign, g.raised]
    return np.column_stack(lengths).astype(float)


@compiled
def leg_row(legs: FloatArray, k: int) -> LegConstants:
    """Row `k` of `leg_array`."""
    return LegConstants(
        legs[k, 0],
        legs[k, 1],
        legs[k, 2],
        legs[k, 3],
        legs[k, 4],
        legs[k, 5],
        legs[k, 6],
        legs[k, 7],
    )


@compiled
def foot_and_jacobian(c: LegConstants, a: float, hip: float, knee: float) -> tuple[Vector, Matrix]:
    """The foot's centre in B [m] and its Jacobian [m/rad] at three joint angles [rad]."""
    sa, ca = sin(a), cos(a)
    both = hip + knee
    x_hip, z_hip = -c.thigh * sin(hip), -c.thigh * cos(hip)
    x_knee, z_knee = -c.shank * sin(both), -c.shank * cos(both)
    x, z, d = x_hip + x_knee, z_hip + z_knee, c.offset
    whole = z + c.raised
    y_up, z_up = ca * d - sa * whole, sa * d + ca * whole
    return (
        (c.x + x, c.y + y_up, c.z + z_up),
        (
            (0.0, z, z_knee),
            (-z_up, sa * x, sa * x_knee),
            (y_up, -ca * x, -ca * x_knee),
        ),
    )


@compiled
def solve_leg(c: LegConstants, x: float, y: float, z: float) -> Vector:
    """Joint angles [rad] that put the foot's centre at (x, y, z) in B [m], or as near as can be."""
    x, y, z = x - c.x, y - c.y, z - c.z
    d, l1, l2 = c.offset, c.thigh, c.shank
    down = -sqrt(max(y * y + z * z - d * d, 1e-12))
    a = atan2(z, y) - atan2(down, d)
    a = (a + pi) % (2.0 * pi) - pi
    down -= c.raised
    reach = min(max(sqrt(x * x + down * down), abs(l1 - l2) + 1e-6), l1 + l2 - 1e-6)
    knee = c.knee_sign * acos(
        min(max((reach * reach - l1 * l1 - l2 * l2) / (2.0 * l1 * l2), -1.0), 1.0)
    )
    return a, atan2(-x, -down) - atan2(l2 * sin(knee), l1 + l2 * cos(knee)), knee


@compiled
def solve_rates(J: Matrix, v: Vector) -> Vector:
    """Joint speeds that move the foot at `v`, by Cramer's rule; zero for a singular leg."""
    (a, b, c), (d, e, f), (g, h, i) = J
    ei, fg, dh = e * i - f * h, f * g - d * i, d * h - e * g
    det = a * ei + b * fg + c * dh
    if abs(det) < 1e-9:
        return (0.0, 0.0, 0.0)
    x, y, z = v
    return (
        (x * ei + b * (f * z - y * i) + c * (y * h - e * z)) / det,
        (a * (y * i - f * z) + x * fg + c * (d * z - y * g)) / det,
        (a * (e * z - y * h) + b * (y * g - d * z) + x * dh) / det,
    )


@compiled
def rotate(R: Matrix, v: Vector) -> Vector:
    """R v."""
    x, y, z = v
    return (
        R[0][0] * x + R[0][1] * y + R[0][2] * z,
        R[1][0] * x + R[1][1] * y + R[1][2] * z,
        R[2][0] * x + R[2][1] * y + R[2][2] * z,
    )


@compiled
def rotate_back(R: Matrix, v: Vector) -> Vector:
    """R transposed, times v."""
    x, y, z = v
    return (
        R[0][0] * x + R[1][0] * y + R[2][0] * z,
        R[0][1] * x + R[1][1] * y + R[2][1] * z,
        R[0][2] * x + R[1][2] * y + R[2][2] * z,
    )


@compiled
def yaw_pitch_rotation(pitch: float, yaw: float) -> Matrix:
    """R_WB of a body turned about z by `yaw`, then about its y by `pitch` [rad]."""
    cp, sp, cy, sy = cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    return ((cy * cp, -sy, cy * sp), (sy * cp, cy, sy * sp), (-sp, 0.0, cp))


@compiled
def quaternion_rotation(w: float, x: float, y: float, z: float) -> Matrix:
    """R_WB of a quaternion of any length."""
    n = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1.0 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)),
        (n * (x * y + w * z), 1.0 - n * (x * x + z * z), n * (y * z - w * x)),
        (n * (x * z - w * y), n * (y * z + w * x), 1.0 - n * (x * x + y * y)),
    )
