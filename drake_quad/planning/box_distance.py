"""Signed distance of points from a box, and of the lines between them, compiled."""

from math import sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray

FAR = 0.1  # [m]: of lines that are sure to keep that, their ends are told
ROUNDS = 12  # by a third each: to less than a hundredth of a line


@compiled
def from_box(p: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    """Distance of a point (3,) from a box in the same frame, inside negative [m]."""
    ax = max(lower[0] - p[0], p[0] - upper[0])
    ay = max(lower[1] - p[1], p[1] - upper[1])
    az = max(lower[2] - p[2], p[2] - upper[2])
    ox, oy, oz = max(ax, 0.0), max(ay, 0.0), max(az, 0.0)
    return sqrt(ox * ox + oy * oy + oz * oz) + min(max(ax, max(ay, az)), 0.0)


@compiled
def line_from_box(
    p: FloatArray, q: FloatArray, lower: FloatArray, upper: FloatArray, enough: float
) -> float:
    """Least distance of the line from p to q (3,) from a box, inside negative [m].

    The box is convex, and so is the distance along a line: its least is found by thirds. A line
    that is sure to keep `enough` [m] is told by its ends alone.
    """
    begin, end = from_box(p, lower, upper), from_box(q, lower, upper)
    best = min(begin, end)
    way = q - p
    if 0.5 * (begin + end - sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)) >= enough:
        return best
    low, high = 0.0, 1.0
    for _ in range(ROUNDS):
        third = (high - low) / 3.0
        a = from_box(p + (low + third) * way, lower, upper)
        b = from_box(p + (high - third) * way, lower, upper)
        best = min(best, min(a, b))
        if a < b:
            high -= third
        else:
            low += third
    return best


@compiled
def all_from_box(points: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Of rows of points (M, K, 3), then of the lines that join these: (M, 2 K - 1) [m]."""
    rows, count = points.shape[0], points.shape[1]
    found = np.empty((rows, 2 * count - 1))
    for i in range(rows):
        for j in range(count):
            found[i, j] = from_box(points[i, j], lower, upper)
        for j in range(count - 1):
            found[i, count + j] = line_from_box(points[i, j], points[i, j + 1], lower, upper, FAR)
    return found
