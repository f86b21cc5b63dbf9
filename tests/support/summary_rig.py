"""A stand and a walk just as planned as a log, and what tests of a run's figures change in it."""

from functools import cache
from typing import Any

import numpy as np
import pyarrow as pa
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RollPitchYaw
from rig import flat_walk, model_layout, model_plant, paper_robot, stand_plan

from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.log import log_table, state_names
from drake_quad.runs.metrics import summarize
from drake_quad.simulation.kinematic_replay import kinematic_logs

PERIOD = 0.01  # [s]


@cache
def log() -> pa.Table:
    """A stand and a walk just as planned, with the weight on the standing feet."""
    plant, robot = model_plant(), paper_robot()
    plans = (stand_plan(0.5), flat_walk())
    times, logs = kinematic_logs(robot, model_layout(), plans, PERIOD, massless_legs=False)
    n = len(times)
    logs["torque"] = np.zeros((n, 12))
    logs["force"] = np.zeros((n, 12))
    logs["zmp_margin"] = np.array(logs["margin"])
    return log_table(
        robot,
        model_layout(),
        times=times,
        logs=logs,
        plans=plans,
        state_names=state_names(plant.GetPositionNames(), plant.GetVelocityNames()),
    )


def values(name: str, table: pa.Table | None = None) -> np.ndarray:
    column = (table or log()).column(name).to_numpy(zero_copy_only=False)
    return np.array(column)


def changed(**columns: np.ndarray) -> pa.Table:
    """The log with other values in these columns, or with columns that a replay does not log."""
    table = log()
    for name, new in columns.items():
        if name in table.column_names:
            table = table.set_column(table.column_names.index(name), name, pa.array(new))
        else:
            table = table.append_column(name, pa.array(new))
    return table


def summary(table: pa.Table) -> dict[str, Any]:
    return summarize(table, paper_robot(), mass=paper_robot().mass)


def base_columns() -> tuple[list[str], list[str]]:
    """Names of the base's quaternion and place."""
    names = log().column_names
    quaternion = [next(n for n in names if n.endswith(f"trunk_q{k}")) for k in "wxyz"]
    return quaternion, [next(n for n in names if n.endswith(f"trunk_{k}")) for k in "xyz"]


def as_dict(value: object) -> dict[str, Any]:
    assert isinstance(value, dict)
    return value


def as_list(value: object) -> list[Any]:
    assert isinstance(value, list)
    return value


def with_columns(table: pa.Table, **columns: np.ndarray) -> pa.Table:
    """The table with columns changed or added."""
    for name, new in columns.items():
        if name in table.column_names:
            table = table.drop_columns([name])
        table = table.append_column(name, pa.array(new))
    return table


def interrupted(*, cut: bool = False) -> pa.Table:
    """The log, but from 1 s on caught with FR, then RL, calm by 1.6 s; the clock runs at 1.7 s."""
    t = values("t")
    mode = np.array(["run"] * len(t), dtype=object)
    leg = np.zeros(len(t), dtype=int)
    for start, end, word, caught in (
        (1.0, 1.2, "catch", 2), (1.2, 1.3, "settle", 0), (1.3, 1.4, "catch", 3),
        (1.4, 1.6, "settle", 0), (1.6, 1.7, "replan", 0),
    ):  # fmt: skip
        mine = (t > start - 1e-9) & (t < end - 1e-9)
        mode[mine], leg[mine] = word, caught
    waited = np.cumsum(np.where(mode == "run", 0.0, PERIOD))
    table = with_columns(log(), gait_mode=mode, catch_leg=leg, gait_waited=waited)
    return table.slice(0, int(np.searchsorted(t, 1.5))) if cut else table


def estimated(table: pa.Table, *, ahead: float = 0.0, yaw: float = 0.0) -> pa.Table:
    """The table with estimates: the truth, moved along x [m], turned about z [rad]."""
    quaternion, place = base_columns()
    w, x, y, z = (values(name, table) for name in quaternion)
    n = table.num_rows
    rpy = np.array([RollPitchYaw(Quaternion(q)).vector() for q in np.column_stack([w, x, y, z])])
    columns: dict[str, np.ndarray] = {"estimator_healthy": np.ones(n, dtype=bool)}
    for k, axis in enumerate("xyz"):
        columns[f"base_estimated_{axis}"] = values(place[k], table) + ahead * (axis == "x")
    for k, name in enumerate(("roll", "pitch", "yaw")):
        columns[f"base_estimated_{name}"] = rpy[:, k] + yaw * (name == "yaw")
    columns |= {f"{leg}_slip_estimated": np.zeros(n, dtype=bool) for leg in SHORT_NAMES}
    columns |= {f"deviation_base_{axis}": np.full(n, 0.01) for axis in "xyz"}
    columns |= {"deviation_turn_z": np.full(n, 0.002)}
    columns |= {"qp_unsolved": np.arange(n) // 100, "carried_force": np.full(n, 49.05)}
    columns |= {"carried_moment_x": np.full(n, 2.4525), "carried_moment_y": np.full(n, -4.905)}
    columns |= {f"{leg}_friction_estimated": np.full(n, 0.5) for leg in SHORT_NAMES}
    return with_columns(table, **columns)
