"""A mission's plan in figures: what `drake-quad plan` prints."""

from collections.abc import Callable
from typing import Any

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.footing import Footing, kind_of
from drake_quad.planning.motion_plan import MotionPlan, Segment, evaluate
from drake_quad.planning.plan_mission import MissionPlan
from drake_quad.planning.plan_torques import torque_ratio
from drake_quad.robot.robot_model import RobotModel
from drake_quad.run_log import plan_margin

TORQUE_EVERY = 10  # so many of these are looked at for torques, which change slowly
PERIOD = 0.02  # [s] between the samples that margins are taken from


def describe_plan(
    robot: RobotModel,
    plan: MissionPlan,
    *,
    massless_legs: bool,
    footing: Footing | None = None,
) -> dict[str, Any]:
    """The plan's figures as plain values.

    Args:
        robot: The robot.
        plan: The mission's plan.
        massless_legs: Whether margins are the body's centre's (the paper's) or the whole robot's.
        footing: What margins were asked of, if not of the hull: those are told besides.
    """
    segments, torque = [], 0.0
    for task, start in zip(plan.plans, plan.starts, strict=True):
        times = np.linspace(0.0, task.duration, int(np.ceil(task.duration / PERIOD)) + 1)
        samples = evaluate(robot, task, times)
        margin = plan_margin(samples, massless_legs=massless_legs)
        torque = max(torque, float(torque_ratio(robot, samples.every(TORQUE_EVERY)).max()))
        beyond = _beyond(footing, task)
        for segment in task.segments:
            mine = (times >= segment.start - 1e-9) & (times <= segment.end + 1e-9)
            segments.append(
                {
                    "name": segment.name,
                    "kind": segment.kind,
                    "start": start + segment.start,
                    "end": start + segment.end,
                    "margin_min": float(margin[mine].min()) if np.any(mine) else None,
                    **beyond(segment),
                    **segment.details,
                    **_steps(segment, start, times, margin),
                }
            )
    margins = [s["margin_min"] for s in segments if s["margin_min"] is not None]
    kind = kind_of(footing)
    others = [s.get(f"margin_{kind}_min") for s in segments]
    least = min((m for m in others if m is not None), default=None)
    return {
        "feasible": True,
        "reason": "",
        "duration": plan.duration,
        "planning_time": plan.planning_time,
        "planned_margin_min": min(margins),
        "torque_ratio_planned_max": torque,
        "margin_kind": kind,
        **({} if footing is None else {f"planned_margin_{kind}_min": least}),
        "segments": segments,
    }


def _beyond(footing: Footing | None, task: MotionPlan) -> Callable[[Segment], dict[str, Any]]:
    """What a segment of a task's plan has as its smallest margin beyond the hull's, by name."""
    if footing is None:
        return lambda _: {}
    # Whoever planned looked at these times, and at each lift-off and touchdown.
    times = sample_times(task.contacts)
    feet, standing = task.contacts.feet_at(times)
    margins = footing.stances(task.body.samples(times)[:, 0], feet, standing).margins()

    def least(segment: Segment) -> dict[str, Any]:
        mine = (times >= segment.start - 1e-9) & (times <= segment.end + 1e-9)
        found = float(margins[mine].min()) if np.any(mine) else None
        return {f"margin_{kind_of(footing)}_min": found}

    return least


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
        "torque_ratio_planned_max": None,
        "segments": [],
    }
