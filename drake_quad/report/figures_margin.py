"""Figures of stability: margins, regions, and the estimate's errors."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.common import FloatArray
from drake_quad.report.axes import (
    draw_event_shading,
    draw_line,
    label_time,
    make_axes,
    mark_point,
    signed,
)
from drake_quad.report.derived import (
    base_motion,
    find_least_margin,
    has_massless_legs,
    least_margins,
    margins,
    whole_robot_margins,
)
from drake_quad.report.style import BAD, INK, LEG_COLOURS, LESS_COLOUR, MUTED, PAPER, WARN
from drake_quad.runs.reader import RecordedRun
from drake_quad.runs.run_log import runs_of
from drake_quad.stability.safety import NO_SUPPORT, safe_margin

LOWEST = -0.15  # [m] what lies deeper is cut off: the figure is of margins, not of falls

# Column, its name, how it is drawn. What is planned is dashed, in the colour of its measure.
LINES = (
    ("margin_friction_planned", "friction, planned", {"color": MUTED, "ls": (0, (4, 2))}),
    ("margin_feasible_planned", "friction and torque, planned", {"color": WARN, "ls": (0, (4, 2))}),
    ("margin_dynamic", "in motion", {"color": LESS_COLOUR, "lw": 0.8}),
    ("margin_feasible", "friction and torque", {"color": WARN}),
    ("margin_friction", "friction", {"color": INK, "lw": 1.3}),
)

FLAGS = 0.025  # of the axes' height, for each leg's row of flags


def draw_margin(run: RecordedRun) -> Figure:
    """Static margin planned and measured, zero-moment-point margin, and the least of them.

    Source: the paper's Fig. 12; measured is of the whole robot's centre of mass over the feet
    that bear. Of the paper's robot, whose legs have no mass, it is the body's centre's, and what
    legs with mass would leave is drawn beside it.
    """
    log = run.log
    figure, grid = make_axes(1, height=3.6)
    axis = grid[0, 0]
    measured, planned, zmp = (margins(run, n) for n in ("margin", "margin_planned", "zmp_margin"))
    draw_event_shading([axis], run, label=axis)
    draw_line(axis, log.t, zmp, color=LESS_COLOUR, lw=0.7, alpha=0.8, label="zero-moment point")
    names = ("static, planned", "static, measured")
    if run.kinematic:
        names = ("static, planned", "static, kinematic replay")
    if has_massless_legs(run):
        # What the log has planned is without their mass, too, and so the curve of the replay.
        planned = whole_robot_margins(run)
        names = ("static, legs with mass", "static, legs without mass (as in the paper)")
    style = {"color": MUTED, "lw": 1.0, "ls": (0, (4, 2)), "label": names[0]}
    draw_line(axis, log.t, planned, **style)
    draw_line(axis, log.t, measured, color=INK, lw=1.3, label=names[1])
    axis.axhline(0.0, color=BAD, lw=1.0)
    for first, past in runs_of(least_margins(run) <= NO_SUPPORT):
        axis.axvspan(log.t[max(first - 1, 0)], log.t[past - 1], ymax=0.04, color=BAD, lw=0)
    known = np.concatenate([v[np.isfinite(v)] for v in (measured, planned, zmp)])
    least = find_least_margin(run)
    if known.size:
        lowest = float(known.min()) if least is None else min(float(known.min()), least.margin)
        low, high = max(lowest, LOWEST), float(np.quantile(known, 0.999))
        pad = 0.08 * max(high - low, 0.02)
        axis.set_ylim(min(low - pad, -pad), high + 2.5 * pad)
        # Below the strip of the clock's waiting, and readable over the lines of pushes.
        clear = {"frameon": True, "facecolor": PAPER, "edgecolor": "none", "framealpha": 0.8}
        axis.legend(loc="upper left", bbox_to_anchor=(0.0, 0.97), ncols=3, **clear)
    if least is not None:
        colour = BAD if least.margin < 0.0 else INK
        height = max(least.margin, LOWEST)
        mark_point(axis, least.time, height, signed(least.sentence), colour=colour)
    axis.set_ylabel("margin [m]")
    label_time([axis])
    return figure


def was_measured(run: RecordedRun) -> bool:
    """Whether the run measured any of it."""
    return bool(np.any(np.isfinite(run.log.number("margin_friction"))))


def draw_regions(run: RecordedRun) -> Figure:
    """The margins of the regions over bands of their worth, planned beside measured; pushes."""
    figure, grid = make_axes(2, height=5.4, height_ratios=[3, 2])
    top, below = grid[:, 0]
    draw_event_shading([top, below], run, label=top)
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
    draw_line(below, run.log.t, budget, color=INK, label="weakest push that forces a step [m/s]")
    if np.any(np.isfinite(budget)):
        k = int(np.nanargmin(budget))
        text = signed(f"smallest {budget[k]:.2f} m/s at {run.log.t[k]:.1f} s")
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


def was_estimated(run: RecordedRun) -> bool:
    """Whether there is anything to show."""
    return bool(np.any(np.isfinite(run.log.number("base_estimated_x"))))


def estimate_errors(run: RecordedRun) -> FloatArray:
    """Errors of place [m], heading and tilt [rad], (N, 3); all but the heading are sizes."""
    base = base_motion(run)
    place = np.linalg.norm(run.log.vector("base_estimated") - base.p_WB, axis=1)
    roll, pitch, yaw = run.log.vector("base_estimated", ("roll", "pitch", "yaw")).T
    up = np.stack([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)], -1)
    # Of both the world's vertical in B: the sine of the angle is exact where it is small.
    true_up = base.R_WB[:, 2]
    tilt = np.arctan2(
        np.linalg.norm(np.cross(up, true_up), axis=1), np.einsum("ij,ij->i", up, true_up)
    )
    turn = np.remainder(yaw - base.rpy[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    return np.stack([place, turn, tilt], axis=-1)


def believed_errors(run: RecordedRun) -> FloatArray:
    """What the filter believes the same to be, (N, 3): one standard deviation."""
    turn = run.log.vector("deviation_turn")
    place = np.linalg.norm(run.log.vector("deviation_base"), axis=1)
    return np.stack([place, turn[:, 2], np.hypot(turn[:, 0], turn[:, 1])], axis=-1)


def draw_estimate(run: RecordedRun) -> Figure:
    """Errors of place [mm], of heading and of tilt [deg] over time; slips along the bottom."""
    figure, axes = make_axes(3, height=5.0)
    scale = np.array([1e3, *np.degrees([1.0, 1.0])])
    errors, believed = scale * estimate_errors(run), scale * believed_errors(run)
    names = ("position [mm]", "heading [deg]", "tilt [deg]")
    draw_event_shading(list(axes[:, 0]), run, label=axes[0, 0])
    for k, (axis, name) in enumerate(zip(axes[:, 0], names, strict=True)):
        style = {"color": LESS_COLOUR, "lw": 1.0, "ls": (0, (4, 2))}
        label = "estimated, one standard deviation"
        draw_line(axis, run.log.t, believed[:, k], label=label, **style)
        if k == 1:  # the heading's error has a sign
            draw_line(axis, run.log.t, -believed[:, k], **style)
        draw_line(axis, run.log.t, errors[:, k], color=INK, lw=1.2, label="error")
        # At first the filter believes little: that would flatten all the rest.
        top = 1.15 * max(_greatest(errors[:, k]), _greatest(believed[:, k], 0.98), 1e-6)
        axis.set_ylim(-top if k == 1 else 0.0, top)
        axis.set_ylabel(name)
    _draw_sightings(list(axes[:2, 0]), run)
    slips, t = run.log.flags("slip_estimated"), run.log.t
    for row, colour in enumerate(LEG_COLOURS):
        spans = [(t[a], t[min(b, len(t) - 1)] - t[a]) for a, b in runs_of(slips[:, row])]
        axes[0, 0].broken_barh(
            spans,
            ((3 - row) * FLAGS, FLAGS),
            transform=axes[0, 0].get_xaxis_transform(),
            facecolor=colour,
            edgecolor=colour,
            lw=0.6,
        )
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    label_time(axes[-1])
    return figure


def _draw_sightings(axes: list[Axes], run: RecordedRun) -> None:
    """What each sighting of a flight had as the errors of place [mm] and heading [deg]."""
    count = run.log.number("landmarks_seen")
    new = np.flatnonzero(np.diff(count, prepend=0.0) > 0.0)
    if not len(new):
        return
    ahead, left = (run.log.number(f"landmark_{name}")[new] for name in ("ahead", "left"))
    turn = np.degrees(run.log.number("landmark_turn")[new])
    style = {"ls": "", "marker": ".", "ms": 2.5, "color": MUTED, "zorder": 1}
    axes[0].plot(run.log.t[new], 1e3 * np.hypot(ahead, left), label="seen by the camera", **style)
    axes[1].plot(run.log.t[new], turn, **style)


def _greatest(values: FloatArray, share: float = 1.0) -> float:
    """The size that this share of the known values stays within; 0 of none."""
    known = np.abs(values[np.isfinite(values)])
    return float(np.quantile(known, share)) if known.size else 0.0
