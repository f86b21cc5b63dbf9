"""How the map of a flight grew, look by look, and what feet made of it, against what there is."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.common import FloatArray
from drake_quad.errors import DrakeQuadError
from drake_quad.report.style import GRID, INK, LESS_COLOUR, MUTED, THREE_COLOURS, WIDTH
from drake_quad.report.tables import entries_of
from drake_quad.runs.reader import RecordedRun
from drake_quad.runs.summary_figures import look_up

BEYOND, STEP = 0.8, 0.005  # [m] shown beyond the nosings, and between places of the ground
COLOURS = (LESS_COLOUR, *THREE_COLOURS[:2])  # of looks, in turn


@dataclass(frozen=True)
class RevisionRow:
    """A look, or what feet have found, and the map since then, in words.

    Attributes:
        name: Which look.
        time: When its image was taken, or when a foot landed last.
        seen: What it showed.
        steps: How many steps the map has since then, and how many are planned on.
        inside: How many of its places and heights lie in their intervals.
        outcome: What came of it.
    """

    name: str
    time: str
    seen: str
    steps: str
    inside: str
    outcome: str


def has_grown(run: RecordedRun) -> bool:
    """Whether the robot looked again on its way, or its feet made the map better."""
    return len(entries_of(run.seen, "revisions")) > 1


def revision_times(run: RecordedRun) -> list[tuple[str, float]]:
    """Names and times [s] of the map's revisions on the way, without the look from the start."""
    found = []
    for number, entry in enumerate(entries_of(run.seen, "revisions")):
        stamp = look_up(entry, "stamp")
        if number and math.isfinite(stamp):
            found.append((revision_name(number, entry), stamp))
    return found


def revision_name(number: int, entry: Mapping[str, Any]) -> str:
    """What a revision of the map is called."""
    if entry.get("looked") is False:
        return "by the feet"
    return f"look {number}" if number else "from the start"


def draw_looks(axis: Axes, run: RecordedRun) -> None:
    """Marks the looks on the way, and when feet have made the map better, in axes over time."""
    for name, stamp in revision_times(run):
        axis.axvline(stamp, color=LESS_COLOUR, lw=1.2, zorder=2.5)
        axis.annotate(
            name if name.startswith("look") else f"map {name}", (stamp, 0.02),
            xycoords=("data", "axes fraction"), rotation=90,
            color=LESS_COLOUR, ha="right", va="bottom", annotation_clip=True,
        ).set_in_layout(False)  # fmt: skip


def revision_rows(run: RecordedRun) -> list[RevisionRow]:
    """The looks in order of time, and what feet found; none where the map stayed as first seen."""
    if not has_grown(run):
        return []
    rows = []
    for number, entry in enumerate(entries_of(run.seen, "revisions")):
        verdicts = [
            figure.get("inside")
            for nosing in entries_of(entry, "nosings")
            for figure in (nosing.get("place"), nosing.get("height"))
            if isinstance(figure, Mapping)
        ]
        steps, trusted = (look_up(entry, key) for key in ("steps", "planned_on"))
        known = f"{steps:.0f}" if math.isfinite(steps) else "–"
        if entry.get("looked") is False:
            outcome, planned = "the rest is planned on it", ""
        elif entry.get("complete") is True:
            outcome, planned = "its end is seen", ""
        else:
            outcome = "goes on as far as it knows"
            planned = f", {trusted:.0f} of them planned on" if math.isfinite(trusted) else ""
        stamp = look_up(entry, "stamp")
        rows.append(
            RevisionRow(
                revision_name(number, entry),
                f"{stamp:.1f} s" if math.isfinite(stamp) else "–",
                str(entry.get("words", "")),
                known + planned,
                f"{sum(v is True for v in verdicts)} of {len(verdicts)}",
                str(entry.get("reason") or outcome),
            )
        )
    return rows


def draw_revisions(run: RecordedRun) -> Figure:
    """The flight from the side, with the nosings as looks and feet told them; then their errors."""
    figure = Figure(figsize=(WIDTH, 6.0), layout="constrained")
    side, places, heights = figure.subplots(3, 1, sharex=True, height_ratios=[2.2, 1.0, 1.0])
    last: FloatArray = np.zeros((0, 2))
    touched_before = 0
    for number, entry in enumerate(entries_of(run.seen, "revisions")):
        colour = COLOURS[number % len(COLOURS)]
        nosings = entries_of(entry, "nosings")
        touched = sum(n.get("touched") is True for n in nosings)
        more = touched > touched_before
        by_feet = entry.get("looked") is False
        name = "the feet" if by_feet else f"look {number}" if number else "the first look"
        mine = [
            n for n in nosings
            if look_up(n, "look") == number or (more and n.get("touched") is True)
        ]  # fmt: skip
        touched_before = touched
        table = np.array([_figures(n) for n in mine], dtype=float).reshape(-1, 6)
        table = table[np.isfinite(table[:, :4]).all(axis=1)]
        if not len(table):
            continue
        last = np.concatenate([last, table[:, [0, 2]]])
        side.errorbar(
            table[:, 0], table[:, 2], xerr=table[:, 1], yerr=table[:, 3], fmt=".", ms=3.0, lw=1.2,
            color=colour, capsize=2.0, label=f"nosings as {name} told them",
        )  # fmt: skip
        for axis, width, error in ((places, 1, 4), (heights, 3, 5)):
            axis.errorbar(
                table[:, 0] + 0.02 * number, 1e3 * table[:, error], yerr=1e3 * table[:, width],
                fmt=".", ms=4.0, lw=1.2, color=colour, capsize=2.0,
            )  # fmt: skip
    _draw_truth(side, run, last)
    for axis, label in ((places, "place [mm]"), (heights, "height [mm]")):
        axis.axhline(0.0, color=MUTED, lw=0.8)
        axis.set_ylabel(f"error of\n{label}")
    heights.set_xlabel("along the map's lane [m]")
    side.set_ylabel("z in W [m]")
    if len(last):
        side.legend(loc="upper left")
    return figure


def _figures(nosing: Mapping[str, Any]) -> list[float]:
    """Place and height with their half intervals, and the errors of both."""
    told = [
        look_up(nosing, f"{n}.{p}") for n in ("place", "height") for p in ("value", "half_width")
    ]
    return [*told, look_up(nosing, "place.error"), look_up(nosing, "height.error")]


def _draw_truth(axis: Axes, run: RecordedRun, nosings: FloatArray) -> None:
    """The ground as it is, along the map's lane."""
    if not len(nosings):
        axis.set_title("no revision can be shown")
        return
    s = np.arange(nosings[:, 0].min() - BEYOND, nosings[:, 0].max() + BEYOND, STEP)
    try:
        p_W = run.course.lanes[0].point(s)
        z = run.world.height(p_W[:, 0], p_W[:, 1])
    except (DrakeQuadError, IndexError, ValueError):
        return
    if np.any(np.isfinite(z)):
        axis.fill_between(s, z, np.nanmin(z) - 0.1, color=GRID, lw=0)
        axis.plot(s, z, color=INK, lw=1.0, label="the stairs as they are")
