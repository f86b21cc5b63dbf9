"""How much lower the body has to be for its legs to reach the ground that was found.

Where rises are higher than the map's, a flight is steeper than the body leans: on the way down the
legs in front have farther to go than in the plan, and a foot that searches for its tread may come
to its leg's end above it. Then the body goes down after it, as fast as a foot searches.
"""

from math import sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.control.pace import Pace
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.robot.leg_kinematics import LegGeometry
from drake_quad.robot.leg_scalar import leg_row

MOST_LOWER = 0.06  # [m]; ground further down is no tread's error
STEPS = 3  # of Newton's method, which nearly ends in one: legs are long and shortages small
LEAST_SLOPE = 0.3  # of a leg's length by the body's height: less, and lowering hardly helps


def longest_legs(geometry: LegGeometry, q_lower: FloatArray, q_upper: FloatArray) -> FloatArray:
    """From hip to foot's centre, the knee as straight as its limits let it be (4,) [m].

    Args:
        geometry: Of the legs.
        q_lower: Of the joints, leg by leg (12,) [rad].
        q_upper: The same.
    """
    least = np.maximum(np.maximum(q_lower[2::3], -q_upper[2::3]), 0.0)  # |knee|
    a, b = geometry.thigh, geometry.shank
    return np.asarray(np.sqrt(a * a + b * b + 2.0 * a * b * np.cos(least)))


@compiled
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
        legs: See `leg_array`.
        longest: See `longest_legs`.
        place: Where the feet are to be in W (4, 3) [m].
        counts: Whose feet count (4,).
        p: Of the body in W (3,) [m].
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


@compiled
def next_lower(lower: float, wanted: float, pace: Pace) -> float:
    """How much lower the body is a tick later: down as fast as feet search, back by and by [m].

    Args:
        lower: How much it is [m].
        wanted: See `shortage` [m].
        pace: Times and speeds.
    """
    if wanted > lower:
        return min(wanted, lower + pace.search_speed * pace.period)
    return lower + min(pace.period / max(pace.height_time, pace.period), 1.0) * (wanted - lower)
