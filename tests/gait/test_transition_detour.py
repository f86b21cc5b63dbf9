"""Transitions by way of places in between."""

import numpy as np
import pytest

from drake_quad.common import FloatArray
from drake_quad.gait.transition_detour import best_detour, plan_sequence
from drake_quad.gait.transition_search import LiftRules, Places, apply_lift, best_direct
from drake_quad.gait.workspace import PAPER_WORKSPACE, wave_desired_configuration

ALL = frozenset(range(4))
CENTRES = PAPER_WORKSPACE.centres
WAVE = wave_desired_configuration(PAPER_WORKSPACE, stroke=0.75, duty_factor=0.75)


def make_rules(
    start: FloatArray, goal: FloatArray, max_shift: float = 0.0, *, boxes: bool = True
) -> LiftRules:
    def places(feet: FloatArray) -> Places:
        a, b, c, d = ((x, y) for x, y in feet.tolist())
        return a, b, c, d

    workspace = PAPER_WORKSPACE if boxes else None
    return LiftRules((0.0, 0.0), max_shift, places(start), places(goal), (0.0, 0.0), workspace)


def random_stances(count: int) -> list[tuple[FloatArray, FloatArray]]:
    rng = np.random.default_rng(3)
    return [
        (
            CENTRES + rng.uniform(-1, 1, (4, 2)) * (0.3, 0.15),
            CENTRES + rng.uniform(-1, 1, (4, 2)) * (0.3, 0.15),
        )
        for _ in range(count)
    ]


@pytest.mark.parametrize("boxes", [True, False])
def test_detours_end_at_the_goal_by_way_of_admissible_places(boxes: bool) -> None:
    """All lifts are stable, a leg's last ends at its goal and an earlier one in its workspace.

    The plan is what doing these moves one by one gives.
    """
    found = 0
    for start, goal in random_stances(12):
        rules = make_rules(start, goal, boxes=boxes)
        for count in (5, 6):
            plan = best_detour(rules, ALL, count, 0.0)
            if plan is None:
                continue
            found += 1
            feet = start.copy()
            assert len(plan.lifts) == count and plan.reaches(0.0)
            for row, p_from, p_to, _ in plan.lifts:
                assert p_from == pytest.approx(tuple(feet[row]))
                feet[row] = p_to
                assert not boxes or PAPER_WORKSPACE.contains(feet, tol=1e-9)
            assert feet.tolist() == goal.tolist()
            again = apply_lift(rules, [(row, p_to) for row, _, p_to, _ in plan.lifts])
            assert again.key == plan.key
            break
    assert found >= 8


def test_a_detour_can_be_as_good_as_any_place_of_a_grid() -> None:
    """With one place in between and the body still, no place of a grid is better."""
    rules = make_rules(CENTRES, WAVE)
    for sequence in ((1, 2, 3, 0, 2), (1, 0, 2, 3, 2), (0, 3, 1, 0, 2)):
        plan = plan_sequence(rules, sequence, 0.0)
        assert plan is not None
        twice = next(row for row in sequence if sequence.count(row) == 2)
        half = PAPER_WORKSPACE.half_size
        best: tuple[float, ...] = (-1.0,)
        for share in np.ndindex(21, 21):
            place = CENTRES[twice] + (np.array(share) / 10.0 - 1.0) * half
            moves, seen = [], False
            for row in sequence:
                first = row == twice and not seen
                seen = seen or first
                moves.append((row, (place[0], place[1]) if first else rules.goal[row]))
            best = max(best, apply_lift(rules, moves).key)
        assert plan.key[0] >= best[0] - 1e-9


def test_a_body_that_shifts_gains_from_a_detour() -> None:
    """Five steps with shifts of at most 0.1 m are more stable than the best four."""
    rules = make_rules(CENTRES, WAVE, 0.1)
    direct, detour = best_direct(rules, ALL), plan_sequence(rules, (1, 0, 2, 3, 2), 0.0)
    assert detour is not None
    assert direct.key[0] == pytest.approx(0.105, abs=1e-3)
    assert detour.key[0] > direct.key[0] + 0.03
    assert max(abs(s) for *_, lift in detour.lifts for s in lift.shift) <= 0.1 + 1e-9


def test_more_places_in_between_than_are_handled_give_no_plan() -> None:
    """Three places with the body still, or two with a body that shifts, are not tried."""
    assert plan_sequence(make_rules(CENTRES, WAVE), (0, 1, 0, 1, 2, 3, 2), 0.0) is None
    assert plan_sequence(make_rules(CENTRES, WAVE, 0.1), (0, 1, 0, 1, 2, 3), 0.0) is None


def test_a_leg_at_its_goal_may_step_aside_and_back() -> None:
    """Where a leg in place blocks another, it is moved away and back again."""
    start = CENTRES + np.array([[0.1, 0.0], [-0.1, 0.0], [0.0, 0.0], [0.0, 0.0]])
    goal = start + np.array([[0.1, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    rules = make_rules(start, goal)
    assert not best_direct(rules, frozenset({0})).reaches(0.0)
    plan = best_detour(rules, frozenset({0}), 3, 0.0)
    assert plan is not None and plan.sequence[0] == plan.sequence[2] != 0
