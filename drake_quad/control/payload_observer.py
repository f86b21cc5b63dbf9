"""Estimates a payload that the robot's model lacks: how heavy it is, and where.

It is learned from the errors that it makes in the base's pose: the integral of
the base's height and tilt errors is, once those are gone, the wrench that the load needs. It is
kept in the heading frame H (B's origin, x along the heading, z up), in which the load stays put.
"""

from math import cos, hypot, sin

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.control.kernel_state import PayloadUpdate
from drake_quad.jit import jit

# Errors of the base beyond which it is being pushed, and nothing can be learned about its load.
REST_SPEED = 0.06  # [m/s]
REST_TILT = 0.06  # [rad]
REST_SPIN = 0.15  # [rad/s]
MOST_FORCE = 0.6  # of the robot's weight
MOST_ARM = 0.25  # [m] times the robot's weight: of the moment
IGNORED = 0.005  # [m] of the centre of mass, which errors of other kinds make as well
MOST_SHIFT = 0.12  # [m] of the body


@jit
def at_rest(speed: FloatArray, tilt: FloatArray, spin: FloatArray) -> bool:
    """Whether the base follows its plan well enough to learn from how it does not.

    Args:
        speed: Error of the velocity (3,) [m/s].
        tilt: Error of the orientation (3,) [rad].
        spin: Error of the angular velocity (3,) [rad/s].
    """
    return bool(
        np.sum(speed * speed) < REST_SPEED**2
        and np.sum(tilt * tilt) < REST_TILT**2
        and np.sum(spin * spin) < REST_SPIN**2
    )


@jit
def update_payload(
    payload: FloatArray, height_error: float, tilt: FloatArray, heading: float, how: PayloadUpdate
) -> FloatArray:
    """The wrench that the load needs, a period later.

    Args:
        payload: Force upwards [N] and moments about x and y of H [Nm], (3,).
        height_error: How much too low the base is [m].
        tilt: The rotation vector in W that would right the base (3,) [rad].
        heading: Heading of the body [rad].
        how: The observer's gains.
    """
    c, s = cos(heading), sin(heading)
    x, y = c * tilt[0] + s * tilt[1], c * tilt[1] - s * tilt[0]
    force = payload[0] + how.force_rate * how.period * height_error
    moment_x = payload[1] + how.moment_rate * how.period * x
    moment_y = payload[2] + how.moment_rate * how.period * y
    most = MOST_ARM * how.weight
    return np.array(
        [
            min(max(force, -MOST_FORCE * how.weight), MOST_FORCE * how.weight),
            min(max(moment_x, -most), most),
            min(max(moment_y, -most), most),
        ]
    )


@jit
def payload_wrench(payload: FloatArray, heading: float) -> FloatArray:
    """The load's part of the base's bias terms: moment about B, then force, in W, (6,)."""
    c, s = cos(heading), sin(heading)
    force, x, y = payload[0], payload[1], payload[2]
    return np.array([c * x - s * y, s * x + c * y, 0.0, 0.0, 0.0, force])


@jit
def payload_com_shift(
    payload: FloatArray, p_BScm: FloatArray, heading: float, weight: float
) -> FloatArray:
    """How far the whole's centre of mass is from the model's, in W (2,) [m].

    Args:
        payload: The payload's wrench, see `update_payload`.
        p_BScm: Position of the model's centre of mass from B's origin, in W, (2,) at least [m].
        heading: Heading of the body [rad].
        weight: Robot weight without the payload [N].
    """
    c, s = cos(heading), sin(heading)
    force, x, y = payload[0], payload[1], payload[2]
    # What lies ahead needs a moment that tips the base back, -y; to the left, one about +x.
    arm = np.array([c * -y - s * x, s * -y + c * x])
    shift = (arm - force * p_BScm[:2]) / (weight + force)
    length = hypot(shift[0], shift[1])
    return shift * max(0.0, 1.0 - IGNORED / max(length, 1e-9))


@jit
def compensating_shift(shift: FloatArray, gain: float) -> FloatArray:
    """How far the body is to stand aside for a centre of mass `shift` (2,) from its place [m]."""
    wanted = -shift / gain
    return wanted * min(1.0, MOST_SHIFT / max(hypot(wanted[0], wanted[1]), 1e-9))
