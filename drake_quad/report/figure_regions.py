"""Margins beyond the hull's, over time: what friction, torques and motion leave; and pushes."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.gait.legs import FloatArray
from drake_quad.report.axes import draw_line, label_time, make_axes, mark_point, signed
from drake_quad.report.background import draw_background
from drake_quad.report.columns import runs_of
from drake_quad.report.motion import NO_SUPPORT, margins
from drake_quad.report.run_files import Run
from drake_quad.report.style import BAD, INK, LESS_COLOUR, MUTED, PAPER, WARN
from drake_quad.stability.safety import safe_margin

LOWEST = -0.15  # [m] what lies deeper is cut off
# Column, its name, how it is drawn. What is planned is dashed, in the colour of its measure.
LINES = (
    ("margin_friction_planned", "friction, planned", {"color": MUTED, "ls": (0, (4, 2))}),
    ("margin_feasible_planned", "friction and torque, planned", {"color": WARN, "ls": (0, (4, 2))}),
    ("margin_dynamic", "in motion", {"color": LESS_COLOUR, "lw": 0.8}),
    ("margin_feasible", "friction and torque", {"color": WARN}),
    ("margin_friction", "friction", {"color": INK, "lw": 1.3}),
)


def was_measured(run: Run) -> bool:
    """Whether the run measured any of it."""
    return bool(np.any(np.isfinite(run.log.number("margin_friction"))))


def draw_regions(run: Run) -> Figure:
    """The margins of the regions over bands of their worth, planned beside measured; pushes."""
    figure, grid = make_axes(2, height=5.4, height_ratios=[3, 2])
    top, below = grid[:, 0]
    draw_background([top, below], run, label=top)
    found = {name: margins(run, name) for name, _, _ in LINES}
    for name, label, style in LINES:
        draw_line(top, run.log.t, found[name], label=label, **style)
    _draw_bands(top, safe_margin(run.robot), [v for v in found.values() if np.any(np.isfinite(v))])
    for first, past in runs_of(run.log.number("margin_friction") <= NO_SUPPORT):
        top.axvspan(run.log.t[first], run.log.t[past - 1], ymax=0.04, color=BAD, lw=0)
    top.set_ylabel("margin [m]")
    _legend(top)
    capture, budget = margins(run, "margin_capture"), run.log.number("push_budget")
    draw_line(below, run.log.t, capture, color=LESS_COLOUR, label="capture point [m]")
    draw_line(below, run.log.t, budget, color=INK, label="least push that takes a step [m/s]")
    if np.any(np.isfinite(budget)):
        k = int(np.nanargmin(budget))
        text = signed(f"least {budget[k]:.2f} m/s at {run.log.t[k]:.1f} s")
        mark_point(below, float(run.log.t[k]), float(budget[k]), text, colour=INK)
        below.set_ylim(min(0.0, max(float(np.nanmin(capture)), LOWEST)), None)
        below.margins(y=0.2)
    below.set_ylabel("[m], [m/s]")
    _legend(below)
    label_time([below])
    return figure


def _draw_bands(axis: Axes, safe: float, known: list[FloatArray]) -> None:
    """Bands across the axes: what is lost, and what is less than `safe` [m]."""
    values = np.concatenate([v[np.isfinite(v)] for v in known])
    low, high = max(float(values.min()), LOWEST), float(np.quantile(values, 0.999))
    pad = 0.08 * max(high - low, 0.02)
    axis.set_ylim(min(low - pad, -pad), high + 2.5 * pad)
    # [m] as the replay has them
    for a, b, colour in ((LOWEST, 0.0, BAD), (0.0, safe, WARN)):
        axis.axhspan(a if a > LOWEST else -10.0, b, color=colour, alpha=0.13, lw=0, zorder=0.5)


def _legend(axis: Axes) -> None:
    if axis.get_legend_handles_labels()[0]:
        clear = {"frameon": True, "facecolor": PAPER, "edgecolor": "none", "framealpha": 0.8}
        axis.legend(loc="upper left", bbox_to_anchor=(0.0, 0.97), ncols=3, **clear)
