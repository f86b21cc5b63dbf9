"""Draws a chart: which stairs a robot climbs, and what is in the way of the others."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from drake_quad.feasibility.chart import Cell, StairChart
from drake_quad.feasibility.robot_picture import INK, save_picture, svg_text
from drake_quad.feasibility.standard_stairs import Standard

LETTERS = {
    "reach": "L",
    "joints": "J",
    "torque": "T",
    "margin": "M",
    "legs": "K",
    "apart": "F",
    "trunk": "B",
    "speed": "S",
    "pattern": "H",
    "plan": "P",
}
HATCHES = {"reach": "//", "joints": "\\\\", "torque": "xx", "margin": "--", "legs": "||"}
COLOURS, GREY, PROVEN, MARK = "YlGn", "#dddddd", "#9a9a9a", "#b3261e"
LONE = 0.05  # [m] width or height of a cell that has no neighbour
SHADES = 8  # colours of the scale of margins


def chart_svg(chart: StairChart) -> str:
    """The figure as SVG, to stand in a page; the same chart gives the same text."""
    return svg_text(draw_chart(chart), salt="chart")


def save_chart(chart: StairChart, directory: Path) -> None:
    """Writes chart.svg and chart.png.

    Raises:
        InputError: If they cannot be written.
    """
    figure = draw_chart(chart)
    for kind in ("svg", "png"):
        save_picture(figure, directory / f"chart.{kind}", salt="chart", option="--out")


def draw_chart(chart: StairChart) -> Figure:
    """The figure: each cell with its margin in mm and colour, or what is in the way."""
    wide, high = _cell_size(chart.runs), _cell_size(chart.rises)
    margins = [cell.margin for cell in chart.cells if cell.margin is not None]
    colours: Colormap = matplotlib.colormaps[COLOURS].resampled(256)
    with matplotlib.rc_context({"font.size": 9, "hatch.linewidth": 0.5}):
        size = 2.4 + 0.75 * max(len(chart.runs), 6), 2.6 + 0.48 * max(len(chart.rises), 5)
        figure = Figure(figsize=size, layout="constrained")
        ax = figure.subplots()
        shade = BoundaryNorm(_levels(1e3 * max(margins, default=0.1)), 256)
        scale = matplotlib.cm.ScalarMappable(shade, colours)
        for cell in chart.cells:
            _draw_cell(ax, cell, (wide, high), scale)
        if margins:
            figure.colorbar(
                scale, ax=ax, label="smallest static margin of the plan, mm", shrink=0.8
            )
    ax.set_xlim(chart.runs[0] - 0.5 * wide, chart.runs[-1] + 0.5 * wide)
    ax.set_ylim(chart.rises[0] - 0.5 * high, chart.rises[-1] + 0.5 * high)
    ax.set_xticks(chart.runs)
    ax.set_yticks(chart.rises)
    ax.tick_params(labelsize=8)
    ax.set_xlabel("run of the treads, m")
    ax.set_ylabel("rise of the steps, m")
    _mark_standards(ax, chart.standards)
    incomplete = "" if chart.complete else " (stopped before all were judged)"
    ax.set_title(
        f"Stairs that {chart.name} climbs up and down, flights of {chart.count}{incomplete}",
        parse_math=False,
    )
    _legend(figure, chart)
    return figure


def _draw_cell(
    ax: Axes, cell: Cell, size: tuple[float, float], scale: matplotlib.cm.ScalarMappable
) -> None:
    """One cell: its margin in mm and colour, or grey (darker if proven) with a letter."""
    (wide, high), hatch = size, None
    corner = cell.run - 0.5 * wide, cell.rise - 0.5 * high
    if cell.margin is not None:
        face = scale.to_rgba(1e3 * cell.margin)
        dark = float(np.dot(face[:3], [0.3, 0.59, 0.11])) < 0.5
        text, look = f"{1e3 * cell.margin:.0f}", {"color": "white" if dark else INK}
    else:
        face, hatch = PROVEN if cell.proven else GREY, HATCHES.get(cell.limit)
        text, look = LETTERS.get(cell.limit, "?"), {"color": INK, "fontweight": "bold"}
    ax.add_patch(Rectangle(corner, wide, high, fc=face, ec="white", lw=0.8, hatch=hatch))
    # In a corner, away from most marks and their names.
    ax.text(corner[0] + 0.08 * wide, corner[1] + 0.12 * high, text, **look)


def _mark_standards(ax: Axes, standards: Sequence[Standard]) -> None:
    """The flights of common rules, those that are on the chart."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    for standard in standards:
        x, y = standard.run, standard.rise
        if not (left <= x <= right and low <= y <= high):
            continue
        ax.plot(x, y, "D", color="white", mec=MARK, mew=1.6, ms=6, zorder=5)
        ax.annotate(
            standard.name, (x, y), (8, 5), textcoords="offset points", color=MARK, fontsize=8,
            zorder=6, bbox={"fc": "white", "ec": "none", "alpha": 0.75, "pad": 0.8},
        )  # fmt: skip


def _legend(figure: Figure, chart: StairChart) -> None:
    """The letters that are on the chart, and the marks."""
    here = {cell.limit for cell in chart.cells if cell.margin is None}
    handles: list[Any] = [
        Patch(fc=GREY, ec="white", hatch=HATCHES.get(limit), label=f"{LETTERS[limit]}  {words}")
        for limit, words in chart.limits.items()
        if limit in here
    ]
    if any(cell.proven for cell in chart.cells):
        handles.append(Patch(fc=PROVEN, ec="white", label="no gait climbs these: proven"))
    handles.append(Line2D([], [], marker="D", color="white", mec=MARK, mew=1.6, ms=6,
                          label="stairs by common rules"))  # fmt: skip
    figure.legend(handles=handles, loc="outside lower left", ncols=3, frameon=False, fontsize=8.5)


def _cell_size(values: Sequence[float]) -> float:
    """Width or height of a cell [m]."""
    return float(values[1] - values[0]) if len(values) > 1 else LONE


def _levels(top: float) -> list[float]:
    """Bounds of the shades, from 0 to the smallest round number above `top` [mm]."""
    step = next(s for s in (1, 2, 3, 5, 7, 10, 15, 20, 30, 50, 100, 1000, 1e9) if s * SHADES >= top)
    return [float(step * k) for k in range(SHADES + 1)]
