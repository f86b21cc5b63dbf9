"""One tread a cycle against two: support polygons swing by swing, and the margins."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drake_quad.gait.schedule import wave_table
from drake_quad.report.paper_drawing import (
    Axes,
    draw_centre,
    draw_foot,
    draw_support,
    name_leg,
    new_figure,
    style_axes,
    top_view,
)
from drake_quad.report.paper_study import TABLE_I
from drake_quad.report.paper_treads import ONE, ONE_SPREAD, TWO, TreadGait, dense_phases
from drake_quad.robot.legs import LEGS

BETAS_DRAWN = np.linspace(0.75, 0.95, 21)
_LINES = {TWO: ("#0B5394", "-"), ONE: ("#C0392B", "-"), ONE_SPREAD: ("#C0392B", "--")}


def treads(*_: object) -> Figure:
    """Returns the figure that is not in the paper: its introduction's claim, tried."""
    figure = new_figure(12.0, 8.0)
    parts: Any = figure.subfigures(3, 1, height_ratios=[1.0, 1.0, 1.25])
    for part, gait, letter in zip(parts, (TWO, ONE), "ab", strict=False):
        part.suptitle(f"({letter}) {gait.name}", fontsize=10, x=0.01, ha="left")
        table = wave_table(duty_factor=TABLE_I.beta, cycle_time=1.0)
        for axes, (leg, start, end) in zip(
            part.subplots(1, 4), table.swing_intervals(), strict=True
        ):
            _draw_support(axes, gait, start, end)
            least = gait.margins(TABLE_I.beta, np.linspace(start, end - 1e-9, 51)).min()
            axes.set_title(
                f"leg {int(leg)} swings: at least {round(least, 3) + 0.0:.3f} m", fontsize=8.5
            )
    over_time, over_beta = parts[2].subplots(1, 2)
    phases = dense_phases(TABLE_I.beta)
    for gait, (colour, style) in _LINES.items():
        look: dict[str, Any] = {"color": colour, "ls": style, "lw": 1.5}
        over_time.plot(phases, gait.margins(TABLE_I.beta, phases), label=gait.name, **look)
        over_beta.plot(BETAS_DRAWN, [gait.least_margin(b) for b in BETAS_DRAWN], **look)
    for axes in (over_time, over_beta):
        axes.axhline(0.0, color="#666666", lw=0.8)
        axes.grid(axis="y", color="#E6E6E6", lw=0.6)
    over_time.set_xlim(0.0, 1.0)
    over_time.set_ylim(-0.1, 0.31)
    over_time.legend(fontsize=7.5, loc="upper center")
    title = f"(c) through a cycle, β = {TABLE_I.beta}"
    style_axes(over_time, "t / T", "static margin [m]", title=title)
    style_axes(over_beta, "β", "least static margin [m]", title="(d) the least of a cycle")
    return figure


def _draw_support(axes: Axes, gait: TreadGait, start: float, end: float) -> None:
    """Draws the feet and who stands in the middle of a swing, and the way of the body meanwhile."""
    middle = 0.5 * (start + end)
    feet = gait.feet(TABLE_I.beta, [middle])[0]
    table = wave_table(duty_factor=TABLE_I.beta, cycle_time=1.0)
    standing = table.standing(middle)
    top_view(axes, labels=False)
    axes.set(xlim=(-0.75, 1.0), ylim=(-0.46, 0.46))
    draw_support(axes, feet, standing)
    half = 0.5 * gait.stride * (end - start)
    axes.plot([-half, half], [0.0, 0.0], color="#222222", lw=2.0, zorder=5)
    draw_centre(axes)
    for leg in LEGS:
        draw_foot(axes, leg, feet[leg.row], solid=bool(standing[leg.row]), size=7)
        name_leg(axes, leg, feet[leg.row], offset=(0, 11 if leg.row % 2 == 0 else -11))
