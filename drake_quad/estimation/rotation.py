"""Rotations as the filter's kernels need them: small, allocation-light, compiled."""

from math import atan2, cos, sin, sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray

SMALL = 1e-5  # [rad] below it the series are exact to the last digit


@compiled
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


@compiled
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


@compiled
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


@compiled
def multiply(A: FloatArray, B: FloatArray) -> FloatArray:
    """A B of two (3, 3) matrices; a call of BLAS would cost more than the products."""
    C = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            C[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]
    return C


@compiled
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


@compiled
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
