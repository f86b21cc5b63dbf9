"""A plan's figures and its certificate as plain values."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.certificate.certify import Certificate, certify_plans
from drake_quad.certificate.kinematics import shank_of
from drake_quad.certificate.robust import RobustProof, prove_within
from drake_quad.certificate.tolerances import Tolerances
from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait_design.tempo import least_zmp_margin
from drake_quad.planning.contact_forces import SHARES, ShareWeight, min_norm_forces, torque_ratio
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.mission import MissionPlan
from drake_quad.planning.motion_plan import MotionPlan, Segment, evaluate
from drake_quad.planning.stance_margin import (
    Footing,
    Slopes,
    footing_of,
    kind_of,
    slopes_of,
)
from drake_quad.robot.model import RobotModel, leg_lengths
from drake_quad.runs.planned_columns import plan_margin
from drake_quad.scenario.motion_config import OF_LEG, TolerancesConfig
from drake_quad.simulation.prepare import PreparedScenario, judge_plan
from drake_quad.stability.safety import safe_margin
from drake_quad.util.files import Write, write_together

PERIOD = 0.02  # [s] between the samples that margins are taken from


def describe_plan(
    robot: RobotModel,
    plan: MissionPlan,
    *,
    massless_legs: bool,
    footing: Footing | None = None,
    share: ShareWeight = min_norm_forces,
    ground: Slopes | None = None,
) -> dict[str, Any]:
    """The plan's figures as plain values.

    Args:
        robot: The robot.
        plan: Plan of the mission.
        massless_legs: Whether margins are the body's centre's (the paper's) or the whole robot's.
        footing: Region that margins were asked in, if not the hull: these are added.
        share: How the controller shares the weight among the feet.
        ground: Ground with slopes; None where all is level.
    """
    segments, torque = [], 0.0
    for task, start in zip(plan.plans, plan.starts, strict=True):
        times = np.linspace(0.0, task.duration, int(np.ceil(task.duration / PERIOD)) + 1)
        samples = evaluate(robot, task, times)
        margin = plan_margin(samples, massless_legs=massless_legs)
        torque = max(torque, float(torque_ratio(robot, samples, share, ground).max()))
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
    moving = min(least_zmp_margin(robot, task) for task in plan.plans) if plan.dynamic else None
    beside = [s["zmp_line_distance_max"] for s in segments if "zmp_line_distance_max" in s]
    return {
        "feasible": True,
        "reason": "",
        "duration": plan.duration,
        "planning_time": plan.planning_time,
        "planned_margin_min": min(margins),
        "safe_margin": safe_margin(robot),
        "balance": "dynamic" if plan.dynamic else "static",
        **({"planned_zmp_margin_min": moving} if plan.dynamic else {}),
        **({"planned_zmp_line_distance_max": max(beside)} if beside else {}),
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


def judged_plan(p: PreparedScenario) -> tuple[dict[str, Any], Certificate | None]:
    """A prepared plan's figures with those of its certificate, and the certificate.

    Raises:
        PlanningError: If the plan cannot be carried out, see `judge_plan`.
    """
    judge_plan(p)
    found = describe_plan(
        p.robot,
        p.plan,
        massless_legs=p.settings.uniform_body,
        footing=footing_of(p.robot, p.course, p.settings),
        share=SHARES[p.scenario.controller.kind],
        ground=slopes_of(p.course, p.settings.friction),
    )
    found["certificate"], certificate = certify_plan(p)
    return found, certificate


def describe_failure(error: PlanningError) -> dict[str, Any]:
    """The same keys for a mission that has no plan."""
    return {
        "feasible": False,
        "reason": error.reason,
        "duration": None,
        "planning_time": None,
        "planned_margin_min": None,
        "balance": None,
        "torque_ratio_planned_max": None,
        "segments": [],
    }


FILE, PLAN = "certificate.json", "plan.json"


def certify_plan(p: PreparedScenario) -> tuple[dict[str, Any], Certificate | None]:
    """Certifies a prepared scenario's plan.

    Returns:
        The result as plain values, for `plan --json`: `certified`, `reason`, `time` [s] of the
        mission and `segment` of the first failure, `proven` (the least of each figure over the
        plan), `jumps` (the greatest of body and feet where tasks meet, of value, rate and
        acceleration), `intervals` of time that it took, `certifying_time` [s], `tolerances`: what
        is proven within those that are `asked`, or a `share` of them; and the certificate,
        None of a plan that is not looked at, for it has swings along arcs, or of two legs.
    """
    begun = time.perf_counter()
    beyond = _first_beyond_proof(p)
    if beyond is not None:
        at, segment, reason = beyond
        none = {
            "proven": {}, "jumps": {}, "intervals": 0, "certifying_time": 0.0, "tolerances": None
        }  # fmt: skip
        return {
            "certified": False, "reason": reason, "time": at, "segment": segment, **none
        }, None  # fmt: skip
    asked = p.scenario.certify
    certificate = certify_plans(
        p.robot,
        shank_of(p.robot),
        p.plan.plans,
        p.course.boxes,
        margin=asked.margin,
        clearance=asked.clearance,
    )
    taken, failure = time.perf_counter() - begun, certificate.failure
    segments = [s.name for plan in p.plan.plans for s in plan.segments]
    robust = None
    if failure is None:
        within = tolerances_of(asked.tolerances, p.robot)
        shank = shank_of(p.robot)
        robust = prove_within(p.robot, shank, p.plan.plans, p.course.boxes, within)
    told = {
        "certified": failure is None,
        "reason": failure.reason if failure else "",
        "time": p.plan.starts[failure.task] + failure.time if failure else None,
        "segment": segments[failure.segment] if failure else None,
        "proven": certificate.least,
        "jumps": np.maximum(
            certificate.joins.body.max(axis=1), [certificate.joins.feet, 0.0, 0.0]
        ).tolist(),
        "intervals": len(certificate.proof.cells.half),
        "certifying_time": taken,
        "tolerances": None if robust is None else _robust_figures(p, robust, segments),
    }
    return told, certificate


def tolerances_of(config: TolerancesConfig, robot: RobotModel) -> Tolerances:
    """The tolerances that a scenario states, in radians, what it leaves out by the legs' length."""
    leg = float(leg_lengths(robot).min())

    def or_share(name: str) -> float:
        given: float | None = getattr(config, name)
        return OF_LEG[name] * leg if given is None else given

    return Tolerances(
        rise=config.rise,
        run=config.run,
        mass=config.mass,
        com=config.com,
        body=or_share("body"),
        tilt=float(np.radians(config.tilt_deg)),
        turn=float(np.radians(config.turn_deg)),
        foot=or_share("foot"),
        swing=or_share("swing"),
        late=config.late,
    )


def _robust_figures(
    p: PreparedScenario, robust: RobustProof, segments: list[str]
) -> dict[str, Any]:
    """A proof within tolerances as plain values."""
    failure = robust.failure
    return {
        "asked": vars(robust.asked),
        "share": robust.share,
        "fails_at": robust.fails_at,
        "proven": robust.figures,
        "reason": failure.reason if failure else "",
        "time": p.plan.starts[failure.task] + failure.time if failure else None,
        "segment": segments[failure.segment] if failure else None,
    }


def _first_beyond_proof(p: PreparedScenario) -> tuple[float, str, str] | None:
    """When, in which segment and why a plan first has what no proof is made of, if it has that."""
    for plan, start in zip(p.plan.plans, p.plan.starts, strict=True):
        for phase in plan.contacts.phases:
            reason = ""
            if len(phase.steps) > 1:
                reason = "two legs swing at once, and proofs are of margins on three feet or four"
            elif any(step.swing.pivot is not None for step in phase.steps):
                reason = "swings along arcs are no polynomials of time, of which proofs are made"
            if reason:
                segment = plan.segments[plan.segment_index(phase.start)]
                return start + phase.start, segment.name, reason
    return None


def write_plan(told: dict[str, Any], certificate: Certificate | None, directory: Path) -> None:
    """Writes plan.json, and certificate.json; without a certificate no old one stays, either.

    Args:
        told: Content of plan.json.
        certificate: Certificate of the plan, if there is a plan.
        directory: Directory to write into.

    Raises:
        InputError: If they cannot be written; what was there before stays.
    """
    files: dict[Path, Write] = {}
    if certificate is not None and certificate.record is not None:
        record = json.dumps(certificate.record, allow_nan=False) + "\n"
        files[directory / FILE] = lambda path: path.write_text(record, encoding="utf-8")
    plan = json.dumps(told, indent=2) + "\n"
    files[directory / PLAN] = lambda path: path.write_text(plan, encoding="utf-8")
    write_together(files, gone=[directory / FILE])
