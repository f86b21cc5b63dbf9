"""The gait clock alone: it runs, waits for contact and margin, gives up in the end, and is done.

How it catches pushes is not tested here: no reflex is given, and nothing is disturbed.
"""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context
from rig import fix_inputs, flat_walk, read, stand_plan

from drake_quad.common import FloatArray
from drake_quad.control.ports import BALANCE_SIZE, CATCH_SIZE, SIZE, Balance, GaitPhase, Mode
from drake_quad.control.settings import ControlSettings
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.stability.support_polygon import stability_margin
from drake_quad.systems.gait_scheduler import GaitScheduler

PERIOD = 0.005
LEAST = 0.02  # [m] of margin at a lift-off
FEET = slice(Balance.FEET, Balance.FEET + 12)
PLENTY = 0.06  # [m]
ALL = np.ones(4)


def balance_with(margin: float, without: int) -> FloatArray:
    """A `balance_estimated` whose static margin on the feet but one is `margin` [m].

    Args:
        margin: Of the centre of mass from the side that the lifted foot leaves open [m].
        without: Row of the foot that is lifted.
    """
    feet = flat_walk().contacts.feet
    opposite = feet[3 - without, :2]
    a, b = (feet[row, :2] for row in range(4) if row not in (without, 3 - without))
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
    middle = 0.5 * (a + b)
    com = middle + margin * normal * np.sign(normal @ (opposite - middle))
    assert stability_margin(com, [a, b, opposite]) == pytest.approx(margin)
    balance = np.zeros(BALANCE_SIZE)
    balance[Balance.COM : Balance.ACCELERATION] = [*com, 0.8]
    balance[FEET] = feet.ravel()
    return balance


class Clock:
    """A scheduler in a simulator of its own, with its inputs at hand."""

    def __init__(
        self, plan: MotionPlan | None = None, *, num_tasks: int = 1, patience: float = 2.0
    ) -> None:
        self.plan = plan or flat_walk()
        control = ControlSettings(period=PERIOD, lift_off_margin=LEAST, patience=patience)
        self.system = GaitScheduler(num_tasks=num_tasks, control=control)
        self.simulator = Simulator(self.system)
        self.context: Context = self.simulator.get_mutable_context()
        self.give(motion_plan=self.plan, contact_state_measured=ALL)
        self.balance(PLENTY)

    def balance(self, margin: float) -> None:
        """Gives the centre of mass this margin [m] without the foot that lifts off next."""
        t = self.phase[GaitPhase.TIME]
        later = [step for step in self.plan.contacts.steps if step.lift_off > t - 1e-9]
        self.give(balance_estimated=balance_with(margin, later[0].leg.row if later else 0))

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
        clock.balance(PLENTY)
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
        clock.balance(LEAST - 0.001)
    else:
        others = ALL.copy()
        others[(row + 1) % 4] = 0.0
        clock.give(contact_state_measured=others)
    clock.run(step.lift_off + 0.5)
    assert step.lift_off - PERIOD - 1e-6 <= clock.phase[GaitPhase.TIME] < step.lift_off
    assert clock.phase[GaitPhase.SWING_LEG] == 0 and clock.phase[GaitPhase.RATE] == 0.0
    clock.balance(PLENTY)
    clock.give(contact_state_measured=ALL)
    clock.run(0.1)
    assert clock.phase[GaitPhase.SWING_LEG] == step.leg


def test_margins_of_other_legs_and_the_lifted_foots_contact_do_not_matter() -> None:
    """Only the leg that lifts off needs a margin, and that foot need not bear any more."""
    clock, step = Clock(), first_step()
    row = step.leg.row
    balance, contact = balance_with(LEAST + 0.001, row), ALL.copy()
    contact[row] = 0.0
    feet = balance[FEET].reshape(4, 3)[:, :2]
    assert stability_margin(balance[:2], np.delete(feet, 3 - row, axis=0)) < 0.0
    clock.give(balance_estimated=balance, contact_state_measured=contact)
    clock.run(step.lift_off + 0.1)
    assert clock.phase[GaitPhase.SWING_LEG] == step.leg


@pytest.mark.parametrize("margin", [LEAST + 1e-4, LEAST - 1e-4])
def test_margin_at_which_a_foot_is_lifted_is_the_one_set(margin: float) -> None:
    """A tenth of a millimetre more lets it go, as much less does not, and is said why."""
    clock, step = Clock(patience=0.3), first_step()
    clock.balance(margin)
    status = clock.run(step.lift_off + 0.6)
    if margin > LEAST:
        assert status.succeeded() and clock.phase[GaitPhase.SWING_LEG] == step.leg
    else:
        assert f"without leg {step.leg.short} the margin is" in status.FormatMessage()


def test_margin_is_that_of_the_feet_as_they_stand() -> None:
    """Feet that stand 10 cm off their plan take the margin that was there on paper."""
    clock, step = Clock(patience=0.3), first_step()
    balance = balance_with(PLENTY, step.leg.row)
    feet = balance[FEET].reshape(4, 3).copy()
    for row in {0, 1, 2, 3} - {step.leg.row, 3 - step.leg.row}:
        feet[row, :2] += 0.1 * np.sign(balance[:2] - feet[step.leg.row, :2])
    others = np.delete(feet, step.leg.row, axis=0)[:, :2]
    assert stability_margin(balance[:2], others) < LEAST
    balance[FEET] = feet.ravel()
    clock.give(balance_estimated=balance)
    clock.run(step.lift_off + 0.1)
    assert clock.phase[GaitPhase.SWING_LEG] == 0 and clock.phase[GaitPhase.RATE] == 0.0


def test_undisturbed_it_only_runs() -> None:
    """Without a reflex the mode is RUN all the time, no foot is to catch, nothing is planned anew.

    Not even with the base thrown about: `catch_pushes: false` is what it says.
    """
    clock, step = Clock(), first_step()
    balance = balance_with(PLENTY, step.leg.row)
    clock.run(step.lift_off + 0.1)
    balance[Balance.VELOCITY_ERROR : Balance.FEET] = [1.5, -1.0]
    clock.give(balance_estimated=balance)
    clock.run(0.4)
    assert clock.phase[GaitPhase.MODE] == Mode.RUN and clock.phase[GaitPhase.REVISION] == 0.0
    assert clock.phase[GaitPhase.SWING_LEG] == step.leg
    np.testing.assert_array_equal(read(clock.system, clock.context, "catch"), np.zeros(CATCH_SIZE))


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
    clock.balance(0.0)
    clock.run(step.lift_off + 0.25)
    clock.balance(PLENTY)
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
                   contact_state_measured=ALL,
                   balance_estimated=balance_with(PLENTY, first_step().leg.row))  # fmt: skip
    a.AdvanceTo(1.0)
    assert read(system, b.get_context(), "gait_phase")[GaitPhase.TIME] == 0.0
    b.AdvanceTo(0.25)
    assert read(system, a.get_context(), "gait_phase")[GaitPhase.TIME] == pytest.approx(1.0)
    assert read(system, b.get_context(), "gait_phase")[GaitPhase.TIME] == pytest.approx(0.25)


def test_outputs_are_held_state() -> None:
    """No input reaches an output but by a tick: no algebraic loop can pass through the clock."""
    assert not Clock().system.HasAnyDirectFeedthrough()


def test_a_plan_that_goes_on_is_not_the_missions_end() -> None:
    """The clock begins the next task, and waits there for its plan; the last ends the run."""
    clock = Clock(replace(stand_plan(), goes_on=True))
    status = clock.run(1.5)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedBoundaryTime
    assert clock.phase[GaitPhase.TASK] == 1.0 and clock.phase[GaitPhase.DONE] == 0.0
    clock.give(motion_plan=stand_plan(index=1))
    status = clock.run(1.5)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    assert clock.phase[GaitPhase.DONE] == 1.0
