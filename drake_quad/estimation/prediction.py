"""The filter's prediction: the IMU integrated over one tick, and the covariance with it.

Hartley, Ghaffari, Eustice and Grizzle, "Contact-aided invariant extended Kalman filtering for
robot state estimation", IJRR 39(4), 2020: sections 4 and 5 (world-centric, right-invariant, with
biases in section 7). The error's dynamics A is used to first order in the period, sparse as it is.
"""

import numpy as np

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.estimation.filter_state import (
    ACCEL_BIAS,
    COVARIANCE,
    E_ACCEL,
    E_FEET,
    E_GYRO,
    E_POSITION,
    E_ROTATION,
    E_VELOCITY,
    ERRORS,
    FEET,
    FIRM,
    GYRO_BIAS,
    POSITION,
    RATE,
    ROTATION,
    VELOCITY,
    Record,
)
from drake_quad.jit import copy_matrix, jit
from drake_quad.math.rotations import multiply, normalize, rotation_exp


@jit
def predict(m: FloatArray, imu: FloatArray, dt: float, s: Record) -> None:
    """Moves the memory `m` on by `dt` [s] with the mean rate and specific force `imu` (6,)."""
    R = m[ROTATION : ROTATION + 9].reshape(3, 3)
    rate, force = np.empty(3), np.empty(3)
    for i in range(3):
        rate[i] = imu[i] - m[GYRO_BIAS + i]
        force[i] = imu[3 + i] - m[ACCEL_BIAS + i]
    predict_covariance(m, R, imu, dt, s)
    # The force is the interval's mean in B, which turns meanwhile: taken at the middle.
    h = 0.5 * dt
    middle = multiply(R, rotation_exp(h * rate[0], h * rate[1], h * rate[2]))
    for i in range(3):
        a = middle[i, 0] * force[0] + middle[i, 1] * force[1] + middle[i, 2] * force[2]
        if i == 2:
            a -= GRAVITY
        m[POSITION + i] += dt * (m[VELOCITY + i] + h * a)
        m[VELOCITY + i] += dt * a
    copy_matrix(R, multiply(R, rotation_exp(dt * rate[0], dt * rate[1], dt * rate[2])))
    normalize(R)
    for i in range(3):
        m[RATE + i] = R[i, 0] * rate[0] + R[i, 1] * rate[1] + R[i, 2] * rate[2]


@jit
def transition(M: FloatArray, T: FloatArray, firm: FloatArray, R: FloatArray, dt: float) -> None:
    """M ← Φ M, in place, for the rows of `M` (ERRORS, n): Φ = I + dt A.

    Args:
        M: Errors by rows.
        T: v, p and the four feet in W, (6, 3): the lever of a rate's error on each.
        firm: (4,) which feet are held; the errors of the others are none.
        R: R_WB.
        dt: The period [s].
    """
    for j in range(M.shape[1]):
        g0, g1, g2 = M[E_GYRO, j], M[E_GYRO + 1, j], M[E_GYRO + 2, j]
        if g0 != 0.0 or g1 != 0.0 or g2 != 0.0:
            b0 = dt * (R[0, 0] * g0 + R[0, 1] * g1 + R[0, 2] * g2)
            b1 = dt * (R[1, 0] * g0 + R[1, 1] * g1 + R[1, 2] * g2)
            b2 = dt * (R[2, 0] * g0 + R[2, 1] * g1 + R[2, 2] * g2)
        else:
            b0 = b1 = b2 = 0.0
        a0, a1, a2 = M[E_ACCEL, j], M[E_ACCEL + 1, j], M[E_ACCEL + 2, j]
        c0 = R[0, 0] * a0 + R[0, 1] * a1 + R[0, 2] * a2
        c1 = R[1, 0] * a0 + R[1, 1] * a1 + R[1, 2] * a2
        c2 = R[2, 0] * a0 + R[2, 1] * a1 + R[2, 2] * a2
        t0, t1 = M[E_ROTATION, j], M[E_ROTATION + 1, j]
        v0, v1, v2 = M[E_VELOCITY, j], M[E_VELOCITY + 1, j], M[E_VELOCITY + 2, j]
        M[E_POSITION, j] += dt * v0 - (T[1, 1] * b2 - T[1, 2] * b1)
        M[E_POSITION + 1, j] += dt * v1 - (T[1, 2] * b0 - T[1, 0] * b2)
        M[E_POSITION + 2, j] += dt * v2 - (T[1, 0] * b1 - T[1, 1] * b0)
        # g × θ with g = (0, 0, -GRAVITY)
        M[E_VELOCITY, j] += dt * (GRAVITY * t1 - c0) - (T[0, 1] * b2 - T[0, 2] * b1)
        M[E_VELOCITY + 1, j] += dt * (-GRAVITY * t0 - c1) - (T[0, 2] * b0 - T[0, 0] * b2)
        M[E_VELOCITY + 2, j] += -dt * c2 - (T[0, 0] * b1 - T[0, 1] * b0)
        for k in range(4):
            if firm[k] > 0.5:
                i = E_FEET + 3 * k
                d = T[2 + k]
                M[i, j] -= d[1] * b2 - d[2] * b1
                M[i + 1, j] -= d[2] * b0 - d[0] * b2
                M[i + 2, j] -= d[0] * b1 - d[1] * b0
        M[E_ROTATION, j] -= b0
        M[E_ROTATION + 1, j] -= b1
        M[E_ROTATION + 2, j] -= b2


@jit
def at_end(reading: float, limit: float) -> bool:
    """Whether a reading is clipped: at its range, give or take a hundredth."""
    return abs(abs(reading) - limit) < 0.01 * limit


@jit
def predict_covariance(m: FloatArray, R: FloatArray, imu: FloatArray, dt: float, s: Record) -> None:
    """P ← Φ P Φᵀ + Q, in place in the memory."""
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    firm = m[FIRM : FIRM + 4]
    T = np.empty((6, 3))
    for i in range(3):
        T[0, i], T[1, i] = m[VELOCITY + i], m[POSITION + i]
        for k in range(4):
            T[2 + k, i] = m[FEET + 3 * k + i]
    transition(P, T, firm, R, dt)
    # Φ (Φ P)ᵀ = Φ P Φᵀ, P being symmetric: the same sweep over contiguous rows again.
    for i in range(ERRORS):
        for j in range(i):
            P[i, j], P[j, i] = P[j, i], P[i, j]
    transition(P, T, firm, R, dt)

    # The rate's noise turns everything about the origin of W: G = (I, T_0 ×, T_1 ×, ...).
    G = np.zeros((7, 3, 3))
    for i in range(3):
        G[0, i, i] = 1.0
    for k in range(6):
        if k < 2 or firm[k - 2] > 0.5:
            x, y, z = T[k, 0], T[k, 1], T[k, 2]
            G[k + 1, 0, 1], G[k + 1, 0, 2] = -z, y
            G[k + 1, 1, 0], G[k + 1, 1, 2] = z, -x
            G[k + 1, 2, 0], G[k + 1, 2, 1] = -y, x
    L = G.reshape(21, 3)
    q = s.gyro_density**2 * dt
    for i in range(21):
        for j in range(21):
            P[i, j] += q * (L[i, 0] * L[j, 0] + L[i, 1] * L[j, 1] + L[i, 2] * L[j, 2])
    for i in range(3):
        P[E_VELOCITY + i, E_VELOCITY + i] += s.accel_density**2 * dt
        P[E_GYRO + i, E_GYRO + i] += s.gyro_walk**2 * dt
        P[E_ACCEL + i, E_ACCEL + i] += s.accel_walk**2 * dt
        # A reading at the end of its range hides how much there was beyond it.
        if at_end(imu[3 + i], s.accel_range):
            for k in range(3):
                P[E_VELOCITY + k, E_VELOCITY + k] += s.shock**2
        if at_end(imu[i], s.gyro_range):
            for k in range(3):
                P[E_ROTATION + k, E_ROTATION + k] += (s.gyro_range * dt) ** 2
        for k in range(4):
            if firm[k] > 0.5:
                n = E_FEET + 3 * k + i
                P[n, n] += s.foot_walk**2 * dt
    for i in range(ERRORS):
        for j in range(i):
            P[i, j] = P[j, i] = 0.5 * (P[i, j] + P[j, i])
