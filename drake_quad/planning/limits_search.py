"""The search for a body path that keeps the legs' limits, by one program after another.

Limits are seen along the path so far, as half-planes, which are true near that path only. So each
program's path stays within a *trust region* about the path before: every control point may move by
so much. Where a path turns out to be further beyond limits than it was before, the region becomes
smaller, there alone, and elsewhere it does not (sequential quadratic programming with a trust
region: Nocedal and Wright, "Numerical Optimization", chapter 18). Other than there, a step that
leads further beyond limits is taken all the same: the next program sees limits from there. A path
that is near its limits has no trust region until a step leads astray, and that step is not taken.

The path of most margin may be so far beyond limits that the half-planes along it are of no use.
Then the search begins with the route, whose poses a gait was designed for. If that costs much of
the margin, another begins with the path of most margin all the same, and the better path is taken.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from math import inf
from typing import Protocol

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.errors import PlanningError
from drake_quad.math.curves import most_beside
from drake_quad.planning.body_qp import BROKEN

MOST_PASSES = 16
PATIENCE = 7  # passes after the last that came nearer
CLEARLY = 0.7  # of how short the best was: less is clearly nearer
# The trust region in which a search begins, as shares of a leg's length; those of further searches
# follow. Where one goes to and fro, another may not.
RADII = (0.15, 0.06, 0.3)
LONGER = 1.5  # times as many passes, and as much patience, that a further search has
MOST_TIPPING = 6  # paths in turn along which the robot would fall over: others hardly hold it
LEAST_RADIUS = 0.003  # of a leg
SHRINKS, GROWS = 0.5, 1.5
ACTIVE = 0.99  # of the trust region's radius, from which on it holds a control point
BESIDE = 4  # control points on either side of one, whose trust region becomes smaller with its own
# Of a leg, of what `LimitsSearch.beyond` counts: from the first on, the path of most margin is not
# begun with; up to the second, limits are seen much as they are.
FAR, LINEAR = 0.4, 0.016
NEARER = 0.5  # of how short that is: the route has to be that near to be begun with
ASTRAY = 2.0  # times as far beyond limits as before: a step without a trust region is not taken
REACHED = 1e-3  # [m] less margin than the program believes in, with which a path is good
SHORT_PRICE = 7.5  # metres of margin for one beyond limits, much as in the program
# Of the margin of the path of most margin. Where a search that began with the route finds less, one
# begins with that path, too.
HOPED = 0.75
SETTLED = 1e-3  # [m] of margin that one more pass gains, and another is not worth its time


class LimitsSearch(Protocol):
    """A path, and the program around it."""

    control: FloatArray

    @property
    def leg(self) -> float:
        """A leg's length, which distances are measured by [m]."""

    @property
    def route(self) -> FloatArray:
        """Control points of the way that the body would go if margins did not matter [m]."""

    @property
    def believed(self) -> float:
        """The margin of the last program's path, as the program has it [m]."""

    @property
    def keeps_limits(self) -> bool:
        """Whether the last program's path keeps all limits, as the program has them."""

    @property
    def beyond(self) -> FloatArray:
        """How far the path is beyond limits near each control point (n,), see LegLimits [m]."""

    def margin(self) -> float:
        """The path's margin [m]."""

    def find_limits(self) -> float:
        """Looks where legs are beyond their limits; returns by how much in all."""

    def solve(self, *, broken: float, radius: FloatArray | None = None) -> FloatArray:
        """The path of the program around the path so far; rows may be broken by so much [m].

        Args:
            broken: Violation of a row that is tolerated [m].
            radius: The trust region about the path so far (n,) [m]; None: anywhere.
        """

    def follow(self, control: FloatArray) -> None:
        """Takes a path."""


def keep_limits(search: LimitsSearch, searches: int = 1) -> None:
    """Looks for a path along which legs keep their limits, or come as near to that as they can.

    Args:
        search: The program's path of most margin, and the program around it.
        searches: How many searches there may be at most, each from the same path, until one finds
            a path that keeps all limits.

    Raises:
        PlanningError: If the first program is not solved.
    """
    first, short = search.control, search.find_limits()
    if short == 0.0:
        return
    start, most = _Best(first), search.margin()
    start.take(0, first, short, most, 1.0)
    near = float(search.beyond.max()) <= FAR * search.leg
    route = _begin_with_nearer(search)
    best = _search(search, RADII[0], 1.0, replace(start), free=near)
    if route and best.margin < HOPED * most:
        # From the other side of what cannot be kept a path may have a margin, or more of it.
        search.follow(first)
        search.find_limits()
        with suppress(PlanningError):
            found = _search(search, RADII[0], 1.0, replace(start), free=True)
            best = min(best, found, key=lambda b: b.rank)
    for radius in RADII[1:searches]:
        if best.short == 0.0:
            break
        search.follow(first)
        search.find_limits()
        _begin_with_nearer(search)
        with suppress(PlanningError):  # one path is known already
            found = _search(search, radius, LONGER, replace(start), free=False)
            best = min(best, found, key=lambda b: b.rank)
    if best.path is not search.control:
        search.follow(best.path)


def keep_limits_from(search: LimitsSearch) -> bool:
    """Looks for a path within limits from one that is near them; returns whether it found one."""
    search.find_limits()
    # The path may be none of the program's, and have no ZMP margin: it does not count itself.
    best = _search(search, RADII[0], 1.0, _Best(search.control), free=True)
    if best.path is not search.control:
        search.follow(best.path)
    return best.short == 0.0


@dataclass
class TrustRegion:
    """How far each control point may move in the next step.

    Attributes:
        radius: (n,) [m].
        most: The radius that it begins with, and is never more than [m].
        least: The radius that it is never less than [m].
    """

    radius: FloatArray
    most: float
    least: float

    def adapt(self, step: FloatArray, worse: BoolArray) -> None:
        """Makes it smaller where a step led further beyond limits, larger where it held a step.

        Args:
            step: How far each control point has moved (n,) [m].
            worse: Near which of them the path is further beyond limits than it was (n,).
        """
        near = most_beside(step, BESIDE)
        worse = most_beside(worse.astype(np.float64), BESIDE) > 0.0
        smaller = np.maximum(SHRINKS * np.minimum(self.radius, near), self.least)
        larger = np.where(self.holds(step), np.minimum(GROWS * self.radius, self.most), self.radius)
        self.radius = np.where(worse, smaller, larger)

    def holds(self, step: FloatArray) -> BoolArray:
        """Which control points it kept from moving further (n,)."""
        return step >= ACTIVE * self.radius


@dataclass
class _Best:
    """The best path of a search so far, and when one came nearer to its limits last.

    Attributes:
        path: Its control points [m].
        short: How far it is beyond limits in all [m].
        margin: Its margin [m].
        at: The pass in which a path came clearly nearer, or gained margin within limits.
        margin_then: The margin of that path [m].
    """

    path: FloatArray
    short: float = inf
    margin: float = -inf
    at: int = 0
    margin_then: float = -inf

    def take(self, k: int, path: FloatArray, short: float, margin: float, share: float) -> bool:
        """Takes the path of the pass k if it is better; returns whether it is clearly so.

        Args:
            k: The pass.
            path: Its control points [m].
            short: How far it is beyond limits [m].
            margin: Its margin [m].
            share: Of how short the best is, less than which is clearly nearer.
        """
        if self.short > 0.0:
            nearer = short < self.short and short <= share * self.short
        else:
            nearer = short == 0.0 and margin >= self.margin_then + SETTLED
        if nearer:
            self.at, self.margin_then = k, margin
        if _rank(short, margin) < self.rank:
            self.path, self.short, self.margin = path, short, margin
        return nearer

    @property
    def rank(self) -> tuple[bool, float]:
        """The less the better."""
        return _rank(self.short, self.margin)


def _search(
    search: LimitsSearch, radius: float, longer: float, best: _Best, *, free: bool
) -> _Best:
    """Solves the program again until legs keep their limits, or as nearly as they come to it.

    A path that keeps them is solved around again until it has the margin that the program believes
    in, and that grows no more: limits as they are seen from a path beyond them may be too tight.

    It gives up when no path has come nearer for some time, or has had a margin. Where the program
    believes that limits can be kept, any fall is nearer, for its paths then go there, if slowly.

    Args:
        search: The path, whose limits have been looked at, and the program around it.
        radius: Of the trust region, as a share of a leg.
        longer: Times as many passes as are usual.
        best: The best path so far.
        free: Whether a step may lead anywhere until one leads astray.

    Returns:
        The best path.

    Raises:
        PlanningError: If the first program is not solved.
    """
    most, patience = round(longer * MOST_PASSES), round(longer * PATIENCE)
    leg = search.leg
    region = TrustRegion(
        np.full(len(search.control), radius * leg), radius * leg, LEAST_RADIUS * leg
    )
    tipping = 0
    for k in range(1, most + 1):
        start, beyond, believed = search.control, search.beyond, search.believed
        try:
            path = search.solve(broken=BROKEN, radius=None if free else region.radius)
        except PlanningError:
            if k == 1:
                raise
            break
        search.follow(path)
        short, margin = search.find_limits(), search.margin()
        if free and float(search.beyond.max()) > max(ASTRAY * float(beyond.max()), LINEAR * leg):
            free = False
            search.follow(start)
            search.find_limits()
            continue
        held = False
        if not free:
            step = _step(start, path)
            held = bool(region.holds(step).any())
            region.adapt(step, search.beyond > np.maximum(beyond, LINEAR * leg))
        kept_before = best.short == 0.0
        nearer = best.take(k, path, short, margin, 1.0 if search.keeps_limits else CLEARLY)
        grows = held or search.believed > believed + SETTLED
        if short == 0.0 and margin >= search.believed - REACHED and not grows:
            break
        tipping = tipping + 1 if search.believed < 0.0 and margin < 0.0 else 0
        if (short == 0.0 and kept_before and not nearer) or k >= best.at + patience:
            break
        if tipping >= MOST_TIPPING:
            break
    return best


def _begin_with_nearer(search: LimitsSearch) -> bool:
    """Takes the route in place of a path far beyond limits, if it is much nearer; returns that."""
    path, before = search.control, float(search.beyond.max())
    if before <= FAR * search.leg:
        return False
    search.follow(search.route)
    search.find_limits()
    if float(search.beyond.max()) <= NEARER * before:
        return True
    search.follow(path)
    search.find_limits()
    return False


def _rank(short: float, margin: float) -> tuple[bool, float]:
    """How good a path is, the less the better: within limits or not, then what the program pays.

    Of two paths that are a little beyond limits, the one that is so by less may have no margin.

    Args:
        short: How far it is beyond limits [m].
        margin: Its margin [m].
    """
    return not (short == 0.0 and margin > 0.0), SHORT_PRICE * short - margin


def _step(start: FloatArray, path: FloatArray) -> FloatArray:
    """How far each control point moves (n,) [m], from a path that may not lift or tilt at all."""
    step = np.array(path)
    step[:, : start.shape[1]] -= start
    return np.asarray(np.abs(step).max(axis=1))
