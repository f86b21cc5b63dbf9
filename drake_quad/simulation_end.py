"""How a run ended: its outcome, why, and what its summary tells."""

import platform
import re
from importlib.metadata import version
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad import __version__
from drake_quad.preparation import Preparation
from drake_quad.robot.robot_model import contact_friction
from drake_quad.run_files import RunResult
from drake_quad.scenario import Scenario
from drake_quad.stability.safety import judge_safety, safe_margin
from drake_quad.summary import base_error, push_figures, summarize

AT_GOAL = 0.1  # [m], [rad]: farthest from the end of the plan that counts as there
INTERRUPTED = "interrupted"  # the reason of a run that a person ended


def result_of(
    p: Preparation, outcome: str, reason: str, table: pa.Table, *, simulated: float, wall: float
) -> RunResult:
    """The result of a run with its summary.

    Args:
        p: What was run.
        outcome: `goal_reached`, `fell` or `stopped`.
        reason: What ended it.
        table: Its log.
        simulated: Time simulated [s].
        wall: Time that it took [s].
    """
    # A replay of the plan is not pushed, whatever the scenario says.
    pushes = p.disturbances.pushes if p.scenario.simulation.mode == "physics" else ()
    failed = outcome != "goal_reached" and reason != INTERRUPTED
    summary: dict[str, Any] = {
        "description": p.scenario.description,
        "outcome": outcome,
        "reason": reason,
        "simulation": p.scenario.simulation.mode,
        "simulated_time": simulated,
        "wall_time": wall,
        "real_time_factor": simulated / wall,
        "planning_time": p.plan.planning_time,
        "margin_kind": p.settings.margin,
        "contact_friction": _friction(p),
        "assumes": assumptions_of(p.scenario),
        **summarize(table, p.robot),
        "pushes": push_figures(table, pushes, failed=failed),
        "seed": p.scenario.simulation.seed,
        "versions": {
            "drake_quad": __version__,
            "drake": version("drake"),
            "numpy": np.__version__,
            "python": platform.python_version(),
        },
    }
    wanted = safe_margin(p.robot)
    safety = judge_safety(summary, wanted)
    summary["safety"] = {
        "safe": safety.safe, "margin_wanted": wanted, "lacks": list(safety.lacks)
    }  # fmt: skip
    return RunResult(outcome, reason, summary, table, p.scenario)


def _friction(p: Preparation) -> float | None:
    """The coefficient between feet and ground, of the least foot; None of a replay."""
    if p.scenario.simulation.mode != "physics":
        return None
    return float(contact_friction(p.robot, p.scenario.simulation.friction).min())


def assumptions_of(scenario: Scenario) -> str:
    """What a run's figures take for granted, in a line for people."""
    if scenario.simulation.mode == "kinematic":
        return "that the robot is where its plan has it: nothing was measured"
    flags = "contact flags without error"
    if scenario.estimator.kind == "truth":
        return f"{flags}, and a controller that is told the robot's true state"
    return f"{flags}; the controller estimates its state from its sensors"


def at_goal(table: pa.Table, reason: str) -> tuple[str, str]:
    """Whether the robot is where the plan ends: the gait clock alone does not decide."""
    if table.num_rows == 0:
        return "stopped", "the run is shorter than a sample of the log: nothing was measured"
    last = table.slice(table.num_rows - 1)
    names = table.column_names
    place, tilt = base_error({n: last[n].to_numpy(zero_copy_only=False) for n in names})
    if place[0] > AT_GOAL or tilt[0] > AT_GOAL:
        return "stopped", f"the plan is at its end, but the base is {place[0]:.2f} m off it"
    return "goal_reached", reason


def outcome_of(message: str) -> tuple[str, str]:
    """Outcome and reason from a termination's message: `goal_reached` or `<outcome>: <why>`."""
    found = re.search(r'message: "(.*)"', message, re.DOTALL)
    text = found.group(1) if found else message
    if text == "goal_reached":
        return text, "the mission was carried out"
    outcome, _, reason = text.partition(": ")
    return (outcome, reason) if outcome in ("fell", "stopped") else ("stopped", text)
