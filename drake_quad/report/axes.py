"""Axes over time, with segments, pushes and waits behind the curves."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.common import FloatArray
from drake_quad.report.derived import MODES, PushEvent, clock_stops, push_events
from drake_quad.report.style import (
    BAND_OPACITY,
    MODE_COLOURS,
    MUTED,
    PAPER,
    PUSH_COLOUR,
    WIDTH,
    kind_colour,
)
from drake_quad.runs.reader import RecordedRun
from drake_quad.runs.run_log import Interval

MOST_POINTS = 2500  # points of a line: more cannot be seen at 1100 px
GLYPH = 0.062  # [in] mean width of a letter of a segment's name

STRIP = 0.03  # height of the strip along the top, over that of the axes
ABOVE = 13  # [pt] height of pushes' names over the axes, clear of the segments'


def make_axes(
    rows: int, columns: int = 1, *, height: float, share_y: str | bool = False, **options: Any
) -> tuple[Figure, np.ndarray[Any, Any]]:
    """A figure of the report's width with (rows, columns) axes that share their times.

    Args:
        rows: Number of rows.
        columns: Number of columns.
        height: Height of the figure [in].
        share_y: Value of matplotlib's `sharey`.
        options: Further arguments of matplotlib's `subplots`.
    """
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, sharey=share_y, squeeze=False, **options)
    return figure, axes


def thin(t: FloatArray, y: FloatArray, most: int = MOST_POINTS) -> tuple[FloatArray, FloatArray]:
    """At most about `most` samples of (N,) `t`, `y`, with every peak kept.

    The minimum and the maximum of each of most/2 stretches of equal length stay, in their order, so
    that a spike of one sample is still there. A stretch with nothing but nan stays nan.
    """
    n = len(t)
    if n <= most:
        return t, y
    edges = np.linspace(0, n, most // 2 + 1).astype(int)
    stretch = np.repeat(np.arange(len(edges) - 1), np.diff(edges))
    # Sorted by stretch, then by value: a stretch's first and last rows are its extremes.
    low = np.lexsort((np.where(np.isnan(y), np.inf, y), stretch))[edges[:-1]]
    high = np.lexsort((np.where(np.isnan(y), -np.inf, y), stretch))[edges[1:] - 1]
    keep = np.unique(np.concatenate([[0], low, high, [n - 1]]))
    return t[keep], y[keep]


def draw_line(axes: Axes, t: FloatArray, y: FloatArray, **style: Any) -> None:
    """Draws (N,) `y` over `t`, thinned; nothing where no sample is known."""
    if np.any(np.isfinite(y)):
        axes.plot(*thin(t, y), **style)


def draw_bands(
    axes: Sequence[Axes], bands: Sequence[Interval], *, label: Axes | None = None
) -> None:
    """Colours the segments behind all `axes`, and names them along the top of `label`.

    A name that is wider than its segment gives way to the segment's kind, then to nothing: the
    page's table lists them all.

    Args:
        axes: Axes over time [s].
        bands: The run's segments.
        label: Axes that carry the names, as wide as the figure.
    """
    if not bands:
        return
    start, end = bands[0].start, bands[-1].end
    if end <= start:
        return
    for axis in axes:
        axis.set_xlim(start, end)
        for band in bands:
            axis.axvspan(
                band.start,
                band.end,
                facecolor=kind_colour(band.kind),
                alpha=BAND_OPACITY,
                edgecolor="none",
                zorder=0,
            )
    if label is None:
        return
    inches = 0.92 * WIDTH
    for band in bands:
        width = inches * (band.end - band.start) / (end - start)
        words = [w for w in (band.name, band.kind) if w and GLYPH * len(w) < width]
        if words:
            label.annotate(
                words[0],
                (0.5 * (band.start + band.end), 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 2),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=7.5,
                color=kind_colour(band.kind),
                annotation_clip=False,
            )


def signed(text: str) -> str:
    """The text with true minus signs before its numbers."""
    return re.sub(r"-(?=\d)", "−", text)


def label_time(axes: Sequence[Axes]) -> None:
    """Names the time axis under the lowest axes."""
    for axis in axes:
        axis.set_xlabel("simulated time [s]")


def mark_point(axes: Axes, t: float, y: float, text: str, *, colour: str = MUTED) -> None:
    """Rings the point (t, y) and says what it is, above it and towards the middle."""
    left, right = axes.get_xlim()
    late = t > 0.5 * (left + right)
    axes.plot([t], [y], "o", ms=6, mfc="none", mec=colour, mew=1.4, zorder=5)
    axes.annotate(
        text,
        (t, y),
        xytext=(-10 if late else 10, 12),
        textcoords="offset points",
        ha="right" if late else "left",
        fontsize=8.5,
        fontweight="bold",
        color=colour,
        bbox={"facecolor": PAPER, "edgecolor": "none", "alpha": 0.8, "pad": 1.5},
        arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.8},
        zorder=6,
    )


def draw_event_shading(
    axes: Sequence[Axes], run: RecordedRun, *, label: Axes | None = None
) -> None:
    """Draws segments, pushes and stops of the gait clock behind axes over time.

    Args:
        axes: Axes over time [s]; those of a figure share their times.
        run: The run.
        label: Axes that carry names, as wide as the figure; see `draw_bands`.
    """
    bands = run.log.bands()
    draw_bands(axes, bands, label=label)
    standstill, pushes = clock_stops(run), push_events(run)
    for axis in axes:
        for mode in MODES:
            spans = [
                (band.start, band.end - band.start) for band in standstill if band.mode == mode
            ]
            if spans:
                colour = MODE_COLOURS[mode]
                # The edge makes a wait of one sample wide enough to be seen.
                axis.broken_barh(
                    spans,
                    (1.0 - STRIP, STRIP),
                    transform=axis.get_xaxis_transform(),
                    facecolor=colour,
                    edgecolor=colour,
                    lw=0.6,
                    zorder=3,
                )
        for push in pushes:
            axis.axvline(push.time, color=PUSH_COLOUR, lw=0.9, ls=(0, (3, 2)), zorder=2.5)
    if label is not None and bands:
        _name_pushes(label, pushes, bands[-1].end - bands[0].start)


def _name_pushes(axis: Axes, pushes: Sequence[PushEvent], length: float) -> None:
    """Writes size and direction over each push's line; the direction alone if the next is near.

    Args:
        axis: Axes as wide as the figure.
        pushes: Pushes in order of time.
        length: Length of the time shown [s].
    """
    if length <= 0.0:
        return
    per_inch = length / (0.92 * WIDTH)
    free = -float("inf")  # [s] nothing is written after this time yet
    for push in pushes:
        for text in (f"{push.arrow} {push.speed:.2g} m/s", push.arrow):
            half = 0.5 * GLYPH * (len(text) + 2) * per_inch
            if push.time - half >= free:
                axis.annotate(
                    text,
                    (push.time, 1.0),
                    xycoords=("data", "axes fraction"),
                    xytext=(0, ABOVE),
                    textcoords="offset points",
                    ha="center",
                    va="bottom",
                    fontsize=7.5,
                    fontweight="bold",
                    color=PUSH_COLOUR,
                    annotation_clip=False,
                )
                free = push.time + half
                break
