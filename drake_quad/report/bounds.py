"""A run's figures beside what was asked of them, and how the summary is read."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drake_quad.report.axes import signed
from drake_quad.report.run_files import Run
from drake_quad.stability.safety import MOST_SLIP, safe_margin


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


def bounds(run: Run) -> list[Bound]:
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
