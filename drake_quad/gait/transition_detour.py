"""Transitions on which a leg is put down in between, so that others can be lifted.

With the body still and one place in between, the best place is exact (`transition_place`). With
two of these, or with one and a body that shifts, places and shifts are improved in turn from a
set of beginnings: what is found is as stable as it says, though a better plan may exist.
"""

from collections.abc import Iterator
from itertools import pairwise

from drake_quad.gait.support import Point
from drake_quad.gait.transition_lift import LiftRules
from drake_quad.gait.transition_place import Polygon, Triple, best_place, places_with_margin
from drake_quad.gait.transition_search import ROUNDING, Plan, Sequence, better, follow, sequences

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
        required: The least margin of each lift [m]; at least 0 is asked for.

    Returns:
        None where no plan is found that reaches the margin.
    """
    best: Plan | None = None
    floor = max(required, 0.0)
    for sequence in sequences(rows, count):
        plan = plan_sequence(rules, sequence, floor)
        if plan is not None and better(plan, best):
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
        if plan is not None and plan.reaches(floor) and better(plan, best):
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
        return follow(self.rules, [(visit[0], self.place(visit, chosen)) for visit in targets])

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
            if best is not None and not better(plan, best):
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
