"""The gait diagram: which foot was to stand when, and which one did."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.report.axes import label_time
from drake_quad.report.background import draw_background
from drake_quad.report.columns import RunLog, runs_of
from drake_quad.report.run_files import Run
from drake_quad.report.style import LEG_COLOURS, LEG_NAMES, MUTED, WIDTH

LOST = "#E0162B"  # no other colour of the page: a foot that should bear and does not
TOLERANCE = 0.1  # [s] of delay at a touchdown or a lift-off that is no loss of the ground
LONGEST_ZOOM = 12.0  # [s] shown of the run where it holds no whole cycle


def draw_gait(run: Run) -> Figure:
    """Bars while a foot stands: framed as planned, filled as sensed; the whole run and a cycle."""
    log = run.log
    figure = Figure(figsize=(WIDTH, 4.4), layout="constrained")
    whole, zoom = figure.subplots(2, 1)
    for axis in (whole, zoom):
        _draw_bars(axis, log, frames=axis is zoom)
    draw_background([whole], run, label=whole)
    draw_background([zoom], run)
    start, end = find_cycle(log)
    if end > start:
        zoom.set_xlim(start, end)
        whole.axvspan(start, end, facecolor="none", edgecolor=MUTED, lw=1.2, zorder=4)
    title = "a cycle (framed above): outline planned, filled sensed"
    if run.kinematic:
        title = "a cycle (framed above): as planned, for a kinematic replay senses nothing"
    zoom.set_title(title)
    label_time([zoom])
    return figure


def find_cycle(log: RunLog) -> tuple[float, float]:
    """The times [s] of a cycle to look at closely.

    From one planned lift-off of leg 1 to the next within the longest wave segment, nearest to its
    middle; else the middle of the run.
    """
    if not len(log):
        return 0.0, 0.0
    t, planned = log.t, log.flags("standing_planned")
    waves = [band for band in log.bands() if band.kind in ("wave", "spin")]
    waves.sort(key=lambda band: (band.kind == "wave", band.end - band.start), reverse=True)
    for band in waves:
        lifts = [t[first] for first, _ in runs_of(~planned[:, 0]) if band.start <= t[first]]
        lifts = [lift for lift in lifts if lift <= band.end]
        cycles = list(pairwise(lifts))
        if cycles:
            middle = 0.5 * (band.start + band.end)
            first, last = min(cycles, key=lambda c: abs(0.5 * (c[0] + c[1]) - middle))
            return float(first), float(last)
    middle, half = 0.5 * (t[0] + t[-1]), 0.5 * min(LONGEST_ZOOM, float(t[-1] - t[0]))
    return float(middle - half), float(middle + half)


def find_losses(t: FloatArray, planned: BoolArray, sensed: BoolArray) -> BoolArray:
    """When one foot had lost the ground that it was to stand on, (N,).

    That a foot takes up its load a little after its touchdown, and gives it up a little before
    its lift-off, is no loss, nor that a light foot's contact comes and goes meanwhile; a gap
    within the rest of a stance is, however short.

    Args:
        t: (N,) [s].
        planned: (N,) whether the foot is to stand.
        sensed: (N,) whether it bears.
    """
    lost = np.zeros(len(t), dtype=np.bool_)
    for begin, end in runs_of(planned):
        landed, leaves = t[begin] + TOLERANCE, t[min(end, len(t) - 1)] - TOLERANCE
        for first, past in runs_of(~sensed[begin:end]):
            a, b = begin + first, begin + past
            coming, going = t[b - 1] <= landed, t[a] >= leaves
            if not (coming or going) or t[b - 1] - t[a] > TOLERANCE:
                lost[a:b] = True
    return lost


def _draw_bars(axis: Axes, log: RunLog, *, frames: bool) -> None:
    """The bars of all four legs, leg 1 on top."""
    t, sensed, planned = log.t, log.flags("bearing"), log.flags("standing_planned")
    for row, colour in enumerate(LEG_COLOURS):
        axis.broken_barh(_spans(t, sensed[:, row]), (row - 0.25, 0.5), facecolor=colour, lw=0)
        plan = _spans(t, planned[:, row])
        if frames:
            axis.broken_barh(plan, (row - 0.4, 0.8), facecolor="none", edgecolor=colour, lw=1.3)
        else:
            axis.broken_barh(plan, (row - 0.4, 0.8), facecolor=colour, alpha=0.3, lw=0)
        lost = _spans(t, find_losses(t, planned[:, row], sensed[:, row]))
        # The frame makes a loss of a few samples as wide as can be seen.
        axis.broken_barh(lost, (row - 0.4, 0.8), facecolor=LOST, edgecolor=LOST, lw=1.0, zorder=3)
    axis.set_yticks(range(4), LEG_NAMES)
    axis.set_ylim(3.6, -0.6)
    axis.grid(visible=False, axis="y")
    if len(t) > 1:
        axis.set_xlim(t[0], t[-1])


def _spans(t: np.ndarray, flags: np.ndarray) -> list[tuple[float, float]]:
    """Start and length [s] of each stretch of True."""
    last = len(t) - 1
    return [(float(t[a]), float(t[min(b, last)] - t[a])) for a, b in runs_of(flags)]
