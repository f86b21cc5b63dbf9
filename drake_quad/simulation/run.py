"""Runs or replays a scenario: outcome, log and summary."""

import logging
import platform
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorStatus
from pydrake.systems.framework import Context

from drake_quad import __version__
from drake_quad.common import FloatArray
from drake_quad.errors import DrakeQuadError, InputError
from drake_quad.perception.sight import with_reason
from drake_quad.planning.contact_forces import SHARES
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.stance_margin import slopes_of
from drake_quad.robot.doubts import all_doubts
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import contact_friction
from drake_quad.robot.state import make_layout
from drake_quad.runs.event_metrics import push_figures
from drake_quad.runs.log import log_table, state_names
from drake_quad.runs.metrics import summarize
from drake_quad.runs.planned_columns import Ground
from drake_quad.runs.pose_metrics import base_error
from drake_quad.runs.result import RunResult
from drake_quad.runs.seen import record_sight, seen_figures
from drake_quad.runs.tracking import tracking_figures
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import checked_copy, load_scenario
from drake_quad.simulation.belief_proof import hold_against, prove_believed, stretches_of
from drake_quad.simulation.diagram import StairClimb, Visualize, stair_climb_of
from drake_quad.simulation.kinematic_replay import find_touches, kinematic_logs
from drake_quad.simulation.plan_report import tolerances_of
from drake_quad.simulation.precompile import kernels_for, precompiling
from drake_quad.simulation.prepare import PreparedScenario, prepare
from drake_quad.stability.safety import judge_safety, safe_margin
from drake_quad.systems.controller import MakeTracking
from drake_quad.systems.map_keeper import MapKeeper
from drake_quad.systems.transition_planner import TransitionPlanner
from drake_quad.util.collector import frozen_objects

AT_GOAL = 0.1  # [m], [rad]: farthest from the end of the plan that counts as there
INTERRUPTED = "interrupted"  # the reason of a run that a person ended


def result_of(
    p: PreparedScenario,
    outcome: str,
    reason: str,
    table: pa.Table,
    plans: Sequence[MotionPlan],
    *,
    simulated: float,
    wall: float,
    measured: bool = True,
) -> RunResult:
    """The result of a run with its summary.

    Args:
        p: Scenario that was run.
        outcome: `goal_reached`, `fell` or `stopped`.
        reason: Reason of its end.
        table: Log of the run.
        plans: The plans that were followed, and their revisions.
        simulated: Time that was simulated [s].
        wall: Time that the run took [s].
        measured: Whether the log is of physics, so that it can be held against proofs.
    """
    # A replay of the plan is not pushed, whatever the scenario says.
    pushes = p.disturbances.pushes if p.scenario.simulation.mode == "physics" else ()
    failed = outcome != "goal_reached" and reason != INTERRUPTED
    period = p.scenario.controller.period if p.scenario.simulation.mode == "physics" else 0.0
    seen, proven = None, p.plan.plans
    if p.sight is not None:
        measurements = table if measured else table.slice(0, 0)
        proofs = hold_against(prove_believed(p, plans), p, plans, measurements, period=period)
        seen = record_sight(p.sight, p.world, p.revisions, proofs)
        # Of plans on a map that has changed on the way there is a proof of its own.
        proven = (*proven, *(plan for one in stretches_of(p, plans) for plan in one.plans))
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
        **summarize(table, p.robot, mass=p.disturbances.mass_of(p.robot.mass)),
        "tracking": tracking_figures(
            table,
            p.robot,
            tolerances_of(p.scenario.certify.tolerances, p.robot),
            plans,
            proven,
            period,
        ),
        "seen": None if seen is None else seen_figures(seen.told),
        "pushes": push_figures(table, pushes, failed=failed),
        "seed": p.scenario.simulation.seed,
        "robot": {"name": p.robot.name, "digest": p.robot_digest},
        "versions": {
            "drake_quad": __version__,
            "drake": version("drake"),
            "numpy": np.__version__,
            "python": platform.python_version(),
        },
    }
    estimate = summary.get("estimate")  # a run that ends at once has none
    if estimate is not None and estimate["landmarks_seen"] == 0:
        summary["assumes"] += ". It saw none of them: is there a flight ahead, and in its view?"
    wanted = safe_margin(p.robot)
    safety = judge_safety(summary, wanted)
    summary["safety"] = {
        "safe": safety.safe, "margin_wanted": wanted, "lacks": list(safety.lacks)
    }  # fmt: skip
    return RunResult(outcome, reason, summary, table, p.scenario, seen)


def _friction(p: PreparedScenario) -> float | None:
    """The coefficient between feet and ground, of the least foot; None of a replay."""
    if p.scenario.simulation.mode != "physics":
        return None
    return float(contact_friction(p.robot, p.scenario.simulation.friction).min())


def assumptions_of(scenario: Scenario) -> str:
    """What a run's figures take for granted, in a line for people."""
    if scenario.simulation.mode == "kinematic":
        return "that the robot is where its plan has it: nothing was measured"
    flags = "ideal drives, contact flags without error"
    if scenario.sensors.contacts == "joints":
        flags = "ideal drives and joints without friction, which feel the feet's contacts"
    if scenario.sensors.ground_normal == "feet":
        flags += ", feet that feel the ground's tilt without error"
    if scenario.perception.map == "seen":
        flags = f"a start whose place is known, a level landing that is told, {flags}"
    elif not any(value for name, value in vars(scenario.world).items() if name != "random"):
        flags = f"an exact map, {flags}"
    if scenario.estimator.kind == "truth":
        return f"{flags}, and a controller that is told the robot's true state"
    told = f"{flags}; the controller estimates its state from its sensors"
    if scenario.estimator.landmarks == "stairs":
        told += ", and corrects its place by the flights of the map, which a depth camera sees"
    return told


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


LISTED = 10  # overlaps that a summary holds


def replay_plan(p: PreparedScenario) -> RunResult:
    """The plan of what was prepared, sampled as a run is logged."""
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
    touches = find_touches(p.robot, p.course, times, logs["state"])
    logs["nonfoot"][:, 0], logs["nonfoot_depth"] = touches.count, touches.depth[:, None]
    logs["foot_depth"] = touches.foot_depth
    table = log_table(
        p.robot,
        layout,
        times=times,
        logs=logs,
        plans=plans,
        state_names=state_names(plant.GetPositionNames(), plant.GetVelocityNames()),
        massless_legs=p.settings.uniform_body,
        share=SHARES[p.scenario.controller.kind],
        slopes=slopes_of(p.course, p.settings.friction),
    )
    wall = time.perf_counter() - begun
    outcome = "goal_reached"
    reason = "kinematic replay of the plan: no physics, nothing measured"
    if p.sight is not None and p.sight.refused:
        outcome, reason = "stopped", p.sight.refused
    elif p.growth is not None and p.growth.looks_again:
        outcome, reason = "stopped", "a kinematic replay does not look again from a tread"
    end = float(times[-1])
    result = result_of(p, outcome, reason, table, plans, simulated=end, wall=wall, measured=False)
    result.summary["overlaps"] = list(touches.deepest[:LISTED])
    return result


CHUNK = 0.25  # [s] simulated between looks at the clock and at Ctrl-C

# Called with the simulated time and the time that it is likely to come to [s].
Progress = Callable[[float, float], None]


def simulate(
    scenario: Scenario | PreparedScenario | str | Path,
    *,
    source: str = "scenario",
    progress: Progress | None = None,
    stop: Callable[[], bool] = lambda: False,
    visualize: Visualize | None = None,
    tell: Callable[[str], None] | None = None,
    tracking: str | MakeTracking | None = None,
) -> RunResult:
    """Plans a scenario and simulates it (or replays its plan, if its mode is kinematic).

    Args:
        scenario: A scenario, a shipped one's name or a file; or what `plan` returned.
        source: Name of the file, for errors.
        progress: Called with the simulated time and the time that it is likely to come to [s].
        stop: Called now and then; the run stops where it returns true (Ctrl-C).
        visualize: Function that adds viewers to the Diagram.
        tell: Called with a line about what takes a while before the simulation begins, and with
            one for each thing in the robot's file that may be wrong.
        tracking: Controller of one's own, as for MakeController; the scenario's if None.

    Raises:
        InputError: If something in the scenario cannot be.
        PlanningError: If there is no plan on paper.
    """
    planned = scenario if isinstance(scenario, PreparedScenario) else None
    if not isinstance(scenario, (Scenario, PreparedScenario)):
        scenario, source = load_scenario(scenario), str(scenario)
    given = scenario.scenario if isinstance(scenario, PreparedScenario) else scenario
    checked = checked_copy(given, source=source)  # also of a plan's, which its run is saved with
    if planned is None:
        given = checked
    kinematic = given.simulation.mode == "kinematic"
    if kinematic and tracking is not None:
        raise InputError(
            source=source,
            field="simulation.mode",
            value="kinematic",
            remedy="no controller is in a replay of the plan; leave `tracking` out, or take "
            "physics",
        )
    if kinematic:
        prepared = planned or prepare(given, source=source)
    else:
        parts = given.controller.kind, given.estimator.kind, given.sensors.contacts
        with precompiling(kernels_for(*parts), tell) as wait:
            prepared = planned or prepare(given, source=source)
            wait()
    if tell is not None:
        for doubt in all_doubts(prepared.robot):
            tell(f"doubtful in the robot's file: {doubt}")
    if kinematic:
        return replay_plan(prepared)
    return _simulate(prepared, progress, stop, visualize, tracking)


def _simulate(
    p: PreparedScenario,
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
    begun = time.perf_counter()
    with frozen_objects():
        try:
            simulator.Initialize()
            limit = _time_limit(p, climb, context)
            while context.get_time() < limit:
                limit = max(limit, _time_limit(p, climb, context))
                outcome, reason = "stopped", f"not at the goal after {limit:.0f} s"
                status = simulator.AdvanceTo(min(context.get_time() + CHUNK, limit))
                if progress is not None:
                    progress(context.get_time(), _planned_time(p, climb, context))
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
        except RuntimeError as error:  # Drake's: a solver gave up, or a state is not finite
            outcome, reason = "stopped", f"simulation failed: {str(error).splitlines()[0]}"
        except Exception as error:  # a fault of this program: what was logged is not lost to it
            outcome, reason = "stopped", f"simulation failed: {type(error).__name__}: {error}"
            logging.getLogger(__name__).exception("simulation failed")
    wall = time.perf_counter() - begun
    p = _as_it_grew(p, climb, context, reason)
    table = _collect(p, climb, context)
    if outcome == "goal_reached":
        outcome, reason = at_goal(table, reason)
    if outcome == "goal_reached" and p.sight is not None and p.sight.refused:
        outcome, reason = "stopped", p.sight.refused
    plans, end = _plans(climb, context), float(context.get_time())
    return result_of(p, outcome, reason, table, plans, simulated=end, wall=wall)


def _planned_time(p: PreparedScenario, climb: StairClimb, context: Context) -> float:
    """How long what is planned so far takes, if the gait clock never waits [s]."""
    if p.growth is None:
        return p.plan.duration
    made = sum(plan.duration for plan in _plans(climb, context) if plan.revision == 0)
    return made if p.growth.looks_again else max(p.plan.duration, made)


def _time_limit(p: PreparedScenario, climb: StairClimb, context: Context) -> float:
    """How long a run may take [s]: enough for every wait that the scheduler has patience for."""
    planned = max(p.plan.duration, _planned_time(p, climb, context))
    return 2.0 * planned + 30.0


def _plans(climb: StairClimb, context: Context) -> tuple[MotionPlan, ...]:
    """The plans of all tasks begun so far, and their revisions."""
    planner = _planner_of(climb)
    return planner.plans(planner.GetMyContextFromRoot(context))


def _planner_of(climb: StairClimb) -> TransitionPlanner:
    controller = climb.diagram.GetSubsystemByName("controller")
    planner: TransitionPlanner = controller.GetSubsystemByName("transition_planner")
    return planner


def _as_it_grew(
    p: PreparedScenario, climb: StairClimb, context: Context, reason: str
) -> PreparedScenario:
    """What was prepared, with the map as it is in the end, and how it came to that.

    Args:
        p: What was prepared.
        climb: The simulation.
        context: Its Context as the run has ended.
        reason: Why it ended.
    """
    if p.growth is None:
        return p
    keeper: MapKeeper = climb.diagram.GetSubsystemByName("map_keeper")
    planner = _planner_of(climb)
    mine = planner.GetMyContextFromRoot(context)
    planned_on, refused = planner.map_number(mine), planner.refused(mine)
    if refused:
        reason = f"the map of before stays, because the rest has no plan on this one: {refused}"
    revisions = with_reason(
        keeper.revisions(keeper.GetMyContextFromRoot(context)), planned_on, reason
    )
    known = revisions[planned_on if refused else -1].map
    course = known.course(foot_radius=p.robot.foot_radius)
    return replace(p, course=course, revisions=revisions)


def count_finite(states: FloatArray) -> int:
    """How many of the samples (N, n) come before the first that is not finite."""
    broken = np.flatnonzero(~np.isfinite(states).all(axis=1))
    return int(broken[0]) if len(broken) else len(states)


def _collect(p: PreparedScenario, climb: StairClimb, context: Any) -> pa.Table:
    logs = {name: sink.FindLog(context) for name, sink in climb.loggers.items()}
    times = logs["state"].sample_times()
    plans = _plans(climb, context)
    # Contact results exist once the plant has taken a step and the monitors have seen it.
    first = int(np.searchsorted(times, 2.5 * climb.sensing_period))
    count = count_finite(logs["state"].data().T)
    return log_table(
        p.robot,
        climb.layout,
        times=times[first:count],
        logs={name: log.data().T[first:count] for name, log in logs.items()},
        plans=plans,
        share=SHARES[p.scenario.controller.kind],
        slopes=slopes_of(p.course, p.settings.friction),
        ground=Ground(p.course, p.scenario.simulation.friction),
        state_names=state_names(climb.plant.GetPositionNames(), climb.plant.GetVelocityNames()),
    )
