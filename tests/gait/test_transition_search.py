"""The order of lifts."""

from itertools import pairwise, permutations, product

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from drake_quad.common import FloatArray
from drake_quad.gait.transition_search import (
    LiftRules,
    Places,
    apply_lift,
    apply_lift_to_goal,
    best_direct,
    sequences,
)
from drake_quad.gait.workspace import PAPER_WORKSPACE
from drake_quad.stability.support_polygon import Point, stability_margin

offsets = arrays(np.float64, (4, 2), elements=st.floats(-0.2, 0.2))
ALL = frozenset(range(4))


def places(feet: FloatArray) -> Places:
    a, b, c, d = ((x, y) for x, y in feet.tolist())
    return a, b, c, d


def make_rules(start: FloatArray, goal: FloatArray, max_shift: float) -> LiftRules:
    centres = PAPER_WORKSPACE.centres
    return LiftRules(
        com=(0.0, 0.0),
        max_shift=max_shift,
        start=places(centres + start),
        goal=places(centres + goal),
        goal_shift=(0.0, 0.0),
        workspace=PAPER_WORKSPACE,
    )


@given(offsets, offsets, st.sampled_from([0.0, 0.1]))
@settings(max_examples=50)
def test_the_best_order_is_the_best_of_all_orders(
    start: FloatArray, goal: FloatArray, max_shift: float
) -> None:
    """The search over subsets finds what trying all 24 orders finds, and the first of equals."""
    rules = make_rules(start, goal, max_shift)
    everything = [apply_lift_to_goal(rules, order) for order in permutations(range(4))]
    best = best_direct(rules, ALL)
    assert best.key == max(plan.key for plan in everything)
    assert best.sequence == min(plan.sequence for plan in everything if plan.key == best.key)


@given(offsets, offsets, st.sampled_from([frozenset({0, 3}), frozenset({1}), ALL]))
@settings(max_examples=50)
def test_a_direct_plan_moves_each_leg_once_from_start_to_goal(
    start: FloatArray, goal: FloatArray, rows: frozenset[int]
) -> None:
    """Its margins are those of the three feet that stand, as they then stand."""
    rules = make_rules(start, goal, 0.0)
    feet: list[Point] = list(rules.start)
    for row, p_from, p_to, lift in best_direct(rules, rows).lifts:
        assert (p_from, p_to) == (rules.start[row], rules.goal[row])
        standing = [place for k, place in enumerate(feet) if k != row]
        assert lift.margin == pytest.approx(stability_margin((0.0, 0.0), standing), abs=1e-12)
        feet[row] = p_to
    assert feet == [rules.goal[k] if k in rows else rules.start[k] for k in range(4)]


@pytest.mark.parametrize("rows", [ALL, frozenset({2}), frozenset({0, 1}), frozenset[int]()])
@pytest.mark.parametrize("count", [0, 3, 4, 5])
def test_sequences_are_all_useful_ones(rows: frozenset[int], count: int) -> None:
    """Every leg with a goal is lifted, no leg twice in a row, and others return to their place."""
    found = list(sequences(rows, count))
    assert found == sorted(set(found))
    for sequence in product(range(4), repeat=count):
        useful = (
            rows <= set(sequence)
            and all(sequence.count(row) != 1 for row in set(sequence) - rows)
            and not any(a == b for a, b in pairwise(sequence))
        )
        assert (sequence in found) == useful


def test_plans_count_a_margin_on_the_border_as_reached() -> None:
    """A centre of mass on the border is stable, as in the paper; it has no margin to give."""
    still = make_rules(np.zeros((4, 2)), np.zeros((4, 2)), 0.0)
    assert apply_lift(still, [(0, still.goal[0])]).reaches(0.0)
    assert not apply_lift(still, [(0, still.goal[0])]).reaches(1e-3)
