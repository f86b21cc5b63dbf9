"""What the filter tells others: the state in a layout's order, and how sure it is of it."""

from math import sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.estimation.filter import ANGLE_LIMIT, SPEED_LIMIT, sound
from drake_quad.estimation.memory import (
    COVARIANCE,
    E_POSITION,
    E_VELOCITY,
    ERRORS,
    POSITION,
    RATE,
    ROTATION,
    VELOCITY,
)
from drake_quad.estimation.rotation import write_quaternion
from drake_quad.gait.legs import FloatArray

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.intp]]


@compiled
def write_state(
    m: FloatArray, joints: FloatArray, places: IntArray, q_base: int, v_base: int, x: FloatArray
) -> None:
    """Writes [q; v] to `x`; joint readings that are not sound leave theirs as they were.

    Args:
        m: The memory.
        joints: (24,) angles [rad], then speeds [rad/s], leg by leg.
        places: (24,) where those are in the state.
        q_base: Where the base's quaternion is, its position after it.
        v_base: Where the base's angular velocity is, its velocity after it.
        x: Result.
    """
    write_quaternion(m[ROTATION : ROTATION + 9].reshape(3, 3), x[q_base : q_base + 4])
    for i in range(3):
        x[q_base + 4 + i] = m[POSITION + i]
        x[v_base + i] = m[RATE + i]
        x[v_base + 3 + i] = m[VELOCITY + i]
    if sound(joints, ANGLE_LIMIT, SPEED_LIMIT):
        for i in range(24):
            x[places[i]] = joints[i]


@compiled
def write_deviation(m: FloatArray, out: FloatArray) -> None:
    """Writes deviations (9,) of orientation [rad], velocity [m/s] and position [m], axes of W.

    The filter's errors of velocity and position are invariant ones, which a turn about W's origin
    is part of; here they are those of the vectors themselves: δx = ξ_x - x × ξ_R.
    """
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    for i in range(3):
        out[i] = sqrt(max(P[i, i], 0.0))
    row = np.empty(3)
    for block in range(2):
        at, error = (VELOCITY, E_VELOCITY) if block == 0 else (POSITION, E_POSITION)
        x, y, z = m[at], m[at + 1], m[at + 2]
        for i in range(3):
            row[0], row[1], row[2] = (
                (0.0, z, -y) if i == 0 else (-z, 0.0, x) if i == 1 else (y, -x, 0.0)
            )
            n = error + i
            total = P[n, n]
            for a in range(3):
                total += 2.0 * row[a] * P[a, n]
                for b in range(3):
                    total += row[a] * row[b] * P[a, b]
            out[error + i] = sqrt(max(total, 0.0))
