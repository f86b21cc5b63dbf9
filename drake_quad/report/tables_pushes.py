"""The report's tables of what happened: pushes, and the times that the plan was left."""

import math
from dataclasses import dataclass
from typing import Any

from drake_quad.report.bounds import entries_of, look_up
from drake_quad.report.happenings import push_marks
from drake_quad.report.run_files import Run
from drake_quad.report.tables import metres

MOST_STEPS = 4  # of a recovery, named in its table


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


def push_rows(run: Run) -> list[PushRow]:
    """The pushes that the run came to, and how the robot took them."""
    rows = []
    # The summary has them in the same order, those that the run did not come to at the end.
    told = entries_of(run.summary, "pushes")
    for k, mark in enumerate(push_marks(run)):
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


def recovery_rows(run: Run) -> list[RecoveryRow]:
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
