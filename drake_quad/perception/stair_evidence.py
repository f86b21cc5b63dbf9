"""What pixels say for and against fitted stairs: which steps are there, and how well all agree."""

from dataclasses import replace

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.perception.depth_frame import DepthFrame, keep_pixels
from drake_quad.perception.pixel_tally import explain, tally
from drake_quad.perception.stair_fit import (
    StairFit,
    StairPriors,
    corrected_rays,
    measured,
    prior_cost,
    shape_vector,
    with_steps,
)
from drake_quad.perception.stair_profile import YAW, Pixels

# A pixel that agrees in full speaks for stairs as much as so many squared deviations of the priors
# speak against them: the square of the cutoff, 5, over the number of pixels that err as one.
PIXEL_WORTH = 12.5
CUTOFF = 5.0  # deviations
APART = 4.0  # squared deviations
ENDLESS = 20.0  # [m]
WALL_HEIGHT = 4.0  # [m] higher than what a camera sees
WALL_OFF = 0.1  # [m] how far a wall may be from the risers that a fit makes of it
WALL_PIXELS = 12.0  # above a nosing, or beyond it, without which nothing is said of a wall


def count_evidence(
    frame: DepthFrame, fit: StairFit, priors: StairPriors, cutoff: float = 5.0
) -> tuple[FloatArray, float]:
    """What speaks for and against each riser and tread: see `pixel_tally.tally`.

    Returns:
        The table (2, n + 1, 6), and the cost of all pixels.
    """
    n = fit.shape.steps
    table = np.zeros((2, n + 1, 6))
    vector = shape_vector(fit.shape, fit.theta, priors)
    return table, float(tally(pixels_of(frame, fit), fit.theta, vector, cutoff, table))


def pixels_of(frame: DepthFrame, fit: StairFit) -> Pixels:
    """The frame's pixels without the tilt, the offset and the pattern that the fit found."""
    return Pixels(
        corrected_rays(frame.rays, fit.theta, fit.shape.steps), measured(frame, fit), frame.sigma,
        frame.gain, frame.nodes, frame.row_step,
    )  # fmt: skip


def explained(
    frame: DepthFrame, fit: StairFit, priors: StairPriors, *, last: float | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Each pixel's surface (3 i + kind, or -1), residual in deviations, and place across [m].

    Args:
        frame: The image.
        fit: The stairs.
        priors: What is known before.
        last: Length of the last tread [m]; as it is believed unless told.
    """
    n = fit.shape.steps
    rays = corrected_rays(frame.rays, fit.theta, n)
    surface, rho = np.empty(len(rays)), np.empty(len(rays))
    vector = shape_vector(fit.shape, fit.theta, priors)
    if last is not None:
        vector[4] = last
    explain(rays, fit.theta, vector, surface, rho)
    yaw = fit.other(YAW)
    found = measured(frame, fit)
    across = (rays[:, 1] * np.cos(yaw) - rays[:, 0] * np.sin(yaw)) / found
    return surface, (found - rho) / frame.sigma, across


def find_width(frame: DepthFrame, fit: StairFit, priors: StairPriors) -> tuple[float, float] | None:
    """From where to where, across the climb, pixels agree with the steps.

    Returns:
        The right and the left end [m], left positive; None where they agree nowhere.
    """
    surface, residual, across = explained(frame, fit, priors)
    on_steps = surface >= 3
    if np.count_nonzero(on_steps) < 20:
        return None
    edges = np.arange(-3.0, 3.05, 0.06)
    at = np.digitize(across[on_steps], edges)
    seen = np.bincount(at, minlength=len(edges) + 1).astype(float)
    agree = np.bincount(
        at, weights=(np.abs(residual[on_steps]) < 6.0).astype(float), minlength=len(edges) + 1
    )
    good = (seen >= 3) & (agree > 0.5 * seen)
    best, best_count, begun = None, 0.0, None
    for k in range(len(good) + 1):
        inside = k < len(good) and bool(
            good[k] or (0 < k < len(good) - 1 and good[k - 1] and good[k + 1])
        )
        if inside and begun is None:
            begun = k
        if not inside and begun is not None:
            count = float(agree[begun:k].sum())
            if count > best_count:
                best, best_count = (begun, k), count
            begun = None
    if best is None:
        return None
    low, high = max(best[0] - 1, 0), min(best[1] - 1, len(edges) - 1)
    return float(edges[low]), float(edges[high])


def support(
    frame: DepthFrame,
    fit: StairFit,
    priors: StairPriors,
    width: tuple[float, float] | None = None,
) -> float:
    """How well the stairs explain the image, in pixels that agree in full.

    It is the logarithm of a likelihood ratio: of the stairs, against a scene of which nothing is
    known, in which every pixel is an outlier. A pixel that sees through a surface, or something
    before it, speaks against the stairs, and so do parameters that are unlikely beforehand.
    """
    if width is None:
        width = find_width(frame, fit, priors)
        if width is None:
            return 0.0
    table, _ = count_evidence(crop(frame, fit, width), fit, priors)
    agree = float(table[:, 1:, 5].sum())
    against = float(table[:, 1:, 2:4].sum())
    return agree - 2.0 * against - prior_cost(frame, fit, priors) / PIXEL_WORTH


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


def told_apart(frame: DepthFrame, fit: StairFit, priors: StairPriors) -> bool:
    """Whether the last step explains its pixels better than the tread before it, carried on.

    Far away, and where a tread is grazed, a step differs from level ground by less than the noise:
    pixels agree with both. Then it is not claimed. Per pixel the squared residuals must differ by
    that of two deviations, which is more than errors that neighbours share.
    """
    n = fit.shape.steps
    if n < 2:
        return True
    surface, residual, _ = explained(frame, fit, priors)
    own = surface >= 3 * n
    if not own.any():
        return False
    shape, theta = with_steps(fit, n - 1)
    without = replace(fit, shape=shape, theta=theta)
    there, other, _ = explained(frame, without, priors, last=ENDLESS)
    other = np.where(there >= 0, np.abs(other), CUTOFF)
    gain = np.minimum(other, CUTOFF) ** 2 - np.minimum(np.abs(residual), CUTOFF) ** 2
    return bool(gain[own].mean() >= APART)


def wall_from(frame: DepthFrame, fit: StairFit, priors: StairPriors) -> int | None:
    """The first step from which a wall would explain the pixels better; None if there is none.

    A wall behind a kerb looks like one more riser; seen obliquely, or with noise, like several.
    What tells a step from it is that something farther is seen above the nosing.

    Args:
        frame: The image, what lies beside the stairs left out.
        fit: The stairs.
        priors: What is known before.
    """
    n = fit.shape.steps
    if not fit.shape.up:
        return None
    surface, residual, _ = explained(frame, fit, priors)
    cost = np.minimum(np.abs(residual), CUTOFF) ** 2
    table, _ = count_evidence(frame, fit, priors)
    for i in range(1, n + 1):
        over, same = table[0, i, 4], table[1, i, 4]
        if over >= WALL_PIXELS and same < 0.3 * over:
            continue
        own = surface >= 3 * i
        if np.count_nonzero(own) - table[0, i, 0] < WALL_PIXELS:  # nothing but the riser is seen
            continue
        shape, theta = with_steps(fit, i)
        shape = replace(shape, is_open=False)
        theta[2 * i] = theta[2 * i - 1] + WALL_HEIGHT
        for place in np.linspace(fit.places[i - 1] - WALL_OFF, fit.places[-1] + WALL_OFF, 9):
            theta[i - 1] = place
            there, other, _ = explained(frame, replace(fit, shape=shape, theta=theta), priors)
            other = np.where(there >= 0, np.minimum(np.abs(other), CUTOFF), CUTOFF) ** 2
            # Of 247 seen flights the least sum was 11 a pixel, but for two last steps far away; of
            # walls the greatest was -6.
            if float((other - cost)[own].sum()) < 0.0:
                return i
    return None


def denied(frame: DepthFrame, fit: StairFit, more: StairFit, priors: StairPriors) -> bool:
    """Whether most pixels that should see the next step see something farther: it is not there.

    Its fit alone does not tell: where little of it is in view, it may be put where it is not.

    Args:
        frame: The image.
        fit: The stairs.
        more: The fit with one step more.
        priors: What is known before.
    """
    n = more.shape.steps
    shape, theta = with_steps(fit, n)
    for one in (more, replace(fit, shape=shape, theta=theta)):
        riser = count_evidence(frame, one, priors)[0][0, n]
        if riser[0] < 25.0 or riser[2] <= 0.7 * riser[0]:
            return False
    return True


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
