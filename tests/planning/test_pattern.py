"""The wave gait's footprints on places: laws that hold for any treads a cycle and any lag."""

from itertools import product

import pytest

from drake_quad.planning.foothold_pattern import LIFT_OFF, FootholdPattern
from drake_quad.robot.legs import LEGS, Leg

PATTERNS = [FootholdPattern(treads, lag) for treads, lag in product((1, 2, 3), (1, 2, 3, 4))]


def places(pattern: FootholdPattern, at: float) -> dict[Leg, int]:
    """Where every foot stands at a fraction of the cycle, a swing being over at once."""
    return {leg: pattern.first(leg) + (pattern.treads if LIFT_OFF[leg] < at else 0) for leg in LEGS}


def test_the_papers_two_tread_gait_is_the_default() -> None:
    """Section II-A: legs 1-4-2-3 begin on places 0, -1, 1, 0 of the body's."""
    assert [FootholdPattern().first(leg) for leg in (Leg(1), Leg(4), Leg(2), Leg(3))] == [
        0,
        -1,
        1,
        0,
    ]
    assert FootholdPattern().stance == pytest.approx(1.5)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_body_is_over_the_middle_of_the_strokes_within_half_a_place(
    pattern: FootholdPattern,
) -> None:
    """What is left of it is `ahead`, which the body's path makes up for."""
    assert abs(pattern.ahead(1.0)) <= 0.5 + 1e-9
    assert pattern.ahead(0.75) == pytest.approx(pattern.ahead(1.0) - 0.125 * pattern.treads)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_another_lag_of_one_tread_is_a_stance_of_one_tread_more(pattern: FootholdPattern) -> None:
    """Front feet stay together, and rear feet; only the distance between the pairs grows."""
    longer = FootholdPattern(pattern.treads, pattern.lag + 1)
    assert longer.stance == pytest.approx(pattern.stance + 1.0)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_places_are_shared_where_it_says_so(pattern: FootholdPattern) -> None:
    """A rear foot lands on the place of the front foot of its side, or never does."""
    shared = False
    for rear, front in ((Leg(3), Leg(1)), (Leg(4), Leg(2))):
        landed = places(pattern, LIFT_OFF[rear] + 0.01)
        shared |= landed[rear] == landed[front]
    assert shared == pattern.shares_places


@pytest.mark.parametrize("pattern", PATTERNS)
def test_no_foot_begins_beyond_what_is_laid(pattern: FootholdPattern) -> None:
    """The lattice has a place for every foot as a walk begins and as it ends."""
    first = [pattern.first(leg) for leg in LEGS]
    assert -min(first) <= pattern.behind and max(first) <= pattern.beyond
