"""How well the feet hold the robot, compiled: the margin of `gait/support.py` for four feet."""

from math import inf, sqrt

import numpy as np

from drake_quad.compiled import compiled, copy_vector
from drake_quad.gait.legs import BoolArray, FloatArray

NO_LENGTH = 1e-150  # [m]; below it squares underflow
BEARING = 0.5  # above it a foot bears
LEAST_WEIGHT = 1.0  # [N] on the feet for there to be a centre of pressure


@compiled
def margin_over(x: float, y: float, feet: FloatArray, standing: BoolArray) -> float:
    """The signed static margin of (x, y) over the standing feet [m]; -inf over none.

    The rule is that of `stability_margins`, and a test holds the two equal.

    Args:
        x: Of the projected centre of mass [m].
        y: The same.
        feet: (4, 3) in the same frame; of height there is no need.
        standing: (4,).
    """
    margin, count = inf, 0
    rx, ry = np.empty(4), np.empty(4)
    for k in range(4):
        if standing[k]:
            rx[count], ry[count] = feet[k, 0] - x, feet[k, 1] - y
            count += 1
    for i in range(count):
        for j in range(i):
            high, low = _extent(rx, ry, count, ry[i] - ry[j], rx[j] - rx[i])
            margin = min(margin, high, -low)
        high, _ = _extent(rx, ry, count, -rx[i], -ry[i])
        margin = min(margin, high)
    return margin if count > 0 else -inf


@compiled
def _extent(x: FloatArray, y: FloatArray, count: int, ux: float, uy: float) -> tuple[float, float]:
    """How far points reach along a direction, at most and at least; +x if it has no length."""
    norm = sqrt(ux * ux + uy * uy)
    if norm < NO_LENGTH:
        ux, uy, norm = 1.0, 0.0, 1.0
    high, low = -inf, inf
    for k in range(count):
        along = (x[k] * ux + y[k] * uy) / norm
        high, low = max(high, along), min(low, along)
    return high, low


@compiled
def judge(
    com: FloatArray,
    bearing: FloatArray,
    place: FloatArray,
    force: FloatArray,
    none: float,
    margin: FloatArray,
    zmp_margin: FloatArray,
) -> float:
    """Margins of the centre of mass and of the centre of pressure; returns the ground's height.

    Args:
        com: The robot's centre of mass in W (3,) [m].
        bearing: 1 where a foot bears (4,).
        place: Where the feet's forces act in W (12,) [m].
        force: The forces on the feet in W (12,) [N].
        none: What a margin is where there is none.
        margin: Result (1,) [m].
        zmp_margin: Result (1,) [m].

    Returns:
        The lowest foot's height in W [m] of those that bear; where none does, of all.
    """
    feet, standing = place.reshape(4, 3), np.empty(4, dtype=np.bool_)
    lowest, lowest_bearing = inf, inf
    x, y, total = 0.0, 0.0, 0.0
    for k in range(4):
        standing[k] = bearing[k] > BEARING
        lowest = min(lowest, feet[k, 2])
        if standing[k]:
            lowest_bearing = min(lowest_bearing, feet[k, 2])
        load = force[3 * k + 2]
        x, y, total = x + load * feet[k, 0], y + load * feet[k, 1], total + load
    found = margin_over(com[0], com[1], feet, standing)
    margin[0] = found if np.isfinite(found) else none
    zmp_margin[0] = none
    if total > LEAST_WEIGHT:
        found = margin_over(x / total, y / total, feet, standing)
        zmp_margin[0] = found if np.isfinite(found) else none
    return lowest_bearing if np.isfinite(lowest_bearing) else lowest


@compiled
def watch(
    state: FloatArray,
    base: int,
    com: FloatArray,
    bearing: FloatArray,
    place: FloatArray,
    force: FloatArray,
    none: float,
    counts: bool,
    period: float,
    tilt: float,
    height: float,
    margin: FloatArray,
    zmp_margin: FloatArray,
    com_position: FloatArray,
    recent: FloatArray,
    least: FloatArray,
    fallen: FloatArray,
) -> float:
    """A tick of the stability monitor: margins, the least of late, and whether the robot is down.

    Args:
        state: The robot's [q; v].
        base: Index of the base's quaternion in it; its position follows.
        com: The robot's centre of mass in W (3,) [m].
        bearing: See `judge`, as place, force, none, margin and zmp_margin.
        place: See above.
        force: See above.
        none: See above.
        counts: Whether the margins count towards the least, which they do once contacts are known.
        period: Time since the tick before [s].
        tilt: Cosine of the trunk's tilt beyond which it counts as fallen.
        height: Height of the base over the ground below which it counts as down [m].
        margin: Result (1,) [m].
        zmp_margin: Result (1,) [m].
        com_position: Result: `com` (3,) [m].
        recent: Both margins of the last ticks, the oldest first (2 n,) [m]; goes on a tick.
        least: Result: the least of these (2,) [m].
        fallen: For how long the trunk has been tilted, and down (2,) [s]; goes on a tick.

    Returns:
        The cosine of the trunk's tilt.
    """
    ground = judge(com, bearing, place, force, none, margin, zmp_margin)
    copy_vector(com_position, com)
    if counts:
        n = len(recent)
        for i in range(n - 2):
            recent[i] = recent[i + 2]
        recent[n - 2], recent[n - 1] = margin[0], zmp_margin[0]
        for k in range(2):
            least[k] = inf
            for i in range(k, n, 2):
                least[k] = min(least[k], recent[i])
    w, x, y, z = state[base], state[base + 1], state[base + 2], state[base + 3]
    # R_WB's lower right entry, straight from the quaternion.
    upright = 1.0 - 2.0 * (x * x + y * y) / (w * w + x * x + y * y + z * z)
    # Where no foot bears, where they bore last: a collapsed robot may lie on its knees.
    fallen[0] = fallen[0] + period if upright < tilt else 0.0
    fallen[1] = fallen[1] + period if state[base + 6] - ground < height else 0.0
    return upright
