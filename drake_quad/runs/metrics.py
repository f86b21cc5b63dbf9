"""The figures of summary.json, from a run's log."""

from itertools import pairwise
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.common import GRAVITY, BoolArray, FloatArray
from drake_quad.control.ports import is_swinging
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.model import RobotModel
from drake_quad.runs.event_metrics import recovery_figures, wait_figures
from drake_quad.runs.log import columns_of
from drake_quad.runs.pose_metrics import (
    LEAST_WAY,
    base_error,
    distance_walked,
    estimate_figures,
    least_friction,
    payload_figures,
)
from drake_quad.runs.schema import Columns
from drake_quad.runs.summary_figures import FURTHER, SPREAD
from drake_quad.runs.touchdowns import touch_figures


def further_figures(c: Columns) -> dict[str, Any]:
    """The spread of each margin beyond the hull's; None if it was not measured."""
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
        return dict.fromkeys(SPREAD)
    lowest = np.min(finite if least is None else least[np.isfinite(least)])
    found = (lowest, np.percentile(finite, 1), np.median(finite))
    return dict(zip(SPREAD, map(float, found), strict=True))


WAY = (0.1, 0.8)  # of a swing: before it a foot leaves the ground, after it one may land
HIT = 0.01  # of the weight: the force from which on a swing foot does not only graze something


def swing_figures(c: Columns, weight: float) -> dict[str, Any]:
    """Contacts of swing feet between WAY's ends.

    Args:
        c: The log's columns.
        weight: The robot's weight [N].

    Returns:
        `swing_contact_samples` with any, `swing_hit_samples` with more force than HIT, and the
        greatest force in them, `swing_force_max` [N]; None in a replay, which has no forces.
    """
    force = np.zeros(len(c["t"]))
    under_way = (c["swing_phase"] > WAY[0]) & (c["swing_phase"] < WAY[1])
    under_way &= c["gait_mode"] == "run"  # a push stops the clock where it is
    for number, leg in enumerate(SHORT_NAMES, start=1):
        mine = under_way & is_swinging(c["swing_leg"], number)
        parts = np.stack([c[f"{leg}_force_{k}"][mine] for k in "xyz"])
        force[mine] = np.linalg.norm(parts, axis=0)
    if not np.all(np.isfinite(force)):
        return dict.fromkeys(("swing_contact_samples", "swing_hit_samples", "swing_force_max"))
    return {
        "swing_contact_samples": int(np.sum(force > 0.0)),
        "swing_hit_samples": int(np.sum(force > HIT * weight)),
        "swing_force_max": float(np.max(force)),
    }


WITHIN = 0.02  # [m] by which the measured margin may differ from the planned one


def summarize(table: pa.Table, robot: RobotModel, *, mass: float) -> dict[str, Any]:
    """The figures of a run's log; nan becomes None, an empty log gives no figures.

    Args:
        table: Log of the run.
        robot: The robot.
        mass: Mass that moved, a payload included [kg].
    """
    if table.num_rows == 0:
        return {}
    c = columns_of(table)
    t = c["t"]
    period = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    bearing = np.stack([c[f"{leg}_bearing"] for leg in SHORT_NAMES], axis=-1)
    few, touched = bearing.sum(axis=1) < 3, c["nonfoot_contacts"] > 0
    difference = np.abs(c["margin"] - c["margin_planned"])
    q = _joints(c, "q_", "_q", robot)
    qd = _joints(c, "v_", "_w", robot)
    tau = np.stack([c[f"tau_{name}"] for name in robot.joint_names], axis=-1)
    middle, half = 0.5 * (robot.q_upper + robot.q_lower), 0.5 * (robot.q_upper - robot.q_lower)
    place, tilt = base_error(c)
    slip, roll = _slip(c, period)
    least = between_samples(c, "margin")
    lowest = int(np.nanargmin(least)) if np.any(np.isfinite(least)) else 0
    figures = {
        "margin": spread(c["margin"], least),
        "margin_minimum_at": float(t[lowest]),
        "margin_planned": spread(c["margin_planned"]),
        "zmp_margin": spread(c["zmp_margin"], between_samples(c, "zmp_margin")),
        **further_figures(c),
        "zmp_inside": _share(c["zmp_margin"], 0.0),
        "margin_within_20mm": _share(-difference, -WITHIN),
        "samples": len(t),
        "samples_under_three_feet": int(few.sum()),
        "time_under_three_feet": _total_time(c, "time_under_three_feet", few, period),
        "nonfoot_contact_samples": int(touched.sum()),
        "nonfoot_contact_time": _total_time(c, "nonfoot_contact_time", touched, period),
        "nonfoot_force_max": _largest(
            np.concatenate([c["nonfoot_force"], c.get("nonfoot_force_most", c["nonfoot_force"])])
        ),
        "nonfoot_depth_max": _largest(c["nonfoot_depth"]) if "nonfoot_depth" in c else None,
        "foot_depth_max": _largest(c["foot_depth"]) if "foot_depth" in c else None,
        **swing_figures(c, mass * GRAVITY),
        "base_error_max": float(np.max(place)),
        "base_tilt_error_max_deg": float(np.degrees(np.max(tilt))),
        "slip_max": float(max(slip)),
        "foot_roll_max": float(max(roll)),
        "torque_ratio_max": _largest(np.abs(tau) / robot.effort),
        "torque_ratio_rms": float(np.sqrt(np.max(np.mean((tau / robot.effort) ** 2, axis=0)))),
        "torque_ratio_planned_max": _largest(c["torque_ratio_planned"]),
        "speed_ratio_max": _largest(np.abs(qd) / robot.speed),
        "position_ratio_max": _largest(np.abs(q - middle) / half),
        "cost_of_transport": _cost_of_transport(c, tau, qd, mass, period),
        "clock_waited": float(c["gait_waited"][-1]),
        "clock_waited_for": wait_figures(c),
        "recoveries": recovery_figures(c),
        "qp_unsolved": int(c["qp_unsolved"][-1]) if "qp_unsolved" in c else None,
        "estimate": _plain(estimate_figures(c) or {}) or None,
        "felt": _plain(touch_figures(c) or {}) or None,
        "friction_estimated_min": least_friction(c),
        "carried": _plain(payload_figures(c) or {}) or None,
    }
    return {**_plain(figures), "segments": segment_figures(c)}


def _total_time(c: Columns, name: str, samples: BoolArray, period: float) -> float:
    """How long something was so [s], by what the monitor counted at every tick.

    By the samples where it counted nothing: in a replay of the plan, or at the very last sample,
    which the monitor had yet to count.
    """
    if name not in c:
        return float(samples.sum() * period)
    return float(c[name][-1]) or float(samples.sum() * period)


def segment_figures(c: Columns) -> list[dict[str, Any]]:
    """Name, kind, start, end and smallest margins of every segment as it was run."""
    parts = zip(c["task"], c["plan_revision"], c["segment"], strict=True)
    key = np.array(["/".join(map(str, part)) for part in parts])
    least = between_samples(c, "margin")
    cuts = np.concatenate([[0], np.flatnonzero(key[1:] != key[:-1]) + 1, [len(key)]])
    return [
        _plain(
            {
                "name": str(c["segment"][a]),
                "kind": str(c["segment_kind"][a]),
                "start": float(c["t"][a]),
                "end": float(c["t"][b - 1]),
                "margin_min": _smallest(least[a:b]),
                "margin_planned_min": _smallest(c["margin_planned"][a:b]),
            }
        )
        for a, b in pairwise(cuts)
        if c["segment"][a]
    ]


def stances(bearing: BoolArray, standing: BoolArray) -> list[tuple[int, int]]:
    """Stretches [start, end) of samples in which a foot is to stand and bears."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (bearing & standing).astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _slip(c: Columns, period: float) -> tuple[list[float], list[float]]:
    """Per stance the distance slid [m], and how far the contact wandered in all [m].

    A ball foot rolls as its shank turns, which moves the contact without slip: the two differ.
    """
    slid, wandered = [0.0], [0.0]
    for leg in SHORT_NAMES:
        place = np.stack([c[f"{leg}_position_{k}"] for k in "xy"], axis=-1)
        for a, b in stances(c[f"{leg}_bearing"], c[f"{leg}_standing_planned"]):
            slid.append(float(np.sum(c[f"{leg}_slip_speed"][a:b]) * period))
            wandered.append(float(np.max(np.hypot(*(place[a:b] - place[a]).T))))
    return slid, wandered


def _joints(c: Columns, before: str, after: str, robot: RobotModel) -> FloatArray:
    """The joints' columns (N, 12), by Drake's names `<before><model>_<joint><after>`."""
    names = [f"{before}{robot.name}_{joint}{after}" for joint in robot.joint_names]
    return np.stack([c[name] for name in names], axis=-1)


def _cost_of_transport(
    c: Columns, tau: FloatArray, qd: FloatArray, mass: float, period: float
) -> float | None:
    """Mechanical work of the joints over weight times way walked, which the body's sway is not."""
    way = distance_walked(c)
    if way < LEAST_WAY or not np.all(np.isfinite(tau)):
        return None
    return float(np.sum(np.abs(tau * qd)) * period / (mass * GRAVITY * way))


def _smallest(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else float("nan")


def _largest(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else float("nan")


def _share(values: FloatArray, least: float) -> float | None:
    """The part of the known values that are at least so much."""
    finite = values[np.isfinite(values)]
    return float(np.mean(finite >= least)) if len(finite) else None


def _plain(figures: dict[str, Any]) -> dict[str, Any]:
    """Nan and infinities, which JSON has not, become None."""
    return {
        k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in figures.items()
    }
