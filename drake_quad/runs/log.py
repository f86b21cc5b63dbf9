"""A run's log as one table."""

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa

from drake_quad.common import FloatArray
from drake_quad.control.ports import Catch, GaitPhase, Mode
from drake_quad.math.rotations import roll_pitch_yaw
from drake_quad.planning.contact_forces import Share, min_norm_forces
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.runs.kinematic_log import kinematic_logs
from drake_quad.runs.planned_columns import (
    Ground,
    margin_columns,
    plan_margin,
    planned_figures,
    plans_by_turn,
    turns,
)
from drake_quad.runs.schema import AXES, TURNS, Columns

# ------------------------------------------------------------------------------------------------
# Columns of a log that some controllers have: what they estimate, how their program does.
# ------------------------------------------------------------------------------------------------


def estimate_columns(logs: Mapping[str, FloatArray], layout: StateLayout) -> Columns:
    """The base as estimated and what the filter believes of it; none where nothing estimates.

    Args:
        logs: By the name of the log: (N, size) each.
        layout: Where the base is in the estimated state.
    """
    if "state_estimated" not in logs:
        return {}
    state = logs["state_estimated"]
    base, velocity = layout.q_base, layout.v_base + 3
    rpy = roll_pitch_yaw(state[:, base : base + 4])
    columns: Columns = {}
    for k, axis in enumerate(AXES):
        columns[f"base_estimated_{axis}"] = state[:, base + 4 + k]
    for k, turn in enumerate(TURNS):
        columns[f"base_estimated_{turn}"] = rpy[:, k]
    for k, axis in enumerate(AXES):
        columns[f"v_estimated_{axis}"] = state[:, velocity + k]
    for part, name in enumerate(("turn", "v", "base")):
        for k, axis in enumerate(AXES):
            columns[f"deviation_{name}_{axis}"] = logs["deviation"][:, 3 * part + k]
    for row, leg in enumerate(SHORT_NAMES):
        columns[f"{leg}_slip_estimated"] = logs["slip_estimated"][:, row] > 0.5
    columns["estimator_healthy"] = logs["healthy"][:, 0] > 0.5
    return columns


def program_columns(logs: Mapping[str, FloatArray]) -> Columns:
    """What the whole-body controller counts and learns; none of another controller.

    Args:
        logs: By the name of the log: (N, size) each.
    """
    if "qp_state" not in logs:
        return {}
    force, moment_x, moment_y = logs["carried"].T
    friction = zip(SHORT_NAMES, logs["friction"].T, strict=True)
    return {
        "qp_unsolved": logs["qp_state"][:, 0].astype(np.int64),
        "carried_force": force,
        "carried_moment_x": moment_x,
        "carried_moment_y": moment_y,
        **{f"{leg}_friction_estimated": values for leg, values in friction},
    }


# ------------------------------------------------------------------------------------------------
# A run's log as one table: a row a sample, every column documented in docs/log_format.md.
# ------------------------------------------------------------------------------------------------


__all__ = [
    "Ground",
    "kinematic_logs",
    "log_table",
    "plan_margin",
    "planned_figures",
    "state_names",
]


def log_table(
    robot: RobotModel,
    layout: StateLayout,
    *,
    times: FloatArray,
    logs: Mapping[str, FloatArray],
    plans: Sequence[MotionPlan],
    state_names: Sequence[str],
    massless_legs: bool = False,
    share: Share = min_norm_forces,
    ground: Ground | None = None,
) -> pa.Table:
    """Puts the loggers' arrays into one table.

    Args:
        robot: The robot.
        layout: Where its joints are in the state.
        times: (N,) of the samples [s].
        logs: By the name of the log (`diagram_logs.LOGS` and its neighbours): (N, size) each.
        plans: The plans that were followed, in the order in which they were made: of each task
            begun the first, then its revisions.
        state_names: Names of the state's entries, `q_...` and `v_...`.
        massless_legs: Whether planned margins are the body's centre's (a replay of the paper's
            plan), or the whole robot's.
        share: How the controller shares the weight among the feet.
        ground: What the plans count on, for their margins beyond the hull's.
    """
    phase = logs["gait_phase"]
    columns: Columns = {"t": times, **_gait_columns(phase, logs["catch"], plans)}
    for k, name in enumerate(state_names):
        columns[name] = logs["state"][:, k]
    for k, name in enumerate(robot.joint_names):
        columns[f"tau_{name}"] = logs["torque"][:, layout.actuators[k]]
    columns |= _feet_columns(logs)
    columns |= _vector("com", logs["com"])
    for k, name in enumerate((*AXES, "pitch", "yaw")):
        columns[f"base_desired_{name}"] = logs["body_desired"][:, k]
    columns["margin"] = logs["margin"][:, 0]
    columns |= planned_figures(robot, phase, plans, massless_legs=massless_legs, share=share)
    columns["zmp_margin"] = logs["zmp_margin"][:, 0]
    if "least_margins" in logs:
        # The monitor's own are of before this instant.
        least = logs["least_margins"]
        columns["margin_least"] = np.minimum(least[:, 0], logs["margin"][:, 0])
        columns["zmp_margin_least"] = np.minimum(least[:, 1], logs["zmp_margin"][:, 0])
    columns |= margin_columns(logs, times, robot=robot, plans=plans, ground=ground)
    columns["nonfoot_contacts"] = logs["nonfoot"][:, 0].astype(np.int64)
    columns["nonfoot_force"] = logs["nonfoot"][:, 1]
    if "nonfoot_depth" in logs:  # a kinematic replay's: it has depths in the place of forces
        columns["nonfoot_depth"] = logs["nonfoot_depth"][:, 0]
        columns["foot_depth"] = logs["foot_depth"].max(axis=1)
    columns |= _vector("push_force", logs["push_force"])
    columns |= estimate_columns(logs, layout)
    columns |= program_columns(logs)
    return pa.table(columns)


def _gait_columns(phase: FloatArray, catch: FloatArray, plans: Sequence[MotionPlan]) -> Columns:
    """The clock, the plan that it is in, and the leg that swings or catches."""
    known = plans_by_turn(plans)
    followed = turns(phase)
    names, kinds = [], []
    for (task, revision), t in zip(followed.tolist(), phase[:, GaitPhase.TIME], strict=True):
        # By time and not by the clock's index, which a tick long is that of the plan before.
        plan = known.get((task, revision))
        segment = None if plan is None else plan.segments[plan.segment_index(float(t))]
        names.append("" if segment is None else segment.name)
        kinds.append("" if segment is None else segment.kind)
    words = np.array([mode.name.lower() for mode in Mode], dtype=object)
    return {
        "task": followed[:, 0],
        "plan_revision": followed[:, 1],
        "gait_time": phase[:, GaitPhase.TIME],
        "gait_rate": phase[:, GaitPhase.RATE],
        "gait_waited": phase[:, GaitPhase.WAITED],
        "gait_mode": words[phase[:, GaitPhase.MODE].astype(int)],
        "segment": np.array(names, dtype=object),
        "segment_kind": np.array(kinds, dtype=object),
        "swing_leg": phase[:, GaitPhase.SWING_LEG].astype(np.int64),
        "swing_phase": phase[:, GaitPhase.SWING_PHASE],
        "catch_leg": catch[:, Catch.LEG].astype(np.int64),
    }


def _feet_columns(logs: Mapping[str, FloatArray]) -> Columns:
    """Of each foot what it bears, where it is, and where it should be."""
    n = len(logs["force"])
    force, position = logs["force"].reshape(n, 4, 3), logs["contact_position"].reshape(n, 4, 3)
    desired = logs["feet_desired"].reshape(n, 4, 3)
    columns: Columns = {}
    for row, leg in enumerate(SHORT_NAMES):
        columns[f"{leg}_bearing"] = logs["bearing"][:, row] > 0.5
        columns[f"{leg}_standing_planned"] = logs["standing"][:, row] > 0.5
        columns[f"{leg}_slip_speed"] = logs["slip_speed"][:, row]
        for k, axis in enumerate(AXES):
            columns[f"{leg}_force_{axis}"] = force[:, row, k]
            columns[f"{leg}_position_{axis}"] = position[:, row, k]
            columns[f"{leg}_desired_{axis}"] = desired[:, row, k]
    return columns


def _vector(name: str, values: FloatArray) -> Columns:
    """(N, 3) as three columns."""
    return {f"{name}_{axis}": values[:, k] for k, axis in enumerate(AXES)}


def state_names(plant_names: Sequence[str], velocity_names: Sequence[str]) -> list[str]:
    """Column names of [q; v] by Drake's own position and velocity names."""
    return [f"q_{name}" for name in plant_names] + [f"v_{name}" for name in velocity_names]
