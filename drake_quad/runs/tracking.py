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
DRIFT, LIFT = "drift_max", "lift"  # [m], figures that no tolerance is held against


def track(
    c: Columns,
    robot: RobotModel,
    plans: Sequence[MotionPlan],
    period: float,
    *,
    drifts: bool = False,
) -> dict[str, FloatArray]:
    """How far each sample is from its plan, by the names of TOLERATED (N,) [m, deg, s].

    The plan is as it is proven: its feet roll as is foreseen, and its body does not brake where the
    clock waits. A sample without a plan is held against what the controller wanted.

    A robot that stands elsewhere as a whole, and turned, on stairs that are exactly as mapped is a
    robot that follows its plan on a map that is as much off. If `drifts`, the common motion of the
    standing feet is left out; DRIFT has how far it takes any foot or knee, and LIFT by how much all
    is higher than planned.

    Args:
        c: The log's columns.
        robot: The robot.
        plans: The plans that were followed, as `plans_by_turn` takes them.
        period: The controller's period [s]; 0 in a replay, which has no ticks.
        drifts: Whether what all standing feet are off alike along the ground is left out.
    """
    wanted_body, wanted_feet = _planned(c, plans, period)
    names = [f"q_{robot.name}_{joint}_q" for joint in robot.joint_names]
    q = np.stack([c[name] for name in names], axis=-1).reshape(-1, 4, 3)
    place, quaternion = base_place(c), base_quaternion(c)
    R = np.stack([quaternion_matrix(row) for row in quaternion])
    feet = np.einsum("nij,nlj->nli", R, calc_feet(robot.geometry, q)) + place[:, None]
    stands = _stands(c)
    more = {}
    if drifts:
        more[DRIFT] = _take_along(wanted_body, wanted_feet, feet, stands, robot)
    off = feet - wanted_feet
    # What lifts body and feet alike, as ground does that is higher than mapped, counts for nothing.
    lifted = (off[..., 2] * stands).sum(axis=1) / np.maximum(stands.sum(axis=1), 1)
    if drifts:
        more[LIFT] = lifted
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
        **more,
    }


def _take_along(
    body: FloatArray, wanted: FloatArray, feet: FloatArray, stands: BoolArray, robot: RobotModel
) -> FloatArray:
    """Moves what is planned along the ground, as a whole, onto the feet that stand.

    Args:
        body: The body as planned (N, 5): x, y, z, pitch, yaw; it is changed.
        wanted: The feet as planned (N, 4, 3) [m]; they are changed.
        feet: The feet as they are (N, 4, 3) [m].
        stands: Which of them are to stand (N, 4).
        robot: The robot.

    Returns:
        How far any foot, or any knee, is taken at most (N,) [m].
    """
    share = stands / np.maximum(stands.sum(axis=1, keepdims=True), 1)
    planned, found = wanted[..., :2], feet[..., :2]
    centre, there = (np.einsum("nl,nlk->nk", share, x) for x in (planned, found))
    a, b = planned - centre[:, None], found - there[:, None]
    across = (share * (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])).sum(axis=1)
    along = (share * (a * b).sum(axis=-1)).sum(axis=1)
    turned = np.arctan2(across, along)
    leg = robot.geometry
    knee = np.linalg.norm(leg.p_BH, axis=1) + np.linalg.norm(leg.p_HP, axis=1) + leg.thigh
    knees = np.linalg.norm(body[:, :2] - centre, axis=1) + float(knee.max())
    lever = np.maximum(np.linalg.norm(a, axis=-1).max(axis=1), knees)
    moved = np.linalg.norm(there - centre, axis=1) + np.abs(turned) * lever
    cos, sin = np.cos(turned)[:, None], np.sin(turned)[:, None]
    for points in (wanted, body[:, None]):
        x, y = points[..., 0] - centre[:, :1], points[..., 1] - centre[:, 1:]
        points[..., 0] = there[:, :1] + cos * x - sin * y
        points[..., 1] = there[:, 1:] + sin * x + cos * y
    body[:, 4] += turned
    return np.asarray(moved)


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


def lacks_support(c: Columns) -> BoolArray:
    """Whether fewer than three of the feet that are to stand bear (N,)."""
    return (_stands(c) & _bears(c)).sum(axis=1) < 3


def lacks_foot(c: Columns, late: float) -> BoolArray:
    """Whether a foot does not bear that is to stand, and has not just been to land (N,).

    Args:
        c: The log's columns.
        late: How long after its touchdown a foot may come to bear, by the gait clock [s].
    """
    clock, stands, bears = c["t"] - c["gait_waited"], _stands(c), _bears(c)
    index = np.arange(len(clock))
    found = np.zeros(len(clock), dtype=bool)
    for row in range(4):
        # The last sample at which this foot was in the air, and whether it has borne since then.
        last = np.maximum.accumulate(np.where(stands[:, row], -1, index))
        landing = (last >= 0) & (clock - clock[np.maximum(last, 0)] <= late)
        found |= stands[:, row] & ~bears[:, row] & ~landing
    return found


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
    c, limit = columns_of(table), limits_of(within)
    found = track(c, robot, plans, period)
    beyond = {TOLERATED[name]: values > limit[name] + ROUNDING for name, values in found.items()}
    beyond["support"] = lacks_support(c)
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


def limits_of(within: Tolerances) -> dict[str, float]:
    """The tolerances by the names of TOLERATED [m, deg, s]."""
    limits = {name: float(getattr(within, tolerance)) for name, tolerance in TOLERATED.items()}
    for name in ("tilt_max_deg", "turn_max_deg"):
        limits[name] = float(np.degrees(limits[name]))
    limits["foot_height_max"] += within.foot
    return limits
