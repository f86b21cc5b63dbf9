"""Searches the orders in which legs may step; one step and its best body shift.

A sequence names the legs lifted, in order. The last lift of a leg takes it to its goal; any
earlier one takes it to a place in between, which is free. With no free place the sequences share
their lifts, and the best is found exactly over the subsets of legs already moved. With free
places see `transition_detour`.

Plans are compared by their margins from the smallest up; of equal ones the first in order of legs
is taken, so that the result does not depend on rounding.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import combinations, pairwise, product
from math import hypot, inf

from drake_quad.gait.workspace import Workspace
from drake_quad.stability.support_polygon import Point, nearest_on_segment, stability_margin

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
        margin = stability_margin((self.com[0] + shift[0], self.com[1] + shift[1]), standing)
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
        near: Reference [m]: the nearest of equally good points to it is taken.
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


def _clip(point: Point, low: Point, high: Point) -> Point:
    """Returns the point of the rectangle nearest to `point`."""
    return min(max(point[0], low[0]), high[0]), min(max(point[1], low[1]), high[1])


ROUNDING = 1e-9  # [m]; a margin this much short of what is required counts as reaching it

Sequence = tuple[int, ...]  # rows of the legs lifted


@dataclass(frozen=True)
class Plan:
    """Lifts in order: (row, from, to, margin and shift)."""

    lifts: tuple[tuple[int, Point, Point, Lift], ...]

    @property
    def key(self) -> tuple[float, ...]:
        """The margins from the smallest up, to the nanometre: the larger, the better the plan."""
        return tuple(sorted(round(lift.margin, 9) + 0.0 for *_, lift in self.lifts))

    @property
    def sequence(self) -> Sequence:
        """The rows of the legs lifted."""
        return tuple(row for row, *_ in self.lifts)

    def reaches(self, margin: float) -> bool:
        """Returns whether every lift has at least this margin [m], but for rounding."""
        return all(lift.margin >= margin - ROUNDING for *_, lift in self.lifts)


def is_better(plan: Plan, other: Plan | None) -> bool:
    """Returns whether a plan is to be taken before another of as many lifts."""
    if other is None or plan.key != other.key:
        return other is None or plan.key > other.key
    return plan.sequence < other.sequence


def sequences(rows: frozenset[int], count: int) -> Iterator[Sequence]:
    """Yields all sequences of `count` lifts, in lexicographic order.

    Args:
        rows: Legs that are not at their goals: each is lifted at least once. The others are
            lifted not at all, or away from where they stand and back again.
        count: How many lifts. No leg is lifted twice in a row.
    """
    for sequence in product(range(4), repeat=count):
        lifted = set(sequence)
        if (
            rows <= lifted
            and all(a != b for a, b in pairwise(sequence))
            and all(sequence.count(row) > 1 for row in lifted - rows)
        ):
            yield sequence


def apply_lift(rules: LiftRules, moves: Iterable[tuple[int, Point]]) -> Plan:
    """Returns the plan that moves feet (row, place), one after another, from the rules' start."""
    places = rules.start
    lifts = []
    for row, target in moves:
        lifts.append((row, places[row], target, rules.lift(row, places, target)))
        front_left, front_right, rear_left, rear_right = (
            target if k == row else place for k, place in enumerate(places)
        )
        places = (front_left, front_right, rear_left, rear_right)
    return Plan(tuple(lifts))


def apply_lift_to_goal(rules: LiftRules, sequence: Sequence) -> Plan:
    """Returns the plan that moves each leg of a sequence, once, to its goal."""
    return apply_lift(rules, ((row, rules.goal[row]) for row in sequence))


def best_direct(rules: LiftRules, rows: frozenset[int]) -> Plan:
    """Returns the best plan, stable or not, that moves each leg of `rows` once.

    The best way to have moved a set of legs is to have moved all but one of them in the best way,
    and then that one. (Adding the same margin to two sorted lists does not change which of them
    compares as the better one.) So only the best plan for each set is kept, not all orders.
    """
    best: dict[frozenset[int], Plan] = {frozenset(): Plan(())}
    for _ in rows:
        grown: dict[frozenset[int], Plan] = {}
        for moved, plan in best.items():
            for row in sorted(rows - moved):
                candidate = apply_lift_to_goal(rules, (*plan.sequence, row))
                if is_better(candidate, grown.get(moved | {row})):
                    grown[moved | {row}] = candidate
        best = grown
    return best[rows]
