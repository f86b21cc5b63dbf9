"""One tick of the contact-aided invariant filter: what a robot's sensors say becomes its state."""

from math import atan2, isfinite, sqrt

import numpy as np

from drake_quad.compiled import compiled, copy_matrix, copy_vector
from drake_quad.estimation.correct import correct
from drake_quad.estimation.feet import feet_in_body, let_go, roll, track_contacts
from drake_quad.estimation.level import level_start
from drake_quad.estimation.memory import (
    ACCEL_BIAS,
    ANGLES,
    COVARIANCE,
    E_ROTATION,
    E_VELOCITY,
    ERRORS,
    GYRO_BIAS,
    ROTATION,
    SLIP,
    STARTED,
)
from drake_quad.estimation.predict import predict
from drake_quad.estimation.rotation import multiply, rotation_exp
from drake_quad.estimation.settings import LOST_VELOCITY, SHOCK
from drake_quad.gait.legs import FloatArray

# Beyond these a reading is a fault, not a motion; the filter's own numbers stay far from overflow.
RATE_LIMIT, FORCE_LIMIT, ANGLE_LIMIT, SPEED_LIMIT = 100.0, 5000.0, 100.0, 1000.0


@compiled
def sound(values: FloatArray, first: float, second: float) -> bool:
    """Whether all of `values` are finite, the first half within `first`, the rest in `second`."""
    half = len(values) // 2
    for i in range(len(values)):
        if not isfinite(values[i]) or abs(values[i]) > (first if i < half else second):
            return False
    return True


@compiled
def step(
    m: FloatArray,
    imu: FloatArray,
    joints: FloatArray,
    contacts: FloatArray,
    legs: FloatArray,
    radius: float,
    dt: float,
    s: FloatArray,
) -> bool:
    """One tick, in place in the memory `m`; returns whether the estimate is healthy.

    A reading that is not sound is left out: without the IMU the last estimate holds and grows
    uncertain, without the joints the IMU alone carries on, without the contacts likewise.

    Args:
        m: The memory (SIZE,).
        imu: Mean rate [rad/s] and specific force [m/s^2] in B since the last tick, (6,).
        joints: Angles [rad], then speeds [rad/s], leg by leg, (24,).
        contacts: (4,) 1 where a foot bears.
        legs: (4, 8) as `feet_in_body` takes them.
        radius: Of the feet [m].
        dt: The period [s].
        s: The settings.
    """
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    imu_sound = sound(imu, RATE_LIMIT, FORCE_LIMIT)
    joints_sound = sound(joints, ANGLE_LIMIT, SPEED_LIMIT)
    contacts_sound = sound(contacts, 2.0, 2.0)
    if not imu_sound:
        for i in range(3):
            P[E_VELOCITY + i, E_VELOCITY + i] += (20.0 * s[SHOCK] * dt) ** 2
            P[E_ROTATION + i, E_ROTATION + i] += dt**2
        return False
    if m[STARTED] < 0.5:
        if not joints_sound:
            return False
        start(m, imu, joints)
    else:
        predict(m, imu, dt, s)
    if joints_sound:
        gyro = imu[:3] - m[GYRO_BIAS : GYRO_BIAS + 3]
        roll(m, gyro, joints, dt, radius)
        copy_vector(m[ANGLES : ANGLES + 12], joints[:12])
        if contacts_sound:
            p_BF, v_BF = np.empty((4, 3)), np.empty((4, 3))
            feet_in_body(legs, joints, p_BF, v_BF)
            track_contacts(m, p_BF, v_BF, contacts, dt, s)
            level_start(m, s)
            gated = correct(m, p_BF, contacts, s)
            for k in range(4):
                if gated[k] > 0.5:
                    let_go(m, k)
                    m[SLIP + k] = 1.0
    variance = 0.0
    for i in range(3):
        variance = max(variance, P[E_VELOCITY + i, E_VELOCITY + i])
    return joints_sound and contacts_sound and sqrt(variance) < s[LOST_VELOCITY]


@compiled
def start(m: FloatArray, imu: FloatArray, joints: FloatArray) -> None:
    """Takes roll and pitch from the first specific force; place and heading stay as given.

    A tilt that the force cannot show (a robot in free fall) stays as given too.
    """
    x, y, z = imu[3] - m[ACCEL_BIAS], imu[4] - m[ACCEL_BIAS + 1], imu[5] - m[ACCEL_BIAS + 2]
    if x * x + y * y + z * z > 1.0:
        yaw = atan2(m[ROTATION + 3], m[ROTATION])
        pitch, roll_angle = atan2(-x, sqrt(y * y + z * z)), atan2(y, z)
        R = m[ROTATION : ROTATION + 9].reshape(3, 3)
        level = multiply(rotation_exp(0.0, pitch, 0.0), rotation_exp(roll_angle, 0.0, 0.0))
        copy_matrix(R, multiply(rotation_exp(0.0, 0.0, yaw), level))
    copy_vector(m[ANGLES : ANGLES + 12], joints[:12])
    m[STARTED] = 1.0
