"""Charts of a sweep: curves of the rate of success over what varies, and heat maps."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from drake_quad.report.style import BAD, GOOD, INK, MUTED, WIDTH, report_style, to_svg

COLUMNS = 3  # curves side by side
ROW_HEIGHT = 2.5  # [in]
LINE_HEIGHT = 0.2  # [in] per name, one below the other
SIDE_BY_SIDE = 36  # letters fit below a panel
STRETCH = 20.0  # ratio of largest to smallest from which on an axis is logarithmic
LOW = 0.1  # below this rate its number stands above the point, clear of the axis
COLOURS = "RdYlGn"


def curves_svg(bands: dict[str, list[dict[str, Any]]]) -> str:
    """A panel for each thing that varies: the rate of each band, with its exact bounds.

    Args:
        bands: Bands by what varies, as `summarize_sweep` has them.
    """
    with plain_style():
        label = f"Rate of success over {', '.join(bands)}"
        return to_svg(draw_curves(bands), name="curves", label=label)


@contextmanager
def plain_style() -> Iterator[None]:
    """The report's style, in which names that people chose may have a `$`."""
    with report_style(), matplotlib.rc_context({"text.parse_math": False}):
        yield


def draw_curves(bands: dict[str, list[dict[str, Any]]]) -> Figure:
    """The figure of `curves_svg`; it must be made within `plain_style`.

    Where bands' names are too long to stand side by side, the panel takes the whole width, and they
    stand one below the other.
    """
    listed = {name: own for name, own in bands.items() if _is_list(own)}
    beside = [name for name in bands if name not in listed]
    rows = -(-len(beside) // COLUMNS)
    heights = [ROW_HEIGHT] * rows + [0.6 + LINE_HEIGHT * len(own) for own in listed.values()]
    figure = Figure(figsize=(WIDTH, sum(heights)), layout="constrained")
    grid = figure.add_gridspec(len(heights), COLUMNS, height_ratios=heights)
    for k, name in enumerate(beside):
        ax = figure.add_subplot(grid[k // COLUMNS, k % COLUMNS])
        draw_curve(ax, name, bands[name])
        ax.tick_params(labelleft=k % COLUMNS == 0)
    for k, (name, own) in enumerate(listed.items(), start=rows):
        draw_list(figure.add_subplot(grid[k, :]), name, own)
    return figure


def _is_list(bands: list[dict[str, Any]]) -> bool:
    """Whether the bands' names are too long to stand side by side."""
    words = [band["label"] for band in bands if band["low"] is None]
    return sum(len(word) + 2 for word in words) > SIDE_BY_SIDE


def draw_list(ax: Axes, name: str, bands: list[dict[str, Any]]) -> None:
    """The rates of bands that have long names, one below the other."""
    known = [band for band in bands if band["trials"]]
    for k, band in enumerate(known):
        rate = band["good"] / band["trials"]
        ends = [[rate - band["bound_low"]], [band["bound_high"] - rate]]
        ax.errorbar(
            rate, k, xerr=ends, fmt="o", markersize=4, elinewidth=1.0, capsize=2,
            color=GOOD if rate == 1.0 else BAD,
        )  # fmt: skip
        ax.annotate(
            f"{band['good']}/{band['trials']}", (1.0, k), xytext=(8, 0), va="center",
            textcoords="offset points", fontsize=6.5, color=INK, annotation_clip=False,
        )  # fmt: skip
    ax.set_yticks(range(len(known)), [band["label"] for band in known])
    ax.set_ylim(len(known) - 0.5, -0.5)
    ax.set_xlim(-0.03, 1.03)
    ax.set_xticks([0.0, 0.5, 1.0], ["0", "50 %", "100 %"])
    ax.set_title(name)


def draw_curve(ax: Axes, name: str, bands: list[dict[str, Any]]) -> None:
    """The rates of one thing's bands; numbers at their place, words side by side."""
    known = [band for band in bands if band["trials"]]
    numbers = all(band["low"] is not None for band in known)
    if numbers:
        x = np.array([band["middle"] for band in known], dtype=float)
        ends = np.array([(band["low"], band["high"]) for band in known], dtype=float)
        if len(x) > 2 and ends.min() > 0.0 and x.max() > STRETCH * x.min():
            ax.set_xscale("log")
            ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            ax.xaxis.set_major_formatter("{x:g}")
            ax.xaxis.set_minor_locator(NullLocator())
        else:
            ax.locator_params(axis="x", nbins=5)
    else:
        x = np.arange(len(known), dtype=float)
        ends = np.column_stack([x, x])
        ax.set_xticks(x, [band["label"] for band in known])
        ax.set_xlim(-0.5, len(known) - 0.5)
    rate = np.array([band["good"] / band["trials"] for band in known])
    low = np.array([band["bound_low"] for band in known])
    high = np.array([band["bound_high"] for band in known])
    if numbers:
        ax.plot(x, rate, color=MUTED, linewidth=0.8)
    for k in range(len(known)):
        colour = GOOD if rate[k] == 1.0 else BAD
        ax.errorbar(
            x[k], rate[k], xerr=np.abs(ends[k, :, None] - x[k]),
            yerr=[[rate[k] - low[k]], [high[k] - rate[k]]],
            fmt="o", markersize=4, color=colour, elinewidth=1.0, capsize=2,
        )  # fmt: skip
        ax.annotate(
            f"{known[k]['good']}/{known[k]['trials']}", (x[k], rate[k]),
            xytext=(4, -9 if rate[k] > LOW else 4),
            textcoords="offset points", fontsize=6.5, color=INK,
        )  # fmt: skip
    ax.set_ylim(-0.03, 1.05)
    ax.set_yticks([0.0, 0.5, 1.0], ["0", "50 %", "100 %"])
    ax.set_title(name)


def map_svg(rates: dict[str, Any], number: int) -> str:
    """A heat map of the rate over two things; each cell has its successful and all trials.

    Args:
        rates: One of the maps that `summarize_sweep` has.
        number: Number of the map on its page.
    """
    good, trials = np.array(rates["good"], dtype=float), np.array(rates["trials"], dtype=float)
    rate = np.divide(good, trials, out=np.full_like(good, np.nan), where=trials > 0)
    with plain_style():
        size = (min(WIDTH, 2.2 + 0.9 * len(rates["x_labels"])), 1.2 + 0.42 * len(rates["y_labels"]))
        figure = Figure(figsize=size, layout="constrained")
        ax = figure.subplots()
        ax.pcolormesh(rate, cmap=matplotlib.colormaps[COLOURS], vmin=0.0, vmax=1.0, alpha=0.8)
        for (j, i), all_of in np.ndenumerate(trials):
            if all_of:
                text = f"{good[j, i]:.0f}/{all_of:.0f}"
                ax.text(i + 0.5, j + 0.5, text, ha="center", va="center", fontsize=7.5)
        ax.set_xticks(np.arange(len(rates["x_labels"])) + 0.5, rates["x_labels"], rotation=20)
        ax.set_yticks(np.arange(len(rates["y_labels"])) + 0.5, rates["y_labels"])
        ax.set_xlabel(rates["x"])
        ax.set_ylabel(rates["y"])
        ax.grid(visible=False)
        label = f"Rate of success over {rates['x']} and {rates['y']}"
        return to_svg(figure, name=f"map{number}", label=label)
