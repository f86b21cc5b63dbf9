"""The paper's Fig. 12 for a run: the static stability margin over time."""

import numpy as np
from matplotlib.figure import Figure

from drake_quad.report.axes import draw_line, label_time, make_axes, mark_point, signed
from drake_quad.report.background import draw_background
from drake_quad.report.columns import runs_of
from drake_quad.report.motion import NO_SUPPORT, has_massless_legs, margins
from drake_quad.report.run_files import Run
from drake_quad.report.style import BAD, INK, LESS_COLOUR, MUTED, PAPER

LOWEST = -0.15  # [m] what lies deeper is cut off: the figure is of margins, not of falls


def draw_margin(run: Run) -> Figure:
    """Static margin planned and measured, zero-moment-point margin, and the least of them.

    Source: the paper's Fig. 12; measured is of the whole robot's centre of mass over the feet
    that bear.
    """
    log = run.log
    figure, grid = make_axes(1, height=3.6)
    axis = grid[0, 0]
    measured, planned, zmp = (margins(run, n) for n in ("margin", "margin_planned", "zmp_margin"))
    draw_background([axis], run, label=axis)
    draw_line(axis, log.t, zmp, color=LESS_COLOUR, lw=0.7, alpha=0.8, label="zero-moment point")
    names = ("static, planned", "static, measured")
    if run.kinematic:
        names = ("static, planned", "static, kinematic replay")
    if has_massless_legs(run):
        names = ("static, legs with their mass", "static, legs without mass (the paper's)")
    style = {"color": MUTED, "lw": 1.0, "ls": (0, (4, 2)), "label": names[0]}
    draw_line(axis, log.t, planned, **style)
    draw_line(axis, log.t, measured, color=INK, lw=1.3, label=names[1])
    axis.axhline(0.0, color=BAD, lw=1.0)
    for first, past in runs_of(log.number("margin") <= NO_SUPPORT):
        axis.axvspan(log.t[first], log.t[past - 1], ymax=0.04, color=BAD, lw=0)
    known = np.concatenate([v[np.isfinite(v)] for v in (measured, planned, zmp)])
    if known.size:
        low, high = max(float(known.min()), LOWEST), float(np.quantile(known, 0.999))
        pad = 0.08 * max(high - low, 0.02)
        axis.set_ylim(min(low - pad, -pad), high + 2.5 * pad)
        # Below the strip of the clock's waiting, and readable over the lines of pushes.
        clear = {"frameon": True, "facecolor": PAPER, "edgecolor": "none", "framealpha": 0.8}
        axis.legend(loc="upper left", bbox_to_anchor=(0.0, 0.97), ncols=3, **clear)
    if np.any(np.isfinite(measured)):
        k = int(np.nanargmin(measured))
        colour = BAD if measured[k] < 0.0 else INK
        text = signed(f"least {measured[k]:.3f} m at {log.t[k]:.1f} s")
        mark_point(axis, float(log.t[k]), max(float(measured[k]), LOWEST), text, colour=colour)
    axis.set_ylabel("margin [m]")
    label_time([axis])
    return figure
