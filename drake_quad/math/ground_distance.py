"""Signed distances of points and lines from the ground: a lane's profile, or endless stairs.

Points alone do not see a nosing between two of them: lines do.
"""

from math import inf, sqrt

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.jit import jit


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
