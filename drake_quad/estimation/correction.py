"""Corrects the estimate by the feet that stand: gating, slip, Kalman update.

Hartley et al. 2020, section 5.2: in right-invariant errors a standing foot's innovation is
ξ_p - ξ_d plus noise, whatever the state, so that H is constant and P Hᵀ a difference of columns.
The noise is taken as alike in all directions, so the three components go in one at a time.

A foot is a sphere. While it bears, its lowest point rests and its centre goes with the shank's
rotation: a turn θ of the shank in W rolls the centre by θ × r n, n being the ground's normal, taken
as W's z (treads are level). Left out, that is some per cent of the foot's radius over the stride.
"""

from math import cos, sin, sqrt

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.estimation.filter_state import (
    ACCEL_BIAS,
    ANGLES,
    BORNE,
    CAMERA,
    COVARIANCE,
    E_ACCEL,
    E_CAMERA,
    E_FEET,
    E_GYRO,
    E_POSITION,
    E_VELOCITY,
    ERRORS,
    FEET,
    FIRM,
    GONE,
    GYRO_BIAS,
    POSITION,
    RATE,
    ROTATION,
    SLIP,
    VELOCITY,
    Record,
)
from drake_quad.jit import copy_matrix, copy_vector, jit
from drake_quad.math.rotations import left_jacobian, multiply, normalize, rotation_exp
from drake_quad.robot.kinematics import foot_and_jacobian, leg_row


@jit
def innovation(m: FloatArray, p_BF: FloatArray, k: int) -> FloatArray:
    """Where leg k's joints have its foot, less where the filter does, in W (3,) [m]."""
    y = np.empty(3)
    for i in range(3):
        y[i] = m[POSITION + i] + turned(m, p_BF[k], i) - m[FEET + 3 * k + i]
    return y


@jit
def turned(m: FloatArray, v_B: FloatArray, i: int) -> float:
    """Component `i` in W of a vector (3,) given in B."""
    r = m[ROTATION + 3 * i : ROTATION + 3 * i + 3]
    return r[0] * v_B[0] + r[1] * v_B[1] + r[2] * v_B[2]


@jit
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


@jit
def correct(m: FloatArray, p_BF: FloatArray, bears: Record, s: Record) -> FloatArray:
    """Corrects the memory by the firm feet that bear now; returns (4,) 1 where one was gated.

    A gated foot is left out: against the IMU and the other feet it has slipped.

    Args:
        m: The filter's memory.
        p_BF: Feet's centres in B by the joints, (4, 3) [m].
        bears: (4,) 1 where a foot bears.
        s: The settings, a record of the type SETTINGS.
    """
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    noise = s.foot_noise**2
    gated = np.zeros(4)
    Y = np.zeros((4, 3))
    for k in range(4):
        if m[FIRM + k] > 0.5 and bears[k] > 0.5:
            copy_vector(Y[k], innovation(m, p_BF, k))
            if not distance(m, Y[k], k, noise) <= s.gate:
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


@jit
def retract(m: FloatArray, delta: FloatArray) -> None:
    """X ← exp(-δ) X: takes the estimated error `delta` (ERRORS,) out of the state, in place."""
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
        m[CAMERA + i] -= delta[E_CAMERA + i]


@jit
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


@jit
def feet_in_body(legs: Record, joints: Record, p: FloatArray, v: FloatArray) -> None:
    """Writes the feet's centres `p` (4, 3) [m] and velocities `v` (4, 3) [m/s] in B.

    Args:
        legs: Lengths of the legs (4, 8), see `robot.kinematics.leg_array`.
        joints: Joint angles [rad], then joint speeds [rad/s], leg by leg (24,).
        p: Result: centres.
        v: Result: velocities.
    """
    for k in range(4):
        i = 3 * k
        foot, J = foot_and_jacobian(leg_row(legs, k), joints[i], joints[i + 1], joints[i + 2])
        p[k, 0], p[k, 1], p[k, 2] = foot
        d0, d1, d2 = joints[12 + i], joints[13 + i], joints[14 + i]
        v[k, 0] = J[0][0] * d0 + J[0][1] * d1 + J[0][2] * d2
        v[k, 1] = J[1][0] * d0 + J[1][1] * d1 + J[1][2] * d2
        v[k, 2] = J[2][0] * d0 + J[2][1] * d1 + J[2][2] * d2


@jit
def roll(m: FloatArray, gyro: FloatArray, joints: Record, dt: float, radius: float) -> None:
    """Moves the firm feet on as their shanks turned since the last good tick.

    Args:
        m: The memory, its angles those of the last good tick.
        gyro: The base's rate in B, its bias taken off (3,) [rad/s].
        joints: (24,) as measured now.
        dt: The period [s].
        radius: Radius of the feet [m].
    """
    for k in range(4):
        if m[FIRM + k] < 0.5:
            continue
        i = 3 * k
        a = 0.5 * (joints[i] + m[ANGLES + i])
        bend = (joints[i + 1] - m[ANGLES + i + 1]) + (joints[i + 2] - m[ANGLES + i + 2])
        # The shank's turn in B: abduction about x, hip and knee about the y that it has turned.
        tx = dt * gyro[0] + (joints[i] - m[ANGLES + i])
        ty = dt * gyro[1] + cos(a) * bend
        tz = dt * gyro[2] + sin(a) * bend
        x = m[ROTATION] * tx + m[ROTATION + 1] * ty + m[ROTATION + 2] * tz
        y = m[ROTATION + 3] * tx + m[ROTATION + 4] * ty + m[ROTATION + 5] * tz
        m[FEET + i] += radius * y
        m[FEET + i + 1] -= radius * x


@jit
def let_go(m: FloatArray, k: int) -> None:
    """Leg k's foot is held fixed no longer."""
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    m[FIRM + k] = 0.0
    m[BORNE + k] = 0.0
    for i in range(E_FEET + 3 * k, E_FEET + 3 * k + 3):
        for j in range(ERRORS):
            P[i, j] = P[j, i] = 0.0


@jit
def hold(m: FloatArray, p_BF: FloatArray, k: int, s: Record) -> None:
    """Leg k's foot is fixed from now on where the joints have it.

    In right-invariant errors ξ_d = ξ_p + noise: the foot's rows are the base's position's.
    """
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    m[FIRM + k], m[SLIP + k] = 1.0, 0.0
    for i in range(3):
        m[FEET + 3 * k + i] = m[POSITION + i] + turned(m, p_BF[k], i)
        d = E_FEET + 3 * k + i
        for j in range(ERRORS):
            P[d, j] = P[E_POSITION + i, j]
    for i in range(3):
        d = E_FEET + 3 * k + i
        for j in range(ERRORS):
            P[j, d] = P[j, E_POSITION + i]
        P[d, d] += s.foot_noise**2
        if i == 2:
            P[d, d] += s.foot_sink**2


@jit
def track_contacts(
    m: FloatArray, p_BF: FloatArray, v_BF: FloatArray, bears: Record, dt: float, s: Record
) -> None:
    """Lets go of feet that have left the ground, and holds those that have settled on it."""
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    firm = m[FIRM] + m[FIRM + 1] + m[FIRM + 2] + m[FIRM + 3]
    bearing = 0
    variance = max(P[E_VELOCITY, E_VELOCITY], P[E_VELOCITY + 1, E_VELOCITY + 1])
    # Three sigma of the base's velocity: one that is not known is no judge of a foot's.
    still = s.still_speed + 3.0 * sqrt(max(variance, P[E_VELOCITY + 2, E_VELOCITY + 2]))
    for k in range(4):
        if bears[k] > 0.5:
            bearing += 1
            m[GONE + k] = 0.0
            if m[FIRM + k] < 0.5 and foot_speed(m, p_BF, v_BF, k) > still:
                m[BORNE + k] = 0.0
            else:
                m[BORNE + k] += dt
        else:
            m[GONE + k] += dt
            if m[GONE + k] > s.release_time:
                m[BORNE + k], m[SLIP + k] = 0.0, 0.0
                if m[FIRM + k] > 0.5:
                    let_go(m, k)
    for k in range(4):
        if m[FIRM + k] < 0.5 and bears[k] > 0.5 and m[BORNE + k] > s.settle_time:
            hold(m, p_BF, k, s)
    if bearing >= 2 and firm < 0.5:
        # Feet bear and all seem to slide: as time passes, the likelier that the base is wrong.
        for i in range(3):
            P[E_VELOCITY + i, E_VELOCITY + i] += s.doubt**2 * dt


@jit
def foot_speed(m: FloatArray, p_BF: FloatArray, v_BF: FloatArray, k: int) -> float:
    """Speed of leg k's foot in W [m/s], by the joints' speeds."""
    r, v = np.empty(3), np.empty(3)
    for i in range(3):
        r[i] = turned(m, p_BF[k], i)
        v[i] = m[VELOCITY + i] + turned(m, v_BF[k], i)
    w = m[RATE : RATE + 3]
    x = v[0] + w[1] * r[2] - w[2] * r[1]
    y = v[1] + w[2] * r[0] - w[0] * r[2]
    z = v[2] + w[0] * r[1] - w[1] * r[0]
    return sqrt(x * x + y * y + z * z)
