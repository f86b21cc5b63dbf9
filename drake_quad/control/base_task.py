"""The base's part of a plan: pose, velocity, rotation error, and the acceleration wanted."""

from typing import NamedTuple

import numpy as np

from drake_quad.compiled import compiled, copy_vector
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.leg_scalar import yaw_pitch_rotation


class Target(NamedTuple):
    """What base and feet are to do now, in W.

    Attributes:
        body: x, y, z [m], pitch, yaw [rad].
        R: R_WB (3, 3).
        v: Velocity of B (3,) [m/s].
        w: Its angular velocity (3,) [rad/s].
        acceleration: Angular, then linear (6,) [rad/s^2, m/s^2].
        feet_acceleration: (4, 3) [m/s^2].
        load: How much each foot may carry, 0 to 1, (4,).
    """

    body: FloatArray
    R: FloatArray
    v: FloatArray
    w: FloatArray
    acceleration: FloatArray
    feet_acceleration: FloatArray
    load: FloatArray


@compiled
def body_motion(
    body: FloatArray, rate: float, change: float, height: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Pose, R_WB, velocity, angular velocity and acceleration of a plan's body, see Target.

    Args:
        body: (3, 5) value, and first and second derivative by gait time, of x, y, z, pitch, yaw.
        rate: By which the body goes along its path, gait time by time; see `body_rate.py`.
        change: Of that rate [1/s]. Of the pitch neither this nor its second derivative is
            in the acceleration.
        height: To add to z [m].
    """
    pose = body[0].copy()
    pose[2] += height
    rows = yaw_pitch_rotation(pose[3], pose[4])
    R = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            R[i, j] = rows[i][j]
    pitch_rate, yaw_rate = rate * body[1, 3], rate * body[1, 4]
    w = np.array([-np.sin(pose[4]) * pitch_rate, np.cos(pose[4]) * pitch_rate, yaw_rate])
    acceleration = np.zeros(6)
    acceleration[2] = rate * rate * body[2, 4] + change * body[1, 4]
    for i in range(3):
        acceleration[3 + i] = rate * rate * body[2, i] + change * body[1, i]
    return pose, R, rate * body[1, :3], w, acceleration


@compiled
def base_target(
    body: FloatArray,
    rate: float,
    change: float,
    height: float,
    feet_acceleration: FloatArray,
    load: FloatArray,
) -> Target:
    """The plan's body now, `height` [m] above the plan's own; see `body_motion`."""
    pose, R, v, w, acceleration = body_motion(body, rate, change, height)
    return Target(pose, R, v, w, acceleration, feet_acceleration, load)


@compiled
def rotation_error(R_desired: FloatArray, R: FloatArray) -> FloatArray:
    """The rotation vector, in W, that takes `R` to `R_desired` (small angles) (3,) [rad]."""
    error = np.zeros(3)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for n in range(3):  # of R_desired R^T, less its transpose
            error[i] += 0.5 * (R_desired[k, n] * R[j, n] - R_desired[j, n] * R[k, n])
    return error


@compiled
def shorten(v: FloatArray, most: float) -> FloatArray:
    """The vector, no longer than `most`."""
    length = np.sqrt(np.sum(v * v))
    return v * min(1.0, most / max(length, 1e-12))


class BaseGains(NamedTuple):
    """How the base's errors are corrected: accelerations per error, and the most of each.

    Attributes:
        stiffness: [1/s^2].
        damping: [1/s].
        rotation_stiffness: [1/s^2].
        rotation_damping: [1/s].
        most_shift: Of an error of place, how much counts [m].
        most_turn: Of an error of orientation [rad].
        most_acceleration: Horizontal, in all [m/s^2].
    """

    stiffness: float
    damping: float
    rotation_stiffness: float
    rotation_damping: float
    most_shift: float
    most_turn: float
    most_acceleration: float


@compiled
def wanted_acceleration(
    acceleration: FloatArray,
    shift: FloatArray,
    speed: FloatArray,
    turn: FloatArray,
    spin: FloatArray,
    gains: BaseGains,
) -> FloatArray:
    """The base's acceleration that follows the plan and corrects its errors (6,), angular first.

    Args:
        acceleration: The plan's (6,).
        shift: Place desired less place (3,) [m].
        speed: Velocity desired less velocity (3,) [m/s].
        turn: See `rotation_error` (3,) [rad].
        spin: Angular velocity desired less angular velocity (3,) [rad/s].
        gains: See BaseGains.
    """
    wanted = acceleration.copy()
    turned, shifted = shorten(turn, gains.most_turn), shorten(shift, gains.most_shift)
    for i in range(3):
        wanted[i] += gains.rotation_stiffness * turned[i]
        wanted[i] += gains.rotation_damping * spin[i]
        wanted[3 + i] += gains.stiffness * shifted[i] + gains.damping * speed[i]
    copy_vector(wanted[3:5], shorten(wanted[3:5], gains.most_acceleration))
    return wanted


def smooth(x: float) -> float:
    """A cubic step from 0 at 0 to 1 at 1."""
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


smooth_step = compiled(smooth)
