"""A run's log as one table: a row a sample, every column documented in docs/log_format.md."""

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa

from drake_quad.gait.legs import SHORT_NAMES, FloatArray
from drake_quad.gait.support import stability_margins
from drake_quad.planning.motion_plan import MotionPlan, PlanSamples, evaluate
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.robot_state import StateLayout
from drake_quad.systems.gait_phase import GaitPhase

Columns = dict[str, np.ndarray]
AXES = ("x", "y", "z")


def make_table(
    robot: RobotModel,
    layout: StateLayout,
    *,
    times: FloatArray,
    logs: Mapping[str, FloatArray],
    plans: Sequence[MotionPlan],
    state_names: Sequence[str],
    massless_legs: bool = False,
) -> pa.Table:
    """Puts the loggers' arrays into one table.

    Args:
        robot: The robot.
        layout: Where its joints are in the state.
        times: (N,) of the samples [s].
        logs: By the name of the log (`diagram.LOGS`): (N, size) each.
        plans: The plans that were followed, one a task begun.
        state_names: Names of the state's entries, `q_...` and `v_...`.
        massless_legs: Whether planned margins are the body's centre's (a replay of the paper's
            plan), or the whole robot's.
    """
    n = len(times)
    phase = logs["gait_phase"]
    columns: Columns = {"t": times, **_gait_columns(phase, plans)}
    for k, name in enumerate(state_names):
        columns[name] = logs["state"][:, k]
    for k, name in enumerate(robot.joint_names):
        columns[f"tau_{name}"] = logs["torque"][:, layout.actuators[k]]
    force, position = logs["force"].reshape(n, 4, 3), logs["contact_position"].reshape(n, 4, 3)
    desired = logs["feet_desired"].reshape(n, 4, 3)
    for row, leg in enumerate(SHORT_NAMES):
        columns[f"{leg}_bearing"] = logs["bearing"][:, row] > 0.5
        columns[f"{leg}_standing_planned"] = logs["standing"][:, row] > 0.5
        columns[f"{leg}_slip_speed"] = logs["slip_speed"][:, row]
        for k, axis in enumerate(AXES):
            columns[f"{leg}_force_{axis}"] = force[:, row, k]
            columns[f"{leg}_position_{axis}"] = position[:, row, k]
            columns[f"{leg}_desired_{axis}"] = desired[:, row, k]
    for k, axis in enumerate(AXES):
        columns[f"com_{axis}"] = logs["com"][:, k]
    for k, name in enumerate((*AXES, "pitch", "yaw")):
        columns[f"base_desired_{name}"] = logs["body_desired"][:, k]
    columns["margin"] = logs["margin"][:, 0]
    columns["margin_planned"] = planned_margin(robot, phase, plans, massless_legs=massless_legs)
    columns["zmp_margin"] = logs["zmp_margin"][:, 0]
    columns["nonfoot_contacts"] = logs["nonfoot"][:, 0].astype(np.int64)
    columns["nonfoot_force"] = logs["nonfoot"][:, 1]
    return pa.table(columns)


def _gait_columns(phase: FloatArray, plans: Sequence[MotionPlan]) -> Columns:
    """Task, gait time, segment and swing leg."""
    task = phase[:, GaitPhase.TASK].astype(np.int64)
    segment = phase[:, GaitPhase.SEGMENT].astype(np.int64)
    names, kinds = [], []
    for i, k in zip(task, segment, strict=True):
        known = i < len(plans)
        names.append(plans[i].segments[k].name if known else "")
        kinds.append(plans[i].segments[k].kind if known else "")
    return {
        "task": task,
        "gait_time": phase[:, GaitPhase.TIME],
        "gait_rate": phase[:, GaitPhase.RATE],
        "gait_waited": phase[:, GaitPhase.WAITED],
        "segment": np.array(names, dtype=object),
        "segment_kind": np.array(kinds, dtype=object),
        "swing_leg": phase[:, GaitPhase.SWING_LEG].astype(np.int64),
        "swing_phase": phase[:, GaitPhase.SWING_PHASE],
    }


def planned_margin(
    robot: RobotModel,
    phase: FloatArray,
    plans: Sequence[MotionPlan],
    *,
    massless_legs: bool = False,
) -> FloatArray:
    """The static margin that the plan had at each sample's gait time, (N,) [m]."""
    margin = np.full(len(phase), np.nan)
    task = phase[:, GaitPhase.TASK].astype(int)
    for index, plan in enumerate(plans):
        mine = task == index
        if np.any(mine):
            samples = evaluate(robot, plan, phase[mine, GaitPhase.TIME])
            margin[mine] = plan_margin(samples, massless_legs=massless_legs)
    return margin


def state_names(plant_names: Sequence[str], velocity_names: Sequence[str]) -> list[str]:
    """Column names of [q; v] by Drake's own position and velocity names."""
    return [f"q_{name}" for name in plant_names] + [f"v_{name}" for name in velocity_names]


def kinematic_logs(
    robot: RobotModel,
    layout: StateLayout,
    plans: Sequence[MotionPlan],
    period: float,
    *,
    massless_legs: bool,
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """The logs of a kinematic replay: the plans as they are, no forces, contacts as planned.

    Args:
        robot: The robot.
        layout: Where its joints are in the state.
        plans: What to replay.
        period: Between samples [s].
        massless_legs: Whether margins are the body's centre's (the paper's), or the whole
            robot's centre of mass's.

    Returns:
        times (N,) and the logs, as a simulation's loggers have them.
    """
    times, rows, samples = [], [], []
    start = 0.0
    for index, plan in enumerate(plans):
        count = round(plan.duration / period)
        t = period * np.arange(count + (index == len(plans) - 1), dtype=np.float64)
        samples.append(evaluate(robot, plan, t))
        phase = np.zeros((len(t), len(GaitPhase)))
        phase[:, GaitPhase.TASK], phase[:, GaitPhase.TIME] = index, t
        phase[:, GaitPhase.RATE] = 1.0
        phase[:, GaitPhase.SEGMENT] = [plan.segment_index(x) for x in t]
        for part in plan.contacts.phases:
            if part.step is not None:
                mine = (t >= part.start) & (t < part.end)
                phase[mine, GaitPhase.SWING_LEG] = int(part.step.leg)
                phase[mine, GaitPhase.SWING_PHASE] = (t[mine] - part.start) / (
                    part.end - part.start
                )
        times.append(start + t)
        rows.append(phase)
        start += count * period
    t, phase = np.concatenate(times), np.concatenate(rows)
    n = len(t)
    body, rate = (np.concatenate([s.body[:, k] for s in samples]) for k in range(2))
    feet = np.concatenate([s.feet for s in samples])
    standing = np.concatenate([s.standing for s in samples])
    com = np.concatenate([s.com for s in samples])
    margin = np.concatenate([plan_margin(s, massless_legs=massless_legs) for s in samples])
    state = np.zeros((n, layout.size))
    half_yaw, half_pitch = 0.5 * body[:, 4], 0.5 * body[:, 3]
    cy, sy, cp, sp = np.cos(half_yaw), np.sin(half_yaw), np.cos(half_pitch), np.sin(half_pitch)
    state[:, layout.q_base : layout.q_base + 4] = np.stack(
        [cy * cp, -sy * sp, cy * sp, sy * cp], axis=-1
    )
    state[:, layout.q_base + 4 : layout.q_base + 7] = body[:, :3]
    # Yaw turns about W's z, pitch about the y that yaw has turned.
    sin_yaw, cos_yaw = np.sin(body[:, 4]), np.cos(body[:, 4])
    state[:, layout.v_base : layout.v_base + 3] = np.stack(
        [-sin_yaw * rate[:, 3], cos_yaw * rate[:, 3], rate[:, 4]], axis=-1
    )
    state[:, layout.v_base + 3 : layout.v_base + 6] = rate[:, :3]
    q = np.concatenate([s.q for s in samples]).reshape(n, 12)
    state[:, layout.q_joints] = q
    state[:, layout.v_joints] = np.gradient(q, period, axis=0)
    nan = np.full((n, 1), np.nan)
    contact = feet.copy()
    contact[..., 2] -= robot.foot_radius
    return t, {
        "state": state,
        "torque": np.tile(nan, 12),
        "gait_phase": phase,
        "standing": standing.astype(float),
        "body_desired": body,
        "feet_desired": feet.reshape(n, 12),
        "bearing": standing.astype(float),
        "force": np.tile(nan, 12),
        "contact_position": contact.reshape(n, 12),
        "slip_speed": np.zeros((n, 4)),
        "nonfoot": np.zeros((n, 2)),
        "margin": margin[:, None],
        "zmp_margin": nan,
        "com": com,
    }


def plan_margin(s: PlanSamples, *, massless_legs: bool) -> FloatArray:
    """The margin of the whole centre of mass, or (massless legs) of the body's centre."""
    if not massless_legs:
        return s.margin
    return stability_margins(s.body[:, 0, :2], s.feet[..., :2], s.standing)
