"""Signed distances of points and segments from boxes, step profiles and each other.

Points alone do not see a nosing between two of them: lines do.
"""

from math import inf, sqrt

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.jit import jit

ROUNDS = 12  # of golden sections: to less than a hundredth of a line
GOLDEN = 0.5 * (sqrt(5.0) - 1.0)


@jit
def point_to_box(p: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    """Distance of a point (3,) from a box in the same frame, inside negative [m]."""
    ax = max(lower[0] - p[0], p[0] - upper[0])
    ay = max(lower[1] - p[1], p[1] - upper[1])
    az = max(lower[2] - p[2], p[2] - upper[2])
    ox, oy, oz = max(ax, 0.0), max(ay, 0.0), max(az, 0.0)
    return sqrt(ox * ox + oy * oy + oz * oz) + min(max(ax, max(ay, az)), 0.0)


@jit
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


@jit
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


@jit
def points_to_boxes(points: FloatArray, boxes: FloatArray, enough: float) -> FloatArray:
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
                here[j] = point_to_box(p[j], lower, upper)
                row[j] = min(row[j], here[j])
            for j in range(count - 1):
                bound = min(enough, row[count + j])
                line = line_with_ends(p[j], p[j + 1], here[j], here[j + 1], lower, upper, bound)
                row[count + j] = min(row[count + j], line)
        for j in range(2 * count - 1):
            row[j] = min(row[j], sqrt(least))
    return found


@jit
def ground_distance(
    s: FloatArray, z: FloatArray, ends: FloatArray, heights: FloatArray
) -> FloatArray:
    """Signed distance of points from the ground (N,) [m], negative inside it.

    Args:
        s: Where the points are along the profile (N,) [m].
        z: How high (N,) [m].
        ends: Where the stretches begin and end (n + 1,) [m], the outermost infinitely far away.
        heights: Of the stretches (n,) [m].
    """
    found = np.empty(len(s))
    for i in range(len(s)):
        best = inf
        for k in range(len(heights)):
            beside = max(ends[k] - s[i], s[i] - ends[k + 1])
            if beside > 0.0 and beside >= best:
                continue
            above = z[i] - heights[k]
            if beside <= 0.0:
                here = above if above > 0.0 else max(beside, above)
            else:
                here = beside if above <= 0.0 else sqrt(beside * beside + above * above)
            best = min(best, here)
        found[i] = best
    return found


FAR = 1.0  # [m]: lines that are farther from any nosing are as good as there


@jit
def from_nosing(
    s0: float, z0: float, s1: float, z1: float, edge: float, low: float, high: float, far: float
) -> float:
    """Signed distance of a line from the nosing between two treads [m].

    Negative where the line goes through what is below the nosing, though neither of its ends does.

    Args:
        s0: Where the line begins, along the stairs [m].
        z0: How high [m].
        s1: Where it ends [m].
        z1: How high [m].
        edge: Where the nosing is [m].
        low: Height of the tread before it [m].
        high: Of the tread after it [m].
        far: A distance beyond which any is as good [m]: that is told of lines farther off.
    """
    top = max(low, high)
    if low == high or min(s0, s1) - edge > far or edge - max(s0, s1) > far:
        return far
    ds, dz = s1 - s0, z1 - z0
    square = ds * ds + dz * dz
    t = ((edge - s0) * ds + (top - z0) * dz) / square if square > 0.0 else 0.0
    t = min(max(t, 0.0), 1.0)
    away_s, away_z = s0 + t * ds - edge, z0 + t * dz - top
    distance = sqrt(away_s * away_s + away_z * away_z)
    if (s0 - edge) * (s1 - edge) < 0.0 and z0 + (edge - s0) / ds * dz < top:
        distance = -distance
    return min(distance, far)


@jit
def nosing_distance(
    s: FloatArray, z: FloatArray, ends: FloatArray, heights: FloatArray
) -> FloatArray:
    """The least of every line's from all nosings of a profile (N, M - 1) [m].

    Args:
        s: Where the M points are that each of N rows of lines joins, along the profile (N, M) [m].
        z: How high (N, M) [m].
        ends: Where the profile's level stretches begin and end (n + 1,) [m].
        heights: Of the stretches (n,) [m].
    """
    found = np.full((s.shape[0], s.shape[1] - 1), FAR)
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            for k in range(len(heights) - 1):
                here = from_nosing(
                    s[i, j], z[i, j], s[i, j + 1], z[i, j + 1], ends[k + 1], heights[k],
                    heights[k + 1], FAR,
                )  # fmt: skip
                found[i, j] = min(found[i, j], here)
    return found


PAIRS = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])  # of legs, by their rows
TINY = 1e-12


@jit
def line_to_line(p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray) -> float:
    """Distance of the line from p to q from that from r to s, all (3,) [m].

    Ericson, "Real-Time Collision Detection" (2005), section 5.1.9.
    """
    a = e = f = b = c = 0.0
    for i in range(3):
        along, other, gap = q[i] - p[i], s[i] - r[i], p[i] - r[i]
        a += along * along
        e += other * other
        f += other * gap
        b += along * other
        c += along * gap
    t, u = 0.0, 0.0
    if a <= TINY:
        u = min(max(f / e, 0.0), 1.0) if e > TINY else 0.0
    elif e <= TINY:
        t = min(max(-c / a, 0.0), 1.0)
    else:
        square = a * e - b * b
        t = min(max((b * f - c * e) / square, 0.0), 1.0) if square > TINY else 0.0
        u = (b * t + f) / e
        if u < 0.0:
            u, t = 0.0, min(max(-c / a, 0.0), 1.0)
        elif u > 1.0:
            u, t = 1.0, min(max((b - c) / a, 0.0), 1.0)
    total = 0.0
    for i in range(3):
        away = p[i] + t * (q[i] - p[i]) - r[i] - u * (s[i] - r[i])
        total += away * away
    return sqrt(total)


@jit
def distance_between_legs(points: FloatArray, radii: FloatArray, enough: float) -> FloatArray:
    """Room between the legs of each of PAIRS (N, 6) [m], negative where they would touch.

    Pairs that surely have `enough` [m] are told to have just that.

    Args:
        points: (N, 4, 1 + K, 3) each leg's hip, then its shank's middles from the knee on [m].
        radii: (4, K) of the shanks there; thighs are as thick as knees [m].
        enough: [m].
    """
    N, M = points.shape[0], points.shape[2]
    found = np.full((N, len(PAIRS)), enough)
    for n in range(N):
        for k in range(len(PAIRS)):
            one, two = PAIRS[k, 0], PAIRS[k, 1]
            square = 0.0  # of the gap between the boxes about both
            for axis in range(3):
                a_low = a_high = points[n, one, 0, axis]
                b_low = b_high = points[n, two, 0, axis]
                for j in range(1, M):
                    a, b = points[n, one, j, axis], points[n, two, j, axis]
                    a_low, a_high = min(a_low, a), max(a_high, a)
                    b_low, b_high = min(b_low, b), max(b_high, b)
                gap = max(max(b_low - a_high, a_low - b_high), 0.0)
                square += gap * gap
            if sqrt(square) - radii[one].max() - radii[two].max() >= enough:
                continue
            for i in range(M - 1):
                for j in range(M - 1):
                    if i == 0 and j == 0:
                        continue  # thighs turn beside the trunk, where there is room for both
                    thick = max(radii[one, i], radii[one, max(i - 1, 0)])
                    thick += max(radii[two, j], radii[two, max(j - 1, 0)])
                    away = line_to_line(
                        points[n, one, i], points[n, one, i + 1],
                        points[n, two, j], points[n, two, j + 1],
                    )  # fmt: skip
                    found[n, k] = min(found[n, k], away - thick)
    return found


NEIGHBOURS = 2  # treads to either side that can be the nearest to a point


@jit
def point_to_stairs(s: float, z: float, rise: float, run: float) -> float:
    """Signed distance of a point from a Staircase [m], negative inside it.

    Exact for what is nearer than two treads; beyond, it may be less far than it says.
    """
    middle = np.round(s / run)
    inside, square = 0.0, np.inf
    for k in range(-NEIGHBOURS, NEIGHBOURS + 1):
        beside = abs(s - (middle + k) * run) - 0.5 * run
        above = z - (middle + k) * rise
        out_x, out_z = max(beside, 0.0), max(above, 0.0)
        square = min(square, out_x * out_x + out_z * out_z)
        inside = min(inside, max(beside, above))
    return inside if inside < 0.0 else sqrt(square)


@jit
def line_over_nosings(s: float, z: float, rise: float, run: float) -> float:
    """How far a point is above the plane through a Staircase's nosings [m]; -inf below it.

    All of the staircase is below that plane, so that what is above it is at least as far from any
    of the staircase.
    """
    height = z - (rise * s / run + 0.5 * abs(rise))
    return height * run / sqrt(run * run + rise * rise) if height > 0.0 else -np.inf


@jit
def line_to_stairs(p: FloatArray, q: FloatArray, rise: float, run: float) -> float:
    """Signed distance of the line from p to q from the nosing of a Staircase next to it [m]."""
    k = np.floor(0.5 * (p[0] + q[0]) / run)
    edge = (k + 0.5) * run
    return from_nosing(p[0], p[2], q[0], q[2], edge, k * rise, (k + 1.0) * rise, run)
