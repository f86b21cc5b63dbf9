"""Draws what was seen: the depth image, and the points from the side with the stairs over them."""

from typing import TYPE_CHECKING

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.perception.see import SeenStairs
from drake_quad.perception.stair_evidence import explained
from drake_quad.perception.stair_fit import StairPriors, corrected_rays, measured
from drake_quad.perception.stair_profile import YAW

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def seen_profile(
    places: FloatArray, heights: FloatArray, run: float
) -> tuple[FloatArray, FloatArray]:
    """The stairs from the side as a line: (k,) places and (k,) heights [m]."""
    ends = [places[0] - run, *places, places[-1] + run]
    x = np.repeat(ends, 2)[1:-1]
    return x, np.repeat(heights, 2)


def draw_seen(seen: SeenStairs, depth: FloatArray) -> "Figure":
    """Draws the image, and below it the points and the stairs from the side.

    Args:
        seen: What was seen.
        depth: The image [m].
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.5), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.4])
    shown = np.where(depth > 0.0, depth, np.nan)
    image = left.imshow(shown, cmap="viridis", vmax=float(np.nanquantile(shown, 0.98)))
    figure.colorbar(image, ax=left, label="depth [m]", shrink=0.7)
    left.set_axis_off()
    frame, found, belief = seen.frame, seen.found, seen.belief
    if found is None or belief is None:
        points = frame.points
        right.plot(points[:, 0], points[:, 2], ".", ms=1.0, color="0.6")
        right.set_title("no stairs")
    else:
        rays = corrected_rays(frame.rays, found.fit.theta, found.fit.shape.steps)
        points = rays / measured(frame, found.fit)[:, np.newaxis]
        yaw = found.fit.other(YAW)
        s = points[:, 0] * np.cos(yaw) + points[:, 1] * np.sin(yaw)
        _, residual, across = explained(frame, found.fit, StairPriors())
        inside = (across > found.right) & (across < found.left)
        agree = inside & (np.abs(residual) < 5.0)
        right.plot(s[~inside], points[~inside, 2], ".", ms=1.0, color="0.85", label="elsewhere")
        right.plot(s[inside & ~agree], points[inside & ~agree, 2], ".", ms=1.0, color="tab:orange",
                   label="disagree")  # fmt: skip
        right.plot(s[agree], points[agree, 2], ".", ms=1.0, color="tab:blue", label="agree")
        x, z = seen_profile(belief.places, belief.heights, belief.run)
        right.plot(x, z, color="black", lw=1.2, label="stairs")
        rise, run = belief.estimate("rise"), belief.estimate("run")
        right.set_title(
            f"rise {rise.value:.3f} ± {rise.half_width:.3f} m, "
            f"run {run.value:.3f} ± {run.half_width:.3f} m"
        )
        right.set_xlim(x[0], x[-1])
        right.set_ylim(z.min() - 0.15, z.max() + 0.25)
        right.legend(markerscale=8.0, loc="upper left", fontsize=8)
    right.set_aspect("equal")
    right.set_xlabel("along the climb [m]")
    right.set_ylabel("over the camera [m]")
    return figure
