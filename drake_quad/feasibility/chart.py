"""Which stairs a robot climbs, over a grid of rise and run."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from io import StringIO
from math import floor, inf
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from drake_quad.errors import InputError
from drake_quad.feasibility.check import check_flight, check_stairs_numbers
from drake_quad.feasibility.check_report import LIMITS, limit_of
from drake_quad.feasibility.robot_picture import INK, save_picture
from drake_quad.robot.loader import load_robot
from drake_quad.simulation.precompile import DESIGN, precompiling
from drake_quad.terrain.elements import RISE_MAX, RUN_MAX, Stairs
from drake_quad.util.parallel import check_workers, map_in_processes

MOST_CELLS = 10_000
FINEST = 1e-4  # [m] values are rounded to it: smaller steps would give some of them twice
MOST = {"rise": RISE_MAX, "run": RUN_MAX}


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
COLOURS, GREY, MARK = "YlGn", "#dddddd", "#b3261e"
LONE = 0.05  # [m] width or height of a cell that has no neighbour
SHADES = 8  # colours of the scale of margins


@dataclass(frozen=True)
class Span:
    """Values from `first` to `last`, both included, a step apart [m]."""

    first: float
    last: float
    step: float

    def values(self, name: str) -> list[float]:
        """The values of `name`, rise or run [m], to the tenth of a millimetre.

        Raises:
            InputError: If there is no such span; it names the option --`name`-from, -to or -step.
        """
        most = MOST[name]
        for word, value, bound in (
            ("from", self.first, most), ("to", self.last, most), ("step", self.step, inf)
        ):  # fmt: skip
            if not (FINEST <= value <= bound and value < inf):
                to = f"{FINEST:g} or more" if bound == inf else f"{FINEST:g} to {bound:g}"
                raise _wrong(f"--{name}-{word}", value, f"give metres, {to}")
        if self.last < self.first:
            remedy = f"give no less than --{name}-from, {self.first:g}"
            raise _wrong(f"--{name}-to", self.last, remedy)
        count = int((self.last - self.first) / self.step + 1e-6) + 1
        if count > MOST_CELLS:
            remedy = f"makes {count} columns or rows: give more"
            raise _wrong(f"--{name}-step", self.step, remedy)
        # From a whole tenth: or the finest steps would round to some values twice, to others never.
        first = FINEST * floor(self.first / FINEST + 1e-6)
        return [round(first + k * self.step, 4) for k in range(count)]


def grid_of(rises: Span, runs: Span, count: int) -> list[tuple[float, float]]:
    """Rise and run of every cell [m], run by run.

    Raises:
        InputError: If there can be no such stairs, or they are too many.
    """
    up, along = rises.values("rise"), runs.values("run")
    check_stairs_numbers(Stairs(up[0], along[0], count))
    cells = len(up) * len(along)
    if cells > MOST_CELLS:
        remedy = f"{cells} cells are too many, more than {MOST_CELLS}: give a larger step"
        raise _wrong("--rise-step", rises.step, remedy)
    return [(rise, run) for run in along for rise in up]


def _wrong(option: str, value: float, remedy: str) -> InputError:
    return InputError(source=option, field=option[2:], value=value, remedy=remedy)


@dataclass(frozen=True)
class Standard:
    """A flight that a common rule allows; `rise` and `run` [m]."""

    name: str
    rise: float
    run: float


# The steepest flights that the International Building Code (1011.5.2), the International
# Residential Code (R311.7.5) and OSHA (1910.25) allow, and DIN 18065's usual one.
STANDARDS = (
    Standard("IBC 7 × 11 in", 0.178, 0.279),
    Standard("IRC 7.75 × 10 in", 0.197, 0.254),
    Standard("DIN 18065, 0.17 × 0.29 m", 0.170, 0.290),
    Standard("OSHA 9.5 × 9.5 in", 0.241, 0.241),
)


@dataclass(frozen=True)
class Cell:
    """One kind of stairs, and whether the robot climbs it.

    Attributes:
        rise: Rise of the steps [m].
        run: Run of the treads [m].
        margin: Smallest static margin of the plan [m]; None if there is no plan.
        quality: Smallest ratio of a margin or clearance to what is wanted; None if there is no
            plan.
        treads: Number of treads in a gait cycle; None if there is no plan.
        limit: What is in the way, one of `check_report.LIMITS`; empty if nothing is.
        reason: What is in the way, in a sentence.
    """

    rise: float
    run: float
    margin: float | None
    quality: float | None
    treads: int | None
    limit: str
    reason: str


@dataclass(frozen=True)
class StairChart:
    """Which stairs of a grid a robot climbs, in SI units.

    Attributes:
        robot: Robot name or file, as the person gave it.
        name: Name that the robot's file has.
        count: Number of steps of each flight.
        rises: Rises of the grid [m].
        runs: Runs of the grid [m].
        complete: Whether all cells were judged.
        limits: What can be in the way, and words for it.
        standards: Flights of common rules, to be marked.
        cells: The cells that were judged, in the grid's order.
    """

    robot: str
    name: str
    count: int
    rises: list[float]
    runs: list[float]
    complete: bool
    limits: dict[str, str]
    standards: tuple[Standard, ...]
    cells: list[Cell]

    def as_dict(self) -> dict[str, Any]:
        """The chart as plain values, as chart.json holds them."""
        return {**asdict(self), "standards": [asdict(one) for one in self.standards]}

    def _repr_html_(self) -> str:
        """The picture of the chart, where a notebook shows it."""
        buffer = StringIO()
        with matplotlib.rc_context({"svg.hashsalt": "chart", "svg.fonttype": "none"}):
            draw_chart(self).savefig(buffer, format="svg", metadata={"Date": None})
        _, mark, rest = buffer.getvalue().partition("<svg")
        return mark + rest


Judge = Callable[[float, float], Cell]


def judge_cell(model: str, count: int, rise: float, run: float) -> Cell:
    """Plans one kind of stairs in full.

    Raises:
        InputError: If the robot cannot be used.
    """
    try:
        check = check_flight(model, Stairs(rise, run, count), nearest=False)
    except InputError as error:
        if error.source not in ("--rise", "--run"):
            raise
        # Some cells of a grid may be too shallow for the robot's feet.
        return Cell(rise, run, None, None, None, "plan", f"run {run:g} m: {error.remedy}")
    found = check.designed
    if found is None:
        return Cell(rise, run, None, None, None, limit_of(check, load_robot(model)), check.reason)
    treads = found.scenario.gait.treads
    return Cell(rise, run, found.margin, found.quality, treads, "", "")


def chart_grid(
    model: str,
    rises: Span,
    runs: Span,
    *,
    count: int,
    workers: int,
    judge: Judge | None = None,
    progress: Callable[[int, int], object] = lambda _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
) -> StairChart:
    """Judges every cell of a grid.

    Args:
        model: Robot name or file.
        rises: Rises of the steps.
        runs: Runs of the treads.
        count: Number of steps of a flight.
        workers: Number of processes.
        judge: Function to use instead of `judge_cell`.
        progress: Receives the number of cells that are done and of all cells.
        stop: Whether to stop.

    Raises:
        InputError: If anything given cannot be used, before any long work.
    """
    cells = grid_of(rises, runs, count)
    check_workers(workers)
    robot = load_robot(model)  # here first: it is imported once, and what is wrong is said once
    with precompiling(DESIGN) as wait:
        wait()
    found = map_in_processes(
        judge or partial(judge_cell, model, count), cells,
        workers=workers, progress=progress, stop=stop,
    )  # fmt: skip
    return StairChart(
        robot=model,
        name=robot.name,
        count=count,
        rises=rises.values("rise"),
        runs=runs.values("run"),
        complete=len(found) == len(cells),
        limits=LIMITS,
        standards=STANDARDS,
        cells=found,
    )


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
    """One cell: its margin in mm and colour, or grey with the letter of what is in the way."""
    (wide, high), hatch = size, None
    corner = cell.run - 0.5 * wide, cell.rise - 0.5 * high
    if cell.margin is not None:
        face = scale.to_rgba(1e3 * cell.margin)
        dark = float(np.dot(face[:3], [0.3, 0.59, 0.11])) < 0.5
        text, look = f"{1e3 * cell.margin:.0f}", {"color": "white" if dark else INK}
    else:
        face, hatch = GREY, HATCHES.get(cell.limit)
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
