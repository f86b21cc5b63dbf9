"""Runs a scenario: plan, simulate, measure, and leave a run's files behind."""

import gc
import json
import logging
import platform
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorStatus

from drake_quad import __version__
from drake_quad.diagram import StairClimb, Visualize, stair_climb_of
from drake_quad.errors import DrakeQuadError
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.plan_torques import SHARES
from drake_quad.preparation import Preparation, prepare
from drake_quad.robot.load_robot import MakeModelPlant
from drake_quad.robot.robot_state import make_layout
from drake_quad.run_log import Ground, kinematic_logs, make_table, state_names
from drake_quad.scenario import Scenario, save_scenario
from drake_quad.summary import base_error, push_figures, summarize
from drake_quad.whole_files import write_whole

__all__ = [
    "Preparation",
    "Progress",
    "RunResult",
    "prepare",
    "run",
    "write_files",
    "write_log",
]

AT_GOAL = 0.1  # [m], [rad]: farthest from the end of the plan that counts as there
INTERRUPTED = "interrupted"  # the reason of a run that a person ended
CHUNK = 0.25  # [s] simulated between looks at the clock and at Ctrl-C

# Told how far a run is: simulated time and what it is likely to come to [s].
Progress = Callable[[float, float], None]


@dataclass(eq=False)
class RunResult:
    """A finished (or ended) run.

    Attributes:
        outcome: `goal_reached`, `fell` or `stopped`.
        reason: What ended it, in a sentence.
        summary: What summary.json holds.
        table: What log.parquet holds.
        scenario: As it was run, in full.
    """

    outcome: str
    reason: str
    summary: dict[str, Any]
    table: pa.Table = field(repr=False)
    scenario: Scenario = field(repr=False)


def run(
    scenario: Scenario,
    *,
    source: str = "scenario",
    progress: Progress | None = None,
    stop: Callable[[], bool] = lambda: False,
    visualize: Visualize | None = None,
) -> RunResult:
    """Plans and simulates `scenario` (or replays its plan, if its mode is kinematic).

    Args:
        scenario: Loaded and checked.
        source: What to name as the file in errors.
        progress: Told how far the run is.
        stop: Asked now and then whether to stop (Ctrl-C).
        visualize: Adds viewers to the Diagram.

    Raises:
        InputError: If something in the scenario cannot be.
        PlanningError: If there is no plan on paper.
    """
    prepared = prepare(scenario, source=source)
    if scenario.simulation.mode == "kinematic":
        return _replay_plan(prepared)
    return _simulate(prepared, progress, stop, visualize)


def write_files(result: RunResult, scenario: Scenario, directory: Path) -> None:
    """Writes summary.json, log.parquet and scenario.yaml into `directory`.

    None of them is ever half.

    Raises:
        InputError: If they cannot be written, with the reason.
    """
    text = json.dumps(result.summary, indent=2) + "\n"
    write_whole(directory / "scenario.yaml", lambda p: save_scenario(scenario, p))
    write_whole(directory / "log.parquet", lambda p: write_log(result.table, p))
    write_whole(directory / "summary.json", lambda p: p.write_text(text))


def write_log(table: pa.Table, path: Path) -> None:
    """Writes a log as Parquet; floats byte by byte, which halves them."""
    floats = [f.name for f in table.schema if pa.types.is_floating(f.type)]
    others = [f.name for f in table.schema if f.name not in floats]
    pq.write_table(
        table, path, compression="zstd", use_dictionary=others, use_byte_stream_split=floats
    )


def _simulate(
    p: Preparation,
    progress: Progress | None,
    stop: Callable[[], bool],
    visualize: Visualize | None,
) -> RunResult:
    scenario = p.scenario
    climb = stair_climb_of(p, visualize=visualize)
    simulator = Simulator(climb.diagram)
    ApplySimulatorConfig(scenario.simulation.simulator, simulator)
    simulator.set_target_realtime_rate(scenario.simulation.realtime_rate)
    context = simulator.get_mutable_context()
    # Long enough for every wait that the scheduler has patience for.
    limit = 2.0 * p.plan.duration + 30.0
    begun = time.perf_counter()
    gc.collect()
    gc.freeze()  # what is there now stays: the collector need not look at it at every tick
    try:
        simulator.Initialize()
        outcome, reason = "stopped", f"not at the goal after {limit:.0f} s"
        while context.get_time() < limit:
            status = simulator.AdvanceTo(min(context.get_time() + CHUNK, limit))
            if progress is not None:
                progress(context.get_time(), p.plan.duration)
            if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                outcome, reason = _outcome(status.FormatMessage())
                break
            if stop():
                outcome, reason = "stopped", INTERRUPTED
                break
    except KeyboardInterrupt:
        outcome, reason = "stopped", INTERRUPTED
    except DrakeQuadError as error:
        outcome, reason = "stopped", str(error)
    except RuntimeError as error:  # Drake's own: a solver that gave up, a state that is not finite
        outcome, reason = "stopped", f"simulation failed: {str(error).splitlines()[0]}"
    except Exception as error:  # a fault of this program: what was logged is not lost to it
        outcome, reason = "stopped", f"simulation failed: {type(error).__name__}: {error}"
        logging.getLogger(__name__).exception("simulation failed")
    finally:
        gc.unfreeze()
    wall = time.perf_counter() - begun
    table = _collect(p, climb, context)
    if outcome == "goal_reached":
        outcome, reason = _at_goal(table, reason)
    figures = {
        "simulated_time": float(context.get_time()),
        "wall_time": wall,
        "real_time_factor": float(context.get_time()) / wall,
    }
    return RunResult(
        outcome, reason, _summary(p, outcome, reason, table, figures), table, p.scenario
    )


def _collect(p: Preparation, climb: StairClimb, context: Any) -> pa.Table:
    logs = {name: sink.FindLog(context) for name, sink in climb.loggers.items()}
    times = logs["state"].sample_times()
    planner = climb.diagram.GetSubsystemByName("controller").GetSubsystemByName(
        "transition_planner"
    )
    plans = planner.plans(planner.GetMyContextFromRoot(context))
    # Contact results exist once the plant has taken a step and the monitors have seen it.
    first = int(np.searchsorted(times, 2.5 * climb.monitor_period))
    count = min(log.num_samples() for log in logs.values())
    return make_table(
        p.robot,
        climb.layout,
        times=times[first:count],
        logs={name: log.data().T[first:count] for name, log in logs.items()},
        plans=plans,
        share=SHARES[p.scenario.controller.kind],
        ground=Ground(p.course, p.scenario.simulation.friction),
        state_names=state_names(climb.plant.GetPositionNames(), climb.plant.GetVelocityNames()),
    )


def _at_goal(table: pa.Table, reason: str) -> tuple[str, str]:
    """Whether the robot is where the plan ends: the gait clock alone does not decide."""
    if table.num_rows == 0:
        return "stopped", "the run is shorter than a sample of the log: nothing was measured"
    last = table.slice(table.num_rows - 1)
    names = table.column_names
    place, tilt = base_error({n: last[n].to_numpy(zero_copy_only=False) for n in names})
    if place[0] > AT_GOAL or tilt[0] > AT_GOAL:
        return "stopped", f"the plan is at its end, but the base is {place[0]:.2f} m off it"
    return "goal_reached", reason


def _replay_plan(p: Preparation) -> RunResult:
    begun = time.perf_counter()
    plant = MakeModelPlant(p.robot.url)
    layout = make_layout(plant, p.robot)
    plans: tuple[MotionPlan, ...] = p.plan.plans
    times, logs = kinematic_logs(
        p.robot,
        layout,
        plans,
        p.scenario.simulation.log_period,
        massless_legs=p.settings.uniform_body,
    )
    table = make_table(
        p.robot,
        layout,
        times=times,
        logs=logs,
        plans=plans,
        state_names=state_names(plant.GetPositionNames(), plant.GetVelocityNames()),
        massless_legs=p.settings.uniform_body,
        share=SHARES[p.scenario.controller.kind],
    )
    wall = time.perf_counter() - begun
    figures = {
        "simulated_time": float(times[-1]),
        "wall_time": wall,
        "real_time_factor": float(times[-1]) / wall,
    }
    reason = "kinematic replay of the plan: no physics, nothing measured"
    summary = _summary(p, "goal_reached", reason, table, figures)
    return RunResult("goal_reached", reason, summary, table, p.scenario)


def _summary(
    p: Preparation, outcome: str, reason: str, table: pa.Table, figures: dict[str, float]
) -> dict[str, Any]:
    # A replay of the plan is not pushed, whatever the scenario says.
    pushes = p.disturbances.pushes if p.scenario.simulation.mode == "physics" else ()
    failed = outcome != "goal_reached" and reason != INTERRUPTED
    return {
        "description": p.scenario.description,
        "outcome": outcome,
        "reason": reason,
        "simulation": p.scenario.simulation.mode,
        **figures,
        "planning_time": p.plan.planning_time,
        "margin_kind": p.settings.margin,
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


def _outcome(message: str) -> tuple[str, str]:
    """Outcome and reason from a termination's message: `goal_reached` or `<outcome>: <why>`."""
    found = re.search(r'message: "(.*)"', message, re.DOTALL)
    text = found.group(1) if found else message
    if text == "goal_reached":
        return text, "the mission was carried out"
    outcome, _, reason = text.partition(": ")
    return (outcome, reason) if outcome in ("fell", "stopped") else ("stopped", text)
