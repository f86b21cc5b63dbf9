"""A run's log as one table: a row a sample, with the columns of `runs/schema.py`."""

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa

from drake_quad.common import FloatArray
from drake_quad.control.ports import GaitPhase, Mode
from drake_quad.math.rotations import roll_pitch_yaw
from drake_quad.planning.contact_forces import ShareWeight, min_norm_forces
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.stance_margin import Slopes
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.runs.planned_columns import (
    Ground,
    planned_figures,
    planned_regions,
    plans_by_turn,
    turns,
)
from drake_quad.runs.schema import (
    ESTIMATED,
    EVERY,
    FEASIBLE,
    FELT,
    FRICTION,
    KINEMATIC,
    LANDMARKS,
    PHYSICS,
    SIGNALS,
    WHOLE_BODY,
    Columns,
)
from drake_quad.stability.margins import Margins

_TYPES = {"int": np.int64, "float": np.float64, "text": object}


def log_table(
    robot: RobotModel,
    layout: StateLayout,
    *,
    times: FloatArray,
    logs: Mapping[str, FloatArray],
    plans: Sequence[MotionPlan],
    state_names: Sequence[str],
    massless_legs: bool = False,
    share: ShareWeight = min_norm_forces,
    ground: Ground | None = None,
    slopes: Slopes | None = None,
) -> pa.Table:
    """Puts the loggers' arrays into one table.

    Args:
        robot: The robot.
        layout: Places of the joints in the state.
        times: (N,) times of the samples [s].
        logs: Logs by name (`SOURCES` of the schema, or a replay's): (N, size) each.
        plans: The plans that were followed, in the order in which they were made: of each task
            begun the first, then its revisions.
        state_names: Names of the state's entries, `q_...` and `v_...`.
        massless_legs: Whether planned margins are the body's centre's (a replay of the paper's
            plan), or the whole robot's.
        share: Function by which the controller shares the weight among the feet.
        ground: Ground that the plans count on, for their margins beyond the hull's.
        slopes: Ground with slopes as the controller counts on it; None where all is level.
    """
    where = _groups(logs)
    values = {**logs, **_from_state(logs, layout), "t": times}
    values |= _from_clock(logs["gait_phase"], plans)
    values |= planned_figures(
        robot, logs["gait_phase"], plans, massless_legs=massless_legs, share=share,
        ground=slopes,
    )  # fmt: skip
    if PHYSICS in where:
        # The monitor's own are of before this instant.
        for k, name in enumerate(("margin", "zmp_margin")):
            values[f"{name}_least"] = np.minimum(logs["least_margins"][:, k], logs[name][:, 0])
    if KINEMATIC in where:
        values["foot_depth"] = logs["foot_depth"].max(axis=1)
    if FRICTION in where and ground is not None:
        values |= planned_regions(
            robot, logs["gait_phase"], times, plans, ground, feasible=FEASIBLE in where
        )
    names = {
        "joint": robot.joint_names,
        "position": [n.removeprefix("q_") for n in state_names if n.startswith("q_")],
        "velocity": [n.removeprefix("v_") for n in state_names if n.startswith("v_")],
    }
    columns: Columns = {}
    for signal in SIGNALS:
        key = signal.source or signal.name
        if signal.where not in where or (ground is None and key not in values):
            continue  # without ground there are no planned margins beyond the hull's
        found = values[key] if values[key].ndim == 2 else values[key][:, None]
        for k, name in enumerate(signal.columns(names), start=signal.first):
            column = found[:, k]
            columns[name] = (
                column > 0.5
                if signal.kind == "bool"
                else column.astype(_TYPES[signal.kind], copy=False)
            )
    return pa.table(columns)


def _groups(logs: Mapping[str, FloatArray]) -> set[str]:
    """Which runs' signals these logs have, of the schema's words for them."""
    further = logs.get("further_margins")
    feasible = further is not None and np.any(np.isfinite(further[:, Margins.FEASIBLE]))
    there = {
        EVERY: True,
        PHYSICS: "least_margins" in logs,
        KINEMATIC: "nonfoot_depth" in logs,
        ESTIMATED: "state_estimated" in logs,
        FELT: "felt" in logs,
        LANDMARKS: "landmark" in logs,
        WHOLE_BODY: "qp_state" in logs,
        FRICTION: further is not None,
        FEASIBLE: bool(feasible),
    }
    return {where for where, holds in there.items() if holds}


def _from_state(logs: Mapping[str, FloatArray], layout: StateLayout) -> dict[str, FloatArray]:
    """The state taken apart, and the base's part of the estimated one where there is one."""
    count = layout.num_positions
    found = {
        "q": logs["state"][:, :count],
        "v": logs["state"][:, count:],
        "tau": logs["torque"][:, layout.actuators],
    }
    if "state_estimated" in logs:
        state, base, velocity = logs["state_estimated"], layout.q_base, layout.v_base + 3
        turn = roll_pitch_yaw(state[:, base : base + 4])
        found["base_estimated"] = np.column_stack([state[:, base + 4 : base + 7], turn])
        found["v_estimated"] = state[:, velocity : velocity + 3]
    return found


def _from_clock(phase: FloatArray, plans: Sequence[MotionPlan]) -> Columns:
    """Which plan and which of its segments each sample is in, and what the gait clock does."""
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
        "gait_mode": words[phase[:, GaitPhase.MODE].astype(int)],
        "segment": np.array(names, dtype=object),
        "segment_kind": np.array(kinds, dtype=object),
    }


def state_names(plant_names: Sequence[str], velocity_names: Sequence[str]) -> list[str]:
    """Column names of [q; v] by Drake's own position and velocity names."""
    return [f"q_{name}" for name in plant_names] + [f"v_{name}" for name in velocity_names]


def columns_of(table: pa.Table) -> Columns:
    """A log's columns as arrays."""
    return {name: table.column(name).to_numpy(zero_copy_only=False) for name in table.column_names}
