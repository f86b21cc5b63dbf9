"""Transitions by way of intermediate footholds, and where these may be.

For the margin to be m with feet a, b and q on the ground, the circle of radius m about the centre
of mass has to be inside the triangle a-b-q: q is beyond both of the tangents from a and b that
pass the circle on its far sides. For a fixed m these are half-planes, so the admissible places are
a convex polygon, which shrinks as m grows.

With the body still and one place in between, the best place is exact. With
two of these, or with one and a body that shifts, places and shifts are improved in turn from a
set of beginnings: its margins are exact, though a better plan may exist.
"""

from collections.abc import Iterator
from itertools import pairwise
from math import asin, cos, hypot, sin

from drake_quad.gait.transition_search import (
    ROUNDING,
    LiftRules,
    Plan,
    Sequence,
    apply_lift,
    is_better,
    sequences,
)
from drake_quad.stability.support_polygon import Point, nearest_on_segment

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
        triples: Other three feet of the stance, for each lift during which the foot stands there.
        box: The places allowed, a counterclockwise convex polygon [m].
        floor: The least margin that is of any use [m], not negative.
        near: Reference [m]: the nearest of equally good places to it is taken.
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


Visit = tuple[int, int]  # a leg's row, and how often it has been moved: names a place
Chosen = dict[Visit, Point]

_ROUNDS = 6
_REACH = 0.2  # [m] beyond start and goal, for the places of a foot that no workspace limits


def best_detour(rules: LiftRules, rows: frozenset[int], count: int, required: float) -> Plan | None:
    """Returns the best plan found of `count` lifts by way of places in between.

    Args:
        rules: What holds for every lift.
        rows: Legs that are not at their goals.
        count: How many lifts.
        required: The least margin of each lift [m]; at least 0 is required.

    Returns:
        None where no plan is found that reaches the margin.
    """
    best: Plan | None = None
    floor = max(required, 0.0)
    for sequence in sequences(rows, count):
        plan = plan_sequence(rules, sequence, floor)
        if plan is not None and is_better(plan, best):
            best, floor = plan, max(floor, plan.key[0])
    return best


def plan_sequence(
    rules: LiftRules, sequence: Sequence, floor: float, *, straight: bool = False
) -> Plan | None:
    """Returns the best plan found for one sequence; None if none reaches `floor` >= 0 [m].

    At most two places in between are handled, and one if the body shifts: None with more. Of
    equally good places the nearest to where the leg began is taken; with `straight` rather one
    straight ahead of that or behind it.
    """
    detour = _Detour(rules, sequence, straight=straight)
    if len(detour.free) > (2 if detour.still else 1) or not detour.fixed_lifts_reach(floor):
        return None
    best: Plan | None = None
    for beginning in detour.beginnings(floor):
        plan = detour.improved(beginning, floor)
        if plan is not None and plan.reaches(floor) and is_better(plan, best):
            best = plan
    return best


class _Detour:
    """One sequence with its free places, and which lifts these affect."""

    def __init__(self, rules: LiftRules, sequence: Sequence, *, straight: bool = False) -> None:
        self.rules, self.sequence, self.straight = rules, sequence, straight
        self.still = rules.max_shift == 0.0
        moved = [0, 0, 0, 0]
        self.before: list[list[Visit]] = []  # for each lift, where the feet are before it
        for row in sequence:
            self.before.append(list(enumerate(moved)))
            moved[row] += 1
        self.last = moved
        self.free = [(row, visit) for row in range(4) for visit in range(1, moved[row])]

    def standing(self, step: int) -> list[Visit]:
        """Returns where the other feet stand during a lift."""
        return [visit for visit in self.before[step] if visit[0] != self.sequence[step]]

    def involved(self, step: int) -> list[Visit]:
        """Returns where all feet are before and after a lift."""
        row = self.sequence[step]
        return [*self.before[step], (row, self.before[step][row][1] + 1)]

    def place(self, visit: Visit, chosen: Chosen) -> Point:
        """Returns the place that a visit names; a free one not chosen yet is where its leg began.

        Such a stand-in serves only lifts that do not depend on it.
        """
        row, number = visit
        if 0 < number < self.last[row]:
            return chosen.get(visit, self.rules.start[row])
        return self.rules.goal[row] if number else self.rules.start[row]

    def plan(self, chosen: Chosen) -> Plan:
        """Returns the plan by way of the chosen places."""
        targets = (self.involved(step)[-1] for step in range(len(self.sequence)))
        return apply_lift(self.rules, [(visit[0], self.place(visit, chosen)) for visit in targets])

    def fixed_lifts_reach(self, floor: float) -> bool:
        """Returns whether the lifts that no free place affects have the margin `floor`."""
        for step, (*_, lift) in enumerate(self.plan({}).lifts):
            affecting = self.standing(step) if self.still else self.involved(step)
            if lift.margin < floor - ROUNDING and not set(affecting) & set(self.free):
                return False
        return True

    def beginnings(self, floor: float) -> Iterator[Chosen]:
        """Yields choices of places from which to improve."""
        *_, last = self.free
        if not self.still:
            (x_lo, y_lo), _, (x_hi, y_hi), _ = box = self.box(last, None)
            middle = ((x_lo + x_hi) / 2.0, (y_lo + y_hi) / 2.0)
            edges = [((ax + bx) / 2, (ay + by) / 2) for (ax, ay), (bx, by) in pairwise(box)]
            ends = [self.rules.start[last[0]], self.rules.goal[last[0]]]
            yield from ({last: place} for place in [*ends, middle, *edges, *box])
        elif len(self.free) == 1:
            yield {}
        else:
            steps = [k for k in self.steps_on(last) if self.free[0] not in self.standing(k)]
            triples = [self.triple(last, step, {}, None) for step in steps]
            corners = places_with_margin(triples, self.box(last, None), floor)
            if corners:
                count = len(corners)
                yield {
                    last: (sum(x for x, _ in corners) / count, sum(y for _, y in corners) / count)
                }
            yield from ({last: corner} for corner in corners)

    def improved(self, chosen: Chosen, floor: float) -> Plan | None:
        """Returns the plan after improving each free place in turn; None where one has no place."""
        best: Plan | None = None
        for _ in range(_ROUNDS if len(self.free) > 1 or not self.still else 1):
            for visit in self.free:
                shifts = None if self.still else self.plan(chosen)
                least = floor
                if shifts is not None:
                    # The shifts were the best ones for the place at hand: improve on that.
                    least = min(shifts.lifts[k][3].margin for k in self.steps_on(visit))
                    if least < 0.0:
                        return best
                found = best_place(
                    [self.triple(visit, step, chosen, shifts) for step in self.steps_on(visit)],
                    self.box(visit, shifts),
                    floor=least,
                    near=self.rules.start[visit[0]],
                    straight=self.straight,
                )
                if found is None:
                    return best
                chosen = {**chosen, visit: found[1]}
            plan = self.plan(chosen)
            if best is not None and not is_better(plan, best):
                break
            best = plan
        return best

    def steps_on(self, visit: Visit) -> list[int]:
        """Returns the lifts during which a foot stands at the place of a visit."""
        return [step for step in range(len(self.sequence)) if visit in self.standing(step)]

    def triple(self, visit: Visit, step: int, chosen: Chosen, shifts: Plan | None) -> Triple:
        """Returns the centre of mass and the two other standing feet during a lift."""
        a, b = (self.place(other, chosen) for other in self.standing(step) if other != visit)
        x, y = self.rules.com
        dx, dy = shifts.lifts[step][3].shift if shifts is not None else (0.0, 0.0)
        return (x + dx, y + dy), a, b

    def box(self, visit: Visit, shifts: Plan | None) -> Polygon:
        """Returns the rectangle of admissible places, counterclockwise from its lower corner."""
        row, _ = visit
        if self.rules.workspace is None:
            ends = self.rules.start[row], self.rules.goal[row]
            low = [min(values) - _REACH for values in zip(*ends, strict=True)]
            high = [max(values) + _REACH for values in zip(*ends, strict=True)]
        else:
            steps = [k for k in range(len(self.sequence)) if visit in self.involved(k)]
            moved = (
                [shifts.lifts[k][3].shift for k in steps] if shifts is not None else [(0.0, 0.0)]
            )
            centre = self.rules.workspace.centres[row].tolist()
            half = self.rules.workspace.half_size.tolist()
            low = [centre[k] - half[k] + max(shift[k] for shift in moved) for k in (0, 1)]
            high = [centre[k] + half[k] + min(shift[k] for shift in moved) for k in (0, 1)]
        return [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
