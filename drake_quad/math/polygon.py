"""Plane geometry: convex hulls, and the nearest point of a segment."""

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
