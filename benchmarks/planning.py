"""How long it takes to plan a mission, and where the time goes; the body's QP against its peers.

    python -m benchmarks.planning

Asked for the whole case study: at most 0.1 s in the median. The peers solve the very programs that
planning sets up, through Drake's MathematicalProgram: Clarabel (an interior point method, as
ours) and OSQP (a first-order one).
"""

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import numpy as np
import piqp

from benchmarks.common import markdown_table, provenance, stopwatch
from benchmarks.quadratic import QuadraticProgram, Recorder, compare
from drake_quad.planning import (
    body_path as body_search,
    mission as plan_mission,
    step_builder,
    task as plan_task,
    transition_footsteps as plan_transition,
)
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.load import load_scenario

ASKED = 0.1  # [s]
# What is timed: name, where it is called from, and by which name.
WATCHED = (
    ("walks", plan_task, "plan_walk_footsteps"),
    ("spins", plan_task, "plan_spin_footsteps"),
    ("transitions", plan_transition, "plan_transition"),
    ("swings", step_builder, "plan_swing"),
    ("body", plan_task, "plan_body"),
    ("frame", body_search, "make_frame"),
    ("program", body_search, "solve_body"),
)


class Planner:
    """A scenario made ready for planning, so that only the planning is timed.

    Args:
        scenario: A shipped scenario's name, or a file.
        overrides: `path=value` each.
    """

    def __init__(self, scenario: str, overrides: Sequence[str] = ()) -> None:
        loaded = load_scenario(scenario, overrides)
        self._robot = load_robot(loaded.robot.model)
        self._course = course_of(loaded, foot_radius=self._robot.foot_radius)
        self._settings = plan_settings(loaded)
        self._tasks = mission_of(loaded, self._course)
        self._stance = plan_mission.initial_stance(
            self._robot, self._course, self._settings, start=loaded.start.distance
        )

    def plan(self) -> plan_mission.MissionPlan:
        """Plans the mission."""
        return plan_mission.plan_mission(
            self._robot, self._course, self._settings, self._tasks, self._stance
        )

    def check(self, plan: plan_mission.MissionPlan) -> None:
        """Checks reach, joint limits and speeds of the plan."""
        plan_mission.check_mission(self._robot, plan)


def measure(planner: Planner, *, repeats: int = 10) -> dict[str, Any]:
    """Planning, its parts and its check: medians over `repeats` [s]."""
    planner.plan()  # the first one also imports and warms up
    totals, processor, checks = [], [], []
    splits: list[dict[str, float]] = []
    for _ in range(repeats):
        begun = time.process_time()
        plan, split = split_time(planner)
        processor.append(time.process_time() - begun)
        totals.append(plan.planning_time)
        splits.append(split)
        with stopwatch(plan_mission, "check_mission") as watch:
            planner.check(plan)
        checks.append(watch.total)
    return {
        "planning": float(np.median(totals)),
        "planning_best": float(np.min(totals)),
        "planning_worst": float(np.max(totals)),
        "planning_cpu": float(np.median(processor)),
        "asked": ASKED,
        "parts": {name: float(np.median([s[name] for s in splits])) for name in splits[0]},
        "check": float(np.median(checks)),
        "planned_duration": plan.duration,
    }


def split_time(planner: Planner) -> tuple[plan_mission.MissionPlan, dict[str, float]]:
    """Plans once, and says where the time went [s]: the parts make up the whole."""
    recorded: list[QuadraticProgram] = []
    with ExitStack() as stack:
        w = {
            name: stack.enter_context(stopwatch(module, function))
            for name, module, function in WATCHED
        }
        stack.enter_context(recording(recorded))
        plan = planner.plan()
    seconds = {name: watch.total for name, watch in w.items()}
    solver = sum(program.seconds for program in recorded)
    program = seconds["frame"] + seconds["program"]
    laid = seconds["walks"] + seconds["spins"]
    return plan, {
        "transitions": seconds["transitions"],
        "swings": seconds["swings"],
        "footholds and all else on the ground": laid - seconds["transitions"] - seconds["swings"],
        "body: the QPs' solver": solver,
        "body: setting the QPs up": program - solver,
        "body: CoM, splines, margins": seconds["body"] - program,
        "the rest": plan.planning_time - laid - seconds["body"],
    }


@contextmanager
def recording(recorded: list[QuadraticProgram]) -> Iterator[None]:
    """Keeps every quadratic program that is solved meanwhile in `recorded`."""
    with (
        patch.object(Recorder, "recorded", recorded),
        patch.object(piqp, "SparseSolver", Recorder),
    ):
        yield


def programs(planner: Planner) -> list[QuadraticProgram]:
    """The quadratic programs that planning sets up, in order."""
    recorded: list[QuadraticProgram] = []
    with recording(recorded):
        planner.plan()
    return recorded


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--scenario", default="case_study")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--no-peers", action="store_true", help="leave the QP's peers out")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    planner = Planner(options.scenario, options.set)
    result = measure(planner, repeats=options.repeats)
    result["peers"] = [] if options.no_peers else compare(programs(planner))
    if options.json:
        print(json.dumps(result))
        return
    whole = result["planning"]
    rows = [["planning", f"{1e3 * whole:.1f} ms", "100 %"]]
    rows += [["of which processor time", f"{1e3 * result['planning_cpu']:.1f} ms", ""]]
    rows += [
        [k, f"{1e3 * v:.1f} ms", f"{100 * v / whole:.0f} %"] for k, v in result["parts"].items()
    ]
    rows += [["check of the plan, after it", f"{1e3 * result['check']:.1f} ms", ""]]
    best, worst = (1e3 * result[f"planning_{which}"] for which in ("best", "worst"))
    print(
        f"{options.scenario}, {result['planned_duration']:.1f} s of motion; median of "
        f"{options.repeats}, best {best:.0f}, worst {worst:.0f} ms; asked {1e3 * ASKED:.0f} ms\n"
    )
    print(markdown_table(("", "time", "share"), rows))
    for peer in result["peers"][:1]:
        print()
        print(markdown_table(tuple(peer), [[str(v) for v in p.values()] for p in result["peers"]]))
    print(f"\n{provenance()}")


if __name__ == "__main__":
    main()
