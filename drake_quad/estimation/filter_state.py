"""What the filter remembers between ticks: one flat vector, and where what is in it.

One vector of floats is what a Context can hold and what a compiled kernel takes in one piece.
Errors of the covariance are in the order orientation, velocity, position, feet FL, FR, RL, RR,
gyroscope bias, accelerometer bias: three each, all but the biases in W.
"""

from math import cos, sin

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.estimation.settings import EstimatorSettings

# Places in the memory.
ROTATION = 0  # R_WB by rows (9)
VELOCITY = 9  # v_WB (3) [m/s]
POSITION = 12  # p_WB (3) [m]
FEET = 15  # where the feet's centres stand in W, by leg (12) [m]; of firm feet alone
GYRO_BIAS = 27  # in B (3) [rad/s]
ACCEL_BIAS = 30  # in B (3) [m/s^2]
ANGLES = 33  # joint angles of the last good tick (12) [rad]
BORNE = 45  # how long each foot has borne (4) [s]
GONE = 49  # how long since each foot bore (4) [s]
FIRM = 53  # 1 for each foot that the filter holds fixed (4)
SLIP = 57  # 1 for each foot that slipped and has not been firm since (4)
STARTED = 61  # 1 once the first good tick has been
RATE = 62  # w_WB of the last good tick (3) [rad/s]
LEVELLED = 65  # 1 once the feet have been taken to stand on level ground
COVARIANCE = 66  # by rows (27 x 27)

ERRORS = 27
SIZE = COVARIANCE + ERRORS * ERRORS

# Places of the errors in the covariance.
E_ROTATION, E_VELOCITY, E_POSITION, E_FEET, E_GYRO, E_ACCEL = 0, 3, 6, 9, 21, 24


def initial_memory(
    settings: EstimatorSettings, p_WB: FloatArray, yaw: float, pitch: float, q: FloatArray
) -> FloatArray:
    """The memory (SIZE,) of a robot that is put at a known place and has not felt anything yet.

    Args:
        settings: How well the place is known.
        p_WB: Where the robot is put, (3,) [m].
        yaw: Which way it looks [rad].
        pitch: How it leans forward [rad]; the first specific force says better.
        q: Joint angles, (12,) [rad].
    """
    m = np.zeros(SIZE)
    cy, sy, cp, sp = cos(yaw), sin(yaw), cos(pitch), sin(pitch)
    m[ROTATION : ROTATION + 9] = [cy * cp, -sy, cy * sp, sy * cp, cy, sy * sp, -sp, 0.0, cp]
    m[POSITION : POSITION + 3] = p_WB
    m[ANGLES : ANGLES + 12] = q
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    # Right-invariant errors: p's is δp + p × δθ, so a tilt about the base's own place moves both.
    x, y, z = p_WB
    L = np.vstack(
        [np.eye(3), np.zeros((3, 3)), np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])]
    )
    s = settings
    tilt, heading = s.initial_tilt**2, s.initial_yaw**2
    P[:9, :9] = L @ np.diag([tilt, tilt, heading]) @ L.T
    for at, deviation in (
        (E_VELOCITY, s.initial_velocity),
        (E_POSITION, s.initial_position),
        (E_GYRO, s.initial_gyro_bias),
        (E_ACCEL, s.initial_accel_bias),
    ):
        P[range(at, at + 3), range(at, at + 3)] += deviation**2
    return m
