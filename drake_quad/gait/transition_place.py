"""Where a foot may rest in between, so that given lifts of other legs are stable.

For the margin to be m with feet a, b and q on the ground, the circle of radius m about the centre
of mass has to be inside the triangle a-b-q: q is beyond both of the tangents from a and b that
pass the circle on its far sides. For a fixed m these are half-planes, so the admissible places are
a convex polygon, which shrinks as m grows.
"""

from math import asin, cos, hypot, sin

from drake_quad.gait.support import Point
from drake_quad.gait.transition_lift import nearest_on_segment

HalfPlane = tuple[float, float, float]  # (n_x, n_y, o): the points with n·q <= o
Triple = tuple[Point, Point, Point]  # the centre of mass, and the two other feet on the ground
Polygon = list[Point]

_TOLERANCE = 1e-10
_ON_LINE = 1e-9
_ROW = 1e6  # how much more than x the y of a place counts where the row comes first


def best_place(
    triples: list[Triple], box: Polygon, *, floor: float, near: Point, straight: bool = False
) -> tuple[float, Point] | None:
    """Returns the place of a foot that makes the least margin of some lifts as large as it can be.

    Args:
        triples: For each lift during which the foot stands there, the rest of the stance.
        box: The places allowed, a counterclockwise convex polygon [m].
        floor: The least margin that is of any use [m], not negative.
        near: Of equally good places, the nearest to this one is taken [m].
        straight: Whether a place with the y of `near`, or else the nearest y, comes before that.

    Returns:
        The margin [m], as far as it depends on the place, and the place; None if none reaches
        `floor`.
    """
    region = places_with_margin(triples, box, floor)
    if not region:
        return None
    # A centre of mass on the line a-b has margin 0 wherever the foot is: nothing to be gained.
    free = [triple for triple in triples if _apart(*triple) > _ON_LINE]
    low, high = floor, min((_apart(*triple) for triple in free), default=floor)
    while high - low > _TOLERANCE:
        middle = (low + high) / 2.0
        smaller = places_with_margin(free, box, middle)
        if smaller:
            low, region = middle, smaller
        else:
            high = middle
    if not straight:
        return low, _nearest(region, near)
    if low <= floor + _ON_LINE:  # nothing was gained but rounding: all places are as good
        region = places_with_margin(triples, box, floor)
    x, y = _nearest([(x, _ROW * y) for x, y in region], (near[0], _ROW * near[1]))
    return low, (x, y / _ROW)


def places_with_margin(triples: list[Triple], box: Polygon, margin: float) -> Polygon:
    """Returns the part of `box` in which a foot gives every lift at least `margin` >= 0 [m]."""
    region = box
    for triple in triples:
        planes = _half_planes(*triple, margin)
        if planes is None:
            return []
        for plane in planes:
            region = clip(region, plane)
    return region


def clip(polygon: Polygon, plane: HalfPlane) -> Polygon:
    """Returns the part of a convex polygon in a half-plane (Sutherland and Hodgman)."""
    nx, ny, o = plane
    excess = [nx * x + ny * y - o for x, y in polygon]
    kept: Polygon = []
    for k, (x, y) in enumerate(polygon):
        (px, py), before, here = polygon[k - 1], excess[k - 1], excess[k]
        if (before > _TOLERANCE) != (here > _TOLERANCE):
            t = (before - _TOLERANCE) / (before - here)
            kept.append((px + t * (x - px), py + t * (y - py)))
        if here <= _TOLERANCE:
            kept.append((x, y))
    return kept


def _apart(com: Point, a: Point, b: Point) -> float:
    """Returns the distance of the centre of mass from the line a-b; -1 if a and b coincide."""
    length = hypot(b[0] - a[0], b[1] - a[1])
    if length == 0.0:
        return -1.0
    return abs((b[0] - a[0]) * (com[1] - a[1]) - (b[1] - a[1]) * (com[0] - a[0])) / length


def _half_planes(com: Point, a: Point, b: Point, margin: float) -> list[HalfPlane] | None:
    """Returns the half-planes of admissible third feet; None if no third foot reaches `margin`."""
    apart = _apart(com, a, b)
    if apart < margin - _TOLERANCE:
        return None
    if apart <= _ON_LINE:
        between = (com[0] - a[0]) * (com[0] - b[0]) + (com[1] - a[1]) * (com[1] - b[1]) <= 0.0
        return [] if between else None
    if (b[0] - a[0]) * (com[1] - a[1]) - (b[1] - a[1]) * (com[0] - a[0]) < 0.0:
        a, b = b, a  # so that the centre of mass, and then the third foot, is left of a-b
    return [
        _right_of(b, _tangent(b, com, margin, -1.0)),
        _right_of(a, _tangent(a, com, margin, 1.0), left=True),
        _right_of(a, (b[0] - a[0], b[1] - a[1]), left=True),
    ]


def _tangent(foot: Point, com: Point, margin: float, sense: float) -> Point:
    """Returns the direction from a foot along the circle's tangent on its far side."""
    x, y = com[0] - foot[0], com[1] - foot[1]
    angle = sense * asin(min(margin / hypot(x, y), 1.0))
    return x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle)


def _right_of(point: Point, direction: Point, *, left: bool = False) -> HalfPlane:
    """Returns the half-plane to the right (or left) of the line from `point` along `direction`."""
    size = hypot(*direction) * (-1.0 if left else 1.0)
    nx, ny = -direction[1] / size, direction[0] / size
    return nx, ny, nx * point[0] + ny * point[1]


def _nearest(polygon: Polygon, point: Point) -> Point:
    """Returns the point of a counterclockwise convex polygon that is nearest to `point`."""
    x, y = point
    inside, best, least = True, polygon[0], float("inf")
    for k, b in enumerate(polygon):
        a = polygon[k - 1]
        inside = inside and (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) > 0.0
        candidate = nearest_on_segment(point, a, b)
        distance = hypot(candidate[0] - x, candidate[1] - y)
        if distance < least:
            best, least = candidate, distance
    return point if inside else best
