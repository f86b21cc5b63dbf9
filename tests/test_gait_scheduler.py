"""The gait clock alone: it runs, waits for contact and margin, gives up in the end, and is done."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context
from rig import fix_inputs, flat_walk, read, stand_plan

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.systems.gait_phase import SIZE, GaitPhase
from drake_quad.systems.gait_scheduler import GaitScheduler

PERIOD = 0.005
PLENTY = np.full(4, 0.2)  # [m] of margin without each leg
ALL = np.ones(4)


class Clock:
    """A scheduler in a simulator of its own, with its inputs at hand."""

    def __init__(
        self, plan: MotionPlan | None = None, *, num_tasks: int = 1, patience: float = 2.0
    ) -> None:
        self.plan = plan or flat_walk()
        self.system = GaitScheduler(
            num_tasks=num_tasks, period=PERIOD, lift_off_margin=0.02, patience=patience
        )
        self.simulator = Simulator(self.system)
        self.context: Context = self.simulator.get_mutable_context()
        self.give(motion_plan=self.plan, contact_state_measured=ALL, lift_off_margin=PLENTY)

    def give(self, **inputs: object) -> None:
        """Sets inputs from now on."""
        fix_inputs(self.system, self.context, **inputs)

    def run(self, seconds: float) -> SimulatorStatus:
        """Lets simulated time pass."""
        return self.simulator.AdvanceTo(self.context.get_time() + seconds)

    def run_to(self, gait_time: float) -> None:
        """Runs until the gait clock shows `gait_time`, which it must within a little."""
        for _ in range(20000):
            if self.phase[GaitPhase.TIME] >= gait_time - 1e-9:
                return
            self.run(PERIOD)
        raise AssertionError(f"the clock stands at {self.phase[GaitPhase.TIME]}")

    @property
    def phase(self) -> FloatArray:
        """The `gait_phase` vector now."""
        return read(self.system, self.context, "gait_phase")


def first_step() -> Step:
    return flat_walk().contacts.steps[0]


def test_clock_runs_with_time_while_nothing_holds_it() -> None:
    """Gait time is simulated time, the rate is 1, and nothing is waited for."""
    clock = Clock()
    for t in (0.1, 1.0, 1.7):
        clock.run(t - clock.context.get_time())
        assert clock.phase[GaitPhase.TIME] == pytest.approx(t, abs=1e-9)
        assert clock.phase[GaitPhase.RATE] == 1.0
        assert clock.phase[GaitPhase.WAITED] == 0.0
    assert len(clock.phase) == SIZE


def test_phase_says_what_the_plan_says() -> None:
    """Segment, swing leg, its phase and who is to stand are the plan's at the gait time."""
    clock = Clock()
    seen = set()
    while clock.context.get_time() < 20.0:
        clock.run(0.37)
        phase, t = clock.phase, float(clock.phase[GaitPhase.TIME])
        sample = clock.plan.sample(t)
        assert phase[GaitPhase.SEGMENT] == clock.plan.segment_index(t)
        standing = read(clock.system, clock.context, "contact_state_desired")
        np.testing.assert_array_equal(standing, sample.standing)
        swinging = np.flatnonzero(~sample.standing)
        assert phase[GaitPhase.SWING_LEG] == (swinging[0] + 1 if len(swinging) else 0)
        expected = 0.0 if len(swinging) == 0 else sample.swing_phase
        assert phase[GaitPhase.SWING_PHASE] == pytest.approx(expected)
        seen.add(int(phase[GaitPhase.SWING_LEG]))
    assert len(seen) > 2


def test_clock_waits_for_a_foot_that_has_not_touched_down() -> None:
    """It stops short of the touchdown, says so by its rate, and goes on once the foot bears."""
    clock, step = Clock(), first_step()
    missing = ALL.copy()
    missing[step.leg.row] = 0.0
    clock.run_to(step.lift_off + 0.1)
    clock.give(contact_state_measured=missing)
    clock.run(step.touchdown - step.lift_off + 0.4)
    assert step.touchdown - PERIOD - 1e-6 <= clock.phase[GaitPhase.TIME] < step.touchdown
    assert clock.phase[GaitPhase.RATE] == 0.0 and clock.phase[GaitPhase.SWING_LEG] == step.leg
    assert clock.phase[GaitPhase.WAITED] == pytest.approx(0.5, abs=0.02)
    clock.give(contact_state_measured=ALL)
    clock.run(0.2)
    assert clock.phase[GaitPhase.TIME] == pytest.approx(step.touchdown + 0.2, abs=2 * PERIOD)
    assert clock.phase[GaitPhase.RATE] == 1.0 and clock.phase[GaitPhase.SWING_LEG] == 0


@pytest.mark.parametrize("what", ["margin", "another foot"])
def test_clock_waits_at_a_lift_off_that_is_not_safe(what: str) -> None:
    """Without margin, or while another foot does not bear, no foot is lifted."""
    clock, step = Clock(), first_step()
    row = step.leg.row
    if what == "margin":
        little = PLENTY.copy()
        little[row] = 0.019
        clock.give(lift_off_margin=little)
    else:
        others = ALL.copy()
        others[(row + 1) % 4] = 0.0
        clock.give(contact_state_measured=others)
    clock.run(step.lift_off + 0.5)
    assert step.lift_off - PERIOD - 1e-6 <= clock.phase[GaitPhase.TIME] < step.lift_off
    assert clock.phase[GaitPhase.SWING_LEG] == 0 and clock.phase[GaitPhase.RATE] == 0.0
    clock.give(lift_off_margin=PLENTY, contact_state_measured=ALL)
    clock.run(0.1)
    assert clock.phase[GaitPhase.SWING_LEG] == step.leg


def test_margins_of_other_legs_and_the_lifted_foots_contact_do_not_matter() -> None:
    """Only the leg that lifts off needs a margin, and that foot need not bear any more."""
    clock, step = Clock(), first_step()
    row = step.leg.row
    margins, contact = np.full(4, -1.0), ALL.copy()
    margins[row], contact[row] = 0.021, 0.0
    clock.give(lift_off_margin=margins, contact_state_measured=contact)
    clock.run(step.lift_off + 0.1)
    assert clock.phase[GaitPhase.SWING_LEG] == step.leg


def test_clock_gives_up_after_its_patience_and_says_why() -> None:
    """A foot that never touches down ends the run, with the leg's name in the reason."""
    clock, step = Clock(patience=0.3), first_step()
    clock.run_to(step.lift_off + 0.1)
    clock.give(contact_state_measured=np.zeros(4))
    status = clock.run(5.0)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    message = status.FormatMessage()
    assert "stopped" in message and f"leg {step.leg.short} has not touched down" in message
    assert clock.context.get_time() == pytest.approx(step.touchdown + 0.3, abs=0.03)


def test_patience_is_with_each_switch_anew() -> None:
    """Two waits that are each short enough do not add up to an end."""
    clock, step = Clock(patience=0.3), first_step()
    clock.give(lift_off_margin=np.zeros(4))
    clock.run(step.lift_off + 0.25)
    clock.give(lift_off_margin=PLENTY)
    clock.run_to(step.lift_off + 0.1)
    clock.give(contact_state_measured=np.zeros(4))
    status = clock.run(step.touchdown - step.lift_off + 0.1)
    assert status.succeeded()
    assert clock.phase[GaitPhase.WAITED] > 0.3


def test_last_task_done_is_the_goal_reached() -> None:
    """At the end of the last plan the run ends, with that as its reason."""
    clock = Clock(stand_plan(0.5))
    status = clock.run(2.0)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    assert "goal_reached" in status.FormatMessage()
    assert clock.phase[GaitPhase.DONE] == 1.0
    assert clock.phase[GaitPhase.TIME] == pytest.approx(0.5)


def test_next_task_is_asked_for_and_waited_for() -> None:
    """After a task the phase names the next one; its clock starts when its plan is there."""
    clock = Clock(stand_plan(0.5), num_tasks=2)
    assert clock.run(1.0).succeeded()
    assert clock.phase[GaitPhase.TASK] == 1.0 and clock.phase[GaitPhase.TIME] == 0.0
    assert clock.phase[GaitPhase.RATE] == 0.0 and clock.phase[GaitPhase.DONE] == 0.0
    clock.give(motion_plan=stand_plan(0.7, index=1))
    clock.run(0.3)
    assert clock.phase[GaitPhase.TIME] == pytest.approx(0.3, abs=PERIOD)
    assert "goal_reached" in clock.run(1.0).FormatMessage()


def test_two_contexts_of_one_clock_are_two_clocks() -> None:
    """Nothing of a run is kept in the system itself."""
    system = Clock().system
    a, b = Simulator(system), Simulator(system)
    for simulator in (a, b):
        fix_inputs(system, simulator.get_mutable_context(), motion_plan=flat_walk(),
                   contact_state_measured=ALL, lift_off_margin=PLENTY)  # fmt: skip
    a.AdvanceTo(1.0)
    assert read(system, b.get_context(), "gait_phase")[GaitPhase.TIME] == 0.0
    b.AdvanceTo(0.25)
    assert read(system, a.get_context(), "gait_phase")[GaitPhase.TIME] == pytest.approx(1.0)
    assert read(system, b.get_context(), "gait_phase")[GaitPhase.TIME] == pytest.approx(0.25)


def test_outputs_are_held_state() -> None:
    """No input reaches an output but by a tick: no algebraic loop can pass through the clock."""
    assert not Clock().system.HasAnyDirectFeedthrough()
