"""Runs a scenario: plan, simulate, measure."""

import gc
import logging
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pyarrow as pa
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorStatus

from drake_quad.controller import MakeTracking
from drake_quad.diagram import StairClimb, Visualize, stair_climb_of
from drake_quad.errors import DrakeQuadError
from drake_quad.planning.plan_torques import SHARES
from drake_quad.precompile import kernels_for, precompiling
from drake_quad.preparation import Preparation, prepare
from drake_quad.run_files import RunResult, write_files, write_log
from drake_quad.run_log import Ground, make_table, state_names
from drake_quad.scenario import Scenario
from drake_quad.simulation_end import INTERRUPTED, at_goal, outcome_of, result_of
from drake_quad.simulation_replay import replay_plan

__all__ = [
    "Preparation",
    "Progress",
    "RunResult",
    "prepare",
    "run",
    "write_files",
    "write_log",
]

CHUNK = 0.25  # [s] simulated between looks at the clock and at Ctrl-C

# Told how far a run is: simulated time and what it is likely to come to [s].
Progress = Callable[[float, float], None]


def run(
    scenario: Scenario,
    *,
    source: str = "scenario",
    progress: Progress | None = None,
    stop: Callable[[], bool] = lambda: False,
    visualize: Visualize | None = None,
    tell: Callable[[str], None] | None = None,
    tracking: str | MakeTracking | None = None,
) -> RunResult:
    """Plans and simulates `scenario` (or replays its plan, if its mode is kinematic).

    Args:
        scenario: Loaded and checked.
        source: What to name as the file in errors.
        progress: Told how far the run is.
        stop: Asked now and then whether to stop (Ctrl-C).
        visualize: Adds viewers to the Diagram.
        tell: It is told in a line of what takes a while before the simulation begins.
        tracking: A controller of one's own, as of MakeController; the scenario's if None.

    Raises:
        InputError: If something in the scenario cannot be.
        PlanningError: If there is no plan on paper.
    """
    if scenario.simulation.mode == "kinematic":
        return replay_plan(prepare(scenario, source=source))
    kernels = kernels_for(scenario.controller.kind, scenario.estimator.kind)
    with precompiling(kernels, tell) as wait:
        prepared = prepare(scenario, source=source)
        wait()
    return _simulate(prepared, progress, stop, visualize, tracking)


def _simulate(
    p: Preparation,
    progress: Progress | None,
    stop: Callable[[], bool],
    visualize: Visualize | None,
    tracking: str | MakeTracking | None,
) -> RunResult:
    scenario = p.scenario
    climb = stair_climb_of(p, visualize=visualize, tracking=tracking)
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
                outcome, reason = outcome_of(status.FormatMessage())
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
        outcome, reason = at_goal(table, reason)
    return result_of(p, outcome, reason, table, simulated=float(context.get_time()), wall=wall)


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
