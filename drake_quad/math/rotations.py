"""Rotations: exponential map, yaw and pitch, quaternions, roll-pitch-yaw, angles between.

In the control loop plain floats beat numpy's call overhead several times for so few numbers, so
some rotations are here as arrays and as floats.
"""

import math
from math import atan2, cos, sin, sqrt

import numpy as np

from drake_quad.common import FloatArray, Matrix, Vector
from drake_quad.jit import jit

SMALL = 1e-5  # [rad] below it the series are exact to the last digit


@jit
def rotation_exp(x: float, y: float, z: float) -> FloatArray:
    """The rotation matrix (3, 3) of a rotation vector [rad] (Rodrigues)."""
    a2 = x * x + y * y + z * z
    a = sqrt(a2)
    if a < SMALL:
        s, c = 1.0 - a2 / 6.0, 0.5 - a2 / 24.0
    else:
        s, c = sin(a) / a, (1.0 - cos(a)) / a2
    R = np.empty((3, 3))
    R[0, 0] = 1.0 - c * (y * y + z * z)
    R[1, 1] = 1.0 - c * (x * x + z * z)
    R[2, 2] = 1.0 - c * (x * x + y * y)
    R[0, 1], R[1, 0] = c * x * y - s * z, c * x * y + s * z
    R[0, 2], R[2, 0] = c * x * z + s * y, c * x * z - s * y
    R[1, 2], R[2, 1] = c * y * z - s * x, c * y * z + s * x
    return R


@jit
def left_jacobian(x: float, y: float, z: float) -> FloatArray:
    """J (3, 3) with exp((φ, u)) = (exp(φ), J u) in SE(3), for the rotation vector φ [rad]."""
    a2 = x * x + y * y + z * z
    a = sqrt(a2)
    if a < SMALL:
        s, c = 0.5 - a2 / 24.0, 1.0 / 6.0 - a2 / 120.0
    else:
        s, c = (1.0 - cos(a)) / a2, (a - sin(a)) / (a2 * a)
    J = np.empty((3, 3))
    J[0, 0] = 1.0 - c * (y * y + z * z)
    J[1, 1] = 1.0 - c * (x * x + z * z)
    J[2, 2] = 1.0 - c * (x * x + y * y)
    J[0, 1], J[1, 0] = c * x * y - s * z, c * x * y + s * z
    J[0, 2], J[2, 0] = c * x * z + s * y, c * x * z - s * y
    J[1, 2], J[2, 1] = c * y * z - s * x, c * y * z + s * x
    return J


@jit
def rotation_log(R: FloatArray) -> FloatArray:
    """The rotation vector (3,) [rad] of a rotation matrix well short of half a turn."""
    v = np.empty(3)
    v[0] = 0.5 * (R[2, 1] - R[1, 2])
    v[1] = 0.5 * (R[0, 2] - R[2, 0])
    v[2] = 0.5 * (R[1, 0] - R[0, 1])
    s = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if s > SMALL:
        scale = atan2(s, 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0)) / s
        v *= scale
    return v


@jit
def multiply(A: FloatArray, B: FloatArray) -> FloatArray:
    """A B of two (3, 3) matrices; a call of BLAS would cost more than the products."""
    C = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            C[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]
    return C


@jit
def normalize(R: FloatArray) -> None:
    """Makes `R` (3, 3), a rotation but for rounding, orthonormal again, in place (Gram-Schmidt)."""
    n = sqrt(R[0, 0] ** 2 + R[1, 0] ** 2 + R[2, 0] ** 2)
    for i in range(3):
        R[i, 0] /= n
    d = R[0, 0] * R[0, 1] + R[1, 0] * R[1, 1] + R[2, 0] * R[2, 1]
    for i in range(3):
        R[i, 1] -= d * R[i, 0]
    n = sqrt(R[0, 1] ** 2 + R[1, 1] ** 2 + R[2, 1] ** 2)
    for i in range(3):
        R[i, 1] /= n
    R[0, 2] = R[1, 0] * R[2, 1] - R[2, 0] * R[1, 1]
    R[1, 2] = R[2, 0] * R[0, 1] - R[0, 0] * R[2, 1]
    R[2, 2] = R[0, 0] * R[1, 1] - R[1, 0] * R[0, 1]


@jit
def write_quaternion(R: FloatArray, out: FloatArray) -> None:
    """Writes the unit quaternion w, x, y, z of `R` to `out` (4,), with w >= 0 (Shepperd 1978)."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    k = 0  # the greatest of w, x, y, z keeps the division well away from zero
    if trace < max(R[0, 0], R[1, 1], R[2, 2]):
        k = 1
        if R[1, 1] >= R[0, 0] and R[1, 1] >= R[2, 2]:
            k = 2
        elif R[2, 2] >= R[0, 0]:
            k = 3
    if k == 0:
        out[0] = 1.0 + trace
        out[1], out[2], out[3] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    elif k == 1:
        out[0], out[1] = R[2, 1] - R[1, 2], 1.0 + 2.0 * R[0, 0] - trace
        out[2], out[3] = R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]
    elif k == 2:
        out[0], out[2] = R[0, 2] - R[2, 0], 1.0 + 2.0 * R[1, 1] - trace
        out[1], out[3] = R[0, 1] + R[1, 0], R[1, 2] + R[2, 1]
    else:
        out[0], out[3] = R[1, 0] - R[0, 1], 1.0 + 2.0 * R[2, 2] - trace
        out[1], out[2] = R[0, 2] + R[2, 0], R[1, 2] + R[2, 1]
    n = sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2 + out[3] ** 2)
    if out[0] < 0.0:
        n = -n
    for i in range(4):
        out[i] /= n


@jit
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


@jit
def yaw_pitch_rotation(pitch: float, yaw: float) -> Matrix:
    """R_WB of a body turned about z by `yaw`, then about its y by `pitch` [rad]."""
    cp, sp, cy, sy = cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    return ((cy * cp, -sy, cy * sp), (sy * cp, cy, sy * sp), (-sp, 0.0, cp))


@jit
def quaternion_rotation(w: float, x: float, y: float, z: float) -> Matrix:
    """R_WB of a quaternion of any length."""
    n = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1.0 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)),
        (n * (x * y + w * z), 1.0 - n * (x * x + z * z), n * (y * z - w * x)),
        (n * (x * z - w * y), n * (y * z + w * x), 1.0 - n * (x * x + y * y)),
    )


@jit
def quaternion_matrix(q: FloatArray) -> FloatArray:
    """R (3, 3) of a quaternion w, x, y, z (4,) of any length but none."""
    return np.array(quaternion_rotation(q[0], q[1], q[2], q[3]))


def rotations(body: FloatArray) -> FloatArray:
    """Returns R_WB (..., 3, 3) of body poses (..., 5): yaw about z, then pitch about y."""
    cp, sp = np.cos(body[..., 3]), np.sin(body[..., 3])
    cy, sy = np.cos(body[..., 4]), np.sin(body[..., 4])
    zero = np.zeros_like(cp)
    rows = [
        np.stack([cy * cp, -sy, cy * sp], axis=-1),
        np.stack([sy * cp, cy, sy * sp], axis=-1),
        np.stack([-sp, zero, cp], axis=-1),
    ]
    return np.stack(rows, axis=-2)


def quaternion_of(roll: FloatArray, pitch: FloatArray, yaw: FloatArray) -> FloatArray:
    """Orientations (N, 4), w, x, y, z, of yaw about z, then pitch, then roll, (N,) [rad] each."""
    cr, cp, cy = np.cos(0.5 * roll), np.cos(0.5 * pitch), np.cos(0.5 * yaw)
    sr, sp, sy = np.sin(0.5 * roll), np.sin(0.5 * pitch), np.sin(0.5 * yaw)
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=-1,
    )


def angle_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """The angle from one orientation to the other, (N,) [rad], of quaternions (N, 4).

    From the sine and the cosine of half of it: the cosine alone would have an error of 1e-8 near 0.
    """
    a = a / np.linalg.norm(a, axis=1, keepdims=True)
    b = b / np.linalg.norm(b, axis=1, keepdims=True)
    same = np.where(np.einsum("ij,ij->i", a, b) < 0.0, -1.0, 1.0)[:, None]
    half = np.arctan2(np.linalg.norm(a - same * b, axis=1), np.linalg.norm(a + same * b, axis=1))
    return np.asarray(4.0 * half)


def roll_pitch_yaw(quaternion: FloatArray) -> FloatArray:
    """Roll, pitch, yaw (N, 3) [rad] of orientations (w, x, y, z) (N, 4): yaw first, about z."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    return np.stack(
        [
            np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)),
            np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        ],
        axis=-1,
    )


def rotation(yaw: float) -> FloatArray:
    """The rotation (2, 2) about z by `yaw`; exact at multiples of a right angle.

    So boxes after right-angle turns abut without slivers of rounding between them.
    """
    c, s = (round(v) if abs(v - round(v)) < 1e-15 else v for v in (math.cos(yaw), math.sin(yaw)))
    return np.array([[c, -s], [s, c]], dtype=np.float64)
