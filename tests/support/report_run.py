"""Writes the files of a made-up run, for the tests of the report: a plan, a little off its path."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from drake_quad.planning.body_reference import level_pose, robot_stance
from drake_quad.planning.motion_plan import MotionPlan, Stance, pose_robot
from drake_quad.planning.task import plan_task
from drake_quad.report import page
from drake_quad.report.page import FIGURES
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.loader import MakeModelPlant, load_robot
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import make_layout
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import parse_scenario, save_scenario
from drake_quad.stability.support_polygon import stability_margins

SHORT = """
description: Over one step, for a test
course:
  - {kind: floor, length: 2.6}
  - {kind: stairs, going: up, rise: 0.13, run: 0.50, count: 4}
  - {kind: floor, length: 2.4}
start: {distance: 1.0}
"""
PERIOD = 0.005  # [s] between the samples of a log
GRAVITY = 9.81


@cache
def short_scenario() -> Scenario:
    return parse_scenario(SHORT, source="short")


def plans(scenario: Scenario, *, seconds: float) -> tuple[RobotModel, list[MotionPlan]]:
    """The robot and the plans of the mission's first tasks, at least `seconds` long in all."""
    robot = load_robot(scenario.robot.model)
    course, settings = course_of(scenario), plan_settings(scenario)
    stance_B = robot_stance(settings)
    feet = np.column_stack([stance_B, np.full(4, robot.foot_radius)])
    feet[:, 0] += scenario.start.distance
    body = level_pose(np.array([scenario.start.distance, 0.0]), 0.0, 0.0, settings)
    stance, found = Stance(body, feet), []
    for index, task in enumerate(mission_of(scenario, course)):
        found.append(plan_task(robot, course, settings, task, stance, index=index))
        stance = found[-1].end
        if sum(plan.duration for plan in found) >= seconds:
            break
    return robot, found


@cache
def wave_begins() -> float:
    """When the short scenario's first wave begins [s], a transition before it."""
    start = 0.0
    for plan in plans(short_scenario(), seconds=1e9)[1]:
        for segment in plan.segments:
            if segment.kind == "wave":
                return start + segment.start
        start += plan.duration
    raise AssertionError("the short scenario has no wave")


def make_log(
    scenario: Scenario, *, seconds: float = 3.0, start: float = 0.0, kinematic: bool = False
) -> dict[str, Any]:
    """The columns of a log of `seconds` from `start` on, as a run writes them."""
    robot, found = plans(scenario, seconds=start + seconds)
    parts, begin = [], 0.0
    for index, plan in enumerate(found):
        gait_time = np.arange(0.0, plan.duration, PERIOD)
        part = _columns(robot, plan, gait_time, begin, kinematic=kinematic)
        part["task"] = np.full(len(gait_time), index)
        part["plan_revision"] = np.zeros(len(gait_time), dtype=int)
        part["gait_mode"] = ["run"] * len(gait_time)
        part["catch_leg"] = np.zeros(len(gait_time), dtype=int)
        part["segment"] = [plan.segments[plan.segment_index(t)].name for t in gait_time]
        part["segment_kind"] = [plan.segments[plan.segment_index(t)].kind for t in gait_time]
        parts.append(part)
        begin += len(gait_time) * PERIOD
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    keep = (columns["t"] >= start - 1e-9) & (columns["t"] < start + seconds - 1e-9)
    return {name: values[keep] for name, values in columns.items()}


def _columns(
    robot: RobotModel, plan: MotionPlan, gait_time: np.ndarray, begin: float, *, kinematic: bool
) -> dict[str, Any]:
    t = begin + gait_time
    n = len(t)
    desired = plan.body.samples(gait_time)[:, 0]
    feet, standing = plan.contacts.feet_at(gait_time)
    off = 0.0 if kinematic else 0.01 * np.sin(np.outer(t, [0.7, 1.1, 1.3, 0.9, 0.5]))
    body = desired + off
    q, _, com = pose_robot(robot, body, feet)
    _, _, com_planned = pose_robot(robot, desired, feet)
    late = np.maximum(np.arange(n) - 8, 0)  # a foot is felt 40 ms after its touchdown
    bearing = standing if kinematic else standing & standing[late]
    ground = feet - [0.0, 0.0, robot.foot_radius]
    load = np.where(bearing, robot.mass * GRAVITY / bearing.sum(axis=1, keepdims=True), 0.0)
    force = np.stack([0.05 * load, -0.03 * load, load], axis=-1)
    plant = MakeModelPlant(robot.url)
    layout = make_layout(plant, robot)
    positions = np.zeros((n, plant.num_positions()))
    positions[:, layout.q_base : layout.q_base + 7] = _base(body)
    positions[:, layout.q_joints] = q.reshape(n, 12)
    velocities = np.zeros((n, plant.num_velocities()))
    joint_v = layout.v_joints - layout.num_positions
    velocities[:, joint_v] = np.gradient(q.reshape(n, 12), PERIOD, axis=0) if n > 1 else 0.0
    torque = 0.3 * robot.effort * np.sin(t[:, None] + np.arange(12))
    swing = np.where(standing.all(axis=1), 0, 1 + np.argmin(standing, axis=1))
    columns: dict[str, Any] = {
        "t": t,
        "gait_time": gait_time,
        "gait_rate": np.ones(n),
        "gait_waited": np.zeros(n),
        "swing_leg": swing,
        "swing_phase": np.where(swing > 0, 0.5, 0.0),
    }
    columns |= {f"q_{k}": positions[:, i] for i, k in enumerate(plant.GetPositionNames())}
    columns |= {f"v_{k}": velocities[:, i] for i, k in enumerate(plant.GetVelocityNames())}
    nothing = np.nan if kinematic else 1.0
    columns |= {f"tau_{k}": nothing * torque[:, i] for i, k in enumerate(robot.joint_names)}
    for row, leg in enumerate(SHORT_NAMES):
        columns[f"{leg}_bearing"] = bearing[:, row]
        columns[f"{leg}_standing_planned"] = standing[:, row]
        columns[f"{leg}_slip_speed"] = np.full(n, 0.0 * nothing)
        for i, axis in enumerate("xyz"):
            columns[f"{leg}_force_{axis}"] = nothing * force[:, row, i]
            columns[f"{leg}_position_{axis}"] = ground[:, row, i]
            columns[f"{leg}_desired_{axis}"] = feet[:, row, i]
    columns |= {f"com_{axis}": com[:, i] for i, axis in enumerate("xyz")}
    names = ("x", "y", "z", "pitch", "yaw")
    columns |= {f"base_desired_{name}": desired[:, i] for i, name in enumerate(names)}
    columns["margin"] = stability_margins(com[:, :2], ground[..., :2], bearing)
    columns["margin_planned"] = stability_margins(com_planned[:, :2], feet[..., :2], standing)
    columns["zmp_margin"] = columns["margin"] - (np.nan if kinematic else 0.01)
    columns["nonfoot_contacts"] = np.zeros(n, dtype=int)
    columns["nonfoot_force"] = np.zeros(n)
    columns |= {f"push_force_{axis}": np.zeros(n) for axis in "xyz"}
    return columns


def add_recovery(log: dict[str, Any], start: float) -> dict[str, Any]:
    """The log with the clock still from `start` [s] on: 0.2 s of waiting for a foot, then a catch.

    With FR for 0.3 s, calm after 0.5 s, planned within 0.05 s; then it runs.
    """
    t, mode, leg = log["t"], np.array(log["gait_mode"], dtype=object), np.array(log["catch_leg"])
    waits = (t >= start - 1e-9) & (t < start + 1.05 - 1e-9)
    for begin, end, word in ((0.2, 0.5, "catch"), (0.5, 1.0, "settle"), (1.0, 1.05, "replan")):
        mode[(t >= start + begin - 1e-9) & (t < start + end - 1e-9)] = word
    leg[mode == "catch"] = 2
    waited = PERIOD * np.cumsum(waits)
    changes = {"gait_waited": waited, "gait_rate": 1.0 - waits, "gait_mode": mode}
    revision = (t >= start + 1.05 - 1e-9).astype(int)
    return log | changes | {"catch_leg": leg, "plan_revision": revision}


def add_estimate(log: dict[str, Any], *, ahead: float, yaw: float) -> dict[str, Any]:
    """The log with an estimate off by `ahead` along x [m] and by `yaw` [rad] at its end.

    Both grow from nothing, and the filter believes in half of them.
    """
    n = len(log["t"])
    grown = np.linspace(0.0, 1.0, n)
    name = next(k for k in log if k.startswith("q_") and k.endswith("_qw"))[:-2]
    w, x, y, z = (log[name + k] for k in ("qw", "qx", "qy", "qz"))
    columns: dict[str, Any] = {f"base_estimated_{k}": log[name + k] for k in "xyz"}
    columns["base_estimated_x"] = log[name + "x"] + ahead * grown
    columns["base_estimated_roll"] = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    columns["base_estimated_pitch"] = np.arcsin(2 * (w * y - x * z))
    turn = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    columns["base_estimated_yaw"] = turn + yaw * grown
    columns |= {f"deviation_{k}_{axis}": np.zeros(n) for k in ("turn", "base") for axis in "xyz"}
    columns["deviation_base_x"] = 0.5 * abs(ahead) * grown
    columns["deviation_turn_z"] = 0.5 * abs(yaw) * grown
    columns |= {f"{leg}_slip_estimated": np.zeros(n, dtype=bool) for leg in SHORT_NAMES}
    return log | columns


def add_margins(log: dict[str, Any]) -> dict[str, Any]:
    """The log with margins beyond the hull's, held for 0.1 s, and a tenth less with torque."""
    held = np.arange(len(log["t"])) // 20 * 20
    friction = log["margin"][held]
    columns: dict[str, Any] = {"margin_friction": friction, "margin_capture": 0.8 * friction}
    columns["push_budget"] = np.maximum(3.0 * columns["margin_capture"], 0.0)
    columns["push_budget_direction"] = np.zeros(len(held))
    columns["margin_feasible"] = 0.9 * friction
    columns["margin_dynamic"] = 0.85 * friction
    columns["margin_friction_planned"] = log["margin_planned"][held]
    columns["margin_feasible_planned"] = 0.9 * log["margin_planned"][held]
    return log | columns


def _base(body: np.ndarray) -> np.ndarray:
    """Quaternion (w, x, y, z) and place (n, 7) of body poses (n, 5): yaw, then pitch."""
    cp, sp = np.cos(0.5 * body[:, 3]), np.sin(0.5 * body[:, 3])
    cy, sy = np.cos(0.5 * body[:, 4]), np.sin(0.5 * body[:, 4])
    return np.column_stack([cy * cp, -sy * sp, cy * sp, sy * cp, body[:, :3]])


def make_summary(log: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """What a run says of itself, from its log."""
    t, margin = log["t"], log["margin"]

    def spread(values: np.ndarray) -> dict[str, float]:
        if not np.any(np.isfinite(values)):
            return {"minimum": float("nan")}
        return {
            "minimum": float(np.nanmin(values)),
            "percentile_1": float(np.nanpercentile(values, 1)),
            "median": float(np.nanmedian(values)),
        }

    segments = []
    for name in dict.fromkeys(log["segment"]):
        own = log["segment"] == name
        segments.append(
            {
                "name": str(name),
                "kind": str(log["segment_kind"][own][0]),
                "start": float(t[own][0]),
                "end": float(t[own][-1]),
                "margin_min": float(margin[own].min()),
                "margin_planned_min": float(log["margin_planned"][own].min()),
            }
        )
    return {
        "scenario": "short",
        "outcome": "goal_reached",
        "reason": "goal_reached",
        "simulation": "physics",
        "simulated_time": float(t[-1] - t[0]),
        "wall_time": 1.5,
        "real_time_factor": 2.0,
        "margin": spread(margin),
        "margin_planned": spread(log["margin_planned"]),
        "zmp_margin": spread(log["zmp_margin"]),
        "time_under_three_feet": 0.0,
        "nonfoot_contact_samples": 0,
        "base_error_max": 0.0123,
        "base_tilt_error_max_deg": 0.57,
        "slip_max": 0.0,
        "torque_ratio_max": 0.3,
        "speed_ratio_max": 0.4,
        "position_ratio_max": 0.8,
        "margin_within_20mm": 0.97,
        "cost_of_transport": 0.61,
        "segments": segments,
        "versions": {"drake": "1.51.1", "drake_quad": "0.1.0"},
        "seed": 0,
    } | changes


def write_run(
    directory: Path,
    *,
    scenario: Scenario | None = None,
    log: dict[str, Any] | None = None,
    **summary: Any,
) -> Path:
    """Writes scenario.yaml, log.parquet and summary.json; `summary` overrides its keys."""
    scenario = scenario or short_scenario()
    log = make_log(scenario) if log is None else log
    directory.mkdir(parents=True, exist_ok=True)
    save_scenario(scenario, directory / "scenario.yaml")
    pq.write_table(pa.table(log), directory / "log.parquet")
    text = json.dumps(make_summary(log, **summary))
    (directory / "summary.json").write_text(text, encoding="utf-8")
    return directory


def draw_only(patch: pytest.MonkeyPatch, *names: str) -> None:
    """Leaves all figures but some out of pages: to draw all of a page's takes seconds."""
    assert set(names) <= {kind.name for kind in FIGURES}
    patch.setattr(page, "FIGURES", tuple(kind for kind in FIGURES if kind.name in names))
