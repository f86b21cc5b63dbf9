"""Finds stairs in a depth image of which nothing is known: a coarse search, then fits.

Points are scored against even stairs over a grid of first riser, rise and run, for the few yaws
that surface normals and silhouette edges speak for. The best guesses are fitted, and steps are
added while pixels speak for one more. A scene without enough such steps is refused.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotation_exp
from drake_quad.perception.depth_frame import DepthFrame, keep_pixels
from drake_quad.perception.stair_candidates import (
    ProfilePoints,
    StairGrid,
    candidate_floors,
    candidate_levels,
    candidate_yaws,
    score_profile,
)
from drake_quad.perception.stair_evidence import (
    count_evidence,
    crop,
    denied,
    find_width,
    support,
    supported,
    told_apart,
    wall_from,
)
from drake_quad.perception.stair_fit import (
    COARSE,
    FINE,
    StairFit,
    StairPriors,
    StairShape,
    first_guess,
    fit_stairs,
    with_steps,
)
from drake_quad.perception.stair_profile import MOST_STEPS, PITCH, RISE, ROLL, RUN, YAW

SAMPLE = 700  # points that the coarse search looks at
CORRIDOR = 0.6  # [m] to each side of the line ahead: only what lies within is searched first
GUESS_ERROR = 0.08  # [m] by which a guess of the coarse search may be off, four steps on
THINNED = 5  # of so many pixels one is looked at by the first fits
RISES = np.arange(0.08, 0.235, 0.02)
RUNS = np.arange(0.20, 0.43, 0.03)
FIRSTS = np.arange(0.06, 2.7, 0.04)
FLOOR_UNKNOWN = 0.05  # [m] deviation of the floor's height, from which nobody has told it
FOOT_PIXELS = 25.0  # of the ground before the first nosing, that have to agree
UNLIKE = 0.05  # [m] by which rises, and runs, of one flight may differ as they are seen
LEAST_STEPS = 3  # fewer steps up are no flight (DIN 18065): two may be a block on a kerb
RISE_BOUNDS, RUN_BOUNDS = (0.05, 0.26), (0.15, 0.60)


@dataclass(frozen=True)
class FoundStairs:
    """Stairs that a search, or a tracking step, came to.

    Attributes:
        fit: The fit.
        at_most: How many steps there are at most; None if that is not known.
        right: Where pixels agree with the steps, across the climb, at the right [m].
        left: Edge at the left [m].
    """

    fit: StairFit
    at_most: int | None
    right: float
    left: float


def find_stairs(
    frame: DepthFrame,
    priors: StairPriors,
    generator: np.random.Generator,
    *,
    ways: tuple[bool, ...] = (True, False),
    opens: tuple[bool, ...] = (False, True),
    least: int = LEAST_STEPS,
) -> FoundStairs | None:
    """Looks for stairs in an image.

    Args:
        frame: The image.
        priors: What is known before; with a floor known to 5 cm there is less to search.
        generator: Chooses the points that the coarse search looks at.
        ways: Whether to look for stairs up (True), down (False), or both.
        opens: Whether to look for closed risers (False), for open ones (True), or both.
        least: How many steps up have to be seen; down it is two.

    Returns:
        The stairs; None where nothing speaks for so many steps.
    """
    if len(frame.rho) < 200:
        return None
    pick = np.sort(generator.choice(len(frame.rho), min(SAMPLE, len(frame.rho)), replace=False))
    guesses: list[Guess] = []
    for level in candidate_levels(frame):
        guesses += _guesses(levelled(frame, level), level, priors, pick, ways)
    guesses.sort(key=lambda g: (g.cost, g.first, g.rise, g.run))
    thin = keep_pixels(frame, np.arange(len(frame.rho)) % THINNED == 0)
    cutoffs = coarse_cutoffs(thin)
    fits: list[tuple[float, StairFit]] = []
    for guess, is_open in product(guesses[:12], opens):
        if guess.cost > guesses[0].cost + 0.2:
            break
        if is_open and guess.rise < 0.0:
            continue
        shape = StairShape(steps=3, up=guess.rise > 0.0, is_open=is_open)
        theta = first_guess(
            shape, first=guess.first, floor=guess.ground, rise=guess.rise, run=guess.run,
            yaw=guess.yaw, priors=priors, nodes=frame.grid[0] * frame.grid[1], level=guess.level,
        )  # fmt: skip
        near = crop(
            thin, StairFit(shape, theta, np.eye(len(theta)), 0.0, 1.0), (-CORRIDOR, CORRIDOR)
        )
        fit = fit_stairs(near, shape, theta, priors, cutoffs, held=3)
        if fit is not None:
            fits.append((support(thin, fit, priors), fit))
    fits.sort(key=lambda one: -one[0])
    best: FoundStairs | None = None
    best_support, tried = 0.0, 0
    for rank, (coarse, fit) in enumerate(fits):
        if coarse <= 0.0 or tried == 4 or THINNED * coarse < 0.5 * best_support:
            break
        if any(alike(fit, other) for _, other in fits[:rank]):
            continue
        tried += 1
        for begin in (fit, halved(thin, fit, priors)):
            found = settle(frame, begin, priors, even=least > 2)
            best, best_support = _better(frame, priors, found, best, best_support)
    if (
        best is not None and best.fit.shape.up and len(opens) > 1
    ):  # where risers are grazed, either may come first
        other = replace(best.fit.shape, is_open=not best.fit.shape.is_open)
        found = settle(frame, replace(best.fit, shape=other), priors, even=least > 2)
        best, _ = _better(frame, priors, found, best, best_support)
    if best is not None and best.fit.shape.up and best.fit.shape.steps < least:
        return None
    return best


def _better(
    frame: DepthFrame,
    priors: StairPriors,
    found: FoundStairs | None,
    best: FoundStairs | None,
    best_support: float,
) -> tuple[FoundStairs | None, float]:
    """The one of two that explains more, and how much that is."""
    if found is None:
        return best, best_support
    value = support(frame, found.fit, priors, (found.right, found.left))
    return (found, value) if value > best_support else (best, best_support)


def coarse_cutoffs(frame: DepthFrame) -> tuple[float, ...]:
    """From wide to narrow: a pixel that is farther from a guess than guesses err is no inlier."""
    widest = GUESS_ERROR / float(np.median(frame.sigma / frame.rho**2))
    return tuple(
        min(max(widest * share, FINE[-1]), COARSE[0]) for share in (1.0, 0.7, 0.5, 0, 0, 0)
    )


@dataclass(frozen=True)
class Guess:
    """Even stairs that points speak for.

    Attributes:
        cost: Cost of the points against them.
        first: Place of the first nosing [m].
        rise: Up positive [m].
        run: Run of a tread [m].
        yaw: Yaw of the climb [rad].
        ground: Height of the floor over the camera [m].
        level: Roll and pitch by which the camera's attitude is thought to be off [rad].
    """

    cost: float
    first: float
    rise: float
    run: float
    yaw: float
    ground: float
    level: tuple[float, float]


def _guesses(
    frame: DepthFrame,
    level: tuple[float, float],
    priors: StairPriors,
    pick: NDArray[np.int64],
    ways: tuple[bool, ...],
) -> list[Guess]:
    """The best guesses of one attitude, by which `frame` is level, for each yaw and floor."""
    points = frame.points[pick]
    z = 1.0 / frame.rho[pick]
    tolerance = np.maximum(0.025, 2.0 * frame.sigma[pick] * z * z)
    found = []
    for yaw in candidate_yaws(frame):
        ahead = np.abs(points[:, 1] * np.cos(yaw) - points[:, 0] * np.sin(yaw)) < CORRIDOR
        if np.count_nonzero(ahead) < 50:
            continue
        s = points[ahead, 0] * np.cos(yaw) + points[ahead, 1] * np.sin(yaw)
        profile = ProfilePoints(s, np.ascontiguousarray(points[ahead, 2]), tolerance[ahead])
        for ground, up in product(candidate_floors(frame, priors), ways):
            way = 1.0 if up else -1.0
            costs = np.empty((len(FIRSTS), len(RISES), len(RUNS)))
            score_profile(profile, ground, way, StairGrid(FIRSTS, RISES, RUNS), 6, costs)
            for f, r, q in _best_cells(costs, 4):
                rise, run = way * float(RISES[r]), float(RUNS[q])
                cost = float(costs[f, r, q])
                found.append(Guess(cost, float(FIRSTS[f]), rise, run, yaw, ground, level))
    return found


def levelled(frame: DepthFrame, level: tuple[float, float]) -> DepthFrame:
    """The frame as an attitude that is off by `level` (roll and pitch [rad]) makes it."""
    R_T = rotation_exp(*level, 0.0).T
    return replace(
        frame,
        rays=np.ascontiguousarray(frame.rays @ R_T),
        edges=np.ascontiguousarray(frame.edges @ R_T),
        row_step=frame.row_step @ R_T,
    )


def halved(frame: DepthFrame, fit: StairFit, priors: StairPriors) -> StairFit | None:
    """Stairs with twice as many steps in the same way: every second one may have been taken.

    Returns:
        Their fit; None where such steps would be none, or nothing comes of the fit.
    """
    rise, run = 0.5 * fit.other(RISE), 0.5 * fit.other(RUN)
    if abs(rise) < RISE_BOUNDS[0] or run < RUN_BOUNDS[0]:
        return None
    theta = first_guess(
        fit.shape, first=float(fit.places[0]) - run, floor=float(fit.heights[0]), rise=rise,
        run=run, yaw=fit.other(YAW), priors=priors, nodes=frame.grid[0] * frame.grid[1],
        level=(fit.other(ROLL), fit.other(PITCH)),
    )  # fmt: skip
    return fit_stairs(frame, fit.shape, theta, priors, COARSE)


def alike(one: StairFit, other: StairFit) -> bool:
    """Whether two fits of as many steps are the same stairs."""
    return one.shape == other.shape and bool(
        np.all(np.abs(one.places - other.places) < 0.02)
        and np.all(np.abs(one.heights - other.heights) < 0.02)
    )


def _best_cells(costs: FloatArray, most: int) -> list[tuple[int, int, int]]:
    found: list[tuple[int, int, int]] = []
    for flat in np.argsort(costs, axis=None, kind="stable")[:400]:
        f, r, q = (int(i) for i in np.unravel_index(flat, costs.shape))
        if all(abs(f - a) > 2 or abs(r - b) > 1 or abs(q - c) > 1 for a, b, c in found):
            found.append((f, r, q))
            if len(found) == most:
                break
    return found


def settle(
    frame: DepthFrame, fit: StairFit | None, priors: StairPriors, *, even: bool = True
) -> FoundStairs | None:
    """Takes away steps that nothing speaks for, and adds those that pixels do speak for.

    Args:
        frame: The image.
        fit: A fit near the truth; None is none.
        priors: What is known before.
        even: Whether a step unlike those before it is not of the same flight. Where a flight is
            known to be there, a step below the image may be told anyhow: the map has it better.

    Returns:
        The stairs; None if fewer than two steps are left.
    """
    if fit is None:
        return None
    width = find_width(frame, fit, priors)
    if width is None:
        return None
    inner = crop(frame, fit, width)
    held = fit
    while held.shape.steps > 1 and not _stands(inner, held, priors):
        trimmed = fit_stairs(inner, *with_steps(held, held.shape.steps - 1), priors, FINE)
        if trimmed is None:
            return None
        held = trimmed
    at_most: int | None = None
    while held.shape.steps < MOST_STEPS:
        more = fit_stairs(inner, *with_steps(held, held.shape.steps + 1), priors, (25.0, 12.0, 6.0))
        if more is None:
            break
        if not _stands(inner, more, priors):
            if denied(inner, held, more, priors):
                at_most = held.shape.steps
            break
        held = more
    narrower = find_width(inner, held, priors)
    if narrower is None:
        return None
    width = max(width[0], narrower[0]), min(width[1], narrower[1])  # beside it nobody has looked
    inner = crop(frame, held, width)
    final = fit_stairs(inner, held.shape, held.theta, priors, FINE)
    while final is not None and final.shape.steps >= 2:
        inner = crop(frame, final, width)  # a step's yaw may have changed what is within it
        n, whole = final.shape.steps, _sound_steps(inner, final, priors, even)
        if whole == n:
            break
        # What lies beyond a step that nothing speaks for is not known to be the same flight.
        final = fit_stairs(inner, *with_steps(final, whole), priors, FINE) if whole > 1 else None
    if final is not None and priors.floor[1] > FLOOR_UNKNOWN:
        final = _without_unseen_foot(inner, final, priors)
    if final is None or final.shape.steps < 2:
        return None
    rise, run = abs(final.other(RISE)), final.other(RUN)
    if not (RISE_BOUNDS[0] < rise < RISE_BOUNDS[1] and RUN_BOUNDS[0] < run < RUN_BOUNDS[1]):
        return None
    return FoundStairs(final, at_most, width[0], width[1])


def _sound_steps(frame: DepthFrame, fit: StairFit, priors: StairPriors, even: bool) -> int:
    """How many of the first steps are a flight: seen, alike, and no wall."""
    table, _ = count_evidence(frame, fit, priors)
    n = fit.shape.steps
    whole = next((i for i in range(n) if not supported(table, i + 1, fit)), n)
    wall = wall_from(frame, fit, priors)
    return min(whole, alike_steps(fit) if even else n, n if wall is None else wall - 1)


def alike_steps(fit: StairFit) -> int:
    """How many of the first steps have rises and runs that differ by no more than UNLIKE."""
    rises, runs = np.diff(fit.heights), np.diff(fit.places)
    n = len(rises)
    while n > 1 and max(_spread(rises[:n]), _spread(runs[: n - 1])) > UNLIKE:
        n -= 1
    return n


def _spread(lengths: FloatArray) -> float:
    return float(lengths.max() - lengths.min())


def _without_unseen_foot(frame: DepthFrame, fit: StairFit, priors: StairPriors) -> StairFit | None:
    """Takes away first steps before which no ground is seen.

    Where nobody tells how high the floor is, a nosing at the image's lower edge costs nothing: the
    floor in view may then be taken for the first tread, and the floor itself for out of view.
    """
    found: StairFit | None = fit
    while found is not None and found.shape.steps >= 2:
        table, _ = count_evidence(frame, found, priors)
        if table[1, 0, 1] >= FOOT_PIXELS:
            break
        n = found.shape.steps
        shape = replace(found.shape, steps=n - 1)
        theta = np.concatenate([found.theta[1:n], found.theta[n + 1 :]])
        found = fit_stairs(frame, shape, theta, priors, FINE)
    return found


def _stands(frame: DepthFrame, fit: StairFit, priors: StairPriors) -> bool:
    """Whether pixels speak for the last step, and would not do as well without it."""
    table, _ = count_evidence(frame, fit, priors)
    return supported(table, fit.shape.steps, fit) and told_apart(frame, fit, priors)
