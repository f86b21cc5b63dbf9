"""One lift of a transition: how stable it is, and where the body best stands for it."""

from dataclasses import dataclass, field
from itertools import combinations
from math import hypot, inf

from drake_quad.gait.support import Point, margin_of_floats
from drake_quad.gait.workspace import Workspace

Places = tuple[Point, Point, Point, Point]
_EPS = 1e-12


@dataclass(frozen=True)
class Lift:
    """A leg lifted: its stability margin [m] and the body's shift [m] since the transition began.

    The margin is -inf where no admissible shift keeps all feet in their workspaces.
    """

    margin: float
    shift: Point


@dataclass(frozen=True, eq=False)
class LiftRules:
    """What holds for every lift of one transition; all in the body frame B as it begins.

    Args:
        com: The projected centre of mass [m].
        max_shift: How far the body may be from where it began, along x and along y [m]; 0 keeps
            it still.
        start: The feet as they stand.
        goal: The feet as they are to stand.
        goal_shift: Where the body is to be in the end, from where it began [m].
        workspace: The legs' boxes, which move with the body; None does not limit the shifts.
    """

    com: Point
    max_shift: float
    start: Places
    goal: Places
    goal_shift: Point
    workspace: Workspace | None
    _known: dict[tuple[int, Places, Point], Lift] = field(default_factory=dict, repr=False)

    def lift(self, row: int, places: Places, target: Point) -> Lift:
        """Returns the most stable way to move the leg of `row` to `target`, the others at rest.

        Args:
            row: The swing leg's row.
            places: Where the feet are before the lift [m].
            target: Where the swing leg goes [m].
        """
        key = (row, places, target)
        if key not in self._known:
            self._known[key] = self._lift(row, places, target)
        return self._known[key]

    def _lift(self, row: int, places: Places, target: Point) -> Lift:
        """Computes `lift`."""
        standing = [place for k, place in enumerate(places) if k != row]
        shift: Point = (0.0, 0.0)
        if self.max_shift > 0.0:
            ranges = self._shift_ranges(row, places, target)
            if ranges is None:
                return Lift(-inf, shift)
            (x_lo, x_hi), (y_lo, y_hi) = ranges
            x0, y0 = self.com
            x, y = best_point(
                standing, (x0 + x_lo, y0 + y_lo), (x0 + x_hi, y0 + y_hi), near=self.com
            )
            shift = (x - x0, y - y0)
        margin = margin_of_floats(self.com[0] + shift[0], self.com[1] + shift[1], standing)
        return Lift(margin, shift)

    def _shift_ranges(
        self, row: int, places: Places, target: Point
    ) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """Returns the admissible shifts along x and y: every foot in its box; None if none is."""
        lo, hi = [-self.max_shift] * 2, [self.max_shift] * 2
        if self.workspace is not None:
            centres = self.workspace.centres.tolist()
            half = self.workspace.half_size.tolist()
            for k, place in [*enumerate(places), (row, target)]:
                for axis in (0, 1):
                    offset = place[axis] - centres[k][axis]
                    least, most = offset - half[axis], offset + half[axis]
                    # A foot that stands outside its box as the transition begins, or is to in
                    # the end, does not forbid the body's place at that time.
                    if place == self.start[k]:
                        least, most = min(least, 0.0), max(most, 0.0)
                    if place == self.goal[k]:
                        end = self.goal_shift[axis]
                        least, most = min(least, end), max(most, end)
                    lo[axis], hi[axis] = max(lo[axis], least), min(hi[axis], most)
        if lo[0] > hi[0] + _EPS or lo[1] > hi[1] + _EPS:
            return None
        return (lo[0], max(lo[0], hi[0])), (lo[1], max(lo[1], hi[1]))


def best_point(standing: list[Point], low: Point, high: Point, *, near: Point) -> Point:
    """Returns the point of a rectangle with the largest margin over three standing feet.

    The margin inside a triangle is the least of three linear functions: concave, and largest at
    the incentre. If the incentre is not in the rectangle, the best point is on its border, where
    on each edge it is at an end or where two of the functions cross.

    Args:
        standing: The three feet [m].
        low: The rectangle's lower corner [m].
        high: The rectangle's upper corner [m].
        near: Of equally good points, the nearest to this one is taken [m].
    """
    (ax, ay), (bx, by), (cx, cy) = standing
    a, b, c = hypot(bx - cx, by - cy), hypot(cx - ax, cy - ay), hypot(ax - bx, ay - by)
    twice_area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    around = a + b + c
    if around > 0.0:
        x, y = (a * ax + b * bx + c * cx) / around, (a * ay + b * by + c * cy) / around
        if low[0] <= x <= high[0] and low[1] <= y <= high[1]:
            return x, y
    if abs(twice_area) <= _EPS * around * around:
        return _clip(near, low, high)  # feet in one line hold no margin anywhere
    turn = 1.0 if twice_area > 0.0 else -1.0
    sides = [
        (-turn * (qy - py) / length, turn * (qx - px) / length, (px, py))
        for (px, py), (qx, qy), length in (
            ((ax, ay), (bx, by), c),
            ((bx, by), (cx, cy), a),
            ((cx, cy), (ax, ay), b),
        )
    ]
    corners = [low, (high[0], low[1]), high, (low[0], high[1])]
    candidates: list[tuple[float, Point]] = []
    for (px, py), (qx, qy) in zip(corners, corners[1:] + corners[:1], strict=True):
        lines = [
            (nx * (px - sx) + ny * (py - sy), nx * (qx - px) + ny * (qy - py))
            for nx, ny, (sx, sy) in sides
        ]
        ts = [0.0, 1.0]
        for (u, du), (v, dv) in combinations(lines, 2):
            if abs(du - dv) > _EPS and 0.0 < (v - u) / (du - dv) < 1.0:
                ts.append((v - u) / (du - dv))
        for t in ts:
            value = min(u + t * du for u, du in lines)
            candidates.append((value, (px + t * (qx - px), py + t * (qy - py))))
    best = max(value for value, _ in candidates)
    equals = [point for value, point in candidates if value >= best - 1e-9]
    return nearest_on_segment(near, min(equals), max(equals))


def nearest_on_segment(point: Point, a: Point, b: Point) -> Point:
    """Returns the point of the segment a-b that is nearest to `point`."""
    ex, ey = b[0] - a[0], b[1] - a[1]
    length_squared = ex * ex + ey * ey
    if length_squared == 0.0:
        return a
    t = ((point[0] - a[0]) * ex + (point[1] - a[1]) * ey) / length_squared
    t = min(max(t, 0.0), 1.0)
    return a[0] + t * ex, a[1] + t * ey


def _clip(point: Point, low: Point, high: Point) -> Point:
    """Returns the point of the rectangle nearest to `point`."""
    return min(max(point[0], low[0]), high[0]), min(max(point[1], low[1]), high[1])
