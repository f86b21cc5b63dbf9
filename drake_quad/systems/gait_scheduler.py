"""GaitScheduler: the gait clock and the mission."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_quad.planning.contact_plan import Phase
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.systems.gait_phase import SIZE, GaitPhase


class GaitScheduler(LeafSystem):
    """Runs the gait clock through one task after another.

    The clock waits at a touchdown until the foot is sensed to bear, and at a lift-off until the
    other three feet bear and hold the centre of mass with `lift_off_margin`; for at most
    `patience`, after which it stops the run and says why.

    Input ports:
        motion_plan: The MotionPlan of the task under way (abstract).
        contact_state_measured: (4,) 1 where a foot bears.
        lift_off_margin: (4,) static margin if that leg were lifted now [m].
    Output ports:
        gait_phase: See GaitPhase.
        contact_state_desired: (4,) 1 where a foot is to stand.
    """

    def __init__(
        self,
        *,
        num_tasks: int,
        period: float = 0.005,
        lift_off_margin: float = 0.02,
        patience: float = 2.0,
    ) -> None:
        super().__init__()
        self.set_name("gait_scheduler")
        self._num_tasks = num_tasks
        self._period = period
        self._margin = lift_off_margin
        self._patience = patience
        self._plan_port = self.DeclareAbstractInputPort("motion_plan", AbstractValue.Make(object()))
        self._contact_port = self.DeclareVectorInputPort("contact_state_measured", 4)
        self._margin_port = self.DeclareVectorInputPort("lift_off_margin", 4)
        self._phase = self.DeclareDiscreteState(SIZE)
        self._standing = self.DeclareDiscreteState(np.ones(4))
        self._waiting = self.DeclareDiscreteState(1)  # how long at this switch [s]
        self.DeclareStateOutputPort("gait_phase", self._phase)
        self.DeclareStateOutputPort("contact_state_desired", self._standing)
        # Offset 0, as everywhere: k T and T + k T round apart, and the order of ticks would vary.
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        phase = context.get_discrete_state(self._phase).value().tolist()
        waiting = float(context.get_discrete_state(self._waiting).value()[0])
        plan: MotionPlan = self._plan_port.Eval(context)
        task = int(phase[GaitPhase.TASK])
        phase[GaitPhase.RATE] = 0.0
        if plan.index != task:  # the planner has not yet answered for this task
            state.set_value(self._phase, phase)
            return EventStatus.Succeeded()

        t = phase[GaitPhase.TIME]
        reason = self._must_wait(context, plan, t)
        if reason:
            waiting += self._period
            phase[GaitPhase.WAITED] += self._period
            state.set_value(self._waiting, [waiting])
            state.set_value(self._phase, phase)
            if waiting > self._patience:
                return EventStatus.ReachedTermination(
                    self, f"stopped: the gait clock waited {self._patience} s: {reason}"
                )
            return EventStatus.Succeeded()

        t += self._period
        phase[GaitPhase.RATE] = 1.0
        if t >= plan.duration - 1e-9:
            if task + 1 < self._num_tasks:
                phase[GaitPhase.TASK] = task + 1
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
        if phase[GaitPhase.DONE]:
            return EventStatus.ReachedTermination(self, "goal_reached")
        return EventStatus.Succeeded()

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
            margin = float(self._margin_port.Eval(context)[leg.row])
            if margin < self._margin:
                return f"without leg {leg.short} the margin is {margin:.3f} m"
        return ""
