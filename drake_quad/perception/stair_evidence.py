"""What pixels say for and against fitted stairs: which steps are there, and how well all agree."""

from dataclasses import replace

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.perception.depth_frame import DepthFrame
from drake_quad.perception.stair_fit import (
    StairFit,
    StairPriors,
    corrected_rays,
    count_evidence,
    explained,
    find_width,
    keep_pixels,
    measured,
    prior_cost,
    with_steps,
)
from drake_quad.perception.stair_profile import YAW

# A pixel that agrees in full speaks for stairs as much as so many squared deviations of the priors
# speak against them: the square of the cutoff, 5, over the number of pixels that err as one.
PIXEL_WORTH = 12.5
CUTOFF = 5.0  # deviations
APART = 4.0  # squared deviations
ENDLESS = 20.0  # [m]


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
