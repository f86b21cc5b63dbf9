"""A mission's plan in figures: what `drake-quad plan` prints."""

from typing import Any

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.motion_plan import Segment, evaluate
from drake_quad.planning.plan_mission import MissionPlan
from drake_quad.robot.robot_model import RobotModel
from drake_quad.run_log import plan_margin

PERIOD = 0.02  # [s] between the samples that margins are taken from


def describe_plan(robot: RobotModel, plan: MissionPlan, *, massless_legs: bool) -> dict[str, Any]:
    """The plan's figures as plain values.

    Args:
        robot: The robot.
        plan: The mission's plan.
        massless_legs: Whether margins are the body's centre's (the paper's) or the whole robot's.
    """
    segments = []
    for task, start in zip(plan.plans, plan.starts, strict=True):
        times = np.linspace(0.0, task.duration, int(np.ceil(task.duration / PERIOD)) + 1)
        margin = plan_margin(evaluate(robot, task, times), massless_legs=massless_legs)
        for segment in task.segments:
            mine = (times >= segment.start - 1e-9) & (times <= segment.end + 1e-9)
            segments.append(
                {
                    "name": segment.name,
                    "kind": segment.kind,
                    "start": start + segment.start,
                    "end": start + segment.end,
                    "margin_min": float(margin[mine].min()) if np.any(mine) else None,
                    **segment.details,
                    **_steps(segment, start, times, margin),
                }
            )
    margins = [s["margin_min"] for s in segments if s["margin_min"] is not None]
    return {
        "feasible": True,
        "reason": "",
        "duration": plan.duration,
        "planning_time": plan.planning_time,
        "planned_margin_min": min(margins),
        "segments": segments,
    }


def _steps(segment: Segment, start: float, times: FloatArray, margin: FloatArray) -> dict[str, Any]:
    """A transition's steps, each with the smallest margin while its leg is in the air."""
    steps = []
    for step in segment.details.get("steps", []):
        during = (times >= step["start"] - 1e-9) & (times <= step["end"] + 1e-9)
        shifted = {"start": start + step["start"], "end": start + step["end"]}
        steps.append({**step, **shifted, "margin": float(margin[during].min())})
    return {"steps": steps} if steps else {}


def describe_failure(error: PlanningError) -> dict[str, Any]:
    """The same keys for a mission that has no plan."""
    return {
        "feasible": False,
        "reason": error.reason,
        "duration": None,
        "planning_time": None,
        "planned_margin_min": None,
        "segments": [],
    }
