"""The search for a body path that keeps the legs' limits, by one program after another.

Limits are seen along the path so far, as half-planes. Around a path that is far beyond them they
are much too tight at some places and missing at others, so a path is looked for in steps.
"""

from dataclasses import dataclass
from typing import Protocol

from drake_quad.common import FloatArray
from drake_quad.planning.body_qp import BROKEN

MOST_PASSES = 16
PATIENCE = 8  # passes after the last that came nearer
FALLS = 0.7  # of how short the best was: less is nearer
DAMPED = 0.6  # of the way to the next path
# The same of further searches, which begin anew. Where one search goes to and fro, another with
# steps of another length may not.
OTHERWISE = (0.8, 0.3)
LONGER = 1.5  # times as many passes, and as much patience, that a further search has
LEAST_SHARE = 0.1  # of it, from which no step is made shorter
LINEAR = 0.05  # short of limits by no more than that [m], they are seen much as they are
REACHED = 1e-3  # [m] less margin than the program believes in, with which a path is good


class LimitsSearch(Protocol):
    """A path, and the program around it."""

    control: FloatArray

    @property
    def believed(self) -> float:
        """The margin of the last program's path, as the program has it [m]."""

    @property
    def keeps_limits(self) -> bool:
        """Whether the last program's path keeps all limits, as the program has them."""

    def margin(self) -> float:
        """The path's margin [m]."""

    def find_limits(self) -> float:
        """Looks where legs are beyond their limits; returns by how much in all."""

    def solve(self, *, broken: float) -> FloatArray:
        """The path of the program around the path so far; rows may be broken by so much [m]."""

    def follow(self, control: FloatArray) -> None:
        """Takes a path."""


@dataclass
class _Step:
    """A step from one path towards the next.

    Attributes:
        start: Control points of the path before.
        target: Those of the path that the program has around it.
        short: How far legs were beyond their limits along the path before [m].
        share: Share of the way to the target that is gone.
    """

    start: FloatArray
    target: FloatArray
    short: float
    share: float

    @property
    def path(self) -> FloatArray:
        """Control points of the path that the step leads to."""
        return self.start + self.share * (self.target - self.start)

    def too_far(self, short: float) -> bool:
        """Whether legs are so far beyond their limits after it that it has to be a shorter one."""
        return short > max(2.0 * self.short, LINEAR) and self.share > LEAST_SHARE

    def halve(self) -> None:
        """Goes half as far."""
        self.share *= 0.5


def keep_limits(search: LimitsSearch, searches: int = 1) -> None:
    """Looks for a path along which legs keep their limits, or come as near to that as they can.

    Args:
        search: The path, and the program around it.
        searches: How many searches there may be at most, each from the same path, until one finds
            a path that keeps all limits.
    """
    first = search.control
    best = _search(search, DAMPED, 1.0)
    path = search.control
    for share in OTHERWISE[: searches - 1]:
        if best[0] == 0.0:
            break
        search.follow(first)
        found = _search(search, share, LONGER)
        if found < best:
            best, path = found, search.control
    if path is not search.control:
        search.follow(path)


def _search(search: LimitsSearch, damped: float, longer: float) -> tuple[float, float]:
    """Solves the program again until legs keep their limits, or as nearly as they come to it.

    A path that keeps them may have less margin than it could: limits as they are seen from a path
    far beyond them can be much too tight. So it is also solved again around a path that keeps them,
    until that has the margin that the program believes in.

    It gives up when no path has come nearer for some time. Where the program believes that all
    limits can be kept, any fall is nearer, for its paths then go there, if slowly.

    Args:
        search: The path, and the program around it; it ends with the best path.
        damped: Share of the way to the next path that a step goes.
        longer: Times as many passes as are usual.

    Returns:
        How far the best path is beyond limits, and minus its margin [m].
    """
    most, patience = round(longer * MOST_PASSES), round(longer * PATIENCE)
    best, best_path = (float("inf"), float("inf")), search.control
    best_at, margin_then = 0, float("-inf")
    seen_from = float("inf")  # how short the path was that the last program was made around
    step: _Step | None = None
    for k in range(most + 1):
        short = search.find_limits()
        if short == 0.0 and k == 0:
            return 0.0, 0.0
        while step is not None and step.too_far(short):
            step.halve()
            search.follow(step.path)
            short = search.find_limits()
        margin = search.margin()
        falls = 1.0 if search.keeps_limits else FALLS
        if best[0] > 0.0:
            nearer = short < best[0] and short <= falls * best[0]
        else:
            nearer = short == 0.0 and margin >= margin_then + REACHED
        if nearer:
            best_at, margin_then = k, margin
        if (short, -margin) < best:
            best, best_path = (short, -margin), search.control
        if short == 0.0 and seen_from <= LINEAR and margin >= search.believed - REACHED:
            break
        if k >= min(most, best_at + patience):
            break
        seen_from = short
        path, before = search.solve(broken=BROKEN), search.control
        if k > 0:
            step = _Step(before, path, short, damped)
            path = step.path
        search.follow(path)
    if best_path is not search.control:  # it went to and fro
        search.follow(best_path)
    return best
