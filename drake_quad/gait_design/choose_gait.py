"""Chooses among patterns of footholds, each with the best gait that a search found for it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait_design.candidates import (
    CandidateBatch,
    Staircase,
    candidate_bounds,
    hip_length,
    make_candidates,
    make_foothold_patterns,
)
from drake_quad.gait_design.objective import (
    NAMES,
    wanted_with_tolerance,
)
from drake_quad.gait_design.search import (
    HOPELESS,
    QUICK,
    SURELY,
    Search,
    SearchSettings,
    latin_hypercube,
    least_clearance,
)
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.robot.model import LinkOutline, RobotModel, leg_length

LEVEL_PATTERNS = [FootholdPattern(2, 1), FootholdPattern(1, 1), FootholdPattern(2, 2)]
SPEED_BONUS = 0.1  # of a tread more a cycle, on a score that is 1 where all slacks are enough
LEVEL_PLACES = (0.9, 0.75, 0.6, 0.5, 0.4, 0.3, 0.2)  # strides on level ground, of a leg's length
LEVEL_SCORE = 0.8  # with which the longest of them is taken
LOOKED_AT = 3  # patterns that are searched: those with the best among the first members
ALIKE = 2  # the same of patterns that go as far
PLACES = (1, 2)  # a tread, in turn
ENOUGH = 0.5  # score with one place a tread, for which treads of two places are not looked at
LONGER_SCORE = 0.3  # with which a gait that goes farther in a cycle is planned for its speed
NEARLY = -0.3  # score of a gait that is so near to being one that a thorough search may find one


@dataclass(frozen=True, eq=False)
class Design:
    """A gait and its slacks.

    Attributes:
        gait: The gait alone: a CandidateBatch of one.
        score: Least ratio of a slack to its target, at most 1; negative if a limit is exceeded.
        slacks: Least slacks on any of the flights and on level ground, by NAMES.
        wanted: Slacks that would be enough, by NAMES.
        stride: On level ground [m].
        limit: The name of what leaves the least of what is wanted.
    """

    gait: CandidateBatch
    score: float
    slacks: dict[str, float]
    wanted: dict[str, float]
    stride: float
    limit: str

    @property
    def feasible(self) -> bool:
        """Whether nothing is in the way."""
        return self.score > 0.0


def choose_gaits(
    robot: RobotModel,
    shape: LinkOutline,
    flights: Sequence[Staircase],
    way: SearchSettings = QUICK,
    *,
    map_error: float = 0.0,
) -> Iterator[Design]:
    """The best gaits of the most promising patterns for all of the flights together.

    The most promising of all comes first, if it is good enough, before the others are looked at;
    they come best first, and treads of two places last where others are good enough. For each
    pattern the other parameters are found by differential evolution.

    Args:
        robot: The robot.
        shape: How thick it is.
        flights: As they are walked, going down with negative rises; none for level ground alone.
        way: How to search. If not the quick way, treads of two places are looked at in any case.
        map_error: Position error of the stairs' risers [m], see `targets_for`.
    """
    runs = [stairs.run for stairs in flights]
    one, two = PLACES
    patterns = make_foothold_patterns(robot, runs, one) if flights else LEVEL_PATTERNS
    wanted = wanted_with_tolerance(robot, map_error)
    searches = _search(robot, shape, patterns, flights, way, wanted, hopeless=HOPELESS)
    # Where the map may be wrong, slacks count more than pace: all are compared by them alone.
    bonus = SPEED_BONUS if map_error == 0.0 else 0.0
    early = next(searches, None) if map_error == 0.0 else None
    if early is not None and early.score >= ENOUGH:
        yield early

    def best_first(found: list[Design]) -> list[Design]:
        def rank(d: Design) -> tuple[bool, float]:
            return d.feasible, d.score + bonus * _pace(d.gait.pattern)

        return sorted(found, key=rank, reverse=True)

    found = [*([] if early is None else [early]), *searches]
    patterns = make_foothold_patterns(robot, runs, two) if flights else []
    two_places = _search(robot, shape, patterns, flights, way, wanted, hopeless=HOPELESS)
    if way is not QUICK or max((d.score for d in found), default=0.0) < ENOUGH:
        found += two_places
    yield from (d for d in best_first(found) if d is not early or d.score < ENOUGH)
    # Whoever goes on could not plan these, or not well: what is good on endless stairs may not be
    # on the course.
    yield from best_first(list(two_places))


def choose_longer_gaits(
    robot: RobotModel,
    shape: LinkOutline,
    flights: Sequence[Staircase],
    than: FootholdPattern,
    way: SearchSettings = QUICK,
    *,
    as_long: bool = False,
    worth: Callable[[float], bool] = lambda _: True,
) -> Iterator[Design]:
    """The best gaits that go farther in a cycle than a pattern does, the longest first.

    Gaits that go as far are searched together, each time only when one of them is drawn.

    Args:
        robot: The robot.
        shape: How thick it is.
        flights: As they are walked, going down with negative rises.
        than: The pattern.
        way: How to search.
        as_long: Whether gaits of other patterns that go as far are among them, too.
        worth: Whether gaits that go so many times as far as the pattern are of interest.
    """
    runs, wanted = [stairs.run for stairs in flights], wanted_with_tolerance(robot)
    longer = [
        p
        for places in PLACES
        for p in make_foothold_patterns(robot, runs, places)
        if _pace(p) > _pace(than) or (as_long and _pace(p) == _pace(than) and p != than)
    ]
    for pace in sorted({_pace(p) for p in longer}, reverse=True):
        if not worth((pace + 1.0) / (_pace(than) + 1.0)):
            return
        found: list[Design] = []
        for places in PLACES:
            alike = [p for p in longer if _pace(p) == pace and p.per_tread == places]
            found += _search(
                robot, shape, alike, flights, way, wanted, looked_at=ALIKE, hopeless=HOPELESS
            )
        found.sort(key=lambda d: d.score, reverse=True)
        yield from (design for design in found if design.score >= LONGER_SCORE)


def _pace(pattern: FootholdPattern) -> float:
    """How many treads more than one a cycle takes."""
    return pattern.treads / pattern.per_tread - 1


def _search(
    robot: RobotModel,
    shape: LinkOutline,
    patterns: Sequence[FootholdPattern],
    flights: Sequence[Staircase],
    way: SearchSettings,
    wanted: FloatArray,
    *,
    looked_at: int = LOOKED_AT,
    enough: float = -np.inf,
    hopeless: float = np.inf,
) -> Iterator[Design]:
    """The best gait of each of the most promising patterns; all have as many places a tread.

    A search ends early with `enough`, or as `hopeless`: see `Search.least`.
    """
    if not patterns:
        return
    # On level ground a stride that is sought for every gait anyway must be possible.
    leg = leg_length(robot)
    searches = [
        Search(robot, shape, p, [*flights, Staircase(0.0, 0.3 * leg / p.treads)], wanted)
        for p in patterns
    ]
    lower, upper, _ = candidate_bounds(patterns[0])
    generator = np.random.default_rng(way.seed).spawn(1)[0]
    first = lower + latin_hypercube(way.members, len(lower), generator) * (upper - lower)
    lacks = [float(search(first.T).min()) for search in searches]
    ranked = sorted(zip(lacks, patterns, searches, strict=True), key=lambda row: row[0])[:looked_at]
    ranked.sort(key=lambda row: row[0] - SPEED_BONUS * _pace(row[1]))
    for _, pattern, search in ranked:
        best = make_candidates(
            robot, pattern, search.least(first, way, enough=enough, hopeless=hopeless)
        )
        yield _with_level(robot, shape, best, flights, wanted)


def _any_works(robot: RobotModel, shape: LinkOutline, flights: Sequence[Staircase]) -> bool:
    """Whether a quick search finds a gait of any pattern; it ends with the first."""
    runs = [stairs.run for stairs in flights]
    for per_tread in PLACES:
        patterns = make_foothold_patterns(robot, runs, per_tread)
        found = _search(
            robot, shape, patterns, flights, QUICK, wanted_with_tolerance(robot),
            enough=SURELY, hopeless=HOPELESS,
        )  # fmt: skip
        if any(design.feasible for design in found):
            return True
    return False


def highest_rise(
    robot: RobotModel,
    shape: LinkOutline,
    run: float,
    *,
    below: float,
    going: Sequence[int] = (1, -1),
) -> float | None:
    """The highest rise below another for which a quick search finds a gait, to 10 mm [m].

    Args:
        robot: The robot.
        shape: How thick it is.
        run: Depth of the treads [m].
        below: Rise below which one is sought [m].
        going: How the flights are walked, 1 for up and -1 for down.

    Returns:
        The rise; None if there is none.
    """
    low, high = 0.0, below
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        flights = [Staircase(g * middle, run) for g in going]
        if _any_works(robot, shape, flights):
            low = middle
        else:
            high = middle
    return low if low > 0.0 else None


def _with_level(
    robot: RobotModel,
    shape: LinkOutline,
    gait: CandidateBatch,
    flights: Sequence[Staircase],
    wanted: FloatArray,
) -> Design:
    """Adds the longest stride on level ground whose slacks are nearly enough, or the best one."""
    leg = leg_length(robot)
    row = least_clearance(robot, shape, gait, flights)[0]
    best: tuple[float, float, FloatArray] | None = None
    for share in LEVEL_PLACES:
        stride = min(share * leg, 1.2 * hip_length(robot))
        level = Staircase(0.0, stride / gait.pattern.treads)
        table = least_clearance(robot, shape, gait, [level])[0]
        score = float(np.min(np.minimum(table / wanted, 1.0)))
        if best is None or score > best[0] + 1e-9:
            best = score, stride, table
        if score >= LEVEL_SCORE:
            break
    assert best is not None
    least = np.minimum(row, best[2])
    shares = np.minimum(least / wanted, 1.0)
    return Design(
        gait=gait,
        score=float(shares.min()),
        slacks=dict(zip(NAMES, (float(v) for v in least), strict=True)),
        wanted=dict(zip(NAMES, (float(v) for v in wanted), strict=True)),
        stride=best[1],
        limit=NAMES[int(np.argmin(shares))],
    )


_WORDS = {
    "reach": "the legs are {0:.3f} m too short",
    "joints": "a joint would be {0:.2f} rad beyond its limit",
    "torque": "a joint needs {1:.0f} % of its torque",
    "margin": "the static margin would be {0:.3f} m short of the feet's support",
    "legs": "a knee or shank would be {0:.3f} m inside the stairs",
    "apart": "legs would be {0:.3f} m inside each other or the trunk",
    "trunk": "the trunk would be {0:.3f} m inside the stairs",
}


def describe_shortage(design: Design) -> str:
    """The limit that is missed by most, for the best gait that was found, and that gait."""
    lack = -design.slacks[design.limit]
    short = _WORDS[design.limit].format(lack, 100.0 * (1.0 + lack))
    return f"{short} {describe_gait(design)}"


def describe_gait(design: Design) -> str:
    """The gait in a few words."""
    c = design.gait
    per_tread = c.pattern.per_tread
    one, more = ("tread", "") if per_tread == 1 else ("place", f", {per_tread} to a tread")
    treads = f"1 {one}" if c.pattern.treads == 1 else f"{c.pattern.treads} {one}s"
    tilt = f"tilted by {100 * c.share[0]:.0f} % of the slope"
    return (
        f"({treads} a cycle{more}, rear feet {c.pattern.lag} behind, "
        f"body {c.height[0]:.2f} m up and {tilt})"
    )
