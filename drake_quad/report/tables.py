"""A report's tables: segments, figures beside their bounds, pushes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drake_quad.report.axes import signed
from drake_quad.report.derived import has_massless_legs, push_events
from drake_quad.report.style import kind_colour
from drake_quad.runs.reader import RecordedRun
from drake_quad.runs.summary_figures import BY_FEET, SUMMARY, UNITS, look_up
from drake_quad.stability.safety import margin_words, safe_margin

APART = ("segments", "versions", "pushes", "recoveries")  # what has a table of its own

STATIC = ("margin", "margin_planned")  # figures that are the body's centre's of massless legs

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


def entries_of(summary: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    """The list of tables at a key of the summary; empty where there is none."""
    listed = summary.get(key)
    return [e for e in listed if isinstance(e, Mapping)] if isinstance(listed, list) else []


def bounds(run: RecordedRun) -> list[Bound]:
    """The figures that the summary holds beside their bounds, in the order of weight."""
    found = []
    for figure in SUMMARY:
        shown, value = figure.shown, look_up(run.summary, figure.keys[0])
        if shown is None or not math.isfinite(value) or (figure.physics and run.kinematic):
            continue
        asked, kept, scale, unit = "–", None, figure.scale, shown.unit or figure.unit
        least = safe_margin(run.robot) if figure.safe else figure.at_least
        if least is not None:
            asked, kept = f"≥ {scale * least:.3g} {unit}", value >= least
        elif figure.at_most is not None:
            limit = scale * figure.at_most
            asked = f"{'≤ ' if limit else ''}{limit:g} {unit}"
            kept = value <= figure.at_most
        measured = f"{scale * value:.{shown.digits}f} {unit}".strip()
        if figure.key in BY_FEET or figure.key in STATIC:
            measured = margin_words(value)
        label = shown.label
        if figure.key in STATIC and has_massless_legs(run):
            label += ", legs without mass"
        found.append(Bound(label, asked, signed(measured), kept))
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
            rows.append((path, format_value(value), UNITS.get(path, "")))
    return rows


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
    """A length or a margin with its unit; a dash where it is not known."""
    return signed(margin_words(value)) if math.isfinite(value) else "–"


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
