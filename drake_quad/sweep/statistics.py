"""Rates with exact bounds, tests of significance, and caveats.

A test counts things that go well or badly each by its own luck, its units. Where trials have draws
of their own these are the trials. Where draws are common to all cells of a grid they are the draws:
one that is hard for the robot may fail in every cell at once, and 35 trials lost by it are evidence
of one draw. Every test here is two-sided and exact for few units.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np
from scipy.stats import binomtest, fisher_exact, permutation_test

# ------------------------------------------------------------------------------------------------
# How often it works: rates with exact bounds, and why it does not.
# ------------------------------------------------------------------------------------------------


CONFIDENCE = 0.95


@dataclass(frozen=True)
class Rate:
    """A rate of success.

    Attributes:
        good: Trials that succeeded.
        trials: Of how many.
        low: Clopper and Pearson's exact lower bound (Biometrika 1934), two-sided at 95 %.
        high: The upper one.
    """

    good: int
    trials: int
    low: float
    high: float

    @property
    def rate(self) -> float:
        """The part that succeeded; nan of no trials."""
        return self.good / self.trials if self.trials else float("nan")

    def text(self) -> str:
        """In words, for example `97.5 % (94.6 to 99.1 %)`."""
        if not self.trials:
            return "-"
        return f"{percent(self.rate)} % ({percent(self.low)} to {percent(self.high)} %)"


def percent(part: float) -> str:
    """A part of the whole in percent; only all of it is 100, and only nothing 0."""
    text = f"{100.0 * part:.1f}"
    if text == "100.0" and part < 1.0:
        return ">99.9"
    return "<0.1" if text == "0.0" and part > 0.0 else text


def rate_of(good: int, trials: int) -> Rate:
    """The rate with its bounds."""
    if trials == 0:
        return Rate(0, 0, 0.0, 1.0)
    from scipy.stats import binomtest  # half a second, for which what needs no rates need not wait

    interval = binomtest(good, trials).proportion_ci(confidence_level=CONFIDENCE, method="exact")
    return Rate(good, trials, float(interval.low), float(interval.high))


def causes_of(outcomes: Sequence[str], reasons: Sequence[str]) -> list[tuple[str, int]]:
    """Why trials failed, with how many: reasons that differ in numbers alone count as one."""
    told = Counter(
        f"{outcome}: {re.sub(r'-?[0-9]+([.][0-9]+)?(e[-+]?[0-9]+)?', '#', reason)}"
        for outcome, reason in zip(outcomes, reasons, strict=True)
        if outcome != "goal_reached"
    )
    return sorted(told.items(), key=lambda item: (-item[1], item[0]))


# ------------------------------------------------------------------------------------------------
# Could the difference of two sweeps be chance? Exact tests, of trials or of whole draws.
# ------------------------------------------------------------------------------------------------


SIGNIFICANT = 0.05  # greatest probability of chance at which two rates are called different
RESAMPLES = 2**16  # all there are, if not more; else so many at random, by the same seed each time


@dataclass(frozen=True)
class Finding:
    """What a test found.

    Attributes:
        test: Which, in words.
        unit: Of what it counts: `trial` or `draw`.
        units: How many it had: of both sweeps if they are paired, else of each.
        change: Its sign is that of the change: negative if the second sweep is worse.
        p: How probable so great a difference is by chance, or a greater one.
        least: What `p` would be at the least, of so many units, if the sweeps differed most.
    """

    test: str
    unit: str
    units: tuple[int, ...]
    change: float
    p: float
    least: float

    @property
    def verdict(self) -> str:
        """Of the second sweep: worse, better, no different; or that so few units tell nothing."""
        if self.least >= SIGNIFICANT:
            return "cannot be told"
        if self.p >= SIGNIFICANT:
            return "no different"
        return "worse" if self.change < 0.0 else "better"


def paired_trials(changes: Sequence[int]) -> Finding:
    """McNemar's test (Psychometrika 1947), exact: as many are lost as won, but for chance.

    Args:
        changes: Of each trial of both sweeps: -1 lost, 1 won, 0 as before.
    """
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
        changes: Of each draw of both sweeps, how many more of its trials were won than lost.
    """
    changed = np.array([change for change in changes if change], dtype=float)
    # Of one that changed either sign is as extreme; and the library wants two.
    p = _permuted((changed,), _total, "samples") if len(changed) > 1 else 1.0
    units = (len(changes),)
    least = _least_paired(units[0])
    return Finding("permutation test of pairs", "draw", units, float(changed.sum()), p, least)


def apart_trials(good: Sequence[int], trials: Sequence[int]) -> Finding:
    """Fisher's exact test of two rates.

    Args:
        good: How many trials succeeded, in either sweep.
        trials: Of how many.
    """
    bad = [trials[k] - good[k] for k in (0, 1)]
    p = float(fisher_exact([[good[0], bad[0]], [good[1], bad[1]]]).pvalue)
    least = float(fisher_exact([[trials[0], 0], [0, trials[1]]]).pvalue)
    change = good[1] / trials[1] - good[0] / trials[0]
    return Finding("Fisher's exact test", "trial", tuple(trials), change, p, least)


def apart_draws(before: Sequence[float], after: Sequence[float]) -> Finding:
    """Pitman's permutation test (J. R. Stat. Soc. Suppl. 1937) of the mean over draws.

    Without a difference any draw could be of either sweep. That holds if draws are alike but for
    their luck: each has all cells of a grid, of as many cells in both.

    Args:
        before: The rate of each draw of the first sweep.
        after: Of the second.
    """
    units = (len(before), len(after))
    if min(units) < 2:  # the library wants two of each
        return Finding("permutation test", "draw", units, 0.0, 1.0, 1.0)
    change = float(np.mean(after) - np.mean(before))
    p = _permuted((np.array(after), np.array(before)), _gap, "independent")
    least = 2.0 / comb(sum(units), units[0])
    return Finding("permutation test", "draw", units, change, p, least)


def _least_paired(units: int) -> float:
    """All change one way: 2 of 2^n choices of signs are as extreme."""
    return min(1.0, 2.0 * 0.5**units)


def _permuted(data: tuple[np.ndarray, ...], statistic: Any, how: str) -> float:
    found = permutation_test(
        data, statistic, permutation_type=how, n_resamples=RESAMPLES, batch=4096, vectorized=True,
        rng=0,
    )  # fmt: skip
    return float(found.pvalue)


def _total(changes: np.ndarray, axis: int) -> Any:
    return np.sum(changes, axis=axis)


def _gap(one: np.ndarray, other: np.ndarray, axis: int) -> Any:
    return np.mean(one, axis=axis) - np.mean(other, axis=axis)


# ------------------------------------------------------------------------------------------------
# What has to be said beside a rate wherever it stands: console, report, published sections.
# ------------------------------------------------------------------------------------------------


KINEMATIC = "Kinematic trials are among them: no physics, so they prove nothing."
SHARED = (
    "All cells have the same draws: bounds hold in each alone, and may be too narrow over several."
)


def caveats_of(told: dict[str, Any]) -> list[str]:
    """Sentences without which the rate would say more than was found.

    Args:
        told: The findings of a sweep, as of `tell`.
    """
    lines = []
    if not told["complete"]:
        lines.append(f"{told['trials']} of the {told['asked']} trials of the study are done.")
    if told["given_up"]:
        lines.append(
            f"{told['given_up']} that began before others of them are not done: those that end "
            "early are more of these than of all."
        )
    if told["kinematic"]:
        lines.append(KINEMATIC)
    if told["sharing"] > 1:
        lines.append(SHARED)
    if told["repeats"]:
        lines.append(
            f"{told['repeats']} came out exactly as another of the same cell: nothing in them is "
            "random, they are no evidence of their own, and the bounds are too narrow."
        )
    return lines


# ------------------------------------------------------------------------------------------------
# How a rate is judged: by what was asked for, in words and as a colour.
# ------------------------------------------------------------------------------------------------


def gate_words(told: dict[str, Any]) -> str:
    """What was asked for, and whether it was kept; nothing of a study that asks for nothing."""
    if told["gate"] is None or told["passed"] is None:
        return ""
    of = "" if told["gate_each"] is None else f" of each {told['gate_each']}"
    word = ("kept" if told["passed"] else "missed") + ("" if told["complete"] else " so far")
    none = f"; no trial of {', '.join(told['gate_untried'])}" if told["gate_untried"] else ""
    return f"asked for at least {100 * told['gate']:g} %{of}: {word}{none}"


def grade(told: dict[str, Any]) -> str:
    """The rate's colour: good, warn or bad; without a gate all have to succeed."""
    rate = told["rate"]
    if told["passed"] is False or not rate["good"]:
        return "bad"
    well = told["passed"] if told["gate"] is not None else rate["good"] == rate["trials"]
    return "good" if well and told["complete"] and not told["kinematic"] else "warn"
