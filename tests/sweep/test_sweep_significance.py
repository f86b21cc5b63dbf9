"""Tests of significance: their p worked out here again, how often they err, and what they find."""

from itertools import combinations, product
from math import comb

import numpy as np
import pytest
from compare_rig import CELLS, study_of, swept_of

from drake_quad.sweep.compare import compare_paired, compare_unpaired
from drake_quad.sweep.statistics import apart_draws, paired_draws, paired_trials


@pytest.mark.parametrize(("lost", "won"), [(8, 1), (1, 8), (9, 2), (6, 0), (5, 1), (0, 0), (3, 3)])
def test_mcnemars_test_counts_both_sides(lost: int, won: int) -> None:
    """Of those that changed as many are lost as won, but for chance: heads and tails."""
    before = [True] * lost + [False] * won + [True, False] * 5
    after = [False] * lost + [True] * won + [True, False] * 5
    told, found = compare_paired(swept_of(before, study_of()), swept_of(after, study_of()))
    changed = lost + won
    tail = sum(comb(changed, k) for k in range(min(lost, won) + 1))
    p = min(1.0, 2.0 * tail / 2**changed)
    assert found.p == pytest.approx(p) and (found.unit, found.units) == ("trial", (changed + 10,))
    better = "better" if won > lost else "worse"
    assert found.verdict == (better if p < 0.05 else "no different")
    assert told["lost"] == list(range(lost)) and told["won"] == list(range(lost, changed))


@pytest.mark.parametrize(
    "changes", [[3, 1, 1, 2, 0, -1, 4], [-30, 1, 1, 1, 0, 0], [0] * 7, [5] * 6]
)
def test_signs_of_draws_are_changed_in_every_way(changes: list[int]) -> None:
    """The p is the part of all signs by which the sum is as far from 0."""
    sums = [
        abs(sum(s * change for s, change in zip(signs, changes, strict=True)))
        for signs in product((-1, 1), repeat=len(changes))
    ]
    found = paired_draws(changes)
    assert found.p == pytest.approx(np.mean([one >= abs(sum(changes)) for one in sums]))
    assert found.least == pytest.approx(2.0 / 2 ** len(changes))


def test_draws_of_one_trial_each_are_trials() -> None:
    """Then both tests of pairs are the same, for few draws; for many, nearly."""
    for lost, won in ((7, 2), (2, 7), (1, 0), (25, 10)):
        changes = [-1] * lost + [1] * won + [0] * 5
        one, other = paired_draws(changes), paired_trials(changes)
        assert one.p == pytest.approx(other.p, abs=0.0 if lost + won < 16 else 0.003)
        assert one.verdict == other.verdict


def test_draws_that_are_not_paired_change_sweeps_in_every_way() -> None:
    """The p is the part of all ways to deal the draws by which the means are as far apart."""
    before, after = [1.0, 1.0, 0.8, 0.9, 1.0], [0.2, 0.5, 0.8, 0.3, 0.4, 0.1]
    whole = before + after
    gaps = [
        sum(whole[k] for k in chosen) / 5 - sum(whole[k] for k in range(11) if k not in chosen) / 6
        for chosen in combinations(range(11), 5)
    ]
    # Two-sided where the groups are of two sizes: twice the lesser tail.
    tail = np.mean([gap >= gaps[0] - 1e-12 for gap in gaps])
    found = apart_draws(before, after)
    assert found.p == pytest.approx(2.0 * tail) and found.verdict == "worse"
    assert apart_draws(after, before).verdict == "better"
    assert apart_draws([1.0], [0.0] * 60).verdict == "cannot be told"


def chance(rng: np.random.Generator, draws: int, together: float) -> tuple[list[bool], list[bool]]:
    """Two sweeps that differ by chance alone: by whole draws, and by single cells."""
    sides = []
    for _ in range(2):
        whole = np.repeat(rng.random(draws) < 0.5, CELLS)
        single = rng.random(len(whole)) < 0.5
        sides.append(np.where(rng.random(len(whole)) < together, whole, single).tolist())
    return sides[0], sides[1]


@pytest.mark.parametrize("together", [1.0, 0.7, 0.0])
def test_chance_seldom_looks_like_a_difference(together: float) -> None:
    """Of 300 pairs of sweeps without a difference 5 % are called different, or fewer.

    Whether draws go well or badly as a whole, or cell by cell; paired or not. Trial by trial more
    than half would be, where draws go as a whole.
    """
    rng, called = np.random.default_rng(5), {"paired": 0, "apart": 0, "trials": 0}
    common_study = study_of(cells=CELLS, draws="common")
    for _ in range(300):
        sides = chance(rng, 8, together)
        one, other = (swept_of(side, common_study) for side in sides)
        called["paired"] += compare_paired(one, other)[1].p < 0.05
        # Of fewer: there are many more ways to deal draws than to change their signs.
        unpaired = compare_unpaired(*(swept_of(side[: 5 * CELLS], common_study) for side in sides))
        called["apart"] += unpaired is not None and unpaired.p < 0.05
        changes = [b - a for a, b in zip(*sides, strict=True)]
        called["trials"] += paired_trials(changes).p < 0.05
    most = 300 * 0.05 + 3.0 * np.sqrt(300 * 0.05 * 0.95)
    assert called["paired"] <= most and called["apart"] <= most
    assert called["trials"] > 150 or together < 1.0


def test_a_difference_is_found() -> None:
    """Of ten draws, in each of which a tenth of the cells is lost: nearly always."""
    rng, found = np.random.default_rng(6), 0
    study = study_of(cells=CELLS, draws="common")
    for _ in range(50):
        before = rng.random((10, CELLS)) < 0.9
        after = np.where(rng.random((10, CELLS)) < 0.2, rng.random((10, CELLS)) < 0.4, before)
        sides = [swept_of(side.ravel().tolist(), study) for side in (before, after)]
        found += compare_paired(*sides)[1].verdict == "worse"
    assert found >= 45
