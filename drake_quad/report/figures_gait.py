"""Figures over time: gait diagram, gait clock, joints, forces."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.common import GRAVITY, BoolArray, FloatArray
from drake_quad.report.axes import draw_event_shading, draw_line, label_time, make_axes
from drake_quad.report.derived import MODES, clock_stops
from drake_quad.report.figures_revisions import draw_looks
from drake_quad.report.style import (
    BAD,
    INK,
    LEG_COLOURS,
    LEG_NAMES,
    MODE_COLOURS,
    MUTED,
    THREE_COLOURS,
    WIDTH,
)
from drake_quad.runs.reader import RecordedRun
from drake_quad.runs.run_log import RunLog, runs_of
from drake_quad.scenario.build import disturbances_of

LOST = "#E0162B"  # no other colour of the page: a foot that should bear and does not
TOLERANCE = 0.1  # [s] of delay at a touchdown or a lift-off that is no loss of the ground
LONGEST_ZOOM = 12.0  # [s] shown of the run where it holds no whole cycle

NAMES = {
    "wait": "waits for a foot",
    "catch": "catches a push",
    "settle": "waits until the robot is calm",
    "replan": "waits for the plan",
}

JOINTS = ("abduction", "hip pitch", "knee")


def draw_gait(run: RecordedRun) -> Figure:
    """Bars while a foot stands: framed as planned, filled as sensed; the whole run and a cycle."""
    log = run.log
    figure = Figure(figsize=(WIDTH, 4.4), layout="constrained")
    whole, zoom = figure.subplots(2, 1)
    for axis in (whole, zoom):
        _draw_bars(axis, log, frames=axis is zoom)
    draw_event_shading([whole], run, label=whole)
    draw_event_shading([zoom], run)
    draw_looks(whole, run)
    start, end = find_cycle(log)
    if end > start:
        zoom.set_xlim(start, end)
        whole.axvspan(start, end, facecolor="none", edgecolor=MUTED, lw=1.2, zorder=4)
    title = "one cycle (framed above): outlined as planned, filled as sensed"
    if run.kinematic:
        title = "one cycle (framed above): as planned, because a kinematic replay senses nothing"
    zoom.set_title(title)
    label_time([zoom])
    return figure


def find_cycle(log: RunLog) -> tuple[float, float]:
    """The times [s] of a cycle to look at closely.

    From one planned lift-off of leg 1 to the next within the longest walk, nearest to its
    middle; else the middle of the run.
    """
    if not len(log):
        return 0.0, 0.0
    t, planned = log.t, log.flags("standing_planned")
    waves = [band for band in log.bands() if band.kind in ("wave", "trot", "spin")]
    waves.sort(key=lambda band: (band.kind != "spin", band.end - band.start), reverse=True)
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
    if len(t) > 1 and t[-1] > t[0]:
        axis.set_xlim(t[0], t[-1])


def _spans(t: np.ndarray, flags: np.ndarray) -> list[tuple[float, float]]:
    """Start and length [s] of each stretch of True."""
    last = len(t) - 1
    return [(float(t[a]), float(t[min(b, last)] - t[a])) for a, b in runs_of(flags)]


def stood_still(run: RecordedRun) -> bool:
    """Whether there is anything to show."""
    return bool(clock_stops(run))


def draw_clock(run: RecordedRun) -> Figure:
    """All that the clock has waited over time [s], and bands by what it did instead of running."""
    figure, grid = make_axes(1, height=2.6)
    axis = grid[0, 0]
    draw_event_shading([axis], run, label=axis)
    bands = clock_stops(run)
    for mode in MODES:
        spans = [(band.start, band.end - band.start) for band in bands if band.mode == mode]
        if spans:
            colour, total = MODE_COLOURS[mode], sum(length for _, length in spans)
            axis.broken_barh(
                spans,
                (0.0, 1.0),
                transform=axis.get_xaxis_transform(),
                facecolor=colour,
                edgecolor=colour,
                lw=0.6,
                alpha=0.45,
                zorder=1,
                label=f"{NAMES[mode]}: {total:.2f} s",
            )
    waited = run.log.number("gait_waited")
    style = {"color": INK, "lw": 1.4, "label": f"waited in all: {waited[-1]:.2f} s"}
    draw_line(axis, run.log.t, waited, **style)
    axis.set_ylim(bottom=0.0)
    figure.legend(loc="outside lower center", ncols=5)
    axis.set_ylabel("waited [s]")
    label_time([axis])
    return figure


def torque_ratios(run: RecordedRun) -> FloatArray:
    """Joint torques over their limits, signed, (N, 4, 3)."""
    torque = run.log.numbers([f"tau_{name}" for name in run.robot.joint_names])
    return np.asarray(torque / run.robot.effort).reshape(-1, 4, 3)


def speed_ratios(run: RecordedRun) -> FloatArray:
    """Joint speeds over their limits, signed, (N, 4, 3)."""
    joints = run.layout.v_joints - run.layout.num_positions
    return np.asarray(run.velocities[:, joints] / run.robot.speed).reshape(-1, 4, 3)


def draw_torques(run: RecordedRun) -> Figure:
    """Torque over limit of the joints, a panel a leg."""
    return _draw_ratios(run, torque_ratios(run), "torque / limit")


def draw_speeds(run: RecordedRun) -> Figure:
    """Speed over limit of the joints, a panel a leg."""
    return _draw_ratios(run, speed_ratios(run), "speed / limit")


def draw_forces(run: RecordedRun) -> Figure:
    """The vertical force on each foot [N], and what a quarter of the weight is."""
    force = run.log.feet("force")[..., 2]
    figure, axes = make_axes(2, 2, height=3.8, share_y=True)
    weight = GRAVITY * disturbances_of(run.scenario, run.robot).mass_of(run.robot.mass)
    for row, axis in enumerate(axes.ravel()):
        draw_line(axis, run.log.t, force[:, row], color=LEG_COLOURS[row], lw=0.8)
        axis.axhline(0.25 * weight, color=MUTED, lw=0.8, ls=(0, (4, 2)))
        axis.set_title(f"leg {LEG_NAMES[row]}")
    known = force[np.isfinite(force)]
    if known.size:
        # A touchdown's spike of one sample would flatten all that matters.
        top = 1.3 * float(np.quantile(known, 0.999))
        axes[0, 0].set_ylim(-0.02 * top, max(top, 0.5 * weight))
    draw_event_shading(list(axes.ravel()), run)
    for axis in axes[:, 0]:
        axis.set_ylabel("vertical force [N]")
    label_time(axes[-1])
    return figure


def _draw_ratios(run: RecordedRun, ratios: FloatArray, label: str) -> Figure:
    """(N, 4, 3) ratios over time with their limits ±1 and the greatest marked."""
    figure, axes = make_axes(2, 2, height=4.6, share_y=True)
    bound = float(np.nanmax(np.abs(ratios), initial=0.0)) if np.any(np.isfinite(ratios)) else 0.0
    reach = 1.1 * max(bound, 1.0)
    for row, axis in enumerate(axes.ravel()):
        for joint, colour in enumerate(THREE_COLOURS):
            style = {"color": colour, "lw": 0.8, "label": JOINTS[joint]}
            draw_line(axis, run.log.t, ratios[:, row, joint], **style)
        axis.set_ylim(-reach, reach)
        for limit in (-1.0, 1.0):
            axis.axhline(limit, color=BAD, lw=1.0, ls=(0, (5, 2)))
        axis.set_title(_greatest(run, ratios[:, row], f"leg {LEG_NAMES[row]}"))
    draw_event_shading(list(axes.ravel()), run)
    _mark_greatest(run, ratios, list(axes.ravel()))
    for axis in axes[:, 0]:
        axis.set_ylabel(label)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper right", ncols=3)
    label_time(axes[-1])
    return figure


def _greatest(run: RecordedRun, ratios: FloatArray, name: str) -> str:
    """A panel's title: which of the leg's joints came nearest to its limit, and when."""
    if not np.any(np.isfinite(ratios)):
        return f"{name}: not in the log"
    k, joint = np.unravel_index(int(np.nanargmax(np.abs(ratios))), ratios.shape)
    return f"{name}: {abs(ratios[k, joint]):.2f} at most, {JOINTS[joint]}, {run.log.t[k]:.1f} s"


def _mark_greatest(run: RecordedRun, ratios: FloatArray, axes: list[Axes]) -> None:
    """Rings the greatest of all."""
    if np.any(np.isfinite(ratios)):
        k, row, joint = np.unravel_index(int(np.nanargmax(np.abs(ratios))), ratios.shape)
        ring = {"ms": 8, "mfc": "none", "mec": BAD, "mew": 1.6}
        axes[row].plot([run.log.t[k]], [ratios[k, row, joint]], "o", **ring)
