"""The answer to `check` as plain values."""

from dataclasses import asdict
from typing import Any

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.feasibility.changes import Change
from drake_quad.feasibility.check_words import near_words, stairs_in_words
from drake_quad.feasibility.result import Feasibility, but_not
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.objective import NAMES, targets_for
from drake_quad.gait_design.preference import GaitPreference
from drake_quad.gait_design.quicken import run_error
from drake_quad.gait_design.tempo import static_margin, tread_way
from drake_quad.infeasibility.boxes import ClimbClass
from drake_quad.infeasibility.proof import InfeasibilityProof
from drake_quad.planning.motion_plan import evaluate
from drake_quad.robot.doubts import all_doubts
from drake_quad.robot.mapping import assumed_of_drives_and_inertias
from drake_quad.robot.model import RobotModel
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.elements import Stairs
from drake_quad.util.numbers import whole_millimetres

PERIOD = 0.05  # [s] between the samples of the plan that are looked at

# What is in the way, in a few words, as a legend has them.
LIMITS = {
    "reach": "too short legs",
    "joints": "joint limits",
    "torque": "torque",
    "margin": "margin",
    "legs": "knees or shanks touch",
    "apart": "legs touch each other or the trunk",
    "trunk": "trunk touches",
    "speed": "joint speed",
    "pattern": "treads do not suit the hips",
    "plan": "no plan",
}


def limit_of(check: Feasibility, robot: RobotModel) -> str:
    """Which of LIMITS is in the way; empty if nothing is."""
    if check.designed is not None:
        return ""
    data = check.data
    if "slacks" in data:
        wanted = targets_for(robot)  # without the clearance that errors of the map would need
        return min(NAMES, key=lambda name: data["slacks"][name] / getattr(wanted, name))
    if "room" in data:
        return "trunk" if "the trunk" in check.reason else "legs"
    if "leg" in data and "excess" in data:
        return "reach"
    for key, limit in (
        ("torque", "torque"), ("speed", "speed"), ("joint", "joints"), ("margin", "margin"),
        ("pattern", "pattern"), ("apart", "apart"),
    ):  # fmt: skip
        if key in data:
            return limit
    return "plan"


def feasibility_report(
    check: Feasibility,
    robot: RobotModel,
    *,
    source: str,
    asked: dict[str, Any],
) -> dict[str, Any]:
    """The answer as plain values in SI units; `with_nearest` adds the nearest stairs.

    Args:
        check: The answer.
        robot: The robot.
        source: Robot name or file, as the person gave it.
        asked: A flight's `rise`, `run` and `count`, and `overhang` and `open` if it has them; or
            `scenario`.
    """
    designed = check.designed
    wanted = vars(targets_for(robot)) if designed is None else designed.design.wanted
    left = designed.design.slacks if designed is not None else check.data.get("slacks", {})
    on_course = {} if designed is None else _on_course(designed, robot)
    report = {
        "feasible": check.feasible,
        "verdict": "yes" if check.feasible else "unknown",
        "proof": None,
        "robot": source,
        "name": robot.name,
        "asked": asked,
        "reason": check.reason,
        "limit": limit_of(check, robot),
        "nearest": None,
        "sought": False,
        "stopped": check.stopped,
        "changes": None,
        "doubts": all_doubts(robot),
        "notes": assumed_of_drives_and_inertias(robot),
        "slacks": {
            name: {
                "left": left[name],
                "wanted": wanted[name],
                "on_course": on_course.get(name),
            }
            for name in NAMES
            if name in left
        },
    }
    if designed is not None:
        gait = designed.scenario.gait
        cycle_lasts = gait.cycle_time + 2.0 * gait.switch_wait  # as plan_walk lays it out
        on_stairs = cycle_lasts
        if gait.swing_speed > 0.0 and check.speed is not None and "run" in asked:  # swings differ
            on_stairs = tread_way(gait, asked["run"]) / check.speed
        pitches = _pitches(designed)
        report["gait"] = {
            "treads": gait.treads,
            "lag": gait.lag,
            "places_per_tread": gait.places_per_tread,
            "duty_factor": gait.duty_factor,
            "cycle_time": gait.cycle_time,
            "cycle_lasts": on_stairs,
            "speed_level": gait.stride / cycle_lasts,
            "speed_stairs": None
            if asked.get("run", np.inf) >= gait.deep_tread  # these are walked like floors
            else tread_way(gait, asked["run"]) / on_stairs,
            "pitch_up_deg": float(np.degrees(-min(pitches.min(), 0.0))),
            "pitch_down_deg": float(np.degrees(max(pitches.max(), 0.0))),
            "body_height": gait.body_height,
            "pitch_share": gait.pitch_share if gait.pitch == "slope" else 0.0,
            "stance_width": gait.stance_width,
            "stride": gait.stride,
        }
        report["plan"] = {
            "duration": designed.plan.duration,
            "margin": designed.margin,
            "margin_kind": gait.margin,
            "balance": "dynamic" if check.balanced_by_motion else "static",
            "quality": designed.quality,
            "nearest_part": designed.clearance.part,
            "nearest_task": designed.clearance.task,
        }
        report["pace"] = _pace(check)
        report["certificate"] = _certificate(check, robot)
    return report | {"answer": _answer(report)}


def _close(proven: dict[str, float | None], robot: RobotModel) -> str:
    """What is nearer to the stairs than runs are off their plans, in words; empty if nothing is."""
    off = run_error(robot)
    parts = {"foot_clearance": "swing feet", "shank_clearance": "knees or shanks"}
    found = [
        f"{words} come to {1e3 * room:.1f} mm"
        for name, words in parts.items()
        if (room := proven[name]) is not None and room < off
    ]
    if not found:
        return ""
    return (
        f"{' and '.join(found)} from the stairs, and a run may be {1e3 * off:.1f} mm off its plan: "
        "they may touch"
    )


def _certificate(check: Feasibility, robot: RobotModel) -> dict[str, Any] | None:
    """What is proven of the plan at every time, as plain values, or where the proof fails."""
    certificate, designed = check.certificate, check.designed
    if certificate is None or designed is None:
        return None
    failure, plan = certificate.failure, designed.plan
    segments = [segment.name for task in plan.plans for segment in task.segments]
    return {
        "certified": failure is None,
        "reason": "" if failure is None else failure.reason,
        "time": None if failure is None else plan.starts[failure.task] + failure.time,
        "segment": None if failure is None else segments[failure.segment],
        "proven": certificate.least,
        "close": _close(certificate.least, robot) if failure is None else "",
    }


def _pace(check: Feasibility) -> dict[str, Any] | None:
    """How fast the plan is on the flights, and which limit is nearest, as plain values."""
    pace, bound = check.pace, check.bound
    if pace is None or bound is None:
        return None
    peak = pace.peak
    return {
        "speed": check.speed,
        "time": check.flight_time,
        "flights": [asdict(flight) for flight in pace.flights],
        "bound": asdict(bound),
        "joint": None if peak is None else {**asdict(peak), "share": peak.share},
        "zmp_margin": pace.zmp_margin if np.isfinite(pace.zmp_margin) else None,
        "wish": asdict(check.preference) | {"fulfilled": check.fulfilled, "unmet": check.unmet},
        "slow": _slow(check),
    }


def _slow(check: Feasibility) -> dict[str, Any] | None:
    """Speed [m/s] and margin [m] of the gait found for margin, if another's times were chosen."""
    pace, slow = check.slow_pace, check.slow
    if pace is None or slow is None or pace.slowest is None:
        return None
    return {"speed": pace.slowest.speed, "time": pace.slowest.time, "margin": slow.margin}


def with_nearest(report: dict[str, Any], nearest: Stairs | None) -> dict[str, Any]:
    """A no as plain values, with rise and run of the nearest stairs that are climbed, if any."""
    near = None if nearest is None else {"rise": nearest.rise, "run": nearest.run}
    sought = report | {"nearest": near, "sought": True}
    return sought | {"answer": f"{report['answer']}; {near_words(sought)}"}


def with_changes(report: dict[str, Any], changes: list[Change]) -> dict[str, Any]:
    """A no as plain values, with what would make it a yes."""
    told = [asdict(change) | {"share": change.share} for change in changes]
    return report | {"changes": told}


def _pitches(designed: Designed) -> FloatArray:
    """The body's pitch over the whole plan [rad]: negative where its nose is up."""
    return np.concatenate(
        [
            plan.body.samples(np.arange(0.0, plan.duration, PERIOD))[:, 0, 3]
            for plan in designed.plan.plans
        ]
    )


def _on_course(designed: Designed, robot: RobotModel) -> dict[str, float]:
    """What the plan of the course itself leaves of each limit that it is measured for."""
    joints = np.inf
    for plan in designed.plan.plans:
        count = int(np.ceil(plan.duration / PERIOD)) + 1
        q = evaluate(robot, plan, np.linspace(0.0, plan.duration, count)).q.reshape(-1, 12)
        joints = min(joints, float(np.minimum(q - robot.q_lower, robot.q_upper - q).min()))
    part = "trunk" if designed.clearance.part == "the trunk" else "legs"
    static = static_margin(robot, designed)
    left = {"joints": joints, "torque": designed.torque, "margin": static}
    return left | {part: designed.clearance.weighted}


def with_proof(report: dict[str, Any], proof: InfeasibilityProof | None) -> dict[str, Any]:
    """The answer after a proof that there is no climb was sought; the same if none was found."""
    if proof is None:
        return report
    report = report | {"verdict": "no"}
    return report | {"answer": _answer(report)}


def _answer(report: dict[str, Any]) -> str:
    """The answer in a line: yes with its margin, a proven no, or what was in the way of a plan."""
    asked = report["asked"]
    stairs = stairs_in_words(asked)
    if report["feasible"]:
        plan = report["plan"]
        kind = "static" if plan["margin_kind"] == HULL else plan["margin_kind"]
        moving = plan["balance"] == "dynamic"
        certificate = report["certificate"]
        least = plan["margin"]
        if kind == "static" and certificate is not None and certificate["certified"]:
            least = min(least, certificate["proven"]["margin"])  # between the samples, too
        margin = f"{whole_millimetres(least)} mm"
        kept = f"with a {kind} margin of at least {margin}"
        if moving:
            kept = (
                f"balanced by its motion, its zero-moment point at least {margin} within its feet"
            )
        ways = "" if "scenario" in asked else " up and down"
        torque = report["slacks"]["torque"]["on_course"]
        strong = ""
        if torque < 0.0:
            strong = (
                ", if its feet share the weight so that no joint has to give "
                f"{1.0 - torque:.0%} of its torque"
            )
        quick = _how_quick(report["pace"])
        wanted = report["slacks"]["margin"]["wanted"]
        short = plan["margin"] < wanted and not moving
        little = f", less than the {1e3 * wanted:.0f} mm that designs aim at" if short else ""
        unmet = [] if report["pace"] is None else report["pace"]["wish"]["unmet"]
        return (
            f"Yes{but_not(unmet)}: {report['name']} walks {stairs}{ways}{',' if moving else ''} "
            f"{kept}{little}{strong}{quick}"
        )
    why = f"({LIMITS[report['limit']]}): {report['reason']}"
    if report["verdict"] == "no":
        pitch, roll = np.degrees(ClimbClass.pitch), np.degrees(ClimbClass.roll)
        return (
            f"No, and proven: no gait takes {report['name']} up {stairs} with its centre of mass "
            f"over the polygon of its feet, and its trunk pitched by at most {pitch:.0f}°, and by "
            f"{roll:.0f}° in roll and heading; what was in the way of a plan {why}"
        )
    return f"Unknown: no plan was found for {report['name']} on {stairs} {why}"


def _how_quick(pace: dict[str, Any] | None) -> str:
    """Says how quick the gait is, if that was asked for."""
    if pace is None or not GaitPreference(**_figures(pace["wish"])).quick:
        return ""
    return "" if pace["speed"] is None else f", at {pace['speed']:.3f} m/s"


def _figures(preference: dict[str, Any]) -> dict[str, Any]:
    """A GaitPreference's own fields."""
    return {name: value for name, value in preference.items() if name not in ("fulfilled", "unmet")}
