"""How long the gait clock stood still, and what for."""

from matplotlib.figure import Figure

from drake_quad.report.axes import draw_line, label_time, make_axes
from drake_quad.report.background import draw_background
from drake_quad.report.happenings import MODES, mode_bands
from drake_quad.report.run_files import Run
from drake_quad.report.style import INK, MODE_COLOURS

NAMES = {
    "wait": "waits for a foot",
    "catch": "catches a push",
    "settle": "waits until the robot is calm",
    "replan": "waits for the plan",
}


def stood_still(run: Run) -> bool:
    """Whether there is anything to show."""
    return bool(mode_bands(run))


def draw_clock(run: Run) -> Figure:
    """All that the clock has waited over time [s], and bands by what it did instead of running."""
    figure, grid = make_axes(1, height=2.6)
    axis = grid[0, 0]
    draw_background([axis], run, label=axis)
    bands = mode_bands(run)
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
