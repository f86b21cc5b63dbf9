"""What the robot saw of the stairs before it climbed them, against what there is."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.perception.see import read_depth_image
from drake_quad.report.axes import signed
from drake_quad.report.style import BAD, GOOD, GRID, INK, LESS_COLOUR, WIDTH
from drake_quad.report.tables import entries_of
from drake_quad.runs.reader import RecordedRun
from drake_quad.runs.seen import IMAGE, MILLIMETRE
from drake_quad.runs.summary_figures import look_up

EVERY = 2  # so many rows and columns of the image one is shown of
BEFORE, BEYOND = 0.6, 1.0  # [m] shown before the first nosing and beyond the last
STEP = 0.005  # [m] between places at which the ground is shown


def was_seen(run: RecordedRun) -> bool:
    """Whether the run has anything to show of what was seen."""
    return bool(run.seen)


@dataclass(frozen=True)
class SeenRow:
    """A figure of the stairs as it was seen and as it is; with units, or a dash.

    Attributes:
        name: What it is of.
        seen: Its value with half of its 95 % interval.
        true: The truth.
        error: The difference.
        inside: Whether the truth is in the interval; None where it is not known.
    """

    name: str
    seen: str
    true: str
    error: str
    inside: bool | None


def seen_rows(run: RecordedRun) -> list[SeenRow]:
    """The figures of the flight, then each nosing's place and height."""
    rows = [
        _row(name, run.seen.get(key), scale, unit)
        for name, key, scale, unit in (
            ("mean rise", "rise", 1e3, "mm"),
            ("mean run", "run", 1e3, "mm"),
            ("heading of the climb", "yaw_deg", 1.0, "°"),
        )
        if key in run.seen
    ]
    for k, entry in enumerate(entries_of(run.seen, "nosings"), start=1):
        for name in ("place", "height"):
            rows.append(_row(f"nosing {k}, {name}", entry.get(name), 1e3, "mm"))
    return rows


def _row(name: str, entry: Any, scale: float, unit: str) -> SeenRow:
    """A figure's row, of whatever the file has there."""
    told = entry if isinstance(entry, dict) else {}
    value, half, true, error = (
        scale * look_up(told, key) for key in ("value", "half_width", "true", "error")
    )
    digits = 1

    def words(number: float) -> str:
        return signed(f"{number:.{digits}f} {unit}") if np.isfinite(number) else "–"

    inside = told.get("inside")
    seen = f"{words(value)} ± {half:.{digits}f}" if np.isfinite(value + half) else "–"
    return SeenRow(
        name, seen, words(true), words(error), inside if isinstance(inside, bool) else None
    )


def draw_sight(run: RecordedRun) -> Figure:
    """The last image, and the stairs from the side: as they are, and as they were seen."""
    figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.5])
    _draw_image(left, run)
    _draw_profile(right, run)
    return figure


def _draw_image(axis: Axes, run: RecordedRun) -> None:
    axis.set_axis_off()
    try:
        depth = read_depth_image(run.directory / IMAGE, scale=MILLIMETRE)
    except (OSError, InputError):
        axis.set_title("the image cannot be read")
        return
    shown = np.where(depth > 0.0, depth, np.nan)[::EVERY, ::EVERY]
    most = float(np.nanquantile(shown, 0.98)) if np.any(np.isfinite(shown)) else 1.0
    image = axis.imshow(shown, cmap="viridis", vmax=most)
    axis.figure.colorbar(image, ax=axis, label="depth [m]", shrink=0.7)
    axis.set_title("the last depth image")


def _profile(run: RecordedRun, nosings: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The ground as it is, along the line of what was seen: places and heights [m]."""
    origin = np.array([float(x) for x in run.seen["origin"]])
    yaw = np.radians(look_up(run.seen, "yaw_deg.value"))
    s = np.arange(nosings.min() - BEFORE, nosings.max() + BEYOND, STEP)
    return s, run.world.height(origin[0] + s * np.cos(yaw), origin[1] + s * np.sin(yaw))


def _draw_profile(axis: Axes, run: RecordedRun) -> None:
    axis.set_title("from the side")
    axis.set_xlabel("along the climb, from below the camera [m]")
    axis.set_ylabel("z in W [m]")
    seen = [
        [
            look_up(entry, f"{name}.{part}")
            for name in ("place", "height")
            for part in ("value", "half_width")
        ]
        for entry in entries_of(run.seen, "nosings")
    ]
    told = np.array(seen, dtype=float).reshape(-1, 4)
    told = told[np.isfinite(told).all(axis=1)]
    if not len(told):
        axis.set_axis_off()
        axis.set_title("no stairs were seen")
        return
    try:
        s, z = _profile(run, told[:, 0])
    except (KeyError, TypeError, ValueError):
        s, z = np.zeros(0), np.zeros(0)
    if len(s) and np.any(np.isfinite(z)):
        axis.fill_between(s, z, np.nanmin(z) - 0.1, color=GRID, lw=0)
        axis.plot(s, z, color=INK, lw=1.0, label="the stairs as they are")
    inside = [
        entry.get(name, {}).get("inside") is True
        for entry in entries_of(run.seen, "nosings")
        for name in ("place", "height")
        if isinstance(entry.get(name), dict)
    ]
    axis.errorbar(
        told[:, 0], told[:, 2], xerr=told[:, 1], yerr=told[:, 3], fmt=".", ms=3.0, lw=1.2,
        color=LESS_COLOUR, capsize=2.0, label="nosings as seen, intervals of 95 %",
    )  # fmt: skip
    axis.annotate(
        f"{sum(inside)} of {len(inside)} places and heights in their intervals", (0.98, 0.04),
        xycoords="axes fraction", ha="right", color=GOOD if all(inside) else BAD,
    )  # fmt: skip
    axis.set_aspect("equal", adjustable="datalim")
    axis.legend(loc="upper left")
