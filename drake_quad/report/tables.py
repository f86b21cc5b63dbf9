"""The report's tables: the segments, and every figure of the summary with its unit."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drake_quad.report.axes import signed
from drake_quad.report.bounds import entries_of, look_up
from drake_quad.report.run_files import Run
from drake_quad.report.style import kind_colour

# By the last part of a summary's key, or by how it ends.
UNITS = {
    "simulated_time": "s",
    "wall_time": "s",
    "planning_time": "s",
    "time_under_three_feet": "s",
    "margin_minimum_at": "s",
    "clock_waited": "s",
    "touchdown": "s",
    "lift_off": "s",
    "recovery": "s",
    "drift": "m",
    "way": "m",
    "position_error_max": "m",
    "mass": "kg",
    "ahead": "m",
    "left": "m",
    "moment_x": "Nm",
    "moment_y": "Nm",
    "minimum": "m",
    "percentile_1": "m",
    "median": "m",
    "base_error_max": "m",
    "slip_max": "m",
    "foot_roll_max": "m",
    "nonfoot_force_max": "N",
    "nonfoot_depth_max": "m",
    "foot_depth_max": "m",
}
ENDINGS = {"_deg": "deg", "_ratio_max": "of the limit", "_time": "s", "_samples": "samples"}
APART = ("segments", "versions", "pushes", "recoveries")  # what has a table of its own


@dataclass(frozen=True)
class SegmentRow:
    """A segment of the plan as it was walked; times [s], margins with their unit, or a dash."""

    name: str
    kind: str
    colour: str
    start: float
    end: float
    margin: str
    margin_planned: str
    negative: bool


def segment_rows(run: Run) -> list[SegmentRow]:
    """The summary's segments; those of the log where it has none."""
    entries = entries_of(run.summary, "segments")
    rows = []
    for entry in entries or [vars(band) for band in run.log.bands()]:
        margin = look_up(entry, "margin_min")
        rows.append(
            SegmentRow(
                name=str(entry.get("name", "")),
                kind=str(entry.get("kind", "")),
                colour=kind_colour(str(entry.get("kind", ""))),
                start=look_up(entry, "start"),
                end=look_up(entry, "end"),
                margin=metres(margin),
                margin_planned=metres(look_up(entry, "margin_planned_min")),
                negative=margin < 0.0,
            )
        )
    return rows


def summary_rows(summary: Mapping[str, Any], prefix: str = "") -> list[tuple[str, str, str]]:
    """Every figure of the summary: its dotted key, its value, its unit."""
    rows = []
    for key, value in summary.items():
        path = f"{prefix}{key}"
        if path in APART:
            continue
        if isinstance(value, Mapping):
            rows += summary_rows(value, f"{path}.")
        elif isinstance(value, list) and value and all(isinstance(e, Mapping) for e in value):
            for k, entry in enumerate(value, start=1):
                words = ", ".join(f"{name} {format_value(entry[name])}" for name in entry)
                rows.append((f"{path}.{k}", words, ""))
        else:
            rows.append((path, format_value(value), unit_of(path)))
    return rows


def unit_of(path: str) -> str:
    """The unit of a summary's figure by its key; empty where it has none or is not known."""
    if path.startswith("push_budget"):
        return "m/s"
    key = path.rpartition(".")[2]
    if key in UNITS:
        return UNITS[key]
    return next((unit for ending, unit in ENDINGS.items() if key.endswith(ending)), "")


def format_value(value: Any) -> str:
    """A figure or a word of the summary for people."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, float):
        return signed(f"{value:.4g}")
    if isinstance(value, list):
        return ", ".join(format_value(item) for item in value)
    return str(value)


def metres(value: float) -> str:
    """A length with its unit; a dash where it is not known."""
    return signed(f"{value:.3f} m") if math.isfinite(value) else "–"
