"""How far a run was from its plan, in the terms of a certificate's tolerances.

The tolerances are those of `certificate.tolerances`: a run that keeps within them is one of the
motions that the plan's proof is about.
"""

from collections.abc import Sequence
from math import inf, isfinite
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.certificate.tolerances import Tolerances
from drake_quad.common import BoolArray, FloatArray
from drake_quad.math.rotations import quaternion_matrix, roll_pitch_yaw
from drake_quad.planning.motion_plan import MotionPlan, is_same_plan
from drake_quad.robot.kinematics import calc_feet
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.model import RobotModel
from drake_quad.runs.log import columns_of
from drake_quad.runs.planned_columns import plans_by_turn
from drake_quad.runs.pose_metrics import base_place, base_quaternion
from drake_quad.runs.schema import Columns

# Figures in summary.json, and the tolerance that each is held against.
TOLERATED = {
    "body_max": "body",
    "tilt_max_deg": "tilt",
    "turn_max_deg": "turn",
    "foot_max": "foot",
    "foot_height_max": "rise",
    "swing_max": "swing",
    "late_max": "late",
}

ROUNDING = 1e-9  # [m], [deg], [s] by which a tolerance may be passed
SAME = 1e-6  # [periods] between times that are the same but for rounding


def track(
    c: Columns, robot: RobotModel, plans: Sequence[MotionPlan], period: float
) -> dict[str, FloatArray]:
    """How far each sample is from its plan, by the names of TOLERATED (N,) [m, deg, s].

    The plan is as it is proven: its feet roll as is foreseen, and its body does not brake where the
    clock waits. A sample without a plan is held against what the controller wanted.

    Args:
        c: The log's columns.
        robot: The robot.
        plans: The plans that were followed, as `plans_by_turn` takes them.
        period: The controller's period [s]; 0 in a replay, which has no ticks.
    """
    wanted_body, wanted_feet = _planned(c, plans, period)
    names = [f"q_{robot.name}_{joint}_q" for joint in robot.joint_names]
    q = np.stack([c[name] for name in names], axis=-1).reshape(-1, 4, 3)
    place, quaternion = base_place(c), base_quaternion(c)
    R = np.stack([quaternion_matrix(row) for row in quaternion])
    feet = np.einsum("nij,nlj->nli", R, calc_feet(robot.geometry, q)) + place[:, None]
    off = feet - wanted_feet
    stands = _stands(c)
    # What lifts body and feet alike, as ground does that is higher than mapped, counts for nothing.
    lifted = (off[..., 2] * stands).sum(axis=1) / np.maximum(stands.sum(axis=1), 1)
    off[..., 2] -= lifted[:, None]
    place = place - lifted[:, None] * [0.0, 0.0, 1.0]
    rpy = roll_pitch_yaw(quaternion)
    pitch, yaw = rpy[:, 1] - wanted_body[:, 3], rpy[:, 2] - wanted_body[:, 4]
    turn = np.abs((yaw + np.pi) % (2.0 * np.pi) - np.pi)
    aside, height = np.linalg.norm(off[..., :2], axis=-1), np.abs(off[..., 2])
    swing = np.linalg.norm(off, axis=-1)
    return {
        "body_max": np.abs(place - wanted_body[:, :3]).max(axis=1),
        "tilt_max_deg": np.degrees(np.maximum(np.abs(rpy[:, 0]), np.abs(pitch))),
        "turn_max_deg": np.degrees(turn),
        "foot_max": np.where(stands, aside, 0.0).max(axis=1),
        "foot_height_max": np.where(stands, height, 0.0).max(axis=1),
        "swing_max": np.where(stands, 0.0, swing).max(axis=1),
        "late_max": _lateness(c, stands),
    }


def _planned(
    c: Columns, plans: Sequence[MotionPlan], period: float
) -> tuple[FloatArray, FloatArray]:
    """The body (N, 5) and the feet (N, 4, 3) in W that the plans followed have at each sample.

    The clock's time in a log is that of the end of the controller's tick.
    """
    names = ("x", "y", "z", "pitch", "yaw")
    body = np.stack([c[f"base_desired_{k}"] for k in names], axis=-1)
    feet = _legs(c, "desired")
    to_go = 0.0 if period <= 0.0 else np.ceil(c["t"] / period - SAME) * period - c["t"]
    times = c["gait_time"] - to_go * c["gait_rate"]
    for (task, revision), plan in plans_by_turn(plans).items():
        mine = (c["task"] == task) & (c["plan_revision"] == revision)
        at = np.clip(times[mine], 0.0, plan.duration)
        body[mine], feet[mine] = plan.body.samples(at)[:, 0], plan.contacts.feet_at(at)[0]
    return body, feet


def _stands(c: Columns) -> BoolArray:
    """Which feet are to be on the ground (N, 4)."""
    return np.stack([c[f"{leg}_standing_planned"] for leg in SHORT_NAMES], axis=-1).astype(bool)


def _bears(c: Columns) -> BoolArray:
    """Which feet carry load (N, 4)."""
    return np.stack([c[f"{leg}_bearing"] for leg in SHORT_NAMES], axis=-1).astype(bool)


def _lateness(c: Columns, stands: BoolArray) -> FloatArray:
    """For how long, by the gait clock, a foot that is to stand has not borne (N,) [s]."""
    clock, bears = c["t"] - c["gait_waited"], _bears(c)
    found = np.zeros(len(clock))
    for row in range(4):
        missed = stands[:, row] & ~bears[:, row]
        # The last sample at which all was well with this foot, or the log's first.
        last = np.maximum.accumulate(np.where(missed, 0, np.arange(len(clock))))
        found = np.maximum(found, np.where(missed, clock - clock[last], 0.0))
    return found


def _legs(c: Columns, name: str) -> FloatArray:
    """A vector of each leg (N, 4, 3)."""
    return np.stack(
        [np.stack([c[f"{leg}_{name}_{k}"] for k in "xyz"], axis=-1) for leg in SHORT_NAMES], axis=1
    )


def tracking_figures(
    table: pa.Table,
    robot: RobotModel,
    within: Tolerances,
    plans: Sequence[MotionPlan] = (),
    proven: Sequence[MotionPlan] = (),
    period: float = 0.0,
) -> dict[str, Any] | None:
    """The greatest of `track`, and which of the tolerances were left, and when first.

    Args:
        table: Log of the run.
        robot: The robot.
        within: The tolerances.
        plans: Plans that were followed, see `track`.
        proven: Those of them that a proof is about.
        period: The controller's, see `track` [s].

    Returns:
        The figures of TOLERATED; `share`, the least that all tolerances can be multiplied by so
        that the run is within them, None if there is none; `left`, the names of tolerances that
        were left, `support` where fewer than three of the feet that are to stand bore, and `plan`
        where the plan was made anew on the way, of which no proof is; `left_at` [s], the first
        time, None if none was. None for an empty log.
    """
    if table.num_rows == 0:
        return None
    c, limit = columns_of(table), _limits(within)
    found = track(c, robot, plans, period)
    beyond = {TOLERATED[name]: values > limit[name] + ROUNDING for name, values in found.items()}
    beyond["support"] = (_stands(c) & _bears(c)).sum(axis=1) < 3
    beyond["plan"] = np.zeros(table.num_rows, dtype=bool)
    for (task, revision), plan in plans_by_turn(plans).items():
        if not any(is_same_plan(plan, one) for one in proven):
            beyond["plan"] |= (c["task"] == task) & (c["plan_revision"] == revision)
    unproven = np.any(beyond["support"]) or np.any(beyond["plan"])
    some = np.flatnonzero(np.any(list(beyond.values()), axis=0))
    most = {name: float(values.max()) for name, values in found.items()}
    shares = [v / limit[name] if limit[name] > 0.0 else inf for name, v in most.items() if v > 0.0]
    share = max(shares, default=0.0)
    return {
        **most,
        "share": share if isfinite(share) and not unproven else None,
        "left": [name for name, values in beyond.items() if np.any(values)],
        "left_at": float(c["t"][some[0]]) if len(some) else None,
    }


def _limits(within: Tolerances) -> dict[str, float]:
    """The tolerances by the names of TOLERATED."""
    limits = {name: float(getattr(within, tolerance)) for name, tolerance in TOLERATED.items()}
    for name in ("tilt_max_deg", "turn_max_deg"):
        limits[name] = float(np.degrees(limits[name]))
    limits["foot_height_max"] += within.foot
    return limits
