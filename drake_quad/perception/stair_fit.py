"""Fits parametric stairs to a depth image by Gauss-Newton on each pixel's inverse depth.

Free are every nosing's place, every tread's height, yaw and overhang, tied to one rise and one run
by priors; and what the camera may have wrong: its tilt, an offset of inverse depth, a growth of
edges. Silhouette edges measure nosings whose treads are grazed or not seen at all. Outliers are
weighed down by Tukey's function (Huber and Ronchetti, "Robust Statistics", 2009, section 4.8).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotation_exp
from drake_quad.perception.depth_frame import DepthFrame
from drake_quad.perception.stair_profile import (
    EDGE_BIAS,
    NUISANCES,
    OFFSET,
    OVERHANG,
    PITCH,
    RISE,
    ROLL,
    RUN,
    YAW,
    EdgeRays,
    Equations,
    Pixels,
    accumulate,
    accumulate_edges,
    parameter_count,
)

COARSE = (25.0, 15.0, 10.0, 7.0, 6.0, 6.0)
FINE = (8.0, 6.0, 6.0)
STIFF = 1e6
MOST_ERROR = 3.5  # deviations that what the camera has wrong may be off by


@dataclass(frozen=True, kw_only=True)
class StairPriors:
    """What is known of stairs and camera before an image is seen; (mean, deviation) each.

    Attributes:
        floor: Height of the floor before the stairs over the camera [m].
        rise: Rise of a step [m].
        run: Run of a tread [m].
        uneven: Deviation of single rises and runs from the flight's [m].
        overhang: Overhang of the treads [m].
        yaw: Yaw of the climb in L [rad].
        edge_bias: Growth of the near side at edges [rows of the fitted image].
        edge: Deviation of an edge's place in one column [rows].
        alike: How many pixels err as one: by so much the pixels' information is less.
        thickness: Thickness of treads with an overhang or open risers [m].
    """

    floor: tuple[float, float] = (-0.5, 1.0)
    rise: tuple[float, float] = (0.155, 0.05)
    run: tuple[float, float] = (0.29, 0.08)
    uneven: float = 0.006
    overhang: tuple[float, float] = (0.008, 0.012)
    yaw: tuple[float, float] = (0.0, 1.0)
    edge_bias: tuple[float, float] = (0.8, 0.4)
    edge: float = 0.5
    alike: float = 2.0
    thickness: float = 0.04


@dataclass(frozen=True)
class StairShape:
    """What the fit does not change.

    Attributes:
        steps: Number of risers.
        up: Whether the stairs go up.
        is_open: Whether there is nothing between the treads.
    """

    steps: int
    up: bool
    is_open: bool = False


@dataclass(frozen=True)
class StairFit:
    """Fitted stairs, told in L.

    Attributes:
        shape: What was fitted.
        theta: Places, heights, then the others as `stair_profile` orders them.
        covariance: Covariance of theta.
        cost: Robust cost of the last pass.
        spread: Root of the inliers' mean weighted square, in deviations: 1 for noise as told.
    """

    shape: StairShape
    theta: FloatArray
    covariance: FloatArray
    cost: float
    spread: float

    @property
    def places(self) -> FloatArray:
        """Nosings' places [m], (n,)."""
        return self.theta[: self.shape.steps]

    @property
    def heights(self) -> FloatArray:
        """Heights of the floor and the treads over the camera [m], (n + 1,)."""
        return self.theta[self.shape.steps : 2 * self.shape.steps + 1]

    def other(self, which: int) -> float:
        """One of the parameters after places and heights, for example `RISE`."""
        return float(self.theta[2 * self.shape.steps + 1 + which])


def first_guess(
    shape: StairShape,
    *,
    first: float,
    floor: float,
    rise: float,
    run: float,
    yaw: float,
    priors: StairPriors,
    nodes: int,
    level: tuple[float, float] = (0.0, 0.0),
) -> FloatArray:
    """Parameters of even stairs.

    Args:
        shape: What is to be fitted.
        first: The first nosing's place [m].
        floor: Height of the floor over the camera [m].
        rise: Rise of a step, up positive [m].
        run: Run of a tread [m].
        yaw: Yaw of the climb, in L [rad].
        priors: Overhang and edge bias are their means.
        nodes: How many the pattern has: the product of the frame's `grid`.
        level: Roll and pitch by which the camera's attitude is thought to be off [rad].
    """
    n = shape.steps
    theta = np.zeros(parameter_count(n) + nodes)
    theta[:n] = first + run * np.arange(n)
    theta[n : 2 * n + 1] = floor + rise * np.arange(n + 1)
    base = 2 * n + 1
    theta[base + YAW] = yaw
    theta[base + ROLL], theta[base + PITCH] = level
    theta[base + OVERHANG] = priors.overhang[0] if shape.up and not shape.is_open else 0.0
    theta[base + EDGE_BIAS] = priors.edge_bias[0]
    theta[base + RISE], theta[base + RUN] = rise, run
    return theta


def with_steps(fit: StairFit, steps: int) -> tuple[StairShape, FloatArray]:
    """Shape and parameters with more steps, as rise and run have them, or fewer."""
    n = fit.shape.steps
    shape = replace(fit.shape, steps=steps)
    places, heights = list(fit.places), list(fit.heights)
    rise, run = fit.other(RISE), fit.other(RUN)
    for _ in range(steps - n):
        places.append(places[-1] + run)
        heights.append(heights[-1] + rise)
    theta = np.concatenate([places[:steps], heights[: steps + 1], fit.theta[2 * n + 1 :]])
    return shape, theta


def shape_vector(shape: StairShape, theta: FloatArray, priors: StairPriors) -> FloatArray:
    """What the kernels take of a shape: steps, up, open, thickness, length of the last tread."""
    run = float(theta[2 * shape.steps + 1 + RUN])
    return np.array(
        [shape.steps, float(shape.up), float(shape.is_open), priors.thickness, 0.85 * run]
    )


def corrected_rays(vectors: FloatArray, theta: FloatArray, n: int) -> FloatArray:
    """Rays with the fitted errors of pitch and roll taken out, (k, 3)."""
    R = rotation_exp(float(theta[2 * n + 1 + ROLL]), float(theta[2 * n + 1 + PITCH]), 0.0)
    return np.ascontiguousarray(vectors @ R.T)


def _prior_rows(
    shape: StairShape, priors: StairPriors, frame: DepthFrame
) -> list[tuple[dict[int, float], float, float]]:
    """Sums of parameters by their shares, with the mean and the deviation of each sum."""
    n, base = shape.steps, 2 * shape.steps + 1
    way = 1.0 if shape.up else -1.0
    rows: list[tuple[dict[int, float], float, float]] = [
        ({n: 1.0}, *priors.floor),
        ({base + RISE: 1.0}, way * priors.rise[0], priors.rise[1]),
        ({base + RUN: 1.0}, *priors.run),
        ({base + PITCH: 1.0}, 0.0, frame.tilt),
        ({base + ROLL: 1.0}, 0.0, frame.tilt),
        ({base + OFFSET: 1.0}, 0.0, frame.offset_sigma),
        ({base + EDGE_BIAS: 1.0}, *priors.edge_bias),
        ({base + YAW: 1.0}, *priors.yaw),
    ]
    seen = shape.up and not shape.is_open
    rows.append(({base + OVERHANG: 1.0}, *(priors.overhang if seen else (0.0, 1e-4))))
    for i in range(n):
        rows.append(({n + i + 1: 1.0, n + i: -1.0, base + RISE: -1.0}, 0.0, priors.uneven))
        if i:
            rows.append(({i: 1.0, i - 1: -1.0, base + RUN: -1.0}, 0.0, priors.uneven))
    return rows


def prior_equations(
    theta: FloatArray, shape: StairShape, priors: StairPriors, frame: DepthFrame
) -> tuple[FloatArray, FloatArray]:
    """The priors' part of the normal equations: (p, p) and (p,)."""
    base, p = 2 * shape.steps + 1, len(theta)
    A, b = np.zeros((p, p)), np.zeros(p)
    for k in range(base + NUISANCES, p):
        A[k, k] += 1.0 / frame.pattern_sigma**2
        b[k] -= theta[k] / frame.pattern_sigma**2
    for terms, mean, sigma in _prior_rows(shape, priors, frame):
        keys, values = list(terms), np.array(list(terms.values()))
        residual = mean - float(values @ theta[keys])
        A[np.ix_(keys, keys)] += np.outer(values, values) / sigma**2
        b[keys] += values * residual / sigma**2
    return A, b


def fit_stairs(
    frame: DepthFrame,
    shape: StairShape,
    theta: FloatArray,
    priors: StairPriors,
    cutoffs: Sequence[float] = FINE,
    *,
    held: int = 0,
) -> StairFit | None:
    """Fits from a guess, one Gauss-Newton step for each cutoff.

    Args:
        frame: The image.
        shape: What is fitted.
        theta: The guess.
        priors: What is known before.
        cutoffs: Residuals beyond which pixels are outliers, in deviations, from wide to narrow.
        held: First steps in which the camera's errors stay as they are: far from the
            stairs they would be bent to explain what a guess has wrong.

    Returns:
        The fit; None where it comes to no stairs (a tread at or over the camera's height that is
        looked at from above, steps in no order).
    """
    theta, n, base = theta.copy(), shape.steps, 2 * shape.steps + 1
    p = len(theta)
    totals, edge_totals = np.zeros(5), np.zeros(5)
    information = np.eye(p)
    for number, cutoff in enumerate(cutoffs):
        rays, edges = corrected_rays(frame.rays, theta, n), corrected_rays(frame.edges, theta, n)
        A, b, totals, edge_totals = np.zeros((p, p)), np.zeros(p), np.zeros(5), np.zeros(5)
        vector = shape_vector(shape, theta, priors)
        pixels = Pixels(rays, frame.rho, frame.sigma, frame.gain, frame.nodes, frame.row_step)
        equations = Equations(A, b, totals)
        accumulate(pixels, theta, vector, float(frame.grid[1]), cutoff, equations)
        silhouettes = EdgeRays(edges, frame.edge_rho, frame.row_step)
        equations = Equations(A, b, edge_totals)
        accumulate_edges(silhouettes, theta, vector, priors.edge, min(cutoff, 20.0), equations)
        prior_A, prior_b = prior_equations(theta, shape, priors, frame)
        A = A + np.tril(A, -1).T
        information = A / priors.alike + prior_A
        if number < held:
            for k in (base + PITCH, base + ROLL, base + OFFSET, *range(base + NUISANCES, p)):
                information[k, k] *= STIFF
                information[k, k] += STIFF
        try:
            step = np.linalg.solve(information, b / priors.alike + prior_b)
        except np.linalg.LinAlgError:
            return None
        largest = float(np.max(np.abs(step[:base])))
        theta += step * min(1.0, 0.08 / max(largest, 1e-12))
        theta[base + OVERHANG] = min(max(theta[base + OVERHANG], 0.0), 0.06)
        _bound_nuisances(theta, base, frame)
        if not _is_sound(theta, shape):
            return None
    spread = float(np.sqrt(totals[3] / max(totals[4], 1.0)))
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return StairFit(shape, theta, covariance, float(totals[0] + edge_totals[0]), spread)


def _bound_nuisances(theta: FloatArray, base: int, frame: DepthFrame) -> None:
    """Keeps what the camera may have wrong within what it can have wrong.

    Thousands of pixels outvote any prior. So without bounds there are fits of other surfaces, seen
    by a camera that is tilted by many times of what its attitude is known to.
    """
    for which, sigma in ((PITCH, frame.tilt), (ROLL, frame.tilt), (OFFSET, frame.offset_sigma)):
        theta[base + which] = min(max(theta[base + which], -MOST_ERROR * sigma), MOST_ERROR * sigma)
    pattern = theta[base + NUISANCES :]
    most = MOST_ERROR * frame.pattern_sigma
    np.clip(pattern, -most, most, out=pattern)


def prior_cost(frame: DepthFrame, fit: StairFit, priors: StairPriors) -> float:
    """How unlikely the fit is before the image is seen: the sum of squared deviations."""
    pattern = fit.theta[2 * fit.shape.steps + 1 + NUISANCES :]
    cost = float(np.sum((pattern / frame.pattern_sigma) ** 2)) if len(pattern) else 0.0
    for terms, mean, sigma in _prior_rows(fit.shape, priors, frame):
        told = sum(value * fit.theta[key] for key, value in terms.items())
        cost += float((mean - told) / sigma) ** 2
    return cost


def _is_sound(theta: FloatArray, shape: StairShape) -> bool:
    n = shape.steps
    places, heights = theta[:n], theta[n : 2 * n + 1]
    way = 1.0 if shape.up else -1.0
    return bool(
        np.all(np.isfinite(theta))
        and places[0] > 0.02
        and np.all(np.diff(places) > 0.05)
        and np.all(way * np.diff(heights) > 0.01)
        and np.all(np.abs(heights) > 1e-4)
    )


def measured(frame: DepthFrame, fit: StairFit) -> FloatArray:
    """The inverse depths without the offset and the pattern that the fit found [1/m], (n,)."""
    error = np.full(len(frame.rho), fit.other(OFFSET))
    if frame.grid[1]:
        pattern = fit.theta[2 * fit.shape.steps + 1 + NUISANCES :]
        node, right, below = frame.nodes[:, 0].astype(int), frame.nodes[:, 1], frame.nodes[:, 2]
        high = (1.0 - right) * pattern[node] + right * pattern[node + 1]
        node = node + frame.grid[1]
        low = (1.0 - right) * pattern[node] + right * pattern[node + 1]
        error = error + (1.0 - below) * high + below * low
    return np.asarray(frame.rho - error * frame.gain)
