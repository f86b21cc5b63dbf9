"""A run's margins in a few figures each."""

from typing import Any

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.summary_pose import Columns

FURTHER = (
    "margin_friction",
    "margin_friction_planned",
    "margin_capture",
    "push_budget",
    "margin_feasible",
    "margin_feasible_planned",
    "margin_dynamic",
)


def further_figures(c: Columns) -> dict[str, Any]:
    """Of each margin beyond the hull's its spread; None of what was not measured."""
    return {name: spread(c[name]) if name in c else None for name in FURTHER}


def between_samples(c: Columns, name: str) -> FloatArray:
    """The least of a margin since the sample before, as its monitor measured it more often (N,).

    The samples themselves where the log does not have that, as in a replay of the plan.
    """
    return c.get(f"{name}_least", c[name])


def spread(values: FloatArray, least: FloatArray | None = None) -> dict[str, float | None]:
    """Minimum, first percentile and median of the values that are known.

    Args:
        values: The samples (N,).
        least: The least between them (N,), of which the minimum is then.
    """
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return {"minimum": None, "percentile_1": None, "median": None}
    return {
        "minimum": float(np.min(finite if least is None else least[np.isfinite(least)])),
        "percentile_1": float(np.percentile(finite, 1)),
        "median": float(np.median(finite)),
    }
