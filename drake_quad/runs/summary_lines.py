"""The few figures and the verdict of safety that are printed after a run."""

import math
from collections.abc import Mapping
from typing import Any

from drake_quad.runs.summary_figures import BY_FEET, SUMMARY, look_up
from drake_quad.stability.safety import NO_SUPPORT, judge_safety, margin_words

# What `drake-quad run` prints, in its order: key, label, and form.
PRINTED = (
    ("margin.minimum", "smallest margin {measured}", "{:.3f} m"),
    ("zmp_margin.minimum", "the same of the zero-moment point", "{:.3f} m"),
    ("margin_planned.minimum", "smallest margin planned", "{:.3f} m"),
    ("margin_{kind}.minimum", "smallest {kind} margin {measured}", "{:.3f} m"),
    ("margin_{kind}_planned.minimum", "smallest {kind} margin planned", "{:.3f} m"),
    ("time_under_three_feet", "time on fewer than three feet", "{:.3f} s"),
    ("base_error_max", "base off its plan by at most", "{:.3f} m"),
    ("slip_max", "a standing foot slipped at most", "{:.4f} m"),
    ("contact_friction", "contact friction", "{:.3g}"),
    ("nonfoot_contact_samples", "contacts of anything but feet", "{:.0f}"),
    ("swing_force_max", "a swing foot touched something with up to", "{:.0f} N"),
    ("seen.place_error_max", "a nosing is off where it was seen by at most", "{:.3f} m"),
    ("seen.height_error_max", "the same of its height", "{:.3f} m"),
    ("torque_ratio_max", "largest torque, of its limit", "{:.0%}"),
    ("torque_ratio_planned_max", "{torque}", "{:.0%}"),
    ("simulated_time", "simulated", "{:.1f} s"),
    ("real_time_factor", "pace", "{:.1f} × real time"),
)
NOT_OF_EVERY_RUN = ("zmp", "seen", "swing")  # nothing is printed where there is no figure
LEAST_TOUCH = 1.0  # [N] of a swing foot that is printed
OF_PHYSICS = {figure.key for figure in SUMMARY if figure.physics}  # a replay measures none of them


def summary_lines(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The few figures that are printed after a run: label, and value with its unit."""
    kind = str(summary.get("margin_kind", "hull"))
    replayed = summary.get("simulation") == "kinematic"
    words = {
        "measured": "replayed" if replayed else "measured",
        "kind": kind,
        "torque": "largest torque planned, of its limit" if replayed else "the same, planned",
    }
    lines = []
    for key, label, form in PRINTED:
        value = look_up(summary, key.format(**words))
        if "{kind}" in key and kind == "hull":
            continue
        if key.startswith(NOT_OF_EVERY_RUN) and not math.isfinite(value):
            continue
        if replayed and (key in OF_PHYSICS or not math.isfinite(value)):
            continue
        if key == "swing_force_max" and value < LEAST_TOUCH:
            continue
        # A margin of a rounding error below zero is no negative one.
        text = form.format(round(value, 6) + 0.0) if math.isfinite(value) else "-"
        if key.removesuffix(".minimum") in BY_FEET and value <= NO_SUPPORT:
            text = margin_words(value)
        if key == "nonfoot_contact_samples":
            text += _deepest(summary)
        if key == "margin_planned.minimum" and summary.get("outcome") != "goal_reached":
            label += ", of what was walked"
        lines.append((label.format(**words), text))
        if key == "slip_max" and isinstance(tracking := summary.get("tracking"), Mapping):
            lines.append(("tolerances asked of a certificate", _tracking_words(tracking)))
    return lines


def _tracking_words(tracking: Mapping[str, Any]) -> str:
    """Whether a run kept within the tolerances, in words."""
    left, at = tracking.get("left"), look_up(tracking, "left_at")
    if not left:
        share = look_up(tracking, "share")
        return f"kept, {share:.2f} used; `plan` says what is proven"
    return f"left from {at:.2f} s on: {', '.join(map(str, left))}"


def _deepest(summary: Mapping[str, Any]) -> str:
    """The deepest overlap of a kinematic replay: how deep, of what in what, and when."""
    worst = (summary.get("overlaps") or [None])[0]
    if not worst:
        return ""
    return (
        f" samples, the deepest {1e3 * worst['depth']:.1f} mm: {worst['part']} in "
        f"{worst['inside']} at {worst['time']:.2f} s"
    )


def safety_line(summary: Mapping[str, Any]) -> str:
    """The verdict of safety beside the outcome; empty of a run of before there was one."""
    wanted = look_up(summary, "safety.margin_wanted")
    return judge_safety(summary, wanted).words if math.isfinite(wanted) else ""
