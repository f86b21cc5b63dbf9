"""Figs. 11 and 12: the case study's trajectories, and its static margin over time."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drake_quad.common import FloatArray
from drake_quad.planning.motion_plan import Segment
from drake_quad.report.paper_drawing import BODY, COLOURS, FAINT, Axes, new_figure, style_axes
from drake_quad.report.paper_samples import Samples, Zero, find_zeros
from drake_quad.report.paper_study import TABLE_I, UP, CaseStudy
from drake_quad.report.style import BAND_OPACITY, kind_colour
from drake_quad.robot.legs import Leg

_ZERO_STYLE = {"transition": ("#C0392B", "s"), "wave": ("#5B2C83", "o")}
_NAMES = {
    "walk 2": "level walk, then up the stairs",
    "spin 3": "spin 90°",
    "walk 4": "down the stairs, then level walk",
    "transition to the centres": "to centres",
    "transition to the wave gait": "to wave",
    "transition to the spinning gait": "to spin",
}


def trajectories(study: CaseStudy, samples: Samples) -> Figure:
    """Returns Fig. 11: body, leg 1 and leg 2 over the ground, x, y and z over time."""
    figure = new_figure(12.0, 7.6)
    panels = figure.subplots(3, 1, sharex=True)
    lines: list[tuple[str, str, FloatArray]] = [
        ("body", BODY, samples.body[:, :3]),
        ("leg 1", COLOURS[Leg(1)], samples.feet[:, 0]),
        ("leg 2", COLOURS[Leg(2)], samples.feet[:, 1]),
    ]
    for axis, (axes, name) in enumerate(zip(panels, "xyz", strict=True)):
        draw_segments(axes, study.segments, names=axis == 0)
        for label, colour, places in lines:
            axes.plot(samples.times, places[:, axis], color=colour, lw=1.4, label=label)
        style_axes(axes, "t [s]" if name == "z" else "", f"{name} [m]")
        axes.set_xlim(0.0, study.duration)
    panels[0].legend(fontsize=8, loc="lower right", ncols=3)
    return figure


def margins(study: CaseStudy, samples: Samples) -> Figure:
    """Returns Fig. 12: the static margin over time, its zeros marked, and two close-ups."""
    figure = new_figure(12.0, 7.0)
    parts: Any = figure.subfigures(2, 1, height_ratios=[1.15, 1.0])
    upper, lower = parts
    zeros = find_zeros(study, samples)
    whole = upper.subplots()
    draw_segments(whole, study.segments, names=True)
    _draw_margin(whole, samples, zeros)
    whole.set_xlim(0.0, study.duration)
    style_axes(whole, "t [s]", "static margin [m]")
    whole.legend(fontsize=7.5, loc="upper center", ncols=4, bbox_to_anchor=(0.5, -0.14))
    first, spin = lower.subplots(1, 2, sharey=True)
    wave = next(s for s in study.segments if s.kind == "wave")
    turn = next(s for s in study.segments if s.kind == "spin")
    for axes, start, end, title in (
        (first, study.starts[UP], wave.start + 2.6 * TABLE_I.T, "the first transition, two cycles"),
        (spin, wave.end - 1.0, turn.end + 1.0, "wave → centres → spin"),
    ):
        draw_segments(axes, study.segments, names=False)
        _draw_margin(axes, samples, zeros)
        axes.set_xlim(start, end)
        style_axes(axes, "t [s]", "static margin [m]", title=title)
    return figure


def draw_segments(axes: Axes, segments: Sequence[Segment], *, names: bool) -> None:
    """Colours the segments behind axes over time, and names them along the top."""
    for segment in segments:
        axes.axvspan(segment.start, segment.end, facecolor=kind_colour(segment.kind),
                     alpha=BAND_OPACITY, edgecolor="none", zorder=0)  # fmt: skip
        if names and segment.end - segment.start > 5.0:
            name = _NAMES.get(segment.name, segment.name)
            axes.annotate(name, ((segment.start + segment.end) / 2, 1.0), xytext=(0, 3),
                          xycoords=("data", "axes fraction"), textcoords="offset points",
                          ha="center", fontsize=7, color=kind_colour(segment.kind))  # fmt: skip


def _draw_margin(axes: Axes, samples: Samples, zeros: Sequence[Zero]) -> None:
    """Draws the margin with massless legs, that of the whole robot, and the zeros."""
    axes.axhline(0.0, color="#C0392B", lw=0.8)
    axes.plot(samples.times, samples.margin_robot, color=FAINT, lw=0.8,
              label="whole robot's centre of mass")  # fmt: skip
    axes.plot(samples.times, samples.margin, color="#0B5394", lw=1.3,
              label="the paper's: body's centre, legs massless")  # fmt: skip
    for kind, (colour, marker) in _ZERO_STYLE.items():
        mine = [zero for zero in zeros if zero.kind == kind]
        where = "steps of transitions" if kind == "transition" else "switches 1→4, 2→3 of the wave"
        at = np.array([(zero.start + zero.end) / 2 for zero in mine])
        axes.plot(at, np.zeros(len(at)), marker=marker, ls="none", ms=5, color=colour,
                  mfc="white", mew=1.2, zorder=6, label=f"zero in {len(mine)} {where}")  # fmt: skip
        for zero in mine:
            axes.plot([zero.start, zero.end], [0.0, 0.0], color=colour, lw=3.0, zorder=5)
    axes.grid(axis="y", color="#E6E6E6", lw=0.6)
