"""The support polygon and its static stability margin: on floats, arrays, and compiled.

The paper's stability margin S_SM (section I, Fig. 12) is the least distance from the projected
centre of mass to the sides of the support polygon: positive inside, negative outside. Here it is
the signed distance to the polygon itself, so outside it is minus the Euclidean distance, which
makes the margin 1-Lipschitz in the point everywhere, and it is defined for every number of feet.
"""

from collections.abc import Iterable
from math import hypot, inf, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_quad.common import BoolArray, FloatArray, read_only
from drake_quad.jit import jit

Point = tuple[float, float]


def convex_hull(points: list[Point]) -> list[Point]:
    """Andrew's monotone chain over distinct sorted points; points on a side are left out."""
    if len(points) < 3:
        return points
    return _chain(points)[:-1] + _chain(points[::-1])[:-1]


def _chain(points: list[Point]) -> list[Point]:
    """Returns the half of the hull to the right of the way from the first point to the last."""
    chain: list[Point] = []
    for x, y in points:
        while len(chain) > 1:
            (ax, ay), (bx, by) = chain[-2], chain[-1]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                break
            chain.pop()
        chain.append((x, y))
    return chain


def nearest_on_segment(point: Point, a: Point, b: Point) -> Point:
    """Returns the point of the segment a-b that is nearest to `point`."""
    ex, ey = b[0] - a[0], b[1] - a[1]
    length_squared = ex * ex + ey * ey
    if length_squared == 0.0:
        return a
    t = ((point[0] - a[0]) * ex + (point[1] - a[1]) * ey) / length_squared
    t = min(max(t, 0.0), 1.0)
    return a[0] + t * ex, a[1] + t * ey


_CLEARLY_INSIDE = 1e-9  # [m], well beyond rounding
_NO_LENGTH = 1e-150  # [m]; below it squares underflow
_PAIRS = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


def support_polygon(points: ArrayLike) -> FloatArray:
    """Returns the convex hull of the feet on the ground, counterclockwise.

    Args:
        points: (n, 2) or empty, horizontal foot positions [m] in any one frame, in any order.

    Returns:
        (k, 2), read-only, starting at the leftmost vertex. Degenerate feet give k < 3: the two
        ends of collinear feet, one point for coincident feet, none for no feet.
    """
    rows = np.asarray(points, dtype=np.float64).reshape(-1, 2).tolist()
    hull = convex_hull(sorted({(x, y) for x, y in rows}))
    return read_only(np.array(hull).reshape(-1, 2))


def support_order(points: ArrayLike) -> list[int]:
    """Returns which of the feet are the support polygon's corners, in its order.

    Args:
        points: See `support_polygon`.
    """
    rows = np.asarray(points, dtype=np.float64).reshape(-1, 2).tolist()
    first = {(x, y): k for k, (x, y) in reversed(list(enumerate(rows)))}
    return [first[corner] for corner in convex_hull(sorted(first))]


def stability_margin(point: ArrayLike, points: ArrayLike) -> float:
    """Returns the signed static stability margin of one point over some feet.

    Args:
        point: (2,) the projected centre of mass [m], in the frame of `points`.
        points: (n, 2) horizontal positions [m] of the standing feet, in any order.

    Returns:
        The distance [m] to the nearest side if the point is inside the support polygon, minus
        the distance to the polygon if outside; over one or two feet minus the distance to the
        point or segment; -inf over none.
    """
    x, y = np.asarray(point, dtype=np.float64).tolist()
    return margin_of_floats(x, y, np.asarray(points, dtype=np.float64).reshape(-1, 2).tolist())


def margin_of_floats(x: float, y: float, points: Iterable[Iterable[float]]) -> float:
    """Returns `stability_margin` of (x, y) over points given as plain floats.

    With three or four feet plain floats beat numpy's call overhead several times, and this runs
    at the controller's rate. The rule is that of `stability_margins`; it does not ask on which
    side of a side the point is, which rounding would decide where the feet are nearly in line.
    """
    hull = [(px - x, py - y) for px, py in convex_hull(sorted({(px, py) for px, py in points}))]
    if not hull:
        return -inf
    margin = inf
    ax, ay = hull[-1]
    for bx, by in hull:
        margin = min(margin, _reach(hull, by - ay, ax - bx))
        ax, ay = bx, by
    if _CLEARLY_INSIDE < margin < inf:
        return margin  # no need to look beyond the corners
    return min(margin, 0.0, *[_reach(hull, -qx, -qy) for qx, qy in hull])


def _reach(points: list[Point], x: float, y: float) -> float:
    """Returns how far points reach along the direction (x, y); inf if that has no length."""
    norm = hypot(x, y)
    if norm < _NO_LENGTH:
        return inf
    return max([x * qx + y * qy for qx, qy in points]) / norm


def stability_margins(points: FloatArray, feet: FloatArray, standing: BoolArray) -> FloatArray:
    """Returns the signed static stability margins of many samples: `stability_margin`, vectorised.

    The margin is the least value over all directions u of max_k u·(foot_k - point). That minimum
    lies at the normal of a line through two feet (point inside, or beside a side) or at the
    direction away from one foot (point beyond a corner), and any other direction only bounds it
    from above. Trying all of these needs no hull, no order of the feet and no tolerance.

    Args:
        points: (N, 2) projected centres of mass [m].
        feet: (N, 4, 2) horizontal foot positions [m], in the frame of `points`.
        standing: (N, 4), which feet stand.

    Returns:
        (N,) margins [m]; -inf where no foot stands.
    """
    standing = np.asarray(standing, dtype=np.bool_)
    feet = np.asarray(feet, dtype=np.float64)
    # A foot in the air is put where a standing one is: a foot counted twice changes nothing.
    stand_in = np.take_along_axis(feet, np.argmax(standing, axis=1)[:, None, None], axis=1)
    relative = np.where(standing[:, :, None], feet, stand_in)
    relative = relative - np.asarray(points, dtype=np.float64)[:, None, :]
    x, y = np.ascontiguousarray(relative[:, :, 0].T), np.ascontiguousarray(relative[:, :, 1].T)
    margins = np.full(len(standing), inf)
    for i, j in _PAIRS:
        ux, uy = _unit(y[i] - y[j], x[j] - x[i])
        across = x * ux + y * uy
        np.minimum(margins, across.max(axis=0), out=margins)
        np.minimum(margins, -across.min(axis=0), out=margins)
    for k in range(4):
        ux, uy = _unit(-x[k], -y[k])
        np.minimum(margins, (x * ux + y * uy).max(axis=0), out=margins)
    margins[~standing.any(axis=1)] = -inf
    return margins


def _unit(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns unit vectors along (x, y); along +x where that has no length."""
    norm: FloatArray = np.sqrt(x * x + y * y)
    zero: NDArray[np.bool_] = norm < _NO_LENGTH
    if zero.any():
        norm = np.where(zero, 1.0, norm)
        x, y = np.where(zero, 1.0, x), np.where(zero, 0.0, y)
    return x / norm, y / norm


NO_LENGTH = 1e-150  # [m]; below it squares underflow
BEARING = 0.5  # above it a foot bears
LEAST_WEIGHT = 1.0  # [N] on the feet for there to be a centre of pressure


@jit
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


@jit
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


@jit
def measure_margins(
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


@jit
def watch_margins(
    state: FloatArray,
    base: int,
    margin: float,
    zmp_margin: float,
    ground: float,
    counts: bool,
    period: float,
    tilt: float,
    height: float,
    recent: FloatArray,
    least: FloatArray,
    fallen: FloatArray,
) -> float:
    """A tick of the stability monitor: the least margins of late, and whether the robot is down.

    Args:
        state: The robot's [q; v].
        base: Index of the base's quaternion in it; its position follows.
        margin: Static margin now [m].
        zmp_margin: Margin of the centre of pressure now [m].
        ground: Height of the ground under the robot [m]; see `measure_margins`.
        counts: Whether the margins count towards the least, which they do once contacts are known.
        period: Time since the tick before [s].
        tilt: Cosine of the trunk's tilt beyond which it counts as fallen.
        height: Height of the base over the ground below which it counts as down [m].
        recent: Both margins of the last ticks, the oldest first (2 n,) [m]; goes on a tick.
        least: Result: the least of these (2,) [m].
        fallen: For how long the trunk has been tilted, and down (2,) [s]; goes on a tick.

    Returns:
        The cosine of the trunk's tilt.
    """
    if counts:
        n = len(recent)
        for i in range(n - 2):
            recent[i] = recent[i + 2]
        recent[n - 2], recent[n - 1] = margin, zmp_margin
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
