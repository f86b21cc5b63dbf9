"""Rates with exact bounds, tests of significance, and caveats.

A test counts independent units. These are the trials where each has draws of its own. They are the
draws where all cells of a grid share them: a draw that is hard for the robot may fail in every cell
at once, and 35 trials lost by it are evidence of one draw. Every test here is two-sided and exact
for few units. `scipy.stats` takes half a second to import, so functions import it when they need
it.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np

CONFIDENCE = 0.95

SIGNIFICANT = 0.05  # level of significance: below it two rates are called different
RESAMPLES = 2**16  # all permutations up to this number; beyond it, as many at random

KINEMATIC = "Some trials are kinematic replays without physics, which prove nothing."
SHARED = (
    "All cells have the same draws: the bounds hold for each cell alone, and may be too narrow for "
    "several together."
)


@dataclass(frozen=True)
class Rate:
    """A rate of success.

    Attributes:
        good: Number of trials that succeeded.
        trials: Number of trials.
        low: Clopper and Pearson's exact lower bound (Biometrika 1934), two-sided at 95 %.
        high: Clopper and Pearson's exact upper bound.
    """

    good: int
    trials: int
    low: float
    high: float

    @property
    def rate(self) -> float:
        """The part that succeeded; nan without trials."""
        return self.good / self.trials if self.trials else float("nan")

    def text(self) -> str:
        """In words, for example `97.5 % (94.6 to 99.1 %)`."""
        if not self.trials:
            return "-"
        return f"{percent(self.rate)} % ({percent(self.low)} to {percent(self.high)} %)"


def percent(part: float) -> str:
    """A part of the whole in percent: 100 stands only for all of it, and 0 only for nothing."""
    text = f"{100.0 * part:.1f}"
    if text == "100.0" and part < 1.0:
        return ">99.9"
    return "<0.1" if text == "0.0" and part > 0.0 else text


def rate_of(good: int, trials: int) -> Rate:
    """The rate with its bounds."""
    if trials == 0:
        return Rate(0, 0, 0.0, 1.0)
    from scipy.stats import binomtest

    interval = binomtest(good, trials).proportion_ci(confidence_level=CONFIDENCE, method="exact")
    return Rate(good, trials, float(interval.low), float(interval.high))


def causes_of(outcomes: Sequence[str], reasons: Sequence[str]) -> list[tuple[str, int]]:
    """Why trials failed, and how many did: reasons that differ in numbers alone count as one."""
    causes = Counter(
        f"{outcome}: {re.sub(r'-?[0-9]+([.][0-9]+)?(e[-+]?[0-9]+)?', '#', reason)}"
        for outcome, reason in zip(outcomes, reasons, strict=True)
        if outcome != "goal_reached"
    )
    return sorted(causes.items(), key=lambda item: (-item[1], item[0]))


@dataclass(frozen=True)
class Finding:
    """The result of a test of significance.

    Attributes:
        test: Name of the test.
        unit: What it counts: `trial` or `draw`.
        units: Number of units: of both sweeps if they are paired, else of each.
        change: Change from the first sweep to the second: negative if the second is worse.
        p: Probability of a difference at least as great by chance.
        least: Smallest possible `p` for as many units, if the sweeps differed most.
    """

    test: str
    unit: str
    units: tuple[int, ...]
    change: float
    p: float
    least: float

    @property
    def verdict(self) -> str:
        """How the second sweep is: worse, better, no different; or that units are too few."""
        if self.least >= SIGNIFICANT:
            return "cannot be told"
        if self.p >= SIGNIFICANT:
            return "no different"
        return "worse" if self.change < 0.0 else "better"


def paired_trials(changes: Sequence[int]) -> Finding:
    """McNemar's test (Psychometrika 1947), exact: as many are lost as won, but for chance.

    Args:
        changes: Change of each trial of both sweeps: -1 lost, 1 won, 0 as before.
    """
    from scipy.stats import binomtest

    lost, won = changes.count(-1), changes.count(1)
    p = float(binomtest(lost, lost + won).pvalue) if lost + won else 1.0
    units = (len(changes),)
    return Finding("McNemar's exact test", "trial", units, won - lost, p, _least_paired(units[0]))


def paired_draws(changes: Sequence[int]) -> Finding:
    """Fisher's permutation test of pairs (The Design of Experiments, 1935, section 21).

    Without a difference the two sweeps of a draw could as well change places, all its cells at
    once: the sum over the draws is compared with the sums by every choice of their signs. With one
    trial to each draw this is McNemar's test. It looks at the rate, as a sign test does not, which
    takes three draws that win a trial each for more than one that loses thirty.

    Args:
        changes: Trials won minus trials lost, for each draw of both sweeps.
    """
    changed = np.array([change for change in changes if change], dtype=float)
    # With one change either sign is as extreme; and the library needs two.
    p = _permuted((changed,), _total, "samples") if len(changed) > 1 else 1.0
    units = (len(changes),)
    least = _least_paired(units[0])
    return Finding("permutation test of pairs", "draw", units, float(changed.sum()), p, least)


def apart_trials(good: Sequence[int], trials: Sequence[int]) -> Finding:
    """Fisher's exact test of two rates.

    Args:
        good: Number of trials that succeeded, in either sweep.
        trials: Number of trials, in either sweep.
    """
    from scipy.stats import fisher_exact

    bad = [trials[k] - good[k] for k in (0, 1)]
    p = float(fisher_exact([[good[0], bad[0]], [good[1], bad[1]]]).pvalue)
    least = float(fisher_exact([[trials[0], 0], [0, trials[1]]]).pvalue)
    change = good[1] / trials[1] - good[0] / trials[0]
    return Finding("Fisher's exact test", "trial", tuple(trials), change, p, least)


def apart_draws(before: Sequence[float], after: Sequence[float]) -> Finding:
    """Pitman's permutation test (J. R. Stat. Soc. Suppl. 1937) of the mean over draws.

    Without a difference any draw could belong to either sweep. That holds if draws differ by chance
    alone: each has all cells of a grid, and both grids have as many cells.

    Args:
        before: Rate of each draw of the first sweep.
        after: Rate of each draw of the second sweep.
    """
    units = (len(before), len(after))
    if min(units) < 2:  # the library needs two of each
        return Finding("permutation test", "draw", units, 0.0, 1.0, 1.0)
    change = float(np.mean(after) - np.mean(before))
    p = _permuted((np.array(after), np.array(before)), _gap, "independent")
    least = 2.0 / comb(sum(units), units[0])
    return Finding("permutation test", "draw", units, change, p, least)


def _least_paired(units: int) -> float:
    """The smallest p of n pairs: all change one way, as 2 of 2^n choices of signs have it."""
    return min(1.0, 2.0 * 0.5**units)


def _permuted(data: tuple[np.ndarray, ...], statistic: Any, how: str) -> float:
    from scipy.stats import permutation_test

    found = permutation_test(
        data, statistic, permutation_type=how, n_resamples=RESAMPLES, batch=4096, vectorized=True,
        rng=0,
    )  # fmt: skip
    return float(found.pvalue)


def _total(changes: np.ndarray, axis: int) -> Any:
    return np.sum(changes, axis=axis)


def _gap(one: np.ndarray, other: np.ndarray, axis: int) -> Any:
    return np.mean(one, axis=axis) - np.mean(other, axis=axis)


def caveats_of(findings: dict[str, Any]) -> list[str]:
    """Sentences that must stand beside the rate, lest it say more than was found.

    Args:
        findings: The findings of a sweep, as `summarize_sweep` returns them.
    """
    lines = []
    if not findings["complete"]:
        lines.append(
            f"{findings['trials']} of the {findings['asked']} trials of the study are done."
        )
    if findings["given_up"]:
        lines.append(
            f"{findings['given_up']} trials that began earlier are not done: trials that end early "
            "are overrepresented, and a fall ends a trial early."
        )
    if findings["kinematic"]:
        lines.append(KINEMATIC)
    if findings["sharing"] > 1:
        lines.append(SHARED)
    if findings["repeats"]:
        lines.append(
            f"{findings['repeats']} trials ended exactly as another of the same cell: nothing in "
            "them is random, so they are no further evidence, and the bounds are too narrow."
        )
    return lines


def gate_words(findings: dict[str, Any]) -> str:
    """The gate in words, and whether it was passed; empty if the study has none."""
    if findings["gate"] is None or findings["passed"] is None:
        return ""
    of = "" if findings["gate_each"] is None else f" of each {findings['gate_each']}"
    word = ("passed" if findings["passed"] else "missed") + (
        "" if findings["complete"] else " so far"
    )
    none = (
        f"; no trial of {', '.join(findings['gate_untried'])}" if findings["gate_untried"] else ""
    )
    return f"gate of at least {100 * findings['gate']:g} %{of}: {word}{none}"


def grade(findings: dict[str, Any]) -> str:
    """The rate's colour: good, warn or bad; without a gate all trials have to succeed."""
    rate = findings["rate"]
    if findings["passed"] is False or not rate["good"]:
        return "bad"
    well = findings["passed"] if findings["gate"] is not None else rate["good"] == rate["trials"]
    return "good" if well and findings["complete"] and not findings["kinematic"] else "warn"
