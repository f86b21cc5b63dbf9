"""A page of how a controller did on a robot's bus: its modes, and how well it kept its time."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.report.style import (
    BAD,
    GOOD,
    MUTED,
    WARN,
    WIDTH,
    read_css,
    render,
    report_style,
    to_svg,
)
from drake_quad.util.files import write_whole

SAFETY_MODE_COLOURS = {
    "damping": "#8A8F94",
    "standing_up": "#C98A00",
    "standing": "#0068A8",
    "walking": "#009E73",
    "sitting_down": "#8C6BB1",
}
MODES = "What the robot was told to do"
# Of control.json's `real_time`: the histogram's name, its title, and what its values are.
HISTOGRAMS = (
    ("jitter_ms", "Jitter", "how far a period was from the one that is wanted"),
    ("work_ms", "Work", "how long a tick of the loop took"),
    ("state_age_ms", "Age of the state", "how long the state had been read when it was answered"),
)


def write_bus_page(found: Mapping[str, Any], path: Path, *, name: str) -> Path:
    """Writes the page of a controller's process; it needs no other file.

    Args:
        found: What control.json holds.
        path: File to write.
        name: Name of the scenario.

    Returns:
        The page's path.
    """
    times = found["real_time"]
    good = found["outcome"] == "goal_reached"
    with report_style():
        modes = "What the robot would have been told" if _dry(found) else MODES
        figures = [("modes", modes, _draw_modes(found))]
        figures += [
            (key, f"{title}: {words} [ms]", _draw_histogram(times[key]))
            for key, title, words in HISTOGRAMS
            if times.get(key)
        ]
        drawn = [(title, Markup(to_svg(figure, name=key, label=title)))
                 for key, title, figure in figures]  # fmt: skip
    page = render(
        "bus.html",
        css=Markup(read_css("report.css")),
        name=name,
        grade="good" if good else "bad",
        outcome="Reached the goal" if good else found["outcome"],
        sentence=_sentence(found),
        events=found["events"],
        remarks=found["remarks"],
        rows=_rows(found),
        figures=drawn,
        modes=SAFETY_MODE_COLOURS.items(),
    )
    write_whole(path, lambda file: file.write_text(page, encoding="utf-8"))
    return path


def _sentence(found: Mapping[str, Any]) -> str:
    bus = found["bus"]
    over = {"lcm": "LCM", "unitree": "DDS with Unitree's messages"}.get(bus["bus"], bus["bus"])
    feet = {"feet": "by sensors in them", "joints": "by the joints' torques"}
    felt = feet.get(found["contacts"], found["contacts"])
    listened = " It only listened, and published nothing." if _dry(found) else ""
    return f"A controller over {over}, domain {bus['domain']}; feet are felt {felt}.{listened}"


def _dry(found: Mapping[str, Any]) -> bool:
    """Whether the controller only listened; files of before do not say it."""
    return bool(found.get("dry_run", False))


def _rows(found: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The figures, each with its words."""
    times = found["real_time"]
    rows = [("ticks", f"{times['ticks']}")]
    if "overrun_share" in times:
        share = times["overrun_share"]
        rows.append(("ticks late by half a period or more", f"{share:.2%}"))
        for key, title, _ in HISTOGRAMS:
            if figures := times.get(key):
                rows.append(
                    (
                        f"{title.lower()}: median, 99.9 %, greatest",
                        f"{figures['median']:.2f}, {figures['p99_9']:.2f}, {figures['max']:.1f} ms",
                    )
                )
    stolen = times.get("time_stolen")
    rows += [
        ("ticks held for want of a new state", f"{found['ticks_held']}"),
        ("states lost since the robot was armed", f"{found['states_lost']}"),
        ("largest step of a wanted angle", f"{found['largest_step']:.4f} rad a tick"),
        ("real-time priority", "given" if times.get("fifo") else "not given"),
        ("cores kept from this machine by its host", "not known" if stolen is None
         else f"{stolen:.2f} s"),
    ]  # fmt: skip
    return rows


def _draw_modes(found: Mapping[str, Any]) -> Figure:
    """The modes over time as bars, and when a tick took longest."""
    figure = Figure(figsize=(WIDTH, 1.5), layout="constrained")
    axes = figure.subplots()
    events: Sequence[Mapping[str, Any]] = found["events"]
    # The loop damps before its first event, and for a second after its last.
    times = [0.0, *(event["time"] for event in events)]
    modes = ["damping", *(event["mode"] for event in events)]
    for begun, ended, mode in zip(times, [*times[1:], times[-1] + 1.0], modes, strict=True):
        colour = SAFETY_MODE_COLOURS.get(mode, MUTED)
        axes.broken_barh([(begun, ended - begun)], (0.0, 1.0), facecolor=colour, alpha=0.7)
        if ended - begun > 0.05 * times[-1]:
            axes.text(0.5 * (begun + ended), 0.5, mode.replace("_", " "), ha="center", va="center")
    for one in found["real_time"].get("longest_ticks", []):
        axes.plot([one["at"]], [1.2], marker="v", color=BAD, clip_on=False)
    axes.set_ylim(0.0, 1.4)
    axes.set_xlim(0.0, times[-1] + 1.0)
    axes.set_yticks([])
    axes.set_xlabel("time since the loop began [s]; triangles: the ticks that took longest")
    return figure


def _draw_histogram(figures: Mapping[str, Any]) -> Figure:
    """A histogram's counts; its bins grow with their values, and the greatest values stand out."""
    figure = Figure(figsize=(WIDTH, 2.2), layout="constrained")
    axes: Axes = figure.subplots()
    edges, counts = figures["histogram"]["edges"], figures["histogram"]["counts"]
    ends = [f"{edge:g}" for edge in edges[1:]]
    names = [f"{low:g} to {high}" for low, high in zip(edges, ends, strict=False)]
    names.append(f"over {edges[-1]:g}")
    bars = axes.bar(range(len(counts)), counts, color=GOOD, alpha=0.8)
    total, sofar = sum(counts), 0
    for bar, count in zip(bars, counts, strict=True):
        sofar += count
        if total - sofar < 0.001 * total:
            bar.set_color(WARN)
    axes.bar_label(bars, [f"{count}" if count else "" for count in counts], fontsize=7.5)
    axes.set_yscale("symlog", linthresh=1.0)
    axes.set_ylim(0.0, 4.0 * max(1, *counts))
    axes.set_xticks(range(len(counts)), names)
    axes.set_xlabel("ms; amber from the bin of the 99.9 % on")
    axes.set_ylabel("ticks")
    return figure
