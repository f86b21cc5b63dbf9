"""Finds stairs in a depth image of which nothing is known: a coarse search, then fits.

Points are scored against even stairs over a grid of first riser, rise and run, for the few yaws
that surface normals and silhouette edges speak for. The best guesses are fitted, and steps are
added while pixels speak for one more. A scene without two such steps is refused.
"""

from dataclasses import dataclass
from math import floor

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from drake_quad.common import FloatArray
from drake_quad.jit import jit
from drake_quad.perception.depth_frame import DepthFrame
from drake_quad.perception.stair_fit import (
    COARSE,
    FINE,
    StairFit,
    StairPriors,
    StairShape,
    corrected_rays,
    count_evidence,
    find_width,
    first_guess,
    fit_stairs,
    keep_pixels,
    measured,
    with_steps,
)
from drake_quad.perception.stair_profile import MOST_STEPS, RISE, RUN, YAW

SAMPLE = 700  # points that the coarse search looks at
CORRIDOR = 0.6  # [m] to each side of the line ahead: only what lies within is searched first
THINNED = 5  # of so many pixels one is looked at by the first fits
MOST_YAW = np.radians(45.0)
RISES = np.arange(0.08, 0.235, 0.02)
RUNS = np.arange(0.20, 0.43, 0.03)
RISE_BOUNDS, RUN_BOUNDS = (0.05, 0.26), (0.15, 0.60)


@jit
def score_profile(
    s: FloatArray, h: FloatArray, tolerance: FloatArray, floor_height: float, way: float,
    firsts: FloatArray, rises: FloatArray, runs: FloatArray, steps: int, costs: FloatArray,
) -> None:  # fmt: skip
    """Writes the cost of points against even stairs over a grid.

    Args:
        s: Points' places along the climb (k,) [m].
        h: Their heights (k,) [m].
        tolerance: Distance from the profile that costs 1, as any farther one does (k,) [m].
        floor_height: Of the floor [m].
        way: 1 for up, -1 for down.
        firsts: Places of the first nosing (f,) [m].
        rises: (r,) [m].
        runs: (q,) [m].
        steps: How many are looked at.
        costs: Receives mean costs, (f, r, q).
    """
    for f in range(firsts.shape[0]):
        for r in range(rises.shape[0]):
            for q in range(runs.shape[0]):
                rise, run, total = way * rises[r], runs[q], 0.0
                for k in range(s.shape[0]):
                    x = (s[k] - firsts[f]) / run
                    i = floor(x) + 1
                    cost = 1.0
                    i = max(i, 0)
                    if i <= steps:
                        d = (h[k] - floor_height - i * rise) / tolerance[k]
                        cost = min(1.0, d * d)
                    if way > 0.0:
                        j = floor(x + 0.5)
                        y = (h[k] - floor_height) / rise - j
                        if j >= 0 and j < steps and y > 0.0 and y < 1.0:
                            d = (x - j) * run / tolerance[k]
                            cost = min(cost, d * d)
                    total += cost
                costs[f, r, q] = total / s.shape[0]


@dataclass(frozen=True)
class FoundStairs:
    """Stairs that a search, or a tracking step, came to.

    Attributes:
        fit: The fit.
        at_most: How many steps there are at most; None if that is not known.
        right: Where pixels agree with the steps, across the climb, at the right [m].
        left: At the left [m].
    """

    fit: StairFit
    at_most: int | None
    right: float
    left: float


def surface_normals(frame: DepthFrame) -> tuple[FloatArray, NDArray[np.int64]]:
    """Normals of local planes of 5 by 5 pixels, in L, and the places of their pixels in `index`.

    In inverse depth a plane is linear in the pixel's place, so its normal comes of two slopes.
    """
    model = frame.model
    flat = np.zeros(model.height * model.width)
    flat[frame.index] = frame.rho
    image = flat.reshape(model.height, model.width)
    whole = correlate1d(
        correlate1d((image > 0).astype(float), np.ones(5), axis=0), np.ones(5), axis=1
    )
    slope, mean = np.arange(-2.0, 3.0) / 10.0, np.ones(5) / 5.0
    a = correlate1d(correlate1d(image, slope, axis=1), mean, axis=0).ravel()[frame.index]
    b = correlate1d(correlate1d(image, slope, axis=0), mean, axis=1).ravel()[frame.index]
    rho = correlate1d(correlate1d(image, mean, axis=0), mean, axis=1).ravel()[frame.index]
    u, v = frame.index % model.width, frame.index // model.width
    normal = np.stack(
        [a * model.fx, b * model.fy, rho - a * (u - model.cx) - b * (v - model.cy)], axis=-1
    )
    # rays = R (x, y, 1): R comes back from the rays of three pixels
    camera = model.rays().reshape(-1, 3)[frame.index]
    R_T, *_ = np.linalg.lstsq(camera, frame.rays, rcond=None)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    good = np.flatnonzero((whole.ravel()[frame.index] > 24.5) & (length[:, 0] > 1e-9))
    return np.asarray((normal[good] / length[good]) @ R_T), good


def candidate_yaws(frame: DepthFrame) -> list[float]:
    """The few yaws [rad] that upright surfaces, and rows of silhouette edges, speak for."""
    normals, _ = surface_normals(frame)
    found: list[float] = [0.0]
    upright = np.abs(normals[:, 2]) < 0.35
    bins = np.radians(np.arange(-50.0, 51.0, 2.0))
    if np.count_nonzero(upright) > 30:
        azimuth = np.arctan2(normals[upright, 1], normals[upright, 0])
        votes, _ = np.histogram(azimuth, bins)
        found += _peaks(votes.astype(float), bins, 3)
    if len(frame.edges) > 10:
        points = frame.edges / frame.edge_rho[:, np.newaxis]
        centres = 0.5 * (bins[1:] + bins[:-1])
        votes = np.zeros(len(centres))
        for i, yaw in enumerate(centres):
            s = points[:, 0] * np.cos(yaw) + points[:, 1] * np.sin(yaw)
            counts, _ = np.histogram(s, np.arange(0.0, 4.0, 0.02))
            votes[i] = float((counts.astype(float) ** 2).sum())
        found += _peaks(votes, bins, 2)
    apart: list[float] = []
    for yaw in found[1:] + found[:1]:
        if all(abs(yaw - other) > np.radians(3.0) for other in apart):
            apart.append(yaw)
    return apart


def _peaks(votes: FloatArray, bins: FloatArray, most: int) -> list[float]:
    smooth = correlate1d(votes, np.array([0.5, 1.0, 0.5]), mode="constant")
    centres = 0.5 * (bins[1:] + bins[:-1])
    found: list[float] = []
    for i in np.argsort(-smooth, kind="stable"):
        if smooth[i] <= 0.15 * smooth.max() or len(found) == most:
            break
        if all(abs(centres[i] - c) > np.radians(6.0) for c in found):
            window = slice(max(0, i - 2), i + 3)
            weight = votes[window]
            found.append(float((weight * centres[window]).sum() / max(weight.sum(), 1e-9)))
    return found


def candidate_floors(frame: DepthFrame, priors: StairPriors) -> list[float]:
    """Heights of the floor over the camera [m] that are worth a try."""
    mean, sigma = priors.floor
    if sigma < 0.05:
        return [mean]
    normals, good = surface_normals(frame)
    flat = np.abs(normals[:, 2]) > 0.9
    heights = frame.points[good[flat], 2]
    if len(heights) < 20:
        return []
    bins = np.arange(-2.5, 0.5, 0.02)
    votes, _ = np.histogram(heights, bins)
    smooth = correlate1d(votes.astype(float), np.ones(3), mode="constant")
    centres = 0.5 * (bins[1:] + bins[:-1])
    found: list[float] = []
    for i in np.argsort(-smooth, kind="stable"):
        if smooth[i] < max(12.0, 0.02 * len(heights)) or len(found) == 6:
            break
        if all(abs(centres[i] - c) > 0.05 for c in found):
            found.append(float(centres[i]))
    return found


def find_stairs(
    frame: DepthFrame,
    priors: StairPriors,
    generator: np.random.Generator,
    *,
    ways: tuple[bool, ...] = (True, False),
) -> FoundStairs | None:
    """Looks for stairs in an image.

    Args:
        frame: The image.
        priors: What is known before; with a floor known to 5 cm there is less to search.
        generator: Chooses the points that the coarse search looks at.
        ways: Whether to look for stairs up (True), down (False), or both.

    Returns:
        The stairs; None where nothing speaks for two steps at least.
    """
    if len(frame.rho) < 200:
        return None
    pick = np.sort(generator.choice(len(frame.rho), min(SAMPLE, len(frame.rho)), replace=False))
    points = frame.points[pick]
    z = 1.0 / frame.rho[pick]
    tolerance = np.maximum(0.025, 2.0 * frame.sigma[pick] * z * z)
    firsts = np.arange(0.06, 2.7, 0.04)
    guesses = []
    for yaw in candidate_yaws(frame):
        ahead = np.abs(points[:, 1] * np.cos(yaw) - points[:, 0] * np.sin(yaw)) < CORRIDOR
        if np.count_nonzero(ahead) < 50:
            continue
        s = points[ahead, 0] * np.cos(yaw) + points[ahead, 1] * np.sin(yaw)
        h, allowed = np.ascontiguousarray(points[ahead, 2]), tolerance[ahead]
        for ground in candidate_floors(frame, priors):
            for up in ways:
                costs = np.empty((len(firsts), len(RISES), len(RUNS)))
                score_profile(
                    s, h, allowed, ground, 1.0 if up else -1.0,
                    firsts, RISES, RUNS, 6, costs,
                )  # fmt: skip
                for at in _best_cells(costs, 4):
                    guesses.append((float(costs[at]), yaw, ground, up, at))
    guesses.sort(key=lambda g: (g[0], g[4]))
    thin = keep_pixels(frame, np.arange(len(frame.rho)) % THINNED == 0)
    fits: list[tuple[float, StairFit]] = []
    for cost, yaw, ground, up, (f, r, q) in guesses[:12]:
        if cost > guesses[0][0] + 0.2:
            break
        for is_open in (False, True) if up else (False,):
            shape = StairShape(steps=3, up=up, is_open=is_open)
            rise = float(RISES[r]) if up else -float(RISES[r])
            theta = first_guess(
                shape, first=float(firsts[f]), floor=ground, rise=rise, run=float(RUNS[q]),
                yaw=yaw, priors=priors, nodes=frame.grid[0] * frame.grid[1],
            )  # fmt: skip
            fit = fit_stairs(thin, shape, theta, priors, COARSE)
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
        found = settle(frame, fit, priors)
        if found is not None:
            value = support(frame, found.fit, priors, (found.right, found.left))
            if value > best_support:
                best, best_support = found, value
    return best


def alike(one: StairFit, other: StairFit) -> bool:
    """Whether two fits of as many steps are the same stairs."""
    return one.shape == other.shape and bool(
        np.all(np.abs(one.places - other.places) < 0.02)
        and np.all(np.abs(one.heights - other.heights) < 0.02)
    )


def support(
    frame: DepthFrame,
    fit: StairFit,
    priors: StairPriors,
    width: tuple[float, float] | None = None,
) -> float:
    """How many pixels agree with the steps, less twice those that do not."""
    if width is None:
        width = find_width(frame, fit, priors)
        if width is None:
            return 0.0
    table, _ = count_evidence(crop(frame, fit, width), fit, priors)
    agree = float(table[:, 1:, 1].sum())
    return agree - 2.0 * float(table[:, 1:, 2:4].sum())


def _best_cells(costs: FloatArray, most: int) -> list[tuple[int, int, int]]:
    found: list[tuple[int, int, int]] = []
    for flat in np.argsort(costs, axis=None, kind="stable")[:400]:
        f, r, q = (int(i) for i in np.unravel_index(flat, costs.shape))
        if all(abs(f - a) > 2 or abs(r - b) > 1 or abs(q - c) > 1 for a, b, c in found):
            found.append((f, r, q))
            if len(found) == most:
                break
    return found


def settle(frame: DepthFrame, fit: StairFit | None, priors: StairPriors) -> FoundStairs | None:
    """Takes away steps that nothing speaks for, and adds those that pixels do speak for.

    Args:
        frame: The image.
        fit: A fit near the truth; None is none.
        priors: What is known before.

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
    while held.shape.steps > 1 and not supported(*_last(inner, held, priors), held):
        trimmed = fit_stairs(inner, *with_steps(held, held.shape.steps - 1), priors, FINE)
        if trimmed is None:
            return None
        held = trimmed
    at_most: int | None = None
    while held.shape.steps < MOST_STEPS:
        more = fit_stairs(inner, *with_steps(held, held.shape.steps + 1), priors, (25.0, 12.0, 6.0))
        if more is None:
            break
        table, n = _last(inner, more, priors)
        if not supported(table, n, more):
            if denied(table, n):
                at_most = held.shape.steps
            break
        held = more
    width = find_width(inner, held, priors)
    if width is None:
        return None
    inner = crop(frame, held, width)
    final = fit_stairs(inner, held.shape, held.theta, priors, FINE)
    if final is None or final.shape.steps < 2:
        return None
    table, _ = count_evidence(inner, final, priors)
    if not all(supported(table, i, final) for i in range(1, final.shape.steps + 1)):
        return None
    rise, run = abs(final.other(RISE)), final.other(RUN)
    if not (RISE_BOUNDS[0] < rise < RISE_BOUNDS[1] and RUN_BOUNDS[0] < run < RUN_BOUNDS[1]):
        return None
    return FoundStairs(final, at_most, width[0], width[1])


def _last(frame: DepthFrame, fit: StairFit, priors: StairPriors) -> tuple[FloatArray, int]:
    return count_evidence(frame, fit, priors)[0], fit.shape.steps


def supported(table: FloatArray, i: int, fit: StairFit) -> bool:
    """Whether pixels speak for step i, riser and tread, as `stair_profile.tally` counted them."""
    riser, tread = table[0, i], table[1, i]
    seen = riser[0] + tread[0]
    agree = riser[1] + tread[1]
    if agree < 25.0 or agree < 0.6 * seen:
        return False
    for one in (riser, tread):
        if one[0] >= 25.0 and one[1] < 0.4 * one[0]:
            return False
    if not fit.shape.up:
        return bool(tread[1] >= 25.0)
    if tread[1] >= 12.0 and tread[1] > 0.5 * tread[0]:
        return True
    over, same = table[0, i, 4], table[1, i, 4]
    return bool(riser[1] >= 25.0 and over >= 12.0 and same < 0.3 * over)


def denied(table: FloatArray, i: int) -> bool:
    """Whether most pixels that should see step i see something farther: it is not there."""
    riser = table[0, i]
    return bool(riser[0] >= 25.0 and riser[2] > 0.7 * riser[0])


def crop(frame: DepthFrame, fit: StairFit, width: tuple[float, float]) -> DepthFrame:
    """The pixels and edges that lie within the stairs' width."""
    kept = []
    for rays, rho in (
        (frame.rays, measured(frame, fit)),
        (frame.edges, frame.edge_rho),
    ):
        turned_rays = corrected_rays(rays, fit.theta, fit.shape.steps)
        yaw = fit.other(YAW)
        across = (turned_rays[:, 1] * np.cos(yaw) - turned_rays[:, 0] * np.sin(yaw)) / rho
        kept.append((across > width[0]) & (across < width[1]))
    return keep_pixels(frame, kept[0], kept[1])
