"""The answer to `check` as plain values, and the work that gives it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.feasibility.check import (
    Around,
    Feasibility,
    check_flight,
    check_flight_numbers,
    design_for_course,
    nearest_of,
)
from drake_quad.feasibility.check_picture import check_picture, save_picture
from drake_quad.feasibility.inspect_robot import all_doubts
from drake_quad.gait_design.objective import NAMES, targets_for
from drake_quad.gait_design.plan_candidates import Designed
from drake_quad.planning.motion_plan import evaluate
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.load import save_scenario
from drake_quad.simulation.precompile import DESIGN, precompiling
from drake_quad.stability.equilibrium_region import HULL, KINDS
from drake_quad.util.files import write_whole

# ------------------------------------------------------------------------------------------------
# What `drake-quad check` found, as plain values: an answer, the gait, and what is left.
# ------------------------------------------------------------------------------------------------


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
        wanted = targets_for(robot)  # what is short is told without any room for a map's errors
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
    """What was found, as plain values in SI units; `with_nearest` adds what is near.

    Args:
        check: The finding.
        robot: The robot.
        source: What the person gave for it.
        asked: `rise`, `run` and `count`, or `scenario`.
    """
    designed = check.designed
    wanted = vars(targets_for(robot)) if designed is None else designed.design.wanted
    left = designed.design.slacks if designed is not None else check.data.get("slacks", {})
    on_course = {} if designed is None else _on_course(designed, robot)
    told = {
        "feasible": check.feasible,
        "robot": source,
        "name": robot.name,
        "asked": asked,
        "reason": check.reason,
        "limit": limit_of(check, robot),
        "nearest": None,
        "sought": False,
        "doubts": all_doubts(robot),
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
        pitches = _pitches(designed)
        told["gait"] = {
            "treads": gait.treads,
            "lag": gait.lag,
            "places_per_tread": gait.places_per_tread,
            "duty_factor": gait.duty_factor,
            "cycle_time": gait.cycle_time,
            "cycle_lasts": cycle_lasts,
            "speed_level": gait.stride / cycle_lasts,
            "speed_stairs": None
            if asked.get("run", np.inf) >= gait.deep_tread  # these are walked like floors
            else gait.treads / gait.places_per_tread * asked["run"] / cycle_lasts,
            "pitch_up_deg": float(np.degrees(-min(pitches.min(), 0.0))),
            "pitch_down_deg": float(np.degrees(max(pitches.max(), 0.0))),
            "body_height": gait.body_height,
            "pitch_share": gait.pitch_share if gait.pitch == "slope" else 0.0,
            "stance_width": gait.stance_width,
            "stride": gait.stride,
        }
        told["plan"] = {
            "duration": designed.plan.duration,
            "margin": designed.margin,
            "margin_kind": gait.margin,
            "quality": designed.quality,
            "nearest_part": designed.room.part,
            "nearest_task": designed.room.task,
        }
    return told | {"answer": _answer(told)}


def with_nearest(told: dict[str, Any], nearest: tuple[float, float] | None) -> dict[str, Any]:
    """A no as it is told, with rise and run of the nearest stairs that are climbed [m], if any."""
    near = None if nearest is None else {"rise": nearest[0], "run": nearest[1]}
    sought = told | {"nearest": near, "sought": True}
    return sought | {"answer": f"{told['answer']}; {near_words(sought)}"}


def near_words(told: dict[str, Any]) -> str:
    """Which stairs would work, of those that were sought."""
    near = told["nearest"]
    if near is None:
        return "no lower rise and no deeper run was found that works"
    return f"{near['rise']:g} m on treads of {near['run']:g} m would work"


def _pitches(designed: Designed) -> FloatArray:
    """The body's pitch over the whole plan [rad]: negative where its nose is up."""
    return np.concatenate(
        [
            plan.body.samples(np.arange(0.0, plan.duration, PERIOD))[:, 0, 3]
            for plan in designed.plan.plans
        ]
    )


def _on_course(designed: Designed, robot: RobotModel) -> dict[str, float]:
    """What the plan of the course itself leaves, of the limits that it is measured for."""
    joints = np.inf
    for plan in designed.plan.plans:
        count = int(np.ceil(plan.duration / PERIOD)) + 1
        q = evaluate(robot, plan, np.linspace(0.0, plan.duration, count)).q.reshape(-1, 12)
        joints = min(joints, float(np.minimum(q - robot.q_lower, robot.q_upper - q).min()))
    part = "trunk" if designed.room.part == "the trunk" else "legs"
    left = {"joints": joints, "torque": designed.torque, "margin": designed.margin}
    return left | {part: designed.room.weighted}


def _answer(told: dict[str, Any]) -> str:
    """Yes or no in a line, with what limits it and what would work."""
    asked = told["asked"]
    stairs = (
        f"the course of {asked['scenario']}"
        if "scenario" in asked
        else f"{asked['count']} steps of {asked['rise']:g} m on treads of {asked['run']:g} m"
    )
    if told["feasible"]:
        plan = told["plan"]
        kind = "static" if plan["margin_kind"] == HULL else plan["margin_kind"]
        ways = "" if "scenario" in asked else " up and down"
        torque = told["slacks"]["torque"]["on_course"]
        strong = "" if torque >= 0.0 else f", if a joint gives {1.0 - torque:.0%} of its torque"
        wanted = told["slacks"]["margin"]["wanted"]
        little = "" if plan["margin"] >= wanted else f", less than the {1e3 * wanted:.0f} mm wanted"
        return (
            f"Yes: {told['name']} walks {stairs}{ways} with a {kind} margin of at least "
            f"{1e3 * plan['margin']:.0f} mm{little}{strong}"
        )
    return f"No: {told['name']} does not walk {stairs} ({LIMITS[told['limit']]}): {told['reason']}"


# ------------------------------------------------------------------------------------------------
# The work of `drake-quad check`: ask, look for the nearest stairs, save, and draw.
# ------------------------------------------------------------------------------------------------


RISE, RUN, COUNT = 0.178, 0.28, 10  # a common indoor flight


@dataclass(frozen=True)
class CheckRequest:
    """The question, as it was given.

    Attributes:
        robot: File or name.
        rise: Of the steps [m]; RISE if None, as RUN and COUNT below.
        run: Of the treads [m].
        count: Steps of the flight.
        scenario: Whose course to walk instead of a flight.
        margin: Over what the plan's margin is measured, one of
            `stability.equilibrium_region.KINDS`.
        width: Of the flights [m]; as the robot needs if None.
        landing: Length of the landing between the flights [m]; the same.
        turn: On the landing [deg], left positive; 90 if None.
    """

    robot: str
    rise: float | None = None
    run: float | None = None
    count: int | None = None
    scenario: str | None = None
    margin: str = HULL
    width: float | None = None
    landing: float | None = None
    turn: float | None = None


def run_check(
    asked: CheckRequest,
    *,
    save: Path | None = None,
    picture: Path | None = None,
    nearest: bool = True,
    first: Callable[[dict[str, Any]], object] = lambda _: None,
    note: Callable[[str], object] = lambda _: None,
) -> dict[str, Any]:
    """Answers the question; what is told is as `feasibility_report` has it.

    Args:
        asked: The question.
        save: Where to write the designed scenario, if there is one.
        picture: Where to draw the climb, if there is one.
        nearest: Whether to look for the nearest stairs that it climbs, if not these; it takes a
            minute or two.
        first: Is told the answer, of a no the reason, before that and before anything is written.
        note: Is told what is being done.

    Raises:
        InputError: If anything given cannot be used, before any long work; or a file cannot be
            written, after `first` was told.
    """
    check_picture(picture)
    if asked.margin not in KINDS:
        remedy = "give hull, friction or feasible"
        raise InputError(source="--margin", field="margin", value=asked.margin, remedy=remedy)
    own = {name: getattr(asked, name) for name in ("width", "landing", "turn")}
    given = {"rise": asked.rise, "run": asked.run, "count": asked.count, **own}
    robot = load_robot(asked.robot)
    with precompiling(DESIGN, note) as wait:
        wait()
    if asked.scenario is not None:
        for name, value in given.items():
            if value is not None:
                remedy = "leave it out: with --scenario the stairs are the scenario's"
                raise InputError(source=f"--{name}", field=name, value=value, remedy=remedy)
        question: dict[str, Any] = {"scenario": asked.scenario}
        check = design_for_course(asked.robot, asked.scenario, margin=asked.margin, nearest=nearest)
    else:
        rise = RISE if asked.rise is None else asked.rise
        run = RUN if asked.run is None else asked.run
        count = COUNT if asked.count is None else asked.count
        check_flight_numbers(rise, run, count)
        known = {name: value for name, value in own.items() if value is not None}
        around = Around(**known)
        question = {"rise": rise, "run": run, "count": count, **known}
        check = check_flight(
            asked.robot, rise=rise, run=run, count=count, nearest=False, margin=asked.margin,
            around=around,
        )  # fmt: skip
    if asked.margin != HULL:
        question["margin"] = asked.margin
    told = feasibility_report(check, robot, source=asked.robot, asked=question)
    first(told)
    if not check.feasible and asked.scenario is None and nearest:
        near = nearest_of(
            check, robot, model=asked.robot, rise=rise, run=run, count=count,
            margin=asked.margin, around=around, note=note,
        )  # fmt: skip
        told = with_nearest(told, near)
    if check.designed is not None and save is not None:
        scenario = check.designed.scenario
        write_whole(save, lambda to: save_scenario(scenario, to), option="--save")
        told["saved"] = str(save)
    if check.designed is not None and picture is not None:
        note("drawing")
        save_picture(check.designed, robot, picture)
        told["picture"] = str(picture)
    return told
