"""Signed distances of points, lines and paths from boxes, cylinders and each other."""

from math import sqrt

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.jit import jit

ROUNDS = 12  # of golden sections: to less than a hundredth of a line
GOLDEN = 0.5 * (sqrt(5.0) - 1.0)


@jit
def point_to_box(p: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    """Distance of a point (3,) from a box in the same frame, inside negative [m]."""
    return _to_box(p[0], p[1], p[2], lower, upper)


@jit
def _to_box(x: float, y: float, z: float, lower: FloatArray, upper: FloatArray) -> float:
    """The formula of `point_to_box` without an array, which would cost most of the time."""
    ax = max(lower[0] - x, x - upper[0])
    ay = max(lower[1] - y, y - upper[1])
    az = max(lower[2] - z, z - upper[2])
    ox, oy, oz = max(ax, 0.0), max(ay, 0.0), max(az, 0.0)
    return sqrt(ox * ox + oy * oy + oz * oz) + min(max(ax, max(ay, az)), 0.0)


@jit
def _between(
    p: FloatArray, q: FloatArray, share: float, lower: FloatArray, upper: FloatArray
) -> float:
    """Distance of a box from the point that is `share` of the way from p to q [m]."""
    x = p[0] + share * (q[0] - p[0])
    y = p[1] + share * (q[1] - p[1])
    z = p[2] + share * (q[2] - p[2])
    return _to_box(x, y, z, lower, upper)


@jit
def find_bounds(points: FloatArray, low: FloatArray, high: FloatArray) -> None:
    """Writes the least and greatest coordinates (3,) of points (M, 3): a box around them."""
    for axis in range(3):
        low[axis] = high[axis] = points[0, axis]
        for j in range(1, points.shape[0]):
            low[axis] = min(low[axis], points[j, axis])
            high[axis] = max(high[axis], points[j, axis])


@jit
def squared_gap(low: FloatArray, high: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    """Squared distance between two boxes, given by their corners (3,); 0 where they meet [m²]."""
    square = 0.0
    for axis in range(3):
        out = max(max(lower[axis] - high[axis], low[axis] - upper[axis]), 0.0)
        square += out * out
    return square


@jit
def line_with_ends(
    p: FloatArray, q: FloatArray, at_low: float, at_high: float,
    lower: FloatArray, upper: FloatArray, cutoff: float,
) -> float:  # fmt: skip
    """Least distance of the line from p to q (3,) from a box, inside negative [m].

    The box is convex, and so is the distance along a line: golden sections find its least. The
    distances `at_low` and `at_high` of both ends are known; where they prove that the line keeps
    `cutoff` [m], the lesser of them is returned.
    """
    best = min(at_low, at_high)
    x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    length = sqrt(x * x + y * y + z * z)
    if 0.5 * (at_low + at_high - length) >= min(best, cutoff):
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
        if 0.5 * (at_low + at_high - length * (high - low)) >= min(best, cutoff):
            break
    return min(best, min(a, b))


@jit
def points_to_boxes(points: FloatArray, boxes: FloatArray, cutoff: float) -> FloatArray:
    """Least distances of points (M, K, 3) and their lines from boxes (B, 2, 3) [m].

    Returns:
        (M, 2 K - 1), negative inside: for each row its points, then the lines that join these.
        Distances are exact below `cutoff` [m]; larger ones are at least that.
    """
    rows, count = points.shape[0], points.shape[1]
    found = np.empty((rows, 2 * count - 1))
    low, high, here = np.empty(3), np.empty(3), np.empty(count)
    for i in range(rows):
        row, p = found[i], points[i]
        row[:] = np.inf
        find_bounds(p, low, high)
        least = np.inf
        for k in range(boxes.shape[0]):
            lower, upper = boxes[k, 0], boxes[k, 1]
            square = squared_gap(low, high, lower, upper)
            if square >= cutoff * cutoff:
                least = min(least, square)
                continue
            for j in range(count):
                here[j] = point_to_box(p[j], lower, upper)
                row[j] = min(row[j], here[j])
            for j in range(count - 1):
                bound = min(cutoff, row[count + j])
                line = line_with_ends(p[j], p[j + 1], here[j], here[j + 1], lower, upper, bound)
                row[count + j] = min(row[count + j], line)
        for j in range(2 * count - 1):
            row[j] = min(row[j], sqrt(least))
    return found


PLACES = 5  # of a line, evenly, that are looked at beside a cylinder


@jit
def box_distance_of_path(
    path: FloatArray, lengths: FloatArray, lower: FloatArray, upper: FloatArray, bound: float
) -> float:
    """Distance of a path from a box, inside negative, or a bound if that is less [m].

    Args:
        path: Points that lines join (K, 3) [m].
        lengths: The lines' lengths (K - 1,) [m].
        lower: Least coordinates of the box (3,) [m].
        upper: Greatest ones (3,) [m].
        bound: The bound [m].
    """
    k = 0
    while k < len(lengths):
        here = point_to_box(path[k], lower, upper)
        after = _skip(lengths, k, here - bound)
        if after == k:
            there = point_to_box(path[k + 1], lower, upper)
            bound = min(
                bound, line_with_ends(path[k], path[k + 1], here, there, lower, upper, bound)
            )
            after += 1
        k = after
    return bound


@jit
def rod_distance_of_path(
    path: FloatArray, lengths: FloatArray, rod: FloatArray, bound: float
) -> float:
    """Distance of a path from a solid cylinder, or a bound if that is less [m].

    Each of the path's lines is looked at in PLACES of it.

    Args:
        path: Points that lines join (K, 3) [m].
        lengths: The lines' lengths (K - 1,) [m].
        rod: The cylinder, see `point_to_rod` (8,).
        bound: The bound [m].
    """
    k = 0
    while k < len(lengths):
        p, q = path[k], path[k + 1]
        here = point_to_rod(p[0], p[1], p[2], rod)
        after = _skip(lengths, k, here - bound)
        if after == k:
            for place in range(PLACES):
                s = place / (PLACES - 1.0)
                x, y, z = (
                    p[0] + s * (q[0] - p[0]),
                    p[1] + s * (q[1] - p[1]),
                    p[2] + s * (q[2] - p[2]),
                )
                bound = min(bound, point_to_rod(x, y, z, rod))
            after += 1
        k = after
    return bound


@jit
def _skip(lengths: FloatArray, k: int, spare: float) -> int:
    """The last point of a path to which it is no more than `spare` [m] from its point k.

    No distance changes by more than the way along the path: if that of the point k is a bound plus
    `spare`, nothing before the point found is nearer than the bound.
    """
    while k < len(lengths) and spare >= lengths[k]:
        spare -= lengths[k]
        k += 1
    return k


@jit
def point_to_rod(x: float, y: float, z: float, rod: FloatArray) -> float:
    """Distance of a point from a solid cylinder, negative inside [m].

    Args:
        x: The point's place along x [m].
        y: The same along y [m].
        z: The same along z [m].
        rod: Middle, a unit vector along the axis, half the length, and the radius (8,) [m].
    """
    x, y, z = x - rod[0], y - rod[1], z - rod[2]
    along = x * rod[3] + y * rod[4] + z * rod[5]
    c0, c1, c2 = x - along * rod[3], y - along * rod[4], z - along * rod[5]
    beyond, beside = abs(along) - rod[6], sqrt(c0 * c0 + c1 * c1 + c2 * c2) - rod[7]
    if beyond <= 0.0 or beside <= 0.0:
        return max(beyond, beside)
    return sqrt(beyond * beyond + beside * beside)


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
def distance_between_legs(points: FloatArray, radii: FloatArray, cutoff: float) -> FloatArray:
    """Clearance between the legs of each of PAIRS (N, 6) [m], negative where they would touch.

    Clearances above `cutoff` [m] are reported as `cutoff`.

    Args:
        points: (N, 4, 1 + K, 3) the hip of each leg, then the points along its shank's middle [m].
        radii: (4, K) radii of the shanks there [m]; thighs are as thick as knees.
        cutoff: Cut-off distance [m].
    """
    N, M = points.shape[0], points.shape[2]
    found, low, high = np.full((N, len(PAIRS)), cutoff), np.empty((4, 3)), np.empty((4, 3))
    for n in range(N):
        for leg in range(4):
            find_bounds(points[n, leg], low[leg], high[leg])
        for k in range(len(PAIRS)):
            one, two = PAIRS[k, 0], PAIRS[k, 1]
            gap = sqrt(squared_gap(low[one], high[one], low[two], high[two]))
            if gap - radii[one].max() - radii[two].max() >= cutoff:
                continue
            for i in range(M - 1):
                for j in range(M - 1):
                    if i == 0 and j == 0:
                        continue  # thighs turn beside the trunk, which lies between them
                    thick = max(radii[one, i], radii[one, max(i - 1, 0)])
                    thick += max(radii[two, j], radii[two, max(j - 1, 0)])
                    away = line_to_line(
                        points[n, one, i], points[n, one, i + 1],
                        points[n, two, j], points[n, two, j + 1],
                    )  # fmt: skip
                    found[n, k] = min(found[n, k], away - thick)
    return found
