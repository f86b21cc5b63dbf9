"""The floating base's dynamics, with everything but the feet's forces eliminated.

Every joint belongs to a leg whose foot's acceleration is given, so the joints' accelerations
follow from the base's, and the base's from the forces on the feet:

    M_b a_b + h_b = G f,    qdd = B a_b + d,    tau = T f + t.

What is left to choose are the forces f, in a small program (`whole_body_qp.py`).
"""

from typing import NamedTuple

import numpy as np

from drake_quad.common import FloatArray, IntArray
from drake_quad.control.kernel_state import Record
from drake_quad.jit import jit

SINGULAR = 1e-5  # [m^3] determinant of a leg's Jacobian below which it counts as just that


class Dynamics(NamedTuple):
    """Linear maps of the forces f (12,) on the four feet, in W [N].

    Attributes:
        base: (6, 12) to the base's acceleration: angular, then linear, in W.
        base_offset: (6,): a_b = base f + base_offset.
        joint: (12, 12) to the joints' accelerations [rad/s^2].
        joint_offset: (12,).
        torque: (12, 12) to the joints' torques [Nm].
        torque_offset: (12,).
    """

    base: FloatArray
    base_offset: FloatArray
    joint: FloatArray
    joint_offset: FloatArray
    torque: FloatArray
    torque_offset: FloatArray


@jit
def _inverse(J: FloatArray) -> FloatArray:
    """Inverse of a leg's Jacobian (3, 3), by its adjugate: large but finite for a straight leg."""
    adjugate = np.empty((3, 3))
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            adjugate[j, i] = J[a, c] * J[b, d] - J[a, d] * J[b, c]
    det = J[0, 0] * adjugate[0, 0] + J[0, 1] * adjugate[1, 0] + J[0, 2] * adjugate[2, 0]
    if abs(det) < SINGULAR:
        det = SINGULAR if det >= 0.0 else -SINGULAR
    return adjugate / det


@jit
def reduce_dynamics(
    M: FloatArray,
    h: FloatArray,
    joints: IntArray,
    feet: Record,
    acceleration: FloatArray,
    p: FloatArray,
    radius: float,
) -> Dynamics:
    """Eliminates the accelerations.

    Args:
        M: Mass matrix (18, 18), the base's angular and linear velocity first.
        h: Coriolis and gravity terms (18,): M a + h = generalised forces.
        joints: Indices of the legs' joints in the velocities (12,).
        feet: The feet as `measure_feet` writes them.
        acceleration: What the feet's centres are to have, in W (4, 3) [m/s^2].
        p: p_WB (3,) [m].
        radius: Radius of the foot spheres [m].

    Returns:
        The maps. Those of a straight leg are finite, but not exact; from nan comes nan.
    """
    # Loops all along: a call of a library for matrices this small takes longer than its work.
    # Rows of three are a leg's, which no other leg's joints touch.
    B, d = np.zeros((12, 6)), np.zeros(12)
    M_b, right = np.empty((6, 6)), np.zeros((6, 13))
    for i in range(6):
        right[i, 12] = -h[i]
        for j in range(6):
            M_b[i, j] = M[i, j]
    for k in range(4):
        inverse = _inverse(feet.jacobian[k])
        x, y, z = feet.place[k, 0] - p[0], feet.place[k, 1] - p[1], feet.place[k, 2] - p[2]
        for i in range(3):
            row = 3 * k + i
            a, b, c = inverse[i, 0], inverse[i, 1], inverse[i, 2]
            # a_F = vdot + wdot x r + drift + J qdd
            B[row, 0], B[row, 1], B[row, 2] = z * b - y * c, x * c - z * a, y * a - x * b
            B[row, 3], B[row, 4], B[row, 5] = -a, -b, -c
            for j in range(3):
                d[row] += inverse[i, j] * (acceleration[k, j] - feet.drift[k, j])
            for j in range(6):
                m = M[j, joints[row]]
                right[j, 12] -= m * d[row]
                for n in range(6):
                    M_b[j, n] += m * B[row, n]
        normal = feet.normal[k]  # where the ground pushes is a radius off the centre against it
        x, y, z = x - radius * normal[0], y - radius * normal[1], z - radius * normal[2]
        right[0, 3 * k + 1], right[0, 3 * k + 2] = -z, y
        right[1, 3 * k], right[1, 3 * k + 2] = z, -x
        right[2, 3 * k], right[2, 3 * k + 1] = -y, x
        for i in range(3):
            right[3 + i, 3 * k + i] = 1.0
    _solve_in_place(M_b, right)

    # The offsets are the last column.
    joint, torque = np.zeros((12, 13)), np.zeros((12, 13))
    for row in range(12):
        for j in range(6):
            m, b = M[joints[row], j], B[row, j]
            for n in range(13):
                joint[row, n] += b * right[j, n]
                torque[row, n] += m * right[j, n]
        joint[row, 12] += d[row]
        torque[row, 12] += h[joints[row]]
    for k in range(4):
        for i in range(3):
            row = 3 * k + i
            for j in range(3):
                m = M[joints[row], joints[3 * k + j]]
                for n in range(13):
                    torque[row, n] += m * joint[3 * k + j, n]
                torque[row, 3 * k + j] -= feet.contact_jacobian[k, j, i]
    return Dynamics(
        right[:, :12].copy(), right[:, 12].copy(), joint[:, :12].copy(), joint[:, 12].copy(),
        torque[:, :12].copy(), torque[:, 12].copy(),
    )  # fmt: skip


@jit
def contact_axes(normals: FloatArray) -> FloatArray:
    """Axes (4, 3, 3) in W, in columns, of the force on each foot: two along the ground, its normal.

    The first points straight down the slope; on level ground they are W's x, y and z,
    and that is where the last one's z is 1.

    Args:
        normals: Ground normals under the feet (4, 3).
    """
    axes = np.zeros((4, 3, 3))
    for k in range(4):
        nx, ny, nz = normals[k, 0], normals[k, 1], normals[k, 2]
        if nz == 1.0:
            axes[k, 0, 0] = axes[k, 1, 1] = axes[k, 2, 2] = 1.0
            continue
        tilt = np.sqrt(nx * nx + ny * ny)
        dx, dy = nx / tilt, ny / tilt
        axes[k, 0, 0], axes[k, 1, 0], axes[k, 2, 0] = dx * nz, dy * nz, -tilt
        axes[k, 0, 1], axes[k, 1, 1] = -dy, dx
        axes[k, 0, 2], axes[k, 1, 2], axes[k, 2, 2] = nx, ny, nz
    return axes


@jit
def turn_forces(dynamics: Dynamics, axes: FloatArray) -> None:
    """Makes the maps, in place, those of forces given in axes of their own.

    Args:
        dynamics: Terms that `reduce_dynamics` returned.
        axes: Axes of each foot's force, in columns in W (4, 3, 3); W's own change nothing.
    """
    for k in range(4):
        if axes[k, 2, 2] == 1.0:
            continue
        for matrix in (dynamics.base, dynamics.joint, dynamics.torque):
            for row in range(len(matrix)):
                x, y, z = matrix[row, 3 * k], matrix[row, 3 * k + 1], matrix[row, 3 * k + 2]
                for j in range(3):
                    matrix[row, 3 * k + j] = (
                        x * axes[k, 0, j] + y * axes[k, 1, j] + z * axes[k, 2, j]
                    )


@jit
def _solve_in_place(A: FloatArray, right: FloatArray) -> None:
    """Solves A x = right, (n, n) and (n, m), by Gauss' elimination; both are used up.

    A singular matrix gives nan or inf.
    """
    n, m = right.shape
    for i in range(n):
        best = i
        for k in range(i + 1, n):
            if abs(A[k, i]) > abs(A[best, i]):
                best = k
        if best != i:
            for j in range(n):
                A[i, j], A[best, j] = A[best, j], A[i, j]
            for j in range(m):
                right[i, j], right[best, j] = right[best, j], right[i, j]
        for k in range(i + 1, n):
            factor = A[k, i] / A[i, i]
            for j in range(i + 1, n):
                A[k, j] -= factor * A[i, j]
            for j in range(m):
                right[k, j] -= factor * right[i, j]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            for j in range(m):
                right[i, j] -= A[i, k] * right[k, j]
        for j in range(m):
            right[i, j] /= A[i, i]
