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


def spread(values: FloatArray) -> dict[str, float | None]:
    """Minimum, first percentile and median of the values that are known."""
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return {"minimum": None, "percentile_1": None, "median": None}
    return {
        "minimum": float(finite.min()),
        "percentile_1": float(np.percentile(finite, 1)),
        "median": float(np.median(finite)),
    }
