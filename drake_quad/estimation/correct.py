"""The filter's correction by the feet that stand: gate, Kalman update, retraction.

Hartley et al. 2020, section 5.2: in right-invariant errors a standing foot's innovation is
ξ_p - ξ_d plus noise, whatever the state, so that H is constant and P Hᵀ a difference of columns.
The noise is taken as alike in all directions, so the three components go in one at a time.
"""

import numpy as np

from drake_quad.compiled import compiled, copy_matrix, copy_vector
from drake_quad.estimation.memory import (
    ACCEL_BIAS,
    COVARIANCE,
    E_ACCEL,
    E_FEET,
    E_GYRO,
    E_POSITION,
    E_VELOCITY,
    ERRORS,
    FEET,
    FIRM,
    GYRO_BIAS,
    POSITION,
    ROTATION,
    VELOCITY,
)
from drake_quad.estimation.rotation import left_jacobian, multiply, normalize, rotation_exp
from drake_quad.estimation.settings import FOOT_NOISE, GATE
from drake_quad.gait.legs import FloatArray


@compiled
def innovation(m: FloatArray, p_BF: FloatArray, k: int) -> FloatArray:
    """Where leg k's joints have its foot, less where the filter does, in W (3,) [m]."""
    y = np.empty(3)
    for i in range(3):
        r = m[ROTATION + 3 * i : ROTATION + 3 * i + 3]
        y[i] = (
            m[POSITION + i]
            + (r[0] * p_BF[k, 0] + r[1] * p_BF[k, 1] + r[2] * p_BF[k, 2])
            - m[FEET + 3 * k + i]
        )
    return y


@compiled
def distance(m: FloatArray, y: FloatArray, k: int, noise: float) -> float:
    """Squared Mahalanobis distance of leg k's innovation `y`; `noise` [m^2] is a variance."""
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    p, d = E_POSITION, E_FEET + 3 * k
    S = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            S[i, j] = P[p + i, p + j] - P[p + i, d + j] - P[d + i, p + j] + P[d + i, d + j]
        S[i, i] += noise
    c0 = S[1, 1] * S[2, 2] - S[1, 2] * S[2, 1]
    c1 = S[1, 2] * S[2, 0] - S[1, 0] * S[2, 2]
    c2 = S[1, 0] * S[2, 1] - S[1, 1] * S[2, 0]
    det = S[0, 0] * c0 + S[0, 1] * c1 + S[0, 2] * c2
    i00, i01, i02 = c0, S[0, 2] * S[2, 1] - S[0, 1] * S[2, 2], S[0, 1] * S[1, 2] - S[0, 2] * S[1, 1]
    i11, i12 = S[0, 0] * S[2, 2] - S[0, 2] * S[2, 0], S[0, 2] * S[1, 0] - S[0, 0] * S[1, 2]
    i22 = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    total = i00 * y[0] * y[0] + i11 * y[1] * y[1] + i22 * y[2] * y[2]
    total += 2.0 * (i01 * y[0] * y[1] + i02 * y[0] * y[2] + i12 * y[1] * y[2])
    return total / det


@compiled
def correct(m: FloatArray, p_BF: FloatArray, bears: FloatArray, s: FloatArray) -> FloatArray:
    """Corrects the memory by the firm feet that bear now; returns (4,) 1 where one was gated.

    A gated foot is left out: against the IMU and the other feet it has slipped.

    Args:
        m: The memory.
        p_BF: Feet's centres in B by the joints, (4, 3) [m].
        bears: (4,) 1 where a foot bears.
        s: The settings.
    """
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    noise = s[FOOT_NOISE] ** 2
    gated = np.zeros(4)
    Y = np.zeros((4, 3))
    for k in range(4):
        if m[FIRM + k] > 0.5 and bears[k] > 0.5:
            copy_vector(Y[k], innovation(m, p_BF, k))
            if not distance(m, Y[k], k, noise) <= s[GATE]:
                gated[k] = 1.0
    delta, column = np.zeros(ERRORS), np.empty(ERRORS)
    for k in range(4):
        if m[FIRM + k] > 0.5 and bears[k] > 0.5 and gated[k] < 0.5:
            for i in range(3):
                p, d = E_POSITION + i, E_FEET + 3 * k + i
                for a in range(ERRORS):
                    column[a] = P[a, p] - P[a, d]
                S = column[p] - column[d] + noise
                gain = (Y[k, i] - (delta[p] - delta[d])) / S
                for a in range(ERRORS):
                    delta[a] += column[a] * gain
                    c = column[a] / S
                    for b in range(a + 1):
                        P[a, b] -= c * column[b]
                        P[b, a] = P[a, b]
    retract(m, delta)
    return gated


@compiled
def retract(m: FloatArray, delta: FloatArray) -> None:
    """X ← exp(-δ) X: takes the estimated error `delta` (27,) out of the state, in place."""
    x, y, z = -delta[0], -delta[1], -delta[2]
    turn, J = rotation_exp(x, y, z), left_jacobian(x, y, z)
    R = m[ROTATION : ROTATION + 9].reshape(3, 3)
    copy_matrix(R, multiply(turn, R))
    normalize(R)
    move(m, VELOCITY, turn, J, delta, E_VELOCITY)
    move(m, POSITION, turn, J, delta, E_POSITION)
    for k in range(4):
        if m[FIRM + k] > 0.5:
            move(m, FEET + 3 * k, turn, J, delta, E_FEET + 3 * k)
    for i in range(3):
        m[GYRO_BIAS + i] -= delta[E_GYRO + i]
        m[ACCEL_BIAS + i] -= delta[E_ACCEL + i]


@compiled
def move(
    m: FloatArray, at: int, turn: FloatArray, J: FloatArray, delta: FloatArray, error: int
) -> None:
    """One column of the retraction: x ← turn x - J δ_x."""
    x, y, z = m[at], m[at + 1], m[at + 2]
    e0, e1, e2 = delta[error], delta[error + 1], delta[error + 2]
    for i in range(3):
        m[at + i] = (turn[i, 0] * x + turn[i, 1] * y + turn[i, 2] * z) - (
            J[i, 0] * e0 + J[i, 1] * e1 + J[i, 2] * e2
        )
