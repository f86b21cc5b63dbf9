"""A report's tables: segments, figures beside their bounds, pushes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drake_quad.report.axes import signed
from drake_quad.report.derived import push_events
from drake_quad.report.style import kind_colour
from drake_quad.runs.reader import RecordedRun
from drake_quad.stability.safety import MOST_SLIP, safe_margin

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

MOST_STEPS = 4  # of a recovery, named in its table


@dataclass(frozen=True)
class Bound:
    """A figure beside what was asked of it.

    Attributes:
        name: Name of the figure.
        asked: Its bound in words; a dash if it has none.
        measured: Its value with its unit.
        kept: Whether it keeps its bound; None if it has none.
    """

    name: str
    asked: str
    measured: str
    kept: bool | None


@dataclass(frozen=True)
class _Row:
    key: str
    name: str
    unit: str
    digits: int
    scale: float = 1.0
    at_least: float | None = None
    at_most: float | None = None
    safe: float | None = None  # at least so often the margin that is safe, of this robot
    physics: bool = False  # nothing that a kinematic replay tells


_ROWS = (
    _Row("margin.minimum", "Smallest static margin", "m", 3, safe=1.0),
    _Row("zmp_margin.minimum", "Smallest margin of the zero-moment point", "m", 3, physics=True),
    _Row("margin_planned.minimum", "Smallest static margin of the plan", "m", 3, safe=1.0),
    _Row("zmp_inside", "Samples with the zero-moment point inside", "%", 1, 100.0, physics=True),
    _Row("time_under_three_feet", "Time with fewer than three feet bearing", "s", 3, at_most=0.0),
    _Row(
        "nonfoot_contact_samples",
        "Contacts of anything but a foot",
        "samples",
        0,
        at_most=0.0,
    ),
    _Row("nonfoot_depth_max", "The deepest of these, by geometry", "mm", 1, 1e3, at_most=0.0),
    _Row("foot_depth_max", "Foot deepest in the ground, by geometry", "mm", 1, 1e3),
    _Row("torque_ratio_max", "Greatest joint torque, of its limit", "%", 0, 100.0, at_most=1.0),
    _Row("torque_ratio_planned_max", "The same of the plan, standing still", "%", 0, 100.0),
    _Row("speed_ratio_max", "Greatest joint speed, of its limit", "%", 0, 100.0, at_most=1.0),
    _Row("position_ratio_max", "Joint nearest its end, of its range", "%", 0, 100.0, at_most=1.0),
    _Row(
        "slip_max",
        "Farthest slip of a standing foot",
        "mm",
        1,
        1e3,
        at_most=MOST_SLIP,
        physics=True,
    ),
    _Row("base_error_max", "Body farthest from its plan", "mm", 1, 1e3, at_most=0.03, physics=True),
    _Row(
        "base_tilt_error_max_deg",
        "Body most tilted off its plan",
        "°",
        2,
        at_most=2.0,
        physics=True,
    ),
    _Row(
        "margin_within_20mm",
        "Samples with the margin within 20 mm of its plan",
        "%",
        1,
        100.0,
        at_least=0.95,
        physics=True,
    ),
    _Row("clock_waited", "Time that the gait clock waited", "s", 2, physics=True),
    _Row("estimate.drift_ratio", "Drift of the estimate at the end, of the way", "%", 2, 100.0),
    _Row("estimate.position_error_max", "Estimated place farthest from the truth", "mm", 1, 1e3),
    _Row("estimate.yaw_error_max_deg", "Estimated heading farthest from the truth", "°", 2),
    _Row("qp_unsolved", "Programs of the controller that were not solved", "", 0),
    _Row("contact_friction", "Contact friction", "", 3),
    _Row(
        "friction_estimated_min", "Least friction that a foot was trusted with after slips", "", 2
    ),
    _Row("carried.mass", "Unknown load as learned by the end", "kg", 2),
)


def look_up(summary: Mapping[str, Any], key: str) -> float:
    """The number at a dotted path of the summary; nan where there is none."""
    value: Any = summary
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    return float(value)


def entries_of(summary: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    """The list of tables at a key of the summary; empty where there is none."""
    listed = summary.get(key)
    return [e for e in listed if isinstance(e, Mapping)] if isinstance(listed, list) else []


def bounds(run: RecordedRun) -> list[Bound]:
    """The figures that the summary holds beside their bounds, in the order of weight."""
    found = []
    for row in _ROWS:
        value = look_up(run.summary, row.key)
        if not math.isfinite(value) or (row.physics and run.kinematic):
            continue
        asked, kept = "–", None
        least = row.at_least if row.safe is None else row.safe * safe_margin(run.robot)
        if least is not None:
            asked, kept = f"≥ {row.scale * least:.3g} {row.unit}", value >= least
        elif row.at_most is not None:
            limit = row.scale * row.at_most
            asked = f"{'≤ ' if limit else ''}{limit:g} {row.unit}"
            kept = value <= row.at_most
        measured = f"{row.scale * value:.{row.digits}f} {row.unit}".strip()
        found.append(Bound(row.name, asked, signed(measured), kept))
    return found


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


def segment_rows(run: RecordedRun) -> list[SegmentRow]:
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


@dataclass(frozen=True)
class PushRow:
    """A push that the run came to; figures with their units, or a dash."""

    time: float
    speed: str
    way: str
    error: str
    recovered: str
    failed: bool


@dataclass(frozen=True)
class RecoveryRow:
    """A time that the plan was left; with its units, or a dash."""

    time: float
    legs: str
    duration: str


def push_rows(run: RecordedRun) -> list[PushRow]:
    """The pushes that the run came to, and how the robot took them."""
    rows = []
    # The summary has them in the same order, those that the run did not come to at the end.
    told = entries_of(run.summary, "pushes")
    for k, mark in enumerate(push_events(run)):
        entry = told[k] if k < len(told) else {}
        time, recovered = look_up(entry, "recovery_time"), entry.get("recovered")
        outcome = f"in {time:.1f} s" if math.isfinite(time) else "no" if recovered is False else "–"
        rows.append(
            PushRow(
                time=mark.time,
                speed=f"{mark.speed:.2f} m/s",
                way=f"{mark.arrow} {mark.words}",
                error=metres(look_up(entry, "base_error_max")),
                recovered=outcome,
                failed=recovered is False,
            )
        )
    return rows


def recovery_rows(run: RecordedRun) -> list[RecoveryRow]:
    """The summary's recoveries."""
    rows = []
    for entry in entries_of(run.summary, "recoveries"):
        duration = look_up(entry, "duration")
        rows.append(
            RecoveryRow(
                time=look_up(entry, "time"),
                legs=_steps(entry.get("legs")),
                duration=f"{duration:.2f} s" if math.isfinite(duration) else "not again",
            )
        )
    return rows


def _steps(legs: Any) -> str:
    """The legs put down one after another, the first of many."""
    if not isinstance(legs, list) or not legs:
        return "none"
    text = ", then ".join(map(str, legs[:MOST_STEPS]))
    return text if len(legs) <= MOST_STEPS else f"{text}, … {len(legs)} steps in all"
