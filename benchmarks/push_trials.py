"""Pushes put into copies of one undisturbed run: the trials of `benchmarks.pushes`.

The undisturbed run is simulated once. At every moment its Context is copied, and each copy goes on
with a push of its own: the same states to the bit as a whole run with that push in its scenario.
"""

import gc
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    InitializeParams,
    Simulator,
    SimulatorStatus,
)
from pydrake.systems.framework import Context

from benchmarks.study import Result, finding
from drake_quad.common import FloatArray
from drake_quad.control.ports import GaitPhase, Mode, is_swinging
from drake_quad.errors import DrakeQuadError, InputError
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.scenario.build import disturbances_of
from drake_quad.scenario.config import PushConfig
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.prepare import PreparedScenario, prepare
from drake_quad.sweep.study import Base
from drake_quad.sweep.trials import Trial
from drake_quad.systems.disturbances import Push

VALUES = ("time", "duration", "speed", "direction_deg", "to_goal")  # of a trial
FIGURES = (
    "segment",
    "kind",
    "ground",
    "leg",
    "swing_phase",
    "simulated",
    "waited",
    "base_error_max",
)
NEVER = 1e6  # [s] when the push of the undisturbed run would begin
LOOK = 0.05  # [s] simulated between looks at a trial
BACK = 0.05  # [m] of the base from where the controller wants it: back in the gait
AT_GOAL = 0.1  # [m], [rad] farthest from the end of the plan that counts as there
PATIENCE = 30.0  # [s] beyond the tail in which a trial may still come back
# Between two of the plant's steps nothing changes. Whether an advance to a step's own time has done
# that step would hang on rounding, so runs are stopped half a step before it.
BEFORE = 0.5
NO_LOG = "simulation.log_period=1.0"  # the log is not read, and would be copied with the Context
ASLANT = 0.03  # [m] between front and rear feet's mean heights: on stairs

Given = dict[str, Any]  # a push, by the names of VALUES


def prepare_undisturbed(base: Base, overrides: Sequence[str]) -> PreparedScenario:
    """The run to be pushed, with room for one push.

    Raises:
        InputError: If the scenario has pushes of its own, or a plant without time steps.
        PlanningError: If there is no plan on paper.
    """
    p = prepare(base.load([*overrides, NO_LOG]), source=base.name)
    if p.disturbances.pushes:
        raise InputError(
            source=base.name,
            field="disturbances.pushes",
            value=f"{len(p.disturbances.pushes)} pushes",
            remedy="the study makes them: give --set 'disturbances.pushes=[]'",
        )
    if p.scenario.simulation.plant.time_step <= 0.0:
        raise InputError(
            source=base.name,
            field="simulation.plant.time_step",
            value=p.scenario.simulation.plant.time_step,
            remedy="the study pushes for whole steps: give more than 0",
        )
    never = Push(time=NEVER, duration=0.1, force_H=(0.0, 0.0, 0.0), body=p.robot.trunk)
    return replace(p, disturbances=replace(p.disturbances, pushes=(never,)))


class PushBench:
    """The undisturbed run, as far as it is, and the trials that branch off there."""

    def __init__(self, base: Base, overrides: Sequence[str]) -> None:
        """Prepares the run; nothing is simulated yet."""
        self._p = prepare_undisturbed(base, overrides)
        self._climb = stair_climb_of(self._p)
        self._dt = float(self._p.scenario.simulation.plant.time_step)
        diagram = self._climb.diagram
        self._controller = diagram.GetSubsystemByName("controller")
        self._source = diagram.GetSubsystemByName("push_source")
        self._run, self._branch = Simulator(diagram), Simulator(diagram)
        for simulator in (self._run, self._branch):
            ApplySimulatorConfig(self._p.scenario.simulation.simulator, simulator)
        self._run.Initialize()
        self._step = 0  # of the plant, at which the undisturbed run is
        self._ended = ""  # why it ended, if it did
        gc.collect()
        gc.freeze()  # what is there now stays: the collector need not look at it at every tick

    def try_push(self, push: Given, *, tail: float) -> Result:
        """Pushes the robot and sees what comes of it.

        Args:
            push: `time` [s], not before that of the trial before, `duration` [s], `speed` [m/s],
                `direction_deg` relative to the heading, `to_goal`.
            tail: How long the run goes on after the push begins [s]; then until the clock runs and
                the base is back, at most PATIENCE longer. With `to_goal` to the end of the run.

        Returns:
            `outcome` (ok, goal_reached, fell, stopped), `reason`, and what there is to say of the
            moment and of what followed.
        """
        self._go_to(round(push["time"] / self._dt))
        if self._ended:
            return {"outcome": "stopped", "reason": f"ended without a push: {self._ended}"}
        return {**self._moment(), **self._follow(push, tail)}

    def state(self) -> FloatArray:
        """[q; v] of the robot where the trial tried last is now."""
        plant, context = self._climb.plant, self._branch.get_context()
        return np.array(plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(context)))

    def _go_to(self, step: int) -> None:
        """Lets the undisturbed run go on to the plant's step `step`."""
        if step < self._step:
            raise ValueError(f"step {step} is before {self._step}, where the run is")
        if step > self._step and not self._ended:
            status = self._run.AdvanceTo((step - BEFORE) * self._dt)
            self._step = step
            if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                self._ended = _message(status)

    def _follow(self, push: Given, tail: float) -> Result:
        simulator = self._branch
        simulator.reset_context(self._run.get_context().Clone())
        # The initialization events would make the planner begin anew.
        simulator.Initialize(InitializeParams(suppress_initialization_events=True))
        context = simulator.get_mutable_context()
        now, begun = self._step, self._step * self._dt
        waited = float(self._phase(context)[GaitPhase.WAITED])
        self._set_force(context, self._force(push))
        pushed = now + max(1, round(push["duration"] / self._dt))
        look = max(1, round(LOOK / self._dt))
        limit = 2.0 * self._p.plan.duration + 30.0
        reason = f"not at the goal after {limit:.0f} s"
        if not push["to_goal"]:
            limit = begun + tail + PATIENCE
            reason = f"not back in the gait {tail + PATIENCE:.0f} s after the push"
        outcome, worst, last = "", 0.0, round(limit / self._dt)
        while not outcome and now < last:
            to = min(now + look, last)
            now = min(to, pushed) if now < pushed else to
            try:
                status = simulator.AdvanceTo((now - BEFORE) * self._dt)
            except DrakeQuadError as error:  # no way back to the plan: such a run stops, too
                outcome, reason = "stopped", str(error)
                break
            if now == pushed:
                self._set_force(context, np.zeros(3))
            off, tilt = self._base_error(context)
            worst = max(worst, off)
            if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                outcome, reason = _ending(_message(status), off, tilt)
            elif not push["to_goal"] and now * self._dt >= begun + tail - 1e-9:
                running = int(self._phase(context)[GaitPhase.MODE]) == Mode.RUN
                if running and off < BACK:
                    outcome, reason = "ok", "back in the gait"
        return {
            "outcome": outcome or "stopped",
            "reason": reason,
            "simulated": round(float(context.get_time()) - begun, 6),
            "waited": float(self._phase(context)[GaitPhase.WAITED]) - waited,
            "base_error_max": worst,
        }

    def _moment(self) -> Result:
        """What the undisturbed run is doing."""
        mine = self._controller.GetMyContextFromRoot(self._run.get_context())
        phase = self._controller.GetOutputPort("gait_phase").Eval(mine)
        plan: MotionPlan = self._controller.GetOutputPort("motion_plan").Eval(mine)
        segment = plan.segments[int(phase[GaitPhase.SEGMENT])]
        feet = self._controller.GetOutputPort("feet_desired").Eval(mine).reshape(4, 3)
        slant = float(np.mean(feet[:2, 2]) - np.mean(feet[2:, 2]))
        number = phase[[GaitPhase.SWING_LEG]]
        legs = [name for k, name in enumerate(SHORT_NAMES, 1) if is_swinging(number, k)[0]]
        return {
            "segment": segment.name,
            "kind": segment.kind,
            "ground": "level" if abs(slant) < ASLANT else "up" if slant > 0.0 else "down",
            "leg": " and ".join(legs),
            "swing_phase": float(phase[GaitPhase.SWING_PHASE]),
        }

    def _force(self, given: Given) -> FloatArray:
        """Of the push in W, (3,) [N], by the scenario's own reading of such a push."""
        p = self._p
        push = PushConfig(
            time=given["time"],
            duration=given["duration"],
            speed=given["speed"],
            direction_deg=given["direction_deg"],
        )
        pushed = replace(p.scenario.disturbances, pushes=[push])
        (made,) = disturbances_of(replace(p.scenario, disturbances=pushed), p.robot).pushes
        x, y, z = made.force_H
        R_WB = self._climb.layout.read(self._plant_state(self._run.get_context())).R_WB
        ahead_x, ahead_y = float(R_WB[0, 0]), float(R_WB[1, 0])
        length = (ahead_x**2 + ahead_y**2) ** 0.5
        c, s = ahead_x / length, ahead_y / length
        return np.array([c * x - s * y, s * x + c * y, z])

    def _set_force(self, context: Context, force: FloatArray) -> None:
        mine = self._source.GetMyMutableContextFromRoot(context)
        for state in range(2):  # the one push's, and the sum
            mine.SetDiscreteState(state, force)

    def _phase(self, context: Context) -> FloatArray:
        mine = self._controller.GetMyContextFromRoot(context)
        return np.asarray(self._controller.GetOutputPort("gait_phase").Eval(mine))

    def _plant_state(self, context: Context) -> FloatArray:
        plant = self._climb.plant
        return np.asarray(plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(context)))

    def _base_error(self, context: Context) -> tuple[float, float]:
        """Distance [m] and angle [rad] of the base from where the controller wants it.

        A controller that estimates its state is asked for its estimate: a drift is no push's doing.
        """
        mine = self._controller.GetMyContextFromRoot(context)
        x = self._plant_state(context)
        if self._controller.HasOutputPort("robot_state_estimated"):
            x = self._controller.GetOutputPort("robot_state_estimated").Eval(mine)
        base = self._climb.layout.read(x)
        wanted = self._controller.GetOutputPort("body_desired").Eval(mine)
        cosine = 0.5 * (float(np.trace(rotations(wanted).T @ base.R_WB)) - 1.0)
        return float(np.linalg.norm(base.p_WB - wanted[:3])), math.acos(min(1.0, max(-1.0, cosine)))


@cache
def bench(base: Base, overrides: tuple[str, ...]) -> PushBench:
    """This process's bench, built at its first trial."""
    return PushBench(base, overrides)


def work(trial: Trial, *, tail: float) -> Result:
    """One trial, in a worker process; its trials come in the order of their times."""
    push = dict(zip(VALUES, trial.values, strict=True))
    return finding(trial, bench(trial.base, trial.overrides).try_push(push, tail=tail))


def _message(status: SimulatorStatus) -> str:
    found = re.search(r'message: "(.*)"', status.FormatMessage(), re.DOTALL)
    return found.group(1) if found else status.FormatMessage()


def _ending(message: str, off: float, tilt: float) -> tuple[str, str]:
    """Outcome and reason of a run that ended itself, the base `off` [m] and `tilt` [rad]."""
    if message == "goal_reached":
        if max(off, tilt) > AT_GOAL:
            return "stopped", f"the plan is at its end, but the base is {off:.2f} m off it"
        return "goal_reached", "the mission was carried out"
    outcome, _, reason = message.partition(": ")
    return (outcome, reason) if outcome in ("fell", "stopped") else ("stopped", message)
