"""GaitScheduler: the gait clock and the mission."""

from math import hypot

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiscreteValues, EventStatus

from drake_quad.control.clock import SEGMENT, run_on
from drake_quad.control.margin_guard import guarded_rate
from drake_quad.control.ports import (
    BALANCE_SIZE,
    CATCH_SIZE,
    SIZE,
    Balance,
    Catch,
    GaitPhase,
    Mode,
)
from drake_quad.control.push_reflex import Reflex, balance_margin, calm, choose, disturbed
from drake_quad.control.settings import ControlSettings
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.contact_plan import Phase, Step
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.systems.clocked_system import ClockedSystem

GROUND_FOUND = 0.4  # of a catching step, before which contact is that of its lift-off
GIVE_UP = 0.6  # [s] after which a catching foot that finds no ground is waited for no longer
CALM_SPEED = 0.04  # [m/s] of the base against the plan, below which the clock goes on
CALM_PLACE = 0.03  # [m] from the plan, the same
VX, VY, BODY = Balance.VELOCITY_ERROR, Balance.VELOCITY_ERROR + 1, int(Balance.BODY)
LONGEST_SETTLING = 5.0  # [s] since the foot that caught a push set out
CALM_TIME = 0.3  # [s] for which the robot is to be calm before it goes on


class GaitScheduler(ClockedSystem):
    """Runs the gait clock through one task after another.

    The clock waits at a touchdown until the foot is sensed to bear, and at a lift-off until the
    other three feet bear and hold the centre of mass with `lift_off_margin`; for at most
    `patience`, after which it stops the run and says why. With a `margin_demanded` it slows down,
    and stands, before the margin on the feet that stand falls below that.

    When a push would tip the robot over the feet that stand, the clock stops, the swing foot (or
    another) is put down where it holds the robot, and once that is calm the plan is made anew from
    the feet as they stand.

    Input ports:
        motion_plan: The MotionPlan of the task under way (abstract).
        contact_state_measured: (4,) 1 where a foot bears.
        balance_estimated: See Balance.
    Output ports:
        gait_phase: See GaitPhase.
        contact_state_desired: (4,) 1 where a foot is to stand.
        catch: See Catch.
    """

    def __init__(
        self,
        *,
        num_tasks: int,
        control: ControlSettings,
        reflex: Reflex | None = None,
        may_pause: bool = False,
    ) -> None:
        super().__init__()
        self.set_name("gait_scheduler")
        self._num_tasks, self._control, self._reflex = num_tasks, control, reflex
        self._may_pause = may_pause
        self._period = control.period
        self._plan_port = self.DeclareAbstractInputPort("motion_plan", AbstractValue.Make(object()))
        self._contact_port = self.DeclareVectorInputPort("contact_state_measured", 4)
        self._balance_port = self.DeclareVectorInputPort("balance_estimated", BALANCE_SIZE)
        phase = self.DeclareDiscreteState(SIZE)
        self._standing = self.DeclareDiscreteState(np.ones(4))
        self._catch = self.DeclareDiscreteState(CATCH_SIZE)
        self._waiting = self.DeclareDiscreteState(1)  # how long at this switch, or to be calm [s]
        self._shaken = self.DeclareDiscreteState(1)  # how long for the robot to come back [s]
        self.DeclareStateOutputPort("gait_phase", phase)
        self._phase = int(phase)
        self.DeclareStateOutputPort("contact_state_desired", self._standing)
        self.DeclareStateOutputPort("catch", self._catch)
        # Offset 0, as everywhere: k T and T + k T round apart, and the order of ticks would vary.
        self.DeclarePeriodicDiscreteUpdateEvent(self._period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        plan: MotionPlan = self._plan_port.Eval(context)
        # `state` begins as a copy of the Context's values. Most ticks end here.
        values = state.get_mutable_value(self._phase)
        segment = min(int(values[SEGMENT]), len(plan.segments) - 1)  # perhaps of the plan before
        until = plan.segments[segment].end
        balance = self._balance_port.Eval(context)
        guarded = self._control.margin_demanded > 0.0
        if not guarded and run_on(
            values, plan.phases, plan.index, until, self._period, balance, self._control.push_speed
        ):
            return EventStatus.Succeeded()
        phase = values.tolist()
        task, mode = int(phase[GaitPhase.TASK]), int(phase[GaitPhase.MODE])
        phase[GaitPhase.RATE] = 0.0
        if plan.index != task:  # the planner has not yet answered for this task
            state.set_value(self._phase, phase)
            return EventStatus.Succeeded()
        if mode == Mode.RUN:
            if self._reflex is not None and self._begin_catch(context, state, plan, phase):
                return EventStatus.Succeeded()
            return self._run(context, state, plan, phase)
        phase[GaitPhase.WAITED] += self._period
        if mode == Mode.REPLAN:
            if plan.revision == int(phase[GaitPhase.REVISION]):
                phase[GaitPhase.MODE], phase[GaitPhase.TIME] = float(Mode.RUN), 0.0
            state.set_value(self._phase, phase)
            return EventStatus.Succeeded()
        return self._recover(context, state, phase)

    def _run(
        self, context: Context, state: DiscreteValues, plan: MotionPlan, phase: list[float]
    ) -> EventStatus:
        """Lets the clock go on, or wait."""
        task, t = int(phase[GaitPhase.TASK]), phase[GaitPhase.TIME]
        waiting = float(context.get_discrete_state(self._waiting).value()[0])
        shaken = float(context.get_discrete_state(self._shaken).value()[0])
        if self._is_shaken(context, plan, t, shaken):
            phase[GaitPhase.WAITED] += self._period
            state.set_value(self._shaken, [shaken + self._period])
            state.set_value(self._phase, phase)
            return EventStatus.Succeeded()
        if 0.0 < shaken <= self._control.patience:  # it has come back
            state.set_value(self._shaken, [0.0])
        rate, reason = 1.0, self._must_wait(context, plan, t)
        if self._control.margin_demanded > 0.0 and not reason:
            rate, reason = self._guard(context, plan, t)
        if reason:
            waiting += self._period
            phase[GaitPhase.WAITED] += self._period
            state.set_value(self._waiting, [waiting])
            state.set_value(self._phase, phase)
            if waiting > self._control.patience:
                return EventStatus.ReachedTermination(
                    self,
                    f"stopped: the gait clock waited {self._control.patience} s: {reason}",
                )
            return EventStatus.Succeeded()

        t += rate * self._period
        phase[GaitPhase.RATE] = rate
        if t >= plan.duration - 1e-9:
            if task + 1 < self._num_tasks:
                phase[GaitPhase.TASK] = task + 1
                phase[GaitPhase.REVISION] = 0.0
                t = 0.0
                phase[GaitPhase.SEGMENT] = phase[GaitPhase.SWING_LEG] = 0.0
                phase[GaitPhase.SWING_PHASE] = 0.0
            else:
                t = plan.duration
                phase[GaitPhase.DONE] = 1.0
        phase[GaitPhase.TIME] = t
        if int(phase[GaitPhase.TASK]) == task:
            current = plan.contacts.phase(t)
            step = current.step
            phase[GaitPhase.SEGMENT] = plan.segment_index(t)
            phase[GaitPhase.SWING_LEG] = 0 if step is None else int(step.leg)
            phase[GaitPhase.SWING_PHASE] = (
                0.0 if step is None else (t - current.start) / (current.end - current.start)
            )
            state.set_value(self._standing, current.standing.astype(float))
        state.set_value(self._phase, phase)
        if waiting:
            state.set_value(self._waiting, [0.0])
        if shaken:
            state.set_value(self._shaken, [0.0])
        if phase[GaitPhase.DONE]:
            return EventStatus.ReachedTermination(self, "goal_reached")
        return EventStatus.Succeeded()

    def _is_shaken(self, context: Context, plan: MotionPlan, t: float, shaken: float) -> bool:
        """Whether the robot is too far from its plan for that to go on, after a push.

        It comes back to a plan that stands still without swinging past it. A plan that is balanced
        by its motion alone cannot stand still. For `patience` at most, which is not that of the
        switches: there it begins anew.
        """
        if not self._may_pause or shaken > self._control.patience:
            return False
        balance = self._balance_port.Eval(context)
        speed = hypot(balance[VX], balance[VY])
        if shaken == 0.0:
            return speed > self._control.push_speed
        if speed > CALM_SPEED:
            return True
        wanted = plan.body.sample(t)[0]
        return hypot(balance[BODY] - wanted[0], balance[BODY + 1] - wanted[1]) > CALM_PLACE

    def _guard(self, context: Context, plan: MotionPlan, t: float) -> tuple[float, str]:
        """The rate that the margin demanded leaves; and, if none, why."""
        balance, demanded = self._balance_port.Eval(context), self._control.margin_demanded
        rate = guarded_rate(plan, t, balance, plan.contacts.phase(t).standing, demanded)
        return rate, "" if rate > 0.0 else f"beyond here the margin falls below {demanded:.3f} m"

    def _must_wait(self, context: Context, plan: MotionPlan, t: float) -> str:
        """Why the clock may not go on past the switch that the next tick would cross, if so."""
        now = plan.contacts.phase_index(t)
        after = plan.contacts.phase_index(t + self._period)
        if now == after:
            return ""
        bearing = self._contact_port.Eval(context) > 0.5
        ended: Phase = plan.contacts.phases[now]
        begun: Phase = plan.contacts.phases[after]
        if ended.step is not None and not bearing[ended.step.leg.row]:
            return f"leg {ended.step.leg.short} has not touched down"
        if begun.step is not None:
            leg = begun.step.leg
            others = np.arange(4) != leg.row
            if not np.all(bearing[others]):
                return f"leg {leg.short} is to lift off while another foot does not bear"
            balance = self._balance_port.Eval(context)
            margin = balance_margin(balance, others)
            if margin < max(self._control.lift_off_margin, self._control.margin_demanded):
                return f"without leg {leg.short} the margin is {margin:.3f} m"
        return ""

    def _begin_catch(
        self, context: Context, state: DiscreteValues, plan: MotionPlan, phase: list[float]
    ) -> bool:
        """Whether a push has to be caught; if so, begins to."""
        assert self._reflex is not None
        balance = self._balance_port.Eval(context)
        bearing = self._contact_port.Eval(context)
        current = plan.contacts.phase(phase[GaitPhase.TIME])
        if not disturbed(self._reflex, balance, bearing, current.standing):
            return False
        self._catch_with(state, phase, balance, current.standing, current.step)
        return True

    def _catch_with(
        self,
        state: DiscreteValues,
        phase: list[float],
        balance: FloatArray,
        standing: BoolArray,
        step: Step | None,
    ) -> None:
        assert self._reflex is not None
        catch = choose(self._reflex, balance, standing, step)
        state.set_value(self._catch, catch)
        phase[GaitPhase.MODE] = float(Mode.CATCH if catch[Catch.LEG] else Mode.SETTLE)
        phase[GaitPhase.RATE] = 0.0
        desired = np.ones(4)
        if catch[Catch.LEG]:
            desired[int(catch[Catch.LEG]) - 1] = 0.0
        state.set_value(self._standing, desired)
        state.set_value(self._waiting, [0.0])
        state.set_value(self._phase, phase)

    def _recover(self, context: Context, state: DiscreteValues, phase: list[float]) -> EventStatus:
        """Puts the catching foot down, then waits until the robot is calm."""
        assert self._reflex is not None
        balance = self._balance_port.Eval(context)
        bearing = self._contact_port.Eval(context)
        catch = context.get_discrete_state(self._catch).value().tolist()
        waiting = float(context.get_discrete_state(self._waiting).value()[0])
        if catch[Catch.LEG]:
            catch[Catch.ELAPSED] += self._period
            elapsed = catch[Catch.ELAPSED] / catch[Catch.DURATION]
            landed = bearing[int(catch[Catch.LEG]) - 1] > 0.5 and elapsed > GROUND_FOUND
            if landed or catch[Catch.ELAPSED] > catch[Catch.DURATION] + GIVE_UP:
                catch[Catch.LEG] = 0.0
                phase[GaitPhase.MODE] = float(Mode.SETTLE)
                state.set_value(self._standing, np.ones(4))
            state.set_value(self._catch, catch)
            state.set_value(self._phase, phase)
            return EventStatus.Succeeded()
        everyone = np.ones(4, dtype=bool)
        if disturbed(self._reflex, balance, bearing, everyone):
            self._catch_with(state, phase, balance, everyone, None)
            if phase[GaitPhase.MODE] == Mode.CATCH:
                return EventStatus.Succeeded()
        waiting = waiting + self._period if calm(balance, bearing) else 0.0
        catch[Catch.ELAPSED] += self._period
        state.set_value(self._catch, catch)
        # One that never comes quite to rest, a foot in the air perhaps, is to go on all the same.
        if waiting > CALM_TIME or catch[Catch.ELAPSED] > LONGEST_SETTLING:
            waiting = 0.0
            phase[GaitPhase.MODE] = float(Mode.REPLAN)
            phase[GaitPhase.REVISION] += 1.0
        state.set_value(self._waiting, [waiting])
        state.set_value(self._phase, phase)
        return EventStatus.Succeeded()
