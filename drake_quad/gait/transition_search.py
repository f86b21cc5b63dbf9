"""The search for a transition's lifts: in which order, and by way of which places.

A sequence names the legs lifted, in order. The last lift of a leg takes it to its goal; any
earlier one takes it to a place in between, which is free. With no free place the sequences share
their lifts, and the best is found exactly over the subsets of legs already moved. With free
places see `transition_detour`.

Plans are compared by their margins from the smallest up; of equal ones the first in order of legs
is taken, so that the result does not depend on rounding.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise, product

from drake_quad.gait.support import Point
from drake_quad.gait.transition_lift import Lift, LiftRules

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


def better(plan: Plan, other: Plan | None) -> bool:
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


def follow(rules: LiftRules, moves: Iterable[tuple[int, Point]]) -> Plan:
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


def follow_to_goal(rules: LiftRules, sequence: Sequence) -> Plan:
    """Returns the plan that moves each leg of a sequence, once, to its goal."""
    return follow(rules, ((row, rules.goal[row]) for row in sequence))


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
                candidate = follow_to_goal(rules, (*plan.sequence, row))
                if better(candidate, grown.get(moved | {row})):
                    grown[moved | {row}] = candidate
        best = grown
    return best[rows]
