"""GaitScheduler: the gait clock and the mission."""

from dataclasses import replace

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_quad.common import BoolArray, FloatArray
from drake_quad.control.gait_clock import (
    SEGMENT,
    advance_if_uneventful,
    begin_task,
    clock_rate,
    is_off_plan,
    set_clock,
)
from drake_quad.control.ports import BALANCE_SIZE, CATCH_SIZE, SIZE, Catch, GaitPhase, Mode
from drake_quad.control.push_recovery import Reflex, choose_swing_foot, has_settled, needs_recovery
from drake_quad.control.settings import ControlSettings
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.recovery_step import StepTargetMap
from drake_quad.terrain.course import Course

GROUND_FOUND = 0.4  # of a catching step, before which contact is that of its lift-off
GIVE_UP = 0.6  # [s] after which a catching foot that finds no ground is waited for no longer
LONGEST_SETTLING = 5.0  # [s] since the foot that caught a push set out
CALM_TIME = 0.3  # [s] for which the robot is to be calm before it goes on


class GaitScheduler(LeafSystem):
    """Runs the gait clock through one task after another.

    The clock waits at a touchdown until the foot is sensed to bear, and at a lift-off until the
    other three feet bear and hold the centre of mass with `lift_off_margin`; for at most
    `patience`, after which it stops the run and says why. With a `margin_demanded` it slows down,
    and stands, before the margin on the feet that stand falls below that.

    When a push would tip the robot over the feet that stand, the clock stops, the swing foot (or
    another) is put down where it holds the robot, and once that is calm the plan is made anew from
    the feet as they stand.

    A mission may be longer than what is known of it: where a plan says that it goes on, the clock
    begins the next task, and waits until that is planned.

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
        self._mapped: tuple[Course | None, Reflex] | None = None
        if reflex is not None:
            self._mapped = (None, reflex)
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
        push_speed, phases = self._control.push_speed, plan.tables.phases
        if not guarded and advance_if_uneventful(
            values, phases, plan.index, until, self._period, balance, push_speed
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
        return self._recover(context, state, self._reflex_on(plan), phase)

    def _run(
        self, context: Context, state: DiscreteValues, plan: MotionPlan, phase: list[float]
    ) -> EventStatus:
        """Lets the clock go on, or wait."""
        task, t = int(phase[GaitPhase.TASK]), phase[GaitPhase.TIME]
        waiting = float(context.get_discrete_state(self._waiting).value()[0])
        shaken = float(context.get_discrete_state(self._shaken).value()[0])
        balance = self._balance_port.Eval(context)
        # A plan that is balanced by its motion alone cannot stand still. For `patience` at most,
        # which is not that of the switches: there it begins anew.
        if (
            self._may_pause
            and shaken <= self._control.patience
            and is_off_plan(balance, since=shaken, push_speed=self._control.push_speed)
        ):
            phase[GaitPhase.WAITED] += self._period
            state.set_value(self._shaken, [shaken + self._period])
            state.set_value(self._phase, phase)
            return EventStatus.Succeeded()
        if 0.0 < shaken <= self._control.patience:  # it has come back
            state.set_value(self._shaken, [0.0])
        bearing = self._contact_port.Eval(context) > 0.5
        rate, reason = clock_rate(plan, t, bearing, balance, self._control)
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
        ended = t >= plan.duration - 1e-9
        if ended and (task + 1 < self._num_tasks or plan.goes_on):
            begin_task(phase, task + 1)
        else:
            set_clock(phase, plan, plan.duration if ended else t)
            phase[GaitPhase.DONE] = float(ended)
            standing = plan.contacts.phase(phase[GaitPhase.TIME]).standing
            state.set_value(self._standing, standing.astype(float))
        state.set_value(self._phase, phase)
        if waiting:
            state.set_value(self._waiting, [0.0])
        if shaken:
            state.set_value(self._shaken, [0.0])
        if phase[GaitPhase.DONE]:
            return EventStatus.ReachedTermination(self, "goal_reached")
        return EventStatus.Succeeded()

    def _begin_catch(
        self, context: Context, state: DiscreteValues, plan: MotionPlan, phase: list[float]
    ) -> bool:
        """Whether a push has to be caught; if so, begins to."""
        reflex = self._reflex_on(plan)
        balance = self._balance_port.Eval(context)
        bearing = self._contact_port.Eval(context)
        current = plan.contacts.phase(phase[GaitPhase.TIME])
        if not needs_recovery(reflex, balance, bearing, current.standing):
            return False
        self._catch_with(reflex, state, phase, balance, current.standing, current.steps)
        return True

    def _reflex_on(self, plan: MotionPlan) -> Reflex:
        """The reflex on the map that a plan was made on. It is kept, for it takes a while to make.

        What is kept follows from the plan, so that it is no state.
        """
        assert self._reflex is not None and self._mapped is not None
        if plan.course is not self._mapped[0]:
            ground = self._reflex.ground
            if plan.course is not None:
                ground = StepTargetMap(plan.course, ground.foot_radius)
            self._mapped = plan.course, replace(self._reflex, ground=ground)
        return self._mapped[1]

    def _catch_with(
        self,
        reflex: Reflex,
        state: DiscreteValues,
        phase: list[float],
        balance: FloatArray,
        standing: BoolArray,
        steps: tuple[Step, ...],
    ) -> None:
        catch = choose_swing_foot(reflex, balance, standing, steps)
        state.set_value(self._catch, catch)
        phase[GaitPhase.MODE] = float(Mode.CATCH if catch[Catch.LEG] else Mode.SETTLE)
        phase[GaitPhase.RATE] = 0.0
        desired = np.ones(4)
        if catch[Catch.LEG]:
            desired[int(catch[Catch.LEG]) - 1] = 0.0
        state.set_value(self._standing, desired)
        state.set_value(self._waiting, [0.0])
        state.set_value(self._phase, phase)

    def _recover(
        self, context: Context, state: DiscreteValues, reflex: Reflex, phase: list[float]
    ) -> EventStatus:
        """Puts the catching foot down, then waits until the robot is calm."""
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
        if needs_recovery(reflex, balance, bearing, everyone):
            self._catch_with(reflex, state, phase, balance, everyone, ())
            if phase[GaitPhase.MODE] == Mode.CATCH:
                return EventStatus.Succeeded()
        waiting = waiting + self._period if has_settled(balance, bearing) else 0.0
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
