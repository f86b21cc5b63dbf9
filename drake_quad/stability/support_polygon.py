"""The support polygon and its static stability margin: on floats, arrays, and compiled.

The paper's stability margin S_SM (section I, Fig. 12) is the least distance from the projected
centre of mass to the sides of the support polygon: positive inside, negative outside. Here it is
the signed distance to the polygon itself, so outside it is minus the Euclidean distance, which
makes the margin 1-Lipschitz in the point everywhere, and it is defined for every number of feet.
"""

from math import inf, sqrt
from typing import NamedTuple

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


NO_LENGTH = 1e-150  # [m]; below it squares underflow
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
        points: Positions of the feet, as for `support_polygon`.
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
    return margin_of_points(x, y, np.array(points, dtype=np.float64).reshape(-1, 2))


@jit
def margin_of_points(x: float, y: float, points: FloatArray) -> float:
    """`stability_margin` of (x, y) over points (n, 2) [m], compiled; see `stability_margins`."""
    return _least_reach(points[:, 0] - x, points[:, 1] - y, len(points))


@jit
def margin_over(x: float, y: float, feet: FloatArray, standing: BoolArray) -> float:
    """The signed static margin of (x, y) over the standing feet [m]; -inf over none.

    Args:
        x: Projected centre of mass along the frame's x [m].
        y: Projected centre of mass along the frame's y [m].
        feet: Feet in the same frame (4, 3) [m]; their heights do not matter.
        standing: Whether each foot stands (4,).
    """
    count, rx, ry = 0, np.empty(4), np.empty(4)
    for k in range(4):
        if standing[k]:
            rx[count], ry[count] = feet[k, 0] - x, feet[k, 1] - y
            count += 1
    return _least_reach(rx, ry, count)


@jit
def _least_reach(rx: FloatArray, ry: FloatArray, count: int) -> float:
    """The margin of the origin over `count` points [m], by the rule of `stability_margins`."""
    margin = inf if count > 0 else -inf
    for i in range(count):
        for j in range(i):
            high, low = _extent(rx, ry, count, ry[i] - ry[j], rx[j] - rx[i])
            margin = min(margin, high, -low)
        high, _ = _extent(rx, ry, count, -rx[i], -ry[i])
        margin = min(margin, high)
    return margin


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
    zero: NDArray[np.bool_] = norm < NO_LENGTH
    if zero.any():
        norm = np.where(zero, 1.0, norm)
        x, y = np.where(zero, 1.0, x), np.where(zero, 0.0, y)
    return x / norm, y / norm


BEARING = 0.5  # above it a foot bears
LEAST_WEIGHT = 1.0  # [N] on the feet for there to be a centre of pressure


@jit
def measure_margins(
    com: FloatArray,
    bearing: FloatArray,
    place: FloatArray,
    force: FloatArray,
    none: float,
    margins: FloatArray,
) -> float:
    """Margins of the centre of mass and of the centre of pressure; returns the ground's height.

    Args:
        com: Centre of mass of the robot in W (3,) [m].
        bearing: 1 where a foot bears (4,).
        place: Where the feet's forces act in W (12,) [m].
        force: The forces on the feet in W (12,) [N].
        none: Value of a margin where there is none [m].
        margins: Result (2,) [m].

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
    margins[0] = found if np.isfinite(found) else none
    margins[1] = none
    if total > LEAST_WEIGHT:
        found = margin_over(x / total, y / total, feet, standing)
        margins[1] = found if np.isfinite(found) else none
    return lowest_bearing if np.isfinite(lowest_bearing) else lowest


class FallLimits(NamedTuple):
    """When a robot counts as tilted, and as down.

    Attributes:
        tilt: Cosine of the trunk's tilt beyond which it counts as tilted.
        height: Height of the base over the ground below which it counts as down [m].
        period: Time between two looks [s].
    """

    tilt: float
    height: float
    period: float


@jit
def watch_margins(
    state: FloatArray,
    base: int,
    now: tuple[float, float, float],
    counts: bool,
    limits: FallLimits,
    watch: tuple[FloatArray, FloatArray, FloatArray],
) -> float:
    """A tick of the stability monitor: the least margins of late, and whether the robot is down.

    Args:
        state: The robot's [q; v].
        base: Index of the base's quaternion in it; its position follows.
        now: Static margin, margin of the centre of pressure, and height of the ground under the
            robot [m]; see `measure_margins`.
        counts: Whether the margins count towards the least, which they do once contacts are known.
        limits: When the robot counts as tilted, and as down.
        watch: Both margins of each of the last n ticks, the oldest first (2 n,), the least of each
            (2,) [m], and for how long the trunk has been tilted, and down (2,) [s]; goes on a tick.

    Returns:
        The cosine of the trunk's tilt.
    """
    margin, zmp_margin, ground = now
    recent, least, fallen = watch
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
    fallen[0] = fallen[0] + limits.period if upright < limits.tilt else 0.0
    fallen[1] = fallen[1] + limits.period if state[base + 6] - ground < limits.height else 0.0
    return upright
