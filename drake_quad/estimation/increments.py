"""What an ideal strapdown IMU shows between two states."""

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.estimation.rotation import multiply, rotation_exp, rotation_log
from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import FloatArray


@compiled
def quaternion_matrix(q: FloatArray) -> FloatArray:
    """R (3, 3) of a quaternion w, x, y, z of any length but none."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    n = 2.0 / (w * w + x * x + y * y + z * z)
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)
    R[1, 0], R[1, 1], R[1, 2] = n * (x * y + w * z), 1.0 - n * (x * x + z * z), n * (y * z - w * x)
    R[2, 0], R[2, 1], R[2, 2] = n * (x * z - w * y), n * (y * z + w * x), 1.0 - n * (x * x + y * y)
    return R


@compiled
def imu_increments(before: FloatArray, now: FloatArray, dt: float) -> FloatArray:
    """Mean rate [rad/s] and specific force [m/s^2] in B (6,) between two samples.

    Args:
        before: (7,) quaternion w, x, y, z of R_WB, then v_WB [m/s], at the last sample.
        now: The same at this one.
        dt: Between them [s].
    """
    R = quaternion_matrix(before[:4])
    turn = rotation_log(multiply(np.ascontiguousarray(R.T), quaternion_matrix(now[:4])))
    # B turns within the interval: the mean force is given in B as it is half way.
    middle = multiply(R, rotation_exp(0.5 * turn[0], 0.5 * turn[1], 0.5 * turn[2]))
    a = (now[4:7] - before[4:7]) / dt
    a[2] += GRAVITY
    out = np.empty(6)
    for i in range(3):
        out[i] = turn[i] / dt
        out[3 + i] = middle[0, i] * a[0] + middle[1, i] * a[1] + middle[2, i] * a[2]
    return out
