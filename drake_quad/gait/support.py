"""The support polygon and the signed static stability margin of a point.

The paper's stability margin S_SM (section I, Fig. 12) is the least distance from the projected
centre of mass to the sides of the support polygon: positive inside, negative outside. Here it is
the signed distance to the polygon itself, so outside it is minus the Euclidean distance, which
makes the margin 1-Lipschitz in the point everywhere, and it is defined for every number of feet.
"""

from collections.abc import Iterable
from math import hypot, inf

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_quad.gait.legs import BoolArray, FloatArray, read_only

Point = tuple[float, float]
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
    hull = _hull(sorted({(x, y) for x, y in rows}))
    return read_only(np.array(hull).reshape(-1, 2))


def support_order(points: ArrayLike) -> list[int]:
    """Returns which of the feet are the support polygon's corners, in its order.

    Args:
        points: See `support_polygon`.
    """
    rows = np.asarray(points, dtype=np.float64).reshape(-1, 2).tolist()
    first = {(x, y): k for k, (x, y) in reversed(list(enumerate(rows)))}
    return [first[corner] for corner in _hull(sorted(first))]


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
    hull = [(px - x, py - y) for px, py in _hull(sorted({(px, py) for px, py in points}))]
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


def _hull(points: list[Point]) -> list[Point]:
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
