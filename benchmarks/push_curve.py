"""The curve of `benchmarks.pushes`: how many pushes are withstood, over how hard they are."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from drake_quad.util.files import write_whole

LINE, BAND = "#009E73", 0.18  # the report's good green; the bounds' opacity


def draw_curve(rates: Sequence[dict[str, Any]], path: Path) -> None:
    """Writes the curve with its exact bounds as SVG; the same rates give the same file.

    Args:
        rates: Rates in order of speed: `speed` [m/s], `trials`, `ok`, and the bounds `low`, `high`.
        path: File to write.
    """
    speed = [rate["speed"] for rate in rates]
    with matplotlib.rc_context({"svg.hashsalt": path.name, "font.size": 9.0}):
        figure = Figure(figsize=(6.0, 3.4), layout="constrained")
        axes = figure.add_subplot()
        axes.fill_between(
            speed,
            [100.0 * rate["low"] for rate in rates],
            [100.0 * rate["high"] for rate in rates],
            color=LINE,
            alpha=BAND,
            linewidth=0.0,
            label="exact bounds at 95 %",
        )
        share = [100.0 * rate["ok"] / rate["trials"] for rate in rates]
        axes.plot(speed, share, "o-", color=LINE, label="back in the gait, or at the goal")
        axes.set(xlabel="impulse over mass [m/s]", ylabel="pushes withstood [%]", ylim=(0.0, 103.0))
        axes.grid(color="#DDDDDD", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, loc="lower left")
        write_whole(
            path, lambda partial: figure.savefig(partial, format="svg", metadata={"Date": None})
        )
