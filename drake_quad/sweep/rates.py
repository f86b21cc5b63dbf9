"""How often it works: rates with exact bounds, by band of what varies, and why it does not."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.stats import binomtest

from drake_quad.sweep.draws import GRID, axis_values, draw, way_of
from drake_quad.sweep.study_config import Vary

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
        low, high = 100.0 * self.low, 100.0 * self.high
        return f"{100.0 * self.rate:.1f} % ({low:.1f} to {high:.1f} %)"


@dataclass(frozen=True)
class Band:
    """The trials whose value lies within a band, or is one of a grid's.

    Attributes:
        label: What to call it.
        low: Its ends; both the value itself on a grid's axis; both None of what is no number.
        high: The upper one.
        rate: Of its trials.
    """

    label: str
    low: float | None
    high: float | None
    rate: Rate


def rate_of(good: int, trials: int) -> Rate:
    """The rate with its bounds."""
    if trials == 0:
        return Rate(0, 0, 0.0, 1.0)
    interval = binomtest(good, trials).proportion_ci(confidence_level=CONFIDENCE, method="exact")
    return Rate(good, trials, float(interval.low), float(interval.high))


def places_of(vary: Vary, values: Sequence[Any]) -> tuple[list[str], np.ndarray, list[Any]]:
    """Parts values into bands.

    Returns:
        The bands' labels; of each value the band's number; of each band its ends, or its value
        twice, or None twice of what is no number.
    """
    if way_of(vary) in (*GRID, "choice"):
        known = axis_values(vary) if way_of(vary) in GRID else list(vary.choice or [])
        known = [value for k, value in enumerate(known) if value not in known[:k]]
        numbers = all(type(value) in (int, float) for value in known)
        known = sorted(known) if numbers else known
        places = np.array([known.index(value) for value in values], dtype=int)
        ends = [(value, value) if numbers else (None, None) for value in known]
        return [f"{v:g}" if type(v) is float else str(v) for v in known], places, ends
    if vary.integers is not None:
        return _whole_bands(vary.integers[0], vary.integers[1], vary.bands, values)
    # Bands that as many draws fall into, or nearly so: even in the distribution.
    edges = [draw(vary, min(k / vary.bands, 1.0 - 2.0**-53)) for k in range(vary.bands + 1)]
    edges = sorted(set(edges))
    edges *= 2 if len(edges) == 1 else 1  # all draws are alike
    places = np.clip(np.searchsorted(edges[1:-1], values, side="right"), 0, len(edges) - 2)
    ends = list(pairwise(edges))
    return [f"{low:.3g} to {high:.3g}" for low, high in ends], places, ends


def _whole_bands(
    first: int, last: int, bands: int, values: Sequence[int]
) -> tuple[list[str], np.ndarray, list[Any]]:
    """Bands of whole numbers: one each if they are few, else as many in each as can be."""
    count = last - first + 1
    bands = min(bands, count)
    starts = [first + k * count // bands for k in range(bands + 1)]
    places = np.searchsorted(starts[1:-1], values, side="right")
    ends = [(low, after - 1) for low, after in pairwise(starts)]
    return [f"{a}" if a == b else f"{a} to {b}" for a, b in ends], places, ends


def bands_of(vary: Vary, values: Sequence[Any], success: Sequence[bool]) -> list[Band]:
    """The rate in each band of what varies."""
    labels, places, ends = places_of(vary, values)
    good = np.asarray(success, dtype=bool)
    return [
        Band(label, low, high, rate_of(int(good[places == k].sum()), int((places == k).sum())))
        for k, (label, (low, high)) in enumerate(zip(labels, ends, strict=True))
    ]


def causes_of(outcomes: Sequence[str], reasons: Sequence[str]) -> list[tuple[str, int]]:
    """Why trials failed, with how many: reasons that differ in numbers alone count as one."""
    told = Counter(
        f"{outcome}: {re.sub(r'-?[0-9]+([.][0-9]+)?(e-?[0-9]+)?', '#', reason)}"
        for outcome, reason in zip(outcomes, reasons, strict=True)
        if outcome != "goal_reached"
    )
    return sorted(told.items(), key=lambda item: (-item[1], item[0]))
