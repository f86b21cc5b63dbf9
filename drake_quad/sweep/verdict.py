"""How a rate is judged: by what was asked for, in words and as a colour."""

from typing import Any


def gate_words(told: dict[str, Any]) -> str:
    """What was asked for, and whether it was kept; nothing of a study that asks for nothing."""
    if told["gate"] is None or told["passed"] is None:
        return ""
    of = "" if told["gate_each"] is None else f" of each {told['gate_each']}"
    word = ("kept" if told["passed"] else "missed") + ("" if told["complete"] else " so far")
    none = f"; no trial of {', '.join(told['gate_untried'])}" if told["gate_untried"] else ""
    return f"asked for at least {100 * told['gate']:g} %{of}: {word}{none}"


def grade(told: dict[str, Any]) -> str:
    """The rate's colour: good, warn or bad; without a gate all have to succeed."""
    rate = told["rate"]
    if told["passed"] is False or not rate["good"]:
        return "bad"
    well = told["passed"] if told["gate"] is not None else rate["good"] == rate["trials"]
    return "good" if well and told["complete"] and not told["kinematic"] else "warn"
