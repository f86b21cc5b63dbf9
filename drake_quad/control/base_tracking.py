"""The base's target, its error, and the acceleration that is wanted of it.

A clock that waits for a foot stops at once. A body that did so too would push its centre of
pressure beyond its feet; one that comes to rest over any fixed time does it where it is quick,
high or near an edge. Braked in proportion to its own speed, by the rate of a pendulum of its
height, it would keep the centre of pressure on its capture point, which is the least that stopping
needs (on a level, straight path; Pratt et al., "Capture Point: A Step toward Humanoid Push
Recovery", Humanoids 2006). Here it goes back from where it came to rest to where the clock stands,
too: the centre of pressure begins on the capture point, goes up to 8 % farther, and then comes
back. On the way the body is ahead of the clock by three quarters of the pendulum's time at most.
That may be more than `plan_body`'s guard: what the plan keeps beyond its switches is not relied on.

Where rises are higher than the map's, a flight is steeper than the body leans: on the way down the
legs in front have farther to go than in the plan, and a foot that searches for its tread may come
to its leg's end above it. Then the body goes down after it, as fast as a foot searches.
"""

from math import isnan, sqrt

import numpy as np

from drake_quad.common import GRAVITY, BoolArray, FloatArray
from drake_quad.control.kernel_state import BaseGains, Pace, Record
from drake_quad.jit import copy_vector, jit
from drake_quad.math.rotations import yaw_pitch_rotation
from drake_quad.robot.kinematics import leg_row


@jit
def base_target(
    body: FloatArray, rate: float, change: float, height: float, target: Record
) -> None:
    """Writes the base's part of a target: pose, R_WB, velocities and acceleration of a plan's body.

    Args:
        body: The plan's body (3, 5): value, and first and second derivative by gait time, of x, y,
            z, pitch, yaw.
        rate: Gait time that the body's path advances per unit of time, see `next_body_rate`.
        change: The rate's time derivative [1/s]. The acceleration leaves it, and the second
            derivative, out for the pitch.
        height: Height to add to z [m].
        target: Result, of the type TARGET; feet and loads are left as they are.
    """
    copy_vector(target.body, body[0])
    target.body[2] += height
    rows = yaw_pitch_rotation(body[0, 3], body[0, 4])
    for i in range(3):
        for j in range(3):
            target.R[i, j] = rows[i][j]
        target.v[i] = rate * body[1, i]
        target.acceleration[i] = 0.0
        target.acceleration[3 + i] = rate * rate * body[2, i] + change * body[1, i]
    pitch_rate, yaw_rate = rate * body[1, 3], rate * body[1, 4]
    target.w[0], target.w[1] = -np.sin(body[0, 4]) * pitch_rate, np.cos(body[0, 4]) * pitch_rate
    target.w[2] = yaw_rate
    target.acceleration[2] = rate * rate * body[2, 4] + change * body[1, 4]


@jit
def rotation_error(R_desired: FloatArray, R: FloatArray) -> FloatArray:
    """The rotation vector, in W, that takes `R` to `R_desired` (small angles) (3,) [rad]."""
    error = np.zeros(3)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for n in range(3):  # of R_desired R^T, less its transpose
            error[i] += 0.5 * (R_desired[k, n] * R[j, n] - R_desired[j, n] * R[k, n])
    return error


@jit
def shorten(v: FloatArray, most: float) -> FloatArray:
    """The vector, no longer than `most`."""
    length = np.sqrt(np.sum(v * v))
    return v * min(1.0, most / max(length, 1e-12))


@jit
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
        turn: Error of orientation, see `rotation_error` (3,) [rad].
        spin: Angular velocity desired less angular velocity (3,) [rad/s].
        gains: The gains.
    """
    wanted = acceleration.copy()
    turned, shifted = shorten(turn, gains.most_turn), shorten(shift, gains.most_shift)
    for i in range(3):
        wanted[i] += gains.rotation_stiffness * turned[i]
        wanted[i] += gains.rotation_damping * spin[i]
        wanted[3 + i] += gains.stiffness * shifted[i] + gains.damping * speed[i]
    copy_vector(wanted[3:5], shorten(wanted[3:5], gains.most_acceleration))
    return wanted


@jit
def smooth_step(x: float) -> float:
    """A cubic step from 0 at 0 to 1 at 1."""
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


LEAST_HEIGHT = 0.1  # [m] that a body over its feet is taken for: fallen, it has none
CATCH_UP = 2.0  # [1/s] of its lead by which the body is slower than a clock that runs


@jit
def pendulum_rate(height: float) -> float:
    """Of a point that is balanced at a height [m], as a linear inverted pendulum [1/s]."""
    return sqrt(GRAVITY / max(height, LEAST_HEIGHT))


@jit
def height_over(base: float, feet: FloatArray) -> float:
    """The base's height [m] over the mean of its feet (4, 3) in W [m].

    The base and not the centre of mass, and all feet: it changes little, and does not jump as a
    foot lifts off.
    """
    return base - 0.25 * (feet[0, 2] + feet[1, 2] + feet[2, 2] + feet[3, 2])


@jit
def next_body_rate(
    body_rate: float, lead: float, rate: float, pendulum: float, period: float
) -> tuple[float, float, float]:
    """Goes on a tick. Rates are gait time by time, without a unit: 1 is as planned.

    Under a clock that stands the body goes back to where that is as fast as it can without coming
    past it (critically damped); with one that runs it waits to be caught up.

    Args:
        body_rate: Rate at which the body goes along its path; nan before the first tick.
        lead: How far it is ahead of the clock [s].
        rate: The clock's rate, 0 to 1.
        pendulum: The pendulum's rate, see `pendulum_rate` [1/s].
        period: Control period [s].

    Returns:
        The body's rate and its lead [s] a tick later, and how fast the rate changes [1/s].
    """
    if isnan(body_rate):
        body_rate = rate
    # In between for a clock that creeps: it is no other than one that stands.
    back = rate * CATCH_UP + (1.0 - rate) * 0.25 * pendulum
    change = min(pendulum, 1.0 / period) * (rate - back * lead - body_rate)
    body_rate += change * period
    return body_rate, lead + (body_rate - rate) * period, change


MOST_LOWER = 0.06  # [m]; ground further down is no tread's error
STEPS = 3  # of Newton's method, which nearly ends in one: legs are long and shortages small
LEAST_SLOPE = 0.3  # of a leg's length by the body's height: less, and lowering hardly helps


@jit
def shortage(
    legs: FloatArray,
    longest: FloatArray,
    place: FloatArray,
    counts: BoolArray,
    p: FloatArray,
    R: FloatArray,
) -> float:
    """How much lower the body has to be so that these legs reach, MOST_LOWER at most [m].

    Args:
        legs: Leg lengths, see `leg_array`.
        longest: Longest legs, see `longest_legs` (4,) [m].
        place: Where the feet are to be in W (4, 3) [m].
        counts: Whose feet count (4,).
        p: The body's place in W (3,) [m].
        R: Its R_WB (3, 3).
    """
    lower = 0.0
    for k in range(4):
        if not counts[k]:
            continue
        c = leg_row(legs, k)
        for _ in range(STEPS):
            d0, d1, d2 = place[k, 0] - p[0], place[k, 1] - p[1], place[k, 2] - p[2] + lower
            x = R[0, 0] * d0 + R[1, 0] * d1 + R[2, 0] * d2 - c.x
            y = R[0, 1] * d0 + R[1, 1] * d1 + R[2, 1] * d2 - c.y
            z = R[0, 2] * d0 + R[1, 2] * d1 + R[2, 2] * d2 - c.z
            down = sqrt(max(y * y + z * z - c.offset * c.offset, 1e-12))
            below = down + c.raised
            length = sqrt(x * x + below * below)
            over = length - longest[k]
            if over <= 0.0:
                break
            along = (y * R[2, 1] + z * R[2, 2]) / down
            slope = -(x * R[2, 0] + below * along) / length
            lower += over / max(slope, LEAST_SLOPE)
    return min(lower, MOST_LOWER)


@jit
def next_lower(lower: float, wanted: float, pace: Pace) -> float:
    """How much lower the body is a tick later: down as fast as feet search, back by and by [m].

    Args:
        lower: How much lower it is now [m].
        wanted: How much lower it has to be, see `shortage` [m].
        pace: Times and speeds.
    """
    if wanted > lower:
        return min(wanted, lower + pace.search_speed * pace.period)
    return lower + min(pace.period / max(pace.height_time, pace.period), 1.0) * (wanted - lower)
