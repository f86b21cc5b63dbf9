"""Signed distance of points from boxes, and of the lines between them, compiled."""

from math import sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray

ROUNDS = 12  # of golden sections: to less than a hundredth of a line
GOLDEN = 0.5 * (sqrt(5.0) - 1.0)


@compiled
def from_box(p: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    """Distance of a point (3,) from a box in the same frame, inside negative [m]."""
    ax = max(lower[0] - p[0], p[0] - upper[0])
    ay = max(lower[1] - p[1], p[1] - upper[1])
    az = max(lower[2] - p[2], p[2] - upper[2])
    ox, oy, oz = max(ax, 0.0), max(ay, 0.0), max(az, 0.0)
    return sqrt(ox * ox + oy * oy + oz * oz) + min(max(ax, max(ay, az)), 0.0)


@compiled
def _between(
    p: FloatArray, q: FloatArray, share: float, lower: FloatArray, upper: FloatArray
) -> float:
    """The same of a point on the way from p to q; without arrays, which cost most of it."""
    x = p[0] + share * (q[0] - p[0])
    y = p[1] + share * (q[1] - p[1])
    z = p[2] + share * (q[2] - p[2])
    ax = max(lower[0] - x, x - upper[0])
    ay = max(lower[1] - y, y - upper[1])
    az = max(lower[2] - z, z - upper[2])
    ox, oy, oz = max(ax, 0.0), max(ay, 0.0), max(az, 0.0)
    return sqrt(ox * ox + oy * oy + oz * oz) + min(max(ax, max(ay, az)), 0.0)


@compiled
def line_with_ends(
    p: FloatArray, q: FloatArray, at_low: float, at_high: float,
    lower: FloatArray, upper: FloatArray, enough: float,
) -> float:  # fmt: skip
    """Least distance of the line from p to q (3,) from a box, inside negative [m].

    The box is convex, and so is the distance along a line: its least is found by golden sections.
    Of ends that are known to be so far away; a line that is sure to keep `enough` [m] is told by
    them alone.
    """
    best = min(at_low, at_high)
    x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    length = sqrt(x * x + y * y + z * z)
    if 0.5 * (at_low + at_high - length) >= min(best, enough):
        return best
    low, high = 0.0, 1.0
    first, second = 1.0 - GOLDEN, GOLDEN
    a, b = _between(p, q, first, lower, upper), _between(p, q, second, lower, upper)
    for _ in range(ROUNDS):
        best = min(best, min(a, b))
        if a < b:
            high, at_high, second, b = second, b, first, a
            first = high - GOLDEN * (high - low)
            a = _between(p, q, first, lower, upper)
        else:
            low, at_low, first, a = first, a, second, b
            second = low + GOLDEN * (high - low)
            b = _between(p, q, second, lower, upper)
        # No place changes by more than one is away from it.
        if 0.5 * (at_low + at_high - length * (high - low)) >= min(best, enough):
            break
    return min(best, min(a, b))


@compiled
def from_boxes(points: FloatArray, boxes: FloatArray, enough: float) -> FloatArray:
    """Least distances from boxes (B, 2, 3), inside negative, of those below `enough` [m].

    Of rows of points (M, K, 3), then of the lines that join these: (M, 2 K - 1). What is farther
    off than `enough` is told to be no nearer than that, without how far it is.
    """
    rows, count = points.shape[0], points.shape[1]
    found = np.empty((rows, 2 * count - 1))
    low, high, here = np.empty(3), np.empty(3), np.empty(count)
    for i in range(rows):
        row, p = found[i], points[i]
        row[:] = np.inf
        for axis in range(3):
            low[axis], high[axis] = p[0, axis], p[0, axis]
            for j in range(1, count):
                low[axis], high[axis] = min(low[axis], p[j, axis]), max(high[axis], p[j, axis])
        least = np.inf
        for k in range(boxes.shape[0]):
            lower, upper = boxes[k, 0], boxes[k, 1]
            square = 0.0
            for axis in range(3):
                out = max(max(lower[axis] - high[axis], low[axis] - upper[axis]), 0.0)
                square += out * out
            if square >= enough * enough:
                least = min(least, square)
                continue
            for j in range(count):
                here[j] = from_box(p[j], lower, upper)
                row[j] = min(row[j], here[j])
            for j in range(count - 1):
                bound = min(enough, row[count + j])
                line = line_with_ends(p[j], p[j + 1], here[j], here[j + 1], lower, upper, bound)
                row[count + j] = min(row[count + j], line)
        for j in range(2 * count - 1):
            row[j] = min(row[j], sqrt(least))
    return found
