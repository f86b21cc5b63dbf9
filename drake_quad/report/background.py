"""What stands behind every figure over time: segments, pushes, and where the clock stood still."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from drake_quad.report.axes import GLYPH, draw_bands
from drake_quad.report.happenings import MODES, PushMark, mode_bands, push_marks
from drake_quad.report.run_files import Run
from drake_quad.report.style import MODE_COLOURS, PUSH_COLOUR, WIDTH

STRIP = 0.03  # of the axes' height, along their top
ABOVE = 13  # [pt] over the axes, clear of the segments' names


def draw_background(axes: Sequence[Axes], run: Run, *, label: Axes | None = None) -> None:
    """Draws it on axes over time.

    Args:
        axes: Over time [s]; those of a figure share their times.
        run: The run.
        label: The axes that carry names, as wide as the figure; see `draw_bands`.
    """
    bands = run.log.bands()
    draw_bands(axes, bands, label=label)
    standstill, pushes = mode_bands(run), push_marks(run)
    for axis in axes:
        for mode in MODES:
            spans = [
                (band.start, band.end - band.start) for band in standstill if band.mode == mode
            ]
            if spans:
                colour = MODE_COLOURS[mode]
                # The edge makes a wait of one sample as wide as can be seen.
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


def _name_pushes(axis: Axes, pushes: Sequence[PushMark], length: float) -> None:
    """Size and direction over each push's line, or the direction alone where the next is near.

    Args:
        axis: As wide as the figure.
        pushes: In order of time.
        length: Of the time shown [s].
    """
    if length <= 0.0:
        return
    per_inch = length / (0.92 * WIDTH)
    free = -float("inf")  # [s] from which on nothing is written yet
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
