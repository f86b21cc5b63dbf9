"""Whole runs of a scenario, each with overrides of its own: the trials of two studies."""

from typing import Any

from benchmarks.study import Result, Trial
from drake_quad.errors import DrakeQuadError, InputError
from drake_quad.scenario import load_scenario
from drake_quad.simulation import run

FIGURES = (
    "base_error_max",
    "torque_ratio_max",
    "clock_waited",
    "nonfoot_contact_samples",
    "nonfoot_force_max",
    "slip_max",
    "simulated_time",
)


def work(trial: Trial) -> Result:
    """Runs `trial["scenario"]` with `trial["overrides"]`.

    Returns:
        `outcome` (goal_reached, fell, stopped; refused where there is no such run), `reason`,
        `margin` [m], the smallest, and FIGURES as in summary.json; None of what was not measured.
    """
    try:
        summary = run(load_scenario(trial["scenario"], trial["overrides"])).summary
    except DrakeQuadError as error:
        outcome = "refused" if isinstance(error, InputError) else "stopped"
        return {"outcome": outcome, "reason": str(error)}
    return {
        "outcome": summary["outcome"],
        "reason": summary["reason"],
        "margin": (summary.get("margin") or {}).get("minimum"),
        **{name: summary.get(name) for name in FIGURES},
    }


def text(value: Any, form: str, scale: float = 1.0) -> str:
    """A figure for a table; a dash for one that was not measured."""
    return "-" if value is None else format(scale * value, form)
