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


PLACES = 5  # of a line, evenly, that are looked at beside a rod


@jit
def lines_to_rods(
    points: FloatArray, rods: FloatArray, radii: FloatArray, cutoff: float
) -> FloatArray:
    """Least distances of the lines that join points (M, K, 3) from solid cylinders [m].

    A line is looked at in PLACES of it.

    Args:
        points: The points of each row [m].
        rods: Ends of the cylinders' axes (R, 2, 3) [m].
        radii: Their radii (R,) [m].
        cutoff: Distances are exact below it; larger ones are at least that [m].

    Returns:
        (M,), negative inside.
    """
    found = np.full(points.shape[0], np.inf)
    low, high = np.empty(3), np.empty(3)
    for i in range(points.shape[0]):
        find_bounds(points[i], low, high)
        c0, c1, c2 = 0.5 * (low + high)
        around = 0.5 * sqrt(np.sum((high - low) ** 2))
        for r in range(rods.shape[0]):
            a0, a1, a2 = rods[r, 1] - rods[r, 0]
            length = sqrt(a0 * a0 + a1 * a1 + a2 * a2)
            a0, a1, a2, half = a0 / length, a1 / length, a2 / length, 0.5 * length
            m0, m1, m2 = 0.5 * (rods[r, 0] + rods[r, 1])
            whole = _to_rod(c0 - m0, c1 - m1, c2 - m2, a0, a1, a2, half, radii[r]) - around
            if whole >= cutoff:
                found[i] = min(found[i], whole)
                continue
            for j in range(points.shape[1] - 1):
                p, q = points[i, j], points[i, j + 1]
                w0, w1, w2 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
                x, y, z = p[0] - m0, p[1] - m1, p[2] - m2
                for k in range(PLACES):
                    s = k / (PLACES - 1.0)
                    here = _to_rod(x + s * w0, y + s * w1, z + s * w2, a0, a1, a2, half, radii[r])
                    found[i] = min(found[i], here)
    return found


@jit
def _to_rod(
    x: float, y: float, z: float, a0: float, a1: float, a2: float, half: float, radius: float
) -> float:
    """Distance of a point from a solid cylinder about its middle, negative inside [m].

    Args:
        x: The point's place from the middle, along x [m].
        y: The same along y [m].
        z: The same along z [m].
        a0: The axis's direction, along x.
        a1: The same along y.
        a2: The same along z.
        half: Half the cylinder's length [m].
        radius: Its radius [m].
    """
    along = x * a0 + y * a1 + z * a2
    c0, c1, c2 = x - along * a0, y - along * a1, z - along * a2
    beyond, beside = abs(along) - half, sqrt(c0 * c0 + c1 * c1 + c2 * c2) - radius
    if beyond <= 0.0 or beside <= 0.0:
        return max(beyond, beside)
    return sqrt(beyond * beyond + beside * beside)


@jit
def _to_step(beside: float, above: float) -> float:
    """Signed distance from one step of a profile, inside negative [m].

    Args:
        beside: Distance from the step along the profile, negative over it [m].
        above: Height over its top [m].
    """
    if beside <= 0.0:
        return above if above > 0.0 else max(beside, above)
    return beside if above <= 0.0 else sqrt(beside * beside + above * above)


@jit
def _to_slope(s: float, z: float, begin: float, end: float, low: float, gradient: float) -> float:
    """Signed distance from what is below a sloped stretch of a profile, inside negative [m].

    Args:
        s: Place along the profile [m].
        z: Height [m].
        begin: Where the stretch begins [m]; it may have no end.
        end: Where it ends [m].
        low: Height of its line at `s` [m].
        gradient: Its rise along s [m/m].
    """
    rise, beside = z - low, max(begin - s, s - end)
    if beside <= 0.0 and rise <= 0.0:
        return max(beside, rise / sqrt(1.0 + gradient * gradient))
    foot = s + gradient * rise / (1.0 + gradient * gradient)  # of the perpendicular
    near = min(max(foot, begin), end)  # the nearest place of its line
    over = rise - gradient * (near - s)
    # Below the line's end, what faces the point is the stretch's upright end.
    end_rise = rise - gradient * (min(max(s, begin), end) - s)
    if beside > 0.0 and end_rise <= 0.0:
        return beside
    return sqrt((near - s) ** 2 + over * over)


@jit
def _to_ground(
    s: float, z: float, ends: FloatArray, begins: FloatArray, heights: FloatArray,
    gradients: FloatArray,
) -> float:  # fmt: skip
    """Signed distance of a point from the stretches of `profile_distance` [m]."""
    best = inf
    for k in range(len(heights)):
        beside = max(ends[k] - s, s - ends[k + 1])
        if beside > 0.0 and beside >= best:
            continue
        if gradients[k] == 0.0:
            best = min(best, _to_step(beside, z - heights[k]))
        else:
            line = heights[k] + gradients[k] * (s - begins[k])
            best = min(best, _to_slope(s, z, ends[k], ends[k + 1], line, gradients[k]))
    return best


FAR = 1.0  # [m]: lines that are farther from any nosing are as good as there
SURE = 1e-9  # [m] by which a bound may be wrong, for rounding


@jit
def from_nosing(
    p: tuple[float, float], q: tuple[float, float], edge: float, top: float, far: float
) -> float:
    """Signed distance of the line from p to q from a nosing, or a slope's crest [m].

    Negative where the line goes through what is below the nosing, though neither of its ends does.

    Args:
        p: Where the line begins: along the stairs, and how high [m].
        q: Where the line ends, likewise [m].
        edge: Where the nosing is along the stairs [m].
        top: Height of the nosing [m].
        far: Cut-off distance: larger ones are reported as this [m].
    """
    (s0, z0), (s1, z1) = p, q
    if min(s0, s1) - edge > far or edge - max(s0, s1) > far:
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
def _to_nosings(
    p: tuple[float, float], q: tuple[float, float], ends: FloatArray, begins: FloatArray,
    heights: FloatArray, gradients: FloatArray,
) -> float:  # fmt: skip
    """Signed distance of the line from p to q from the nearest nosing or crest, at most FAR [m]."""
    least, low, high = FAR, min(p[0], q[0]), max(p[0], q[0])
    for k in range(len(heights) - 1):
        beside = max(low - ends[k + 1], ends[k + 1] - high)
        # Nothing of a line that is not over or below the nosing is nearer than along the profile.
        if beside > 0.0 and beside - SURE >= least:
            continue
        before, after = heights[k], heights[k + 1]
        if gradients[k] != 0.0:
            before += gradients[k] * (ends[k + 1] - begins[k])
        # Where ground of one height bends upwards, what is above it sees all of it from there.
        if abs(after - before) <= SURE and gradients[k] <= gradients[k + 1]:
            continue
        least = min(least, from_nosing(p, q, ends[k + 1], max(before, after), FAR))
    return least


@jit
def profile_distance(
    points: FloatArray,
    origin: FloatArray,
    heading: FloatArray,
    ends: FloatArray,
    begins: FloatArray,
    heights: FloatArray,
    gradients: FloatArray,
) -> FloatArray:
    """Signed distances of points (N, M, 3) and their lines from a profile [m].

    Args:
        points: Points in W; those of a row are joined by lines, each to the next [m].
        origin: Where the profile begins in W (2,) [m].
        heading: Unit vector along the profile in W (2,).
        ends: Ends of the stretches along the profile (n + 1,) [m], the outermost infinite.
        begins: Where along the profile each stretch has its height (n,) [m].
        heights: Heights of the stretches there (n,) [m].
        gradients: Rises of the stretches along the profile (n,) [m/m]; 0 of level ones.

    Returns:
        (N, 2 M - 1), negative inside the ground: for each row its points' distances from the
        ground, then those of the lines from the nearest nosing, at most FAR.
    """
    rows, count = points.shape[0], points.shape[1]
    found, along = np.empty((rows, 2 * count - 1)), np.empty(count)
    for i in range(rows):
        for j in range(count):
            x, y = points[i, j, 0] - origin[0], points[i, j, 1] - origin[1]
            along[j] = heading[0] * x + heading[1] * y
            found[i, j] = _to_ground(along[j], points[i, j, 2], ends, begins, heights, gradients)
        for j in range(count - 1):
            p, q = (along[j], points[i, j, 2]), (along[j + 1], points[i, j + 1, 2])
            found[i, count + j] = _to_nosings(p, q, ends, begins, heights, gradients)
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


NEIGHBOURS = 2  # treads to either side that can be the nearest to a point


@jit
def point_to_stairs(s: float, z: float, rise: float, run: float) -> float:
    """Signed distance of a point from a Staircase [m], negative inside it.

    Exact below two treads; larger distances may be overestimated.
    """
    middle, best = np.round(s / run), inf
    for k in range(-NEIGHBOURS, NEIGHBOURS + 1):
        beside = abs(s - (middle + k) * run) - 0.5 * run
        best = min(best, _to_step(beside, z - (middle + k) * rise))
    return best


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
    if rise == 0.0:
        return run
    top = max(k * rise, (k + 1.0) * rise)
    return from_nosing((p[0], p[2]), (q[0], q[2]), edge, top, run)
