"""Draws which stairs a robot climbs: margins over rise and run, and what limits the rest."""

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

from drake_quad.util.files import write_whole

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
COLOURS, GREY, INK, MARK = "YlGn", "#dddddd", "#333333", "#b3261e"
LONE = 0.05  # [m] width or height of a cell that has no neighbour
SHADES = 8  # of margin


def save_chart(told: dict[str, Any], directory: Path) -> None:
    """Writes chart.svg and chart.png.

    Raises:
        InputError: If they cannot be written.
    """
    figure = draw_chart(told)
    with matplotlib.rc_context({"svg.hashsalt": "chart", "svg.fonttype": "none"}):
        write_whole(
            directory / "chart.svg",
            lambda to: figure.savefig(to, format="svg", metadata={"Date": None}),
        )
    write_whole(directory / "chart.png", lambda to: figure.savefig(to, format="png", dpi=130))


def draw_chart(told: dict[str, Any]) -> Figure:
    """The figure of a chart as `chart_stairs` has it."""
    wide, high = _size(told["runs"]), _size(told["rises"])
    margins = [cell["margin"] for cell in told["cells"] if cell["margin"] is not None]
    colours: Colormap = matplotlib.colormaps[COLOURS].resampled(256)
    with matplotlib.rc_context({"font.size": 9, "hatch.linewidth": 0.5}):
        figure = Figure(
            figsize=(
                2.4 + 0.75 * max(len(told["runs"]), 6),
                2.6 + 0.48 * max(len(told["rises"]), 5),
            ),
            layout="constrained",
        )
        ax = figure.subplots()
        top = 1e3 * max(margins, default=0.1)
        shade = BoundaryNorm(_levels(top), 256)
        for cell in told["cells"]:
            _draw_cell(ax, cell, wide, high, colours, shade)
        if margins:
            scale = matplotlib.cm.ScalarMappable(shade, colours)
            figure.colorbar(scale, ax=ax, label="least static margin planned, mm", shrink=0.8)
    ax.set_xlim(told["runs"][0] - 0.5 * wide, told["runs"][-1] + 0.5 * wide)
    ax.set_ylim(told["rises"][0] - 0.5 * high, told["rises"][-1] + 0.5 * high)
    ax.set_xticks(told["runs"])
    ax.set_yticks(told["rises"])
    ax.tick_params(labelsize=8)
    ax.set_xlabel("run of the treads, m")
    ax.set_ylabel("rise of the steps, m")
    _mark_standards(ax, told["standards"])
    incomplete = "" if told["complete"] else " (not all was looked at)"
    ax.set_title(
        f"Stairs that {told['name']} climbs up and down, flights of {told['count']}{incomplete}",
        parse_math=False,
    )
    _legend(figure, told)
    return figure


def _draw_cell(
    ax: Axes,
    cell: dict[str, Any],
    wide: float,
    high: float,
    colours: Colormap,
    shade: BoundaryNorm,
) -> None:
    """One cell: its margin in mm and colour, or grey with the letter of what limits."""
    corner = cell["run"] - 0.5 * wide, cell["rise"] - 0.5 * high
    if cell["margin"] is not None:
        margin = 1e3 * cell["margin"]
        colour = colours(shade(margin))
        dark = float(np.dot(colour[:3], [0.3, 0.59, 0.11])) < 0.5
        text, look = f"{margin:.0f}", {"color": "white" if dark else INK}
        patch = Rectangle(corner, wide, high, fc=colour, ec="white", lw=0.8)
    else:
        text, look = LETTERS.get(cell["limit"], "?"), {"color": INK, "fontweight": "bold"}
        hatch = HATCHES.get(cell["limit"])
        patch = Rectangle(corner, wide, high, fc=GREY, ec="white", lw=0.8, hatch=hatch)
    ax.add_patch(patch)
    # In a corner, away from most marks and their names.
    ax.text(corner[0] + 0.08 * wide, corner[1] + 0.12 * high, text, **look)


def _mark_standards(ax: Axes, standards: Sequence[dict[str, Any]]) -> None:
    """The flights of common rules, those that are on the chart."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    for standard in standards:
        x, y = standard["run"], standard["rise"]
        if not (left <= x <= right and low <= y <= high):
            continue
        ax.plot(x, y, "D", color="white", mec=MARK, mew=1.6, ms=6, zorder=5)
        ax.annotate(
            standard["name"], (x, y), (8, 5), textcoords="offset points", color=MARK, fontsize=8,
            zorder=6, bbox={"fc": "white", "ec": "none", "alpha": 0.75, "pad": 0.8},
        )  # fmt: skip


def _legend(figure: Figure, told: dict[str, Any]) -> None:
    """The letters that are on the chart, and the marks."""
    here = {cell["limit"] for cell in told["cells"] if cell["margin"] is None}
    handles: list[Any] = [
        Patch(fc=GREY, ec="white", hatch=HATCHES.get(limit), label=f"{LETTERS[limit]}  {words}")
        for limit, words in told["limits"].items()
        if limit in here
    ]
    handles.append(Line2D([], [], marker="D", color="white", mec=MARK, mew=1.6, ms=6,
                          label="stairs by common rules"))  # fmt: skip
    figure.legend(handles=handles, loc="outside lower left", ncols=3, frameon=False, fontsize=8.5)


def _size(values: Sequence[float]) -> float:
    """Of a cell [m]."""
    return float(values[1] - values[0]) if len(values) > 1 else LONE


def _levels(top: float) -> list[float]:
    """Bounds of the shades, from 0 to the least round number above `top` [mm]."""
    step = next(s for s in (1, 2, 3, 5, 7, 10, 15, 20, 30, 50, 100, 1000, 1e9) if s * SHADES >= top)
    return [float(step * k) for k in range(SHADES + 1)]
