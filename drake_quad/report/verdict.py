"""What a run comes to: the verdict in a sentence, and its figures beside what was asked."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_quad.report.axes import signed
from drake_quad.report.motion import margins
from drake_quad.report.run_files import Run


@dataclass(frozen=True)
class Verdict:
    """The head of the page.

    Attributes:
        grade: `good`, `warn` or `bad`: the colour.
        word: In a word or two.
        sentence: With the figures that matter.
        least_time: When the margin was least [s], if it is known.
    """

    grade: str
    word: str
    sentence: str
    least_time: float | None


@dataclass(frozen=True)
class Bound:
    """A figure beside what was asked of it.

    Attributes:
        name: Of the figure.
        asked: Of it, in words; a dash where nothing was.
        measured: With its unit.
        kept: Whether it is as asked; None where nothing was.
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
    physics: bool = False  # nothing that a kinematic replay tells


_ROWS = (
    _Row("margin.minimum", "Smallest static margin", "m", 3, at_least=0.03),
    _Row("zmp_margin.minimum", "Smallest margin of the zero-moment point", "m", 3, physics=True),
    _Row("margin_planned.minimum", "Smallest static margin of the plan", "m", 3, at_least=0.03),
    _Row("time_under_three_feet", "Time with fewer than three feet bearing", "s", 3, at_most=0.0),
    _Row(
        "nonfoot_contact_samples",
        "Contacts of anything but a foot",
        "samples",
        0,
        at_most=0.0,
        physics=True,
    ),
    _Row("torque_ratio_max", "Greatest joint torque, of its limit", "%", 0, 100.0, at_most=1.0),
    _Row("speed_ratio_max", "Greatest joint speed, of its limit", "%", 0, 100.0, at_most=1.0),
    _Row("position_ratio_max", "Joint nearest its end, of its range", "%", 0, 100.0, at_most=1.0),
    _Row("slip_max", "Farthest slip of a standing foot", "mm", 1, 1e3, at_most=0.01, physics=True),
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
)


def look_up(summary: Mapping[str, Any], key: str) -> float:
    """The number at a dotted path of the summary; nan where there is none."""
    value: Any = summary
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    return float(value)


def bounds(run: Run) -> list[Bound]:
    """The figures that the summary holds beside their bounds, in the order of weight."""
    found = []
    for row in _ROWS:
        value = look_up(run.summary, row.key)
        if not math.isfinite(value) or (row.physics and run.kinematic):
            continue
        asked, kept = "–", None
        if row.at_least is not None:
            asked, kept = f"≥ {row.scale * row.at_least:g} {row.unit}", value >= row.at_least
        elif row.at_most is not None:
            limit = row.scale * row.at_most
            asked = f"{'≤ ' if limit else ''}{limit:g} {row.unit}"
            kept = value <= row.at_most
        measured = f"{row.scale * value:.{row.digits}f} {row.unit}"
        found.append(Bound(row.name, asked, signed(measured), kept))
    return found


def judge(run: Run) -> Verdict:
    """The verdict on a run, from its summary and its log."""
    outcome = str(run.summary.get("outcome", ""))
    grade, word = {
        "goal_reached": ("good", "Reached the goal"),
        "fell": ("bad", "Fell"),
        "stopped": ("bad", "Stopped"),
    }.get(outcome, ("bad", outcome.replace("_", " ").capitalize() or "Unfinished"))
    log = run.log
    lasted = float(log.t[-1]) if len(log) else look_up(run.summary, "simulated_time")
    sentence = ""
    if math.isfinite(lasted):
        sentence = f"{'Done after' if outcome == 'goal_reached' else 'After'} {lasted:.1f} s"
        bands = log.bands()
        if outcome != "goal_reached" and bands:
            sentence += f" ({bands[-1].name or bands[-1].kind})"
        reason = str(run.summary.get("reason") or "").strip()
        if reason and outcome != "goal_reached":
            sentence += f": {reason.removeprefix(outcome).lstrip(': ')}"
        sentence = sentence.rstrip(": ") + ". "
    text, time, least = _least(run)
    if grade == "good" and (run.kinematic or least < 0.0):
        grade = "warn"
    if run.kinematic:
        word = f"{word}: kinematic replay, no physics"
    return Verdict(grade, word, signed((sentence + text).strip()), time)


def _least(run: Run) -> tuple[str, float | None, float]:
    """The least margin: in words, when [s], and how much [m]."""
    margin, noun = margins(run), "planned" if run.kinematic else "measured"
    if not np.any(np.isfinite(margin)):
        least = look_up(run.summary, "margin.minimum")
        known = math.isfinite(least)
        return f"Smallest {noun} margin {least:.3f} m." if known else "", None, least
    k = int(np.nanargmin(margin))
    time = float(run.log.t[k])
    where = run.log.text("segment")[k]
    where = f" ({where})" if where else ""
    text = f"The smallest {noun} static margin was {margin[k]:.3f} m, at {time:.1f} s{where}."
    return text, time, float(margin[k])
