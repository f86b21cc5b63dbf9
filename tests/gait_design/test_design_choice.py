"""Which gait is chosen, of which patterns; and what is said where there is none."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from design_rig import MODEL, shape
from rig import paper_robot

from drake_quad.common import FloatArray
from drake_quad.feasibility.check import check_flight
from drake_quad.gait_design import choose_gait as choose
from drake_quad.gait_design.candidates import Staircase, candidate_bounds, make_candidates
from drake_quad.gait_design.choose_gait import ENOUGH, choose_gaits, describe_gait
from drake_quad.gait_design.search import (
    AGAIN,
    HOPELESS,
    QUICK,
    SEARCH_SETTINGS,
    SURELY,
    THOROUGH,
    Search,
    SearchSettings,
)
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.terrain.elements import Stairs


def test_higher_steps_are_never_easier() -> None:
    """The best score falls, if anything, as rises grow."""
    robot = paper_robot()
    scores = []
    for rise in (0.05, 0.25, 0.6):
        flights = [Staircase(rise, 0.35), Staircase(-rise, 0.35)]
        scores.append(max(d.score for d in choose_gaits(robot, shape(), flights)))
    assert all(a >= b for a, b in pairwise(scores))
    assert scores[0] > 0.5 > 0.0 > scores[-1]


def test_a_good_gait_comes_before_other_patterns_are_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On easy stairs one search answers; who asks for more gets each other pattern once.

    Those with two places to a tread last: nobody needs them who can plan another.
    """
    searched = []
    least = Search.least

    def counted(
        search: Search, first: FloatArray, way: SearchSettings, **ends: float
    ) -> FloatArray:
        searched.append(search)
        return least(search, first, way, **ends)

    monkeypatch.setattr(Search, "least", counted)
    flights = [Staircase(0.1, 0.4), Staircase(-0.1, 0.4)]
    gaits = choose_gaits(paper_robot(), shape(), flights)
    first = next(gaits)
    assert first.score >= ENOUGH and len(searched) == 1
    others = list(gaits)
    assert len(searched) == 1 + len(others) > 1
    assert len({d.gait.pattern for d in (first, *others)}) == 1 + len(others)
    places = [d.gait.pattern.per_tread for d in (first, *others)]
    assert places == sorted(places) and places[-1] == 2


def test_a_thorough_search_looks_at_treads_of_two_places_in_any_case(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And from other beginnings, more of them; the quick one only where one place is not enough."""
    searched: list[tuple[int, SearchSettings]] = []

    def noted(search: Search, first: FloatArray, way: SearchSettings, **ends: float) -> FloatArray:
        searched.append((len(first), way))
        return np.asarray(first[0])

    monkeypatch.setattr(Search, "least", noted)
    flights = [Staircase(0.9, 0.3), Staircase(-0.9, 0.3)]
    for way in SEARCH_SETTINGS:
        searched.clear()
        gaits = list(choose_gaits(paper_robot(), shape(), flights, way))
        assert {d.gait.pattern.per_tread for d in gaits} == {1, 2}
        assert set(searched) == {(way.members, way)}
    assert len({QUICK.seed, AGAIN.seed}) == 2 and QUICK.members < THOROUGH.members


def test_a_search_ends_with_enough_or_as_hopeless() -> None:
    """With no less room than was asked for; and where much too much is lacking, early."""
    robot, (lower, upper, _) = paper_robot(), candidate_bounds(FootholdPattern(1, 2))
    first = lower + np.random.default_rng(0).random((40, len(lower))) * (upper - lower)

    def lacking(rise: float, **ends: float) -> tuple[float, int]:
        flights = [Staircase(rise, 0.4), Staircase(-rise, 0.4)]
        search, asked = Search(robot, shape(), FootholdPattern(1, 2), flights), []
        search_call = type(search).__call__

        class Counted(Search):
            def __call__(self, x: FloatArray) -> FloatArray:
                asked.append(x.shape[1])
                return search_call(self, x)

        search.__class__ = Counted
        x = search.least(first, QUICK, **ends)
        search.rivals = None
        return float(search(x[:, None])[0]), len(asked)

    best, whole = lacking(0.1)
    found, until = lacking(0.1, enough=SURELY)
    assert best <= found <= SURELY and until < 0.5 * whole
    _, whole = lacking(0.7)
    _, until = lacking(0.7, hopeless=HOPELESS)
    assert until < 0.6 * whole


@pytest.mark.slow  # test_check_nearest.py asks the same, of searches made up
def test_stairs_out_of_reach_are_told_with_what_would_work() -> None:
    """The limit, by how much, the gait that came nearest, and about the highest rise that works."""
    check = check_flight(MODEL, Stairs(0.8, 0.25, 3))
    assert not check.feasible
    for words in (
        "rise 0.8 m on a run of 0.25 m",
        "a cycle",
        "a quick search finds gaits for up to",
    ):
        assert words in check.reason
    nearest = check.data["nearest_rise"]
    assert 0.1 < nearest < 0.8
    for rise, works in ((nearest, True), (nearest + 0.05, False)):
        flights = [Staircase(rise, 0.25), Staircase(-rise, 0.25)]
        found = any(d.feasible for d in choose_gaits(paper_robot(), shape(), flights))
        assert found == works, rise
    assert check_flight(MODEL, Stairs(0.5 * nearest, 0.25, 3)).feasible


def test_runs_that_no_stance_fits_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Front and rear feet would be too near or too far apart, with any pattern of footprints."""
    monkeypatch.setattr(choose, "make_foothold_patterns", lambda *_: [])
    check = check_flight(MODEL, Stairs(0.05, 0.3, 2))
    assert not check.feasible and "as far apart as the hips" in check.reason


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        (FootholdPattern(1, 2), "1 tread a cycle, rear"),
        (FootholdPattern(2, 3), "2 treads a cycle, rear"),
        (FootholdPattern(1, 3, 2), "1 place a cycle, 2 to a tread, rear"),
        (FootholdPattern(2, 4, 2), "2 places a cycle, 2 to a tread, rear"),
    ],
)
def test_a_gait_is_told_in_words(pattern: FootholdPattern, words: str) -> None:
    """How far a cycle goes, and how treads are shared."""
    first = next(choose_gaits(paper_robot(), shape(), [Staircase(0.1, 0.4)]))
    _, _, usual = candidate_bounds(pattern)
    told = describe_gait(replace(first, gait=make_candidates(paper_robot(), pattern, usual)))
    assert told.startswith(f"({words} feet {pattern.lag} behind, body ")
