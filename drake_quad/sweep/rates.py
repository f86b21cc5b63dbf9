"""How often it works: rates with exact bounds, and why it does not."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

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
