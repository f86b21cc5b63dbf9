"""The least room of a candidate's parts in one pose, each the less of what is told and found.

Most parts are far from what they might touch. A bound that costs little tells so: what surely is
no nearer than something else already was is not looked at, which changes no result.
"""

from math import sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.design.kernel_distance import (
    SHANK,
    THIGH,
    from_stairs,
    line_from_stairs,
    over_nosings,
)
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.box_distance import from_box, line_with_ends
from drake_quad.robot.shank_outline import ROOM_WORTH

SURE = 1e-9  # [m] by which a bound may be wrong, for rounding


@compiled
def leg_room(points: FloatArray, radii: FloatArray, rise: float, run: float, least: float) -> float:
    """Between a shank's points (SHANK, 3), with the lines between them, and the stairs [m].

    Args:
        points: In W [m].
        radii: At the points (SHANK,) [m].
        rise: Of the staircase [m].
        run: Of the staircase [m].
        least: What there is elsewhere [m], weighed by ROOM_WORTH as this is.
    """
    before = 0.0
    for i in range(SHANK):
        x, z, radius, worth = points[i, 0], points[i, 2], radii[i], ROOM_WORTH[i]
        bound = min(over_nosings(x, z, rise, run), run) - SURE
        if (bound - radius) * worth < least:
            least = min(least, (from_stairs(x, z, rise, run) - radius) * worth)
        if i > 0:
            thick = min(radius, radii[i - 1])
            if (min(bound, before) - thick) * worth < least:
                line = line_from_stairs(points[i - 1], points[i], rise, run)
                least = min(least, (line - thick) * worth)
        before = bound
    return least


@compiled
def trunk_room(points: FloatArray, radii: FloatArray, boxes: FloatArray, least: float) -> float:
    """Between a shank's points (SHANK, 3) in B, with their lines, and the trunk [m].

    Args:
        points: In B [m].
        radii: At the points (SHANK,) [m].
        boxes: The trunk's: one about all the others, then those (1 + K, 2, 3) [m].
        least: What there is elsewhere [m].
    """
    low, high, widest = np.empty(3), np.empty(3), 0.0
    for axis in range(3):
        low[axis], high[axis] = points[0, axis], points[0, axis]
        for i in range(1, SHANK):
            low[axis], high[axis] = (
                min(low[axis], points[i, axis]),
                max(high[axis], points[i, axis]),
            )
    for i in range(SHANK):
        widest = max(widest, radii[i])
    for k in range(len(boxes)):
        lower, upper = boxes[k, 0], boxes[k, 1]
        square = 0.0
        for axis in range(3):
            out = max(max(lower[axis] - high[axis], low[axis] - upper[axis]), 0.0)
            square += out * out
        if square > 0.0 and sqrt(square) - SURE - widest >= least:
            if k == 0:
                return least  # no nearer to those within
            continue
        if k == 0:
            continue
        before = 0.0
        for i in range(SHANK):
            here = from_box(points[i], lower, upper)
            least = min(least, here - radii[i])
            if i > 0:
                thick = min(radii[i], radii[i - 1])
                line = line_with_ends(
                    points[i - 1], points[i], before, here, lower, upper, least + thick
                )
                least = min(least, line - thick)
            before = here
    return least


@compiled
def room_apart(
    front: FloatArray,
    rear: FloatArray,
    front_radii: FloatArray,
    rear_radii: FloatArray,
    least: float,
) -> float:
    """Between a front leg and the rear leg of its side, (SHANK + THIGH, 3) points in W each [m]."""
    low, high = np.inf, -np.inf
    for i in range(SHANK + THIGH):
        low = min(low, front[i, 0] - front_radii[i if i < SHANK else 0])
        high = max(high, rear[i, 0] + rear_radii[i if i < SHANK else 0])
    if low - high - SURE >= least:
        return least
    for i in range(SHANK + THIGH):
        for j in range(SHANK + THIGH):
            x, y = front[i, 0] - rear[j, 0], front[i, 1] - rear[j, 1]
            z = front[i, 2] - rear[j, 2]
            thick = front_radii[i if i < SHANK else 0] + rear_radii[j if j < SHANK else 0]
            least = min(least, sqrt(x * x + y * y + z * z) - thick)
    return least


@compiled
def room_under(points: FloatArray, rise: float, run: float, least: float) -> float:
    """Between points under the trunk (M, 3) in W, in a line, and the stairs, the line too [m]."""
    last = len(points) - 1
    bound = over_nosings(points[0, 0], points[0, 2], rise, run)
    bound = min(bound, over_nosings(points[last, 0], points[last, 2], rise, run))
    if min(bound, run) - SURE >= least:
        return least
    for i in range(len(points)):
        least = min(least, from_stairs(points[i, 0], points[i, 2], rise, run))
        if i > 0:
            least = min(least, line_from_stairs(points[i - 1], points[i], rise, run))
    return least
