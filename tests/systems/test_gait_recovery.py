"""The gait clock in a push: it pauses, catches, settles, asks for a new plan, and goes on."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context
from rig import fix_inputs, flat_course, flat_walk, paper_robot, read

from drake_quad.common import FloatArray
from drake_quad.control.gait_clock import CALM_PLACE
from drake_quad.control.ports import BALANCE_SIZE, Balance, Catch, GaitPhase, Mode
from drake_quad.control.push_recovery import Reflex
from drake_quad.control.settings import ControlSettings
from drake_quad.planning.recovery_step import StepTargetMap
from drake_quad.systems.gait_scheduler import CALM_TIME, LONGEST_SETTLING, GaitScheduler

PERIOD = 0.005
ALL = np.ones(4)
STEP = flat_walk().contacts.steps[0]


def balance_at(t: float, *, vx: float = 0.0, vy: float = 0.0, off: float = 0.0) -> FloatArray:
    """The robot on its plan at `t`, but its base this much faster than planned, and off it."""
    sample = flat_walk().sample(t)
    balance = np.zeros(BALANCE_SIZE)
    x, y, z, _, yaw = sample.body[0]
    balance[:3] = [x, y, z - 0.05]
    balance[Balance.VELOCITY_ERROR : Balance.FEET] = vx, vy
    balance[Balance.FEET : Balance.BODY] = sample.feet.ravel()
    balance[Balance.BODY : Balance.BODY + 4] = [x + off, y, z, yaw]
    balance[Balance.PLACE_ERROR] = off
    return balance


class Clock:
    """A scheduler that may pause and catch, in a simulator of its own."""

    def __init__(self, *, catches: bool = True, patience: float = 2.0, start: float = 0.5) -> None:
        ground = StepTargetMap(flat_course(), paper_robot().foot_radius)
        self.system = GaitScheduler(
            num_tasks=1,
            control=ControlSettings(period=PERIOD, patience=patience),
            reflex=Reflex(robot=paper_robot(), ground=ground) if catches else None,
            may_pause=True,
        )
        self.simulator = Simulator(self.system)
        self.context: Context = self.simulator.get_mutable_context()
        self.give(motion_plan=flat_walk(), contact_state_measured=ALL)
        self.give(balance_estimated=balance_at(0.0))
        while self.phase[GaitPhase.TIME] < start - 1e-9:
            t = float(self.phase[GaitPhase.TIME])
            self.give(balance_estimated=balance_at(t + PERIOD))
            self.run(PERIOD)

    def give(self, **inputs: object) -> None:
        """Fixes these inputs."""
        fix_inputs(self.system, self.context, **inputs)

    def run(self, seconds: float) -> SimulatorStatus:
        """Lets time pass."""
        return self.simulator.AdvanceTo(self.context.get_time() + seconds)

    @property
    def phase(self) -> FloatArray:
        """Port gait_phase."""
        return read(self.system, self.context, "gait_phase")

    @property
    def catch(self) -> FloatArray:
        """Port catch."""
        return read(self.system, self.context, "catch")

    @property
    def mode(self) -> Mode:
        """What the clock is at."""
        return Mode(int(self.phase[GaitPhase.MODE]))


def caught_in_swing() -> Clock:
    """A clock that has just begun to catch a push, in the middle of the first swing."""
    t = 0.5 * (STEP.lift_off + STEP.touchdown)
    clock = Clock(start=t)
    outward = np.sign(STEP.swing.p_end[1])
    clock.give(balance_estimated=balance_at(t, vy=-outward * 1.0))
    clock.give(contact_state_measured=(np.arange(4) != STEP.leg.row).astype(float))
    clock.run(2 * PERIOD)
    assert clock.phase[GaitPhase.MODE] == Mode.CATCH
    return clock


def test_shaken_robot_is_waited_for_until_it_is_back() -> None:
    """A fast error stops the clock; it goes on once slow and near, and not by speed alone."""
    clock = Clock()
    t = float(clock.phase[GaitPhase.TIME])
    clock.give(balance_estimated=balance_at(t, vx=0.2))
    clock.run(0.2)
    assert clock.phase[GaitPhase.TIME] == pytest.approx(t, abs=2 * PERIOD)
    assert clock.phase[GaitPhase.RATE] == 0.0 and clock.phase[GaitPhase.MODE] == Mode.RUN
    stopped = clock.phase[GaitPhase.TIME]
    clock.give(balance_estimated=balance_at(t, off=CALM_PLACE + 0.01))
    clock.run(0.2)
    assert clock.phase[GaitPhase.TIME] == stopped
    clock.give(balance_estimated=balance_at(t))
    clock.run(0.2)
    assert clock.phase[GaitPhase.TIME] == pytest.approx(stopped + 0.2, abs=2 * PERIOD)
    assert clock.phase[GaitPhase.WAITED] == pytest.approx(0.4, abs=3 * PERIOD)


def test_pausing_does_not_use_up_the_patience_of_a_switch() -> None:
    """A push just before a lift-off that then has to wait does not end the run for it."""
    clock = Clock(patience=0.4, start=STEP.lift_off - 2 * PERIOD)
    t = float(clock.phase[GaitPhase.TIME])
    clock.give(balance_estimated=balance_at(t, vx=0.2))
    assert clock.run(0.35).succeeded()
    missing = ALL.copy()
    missing[(STEP.leg.row + 1) % 4] = 0.0
    clock.give(balance_estimated=balance_at(t), contact_state_measured=missing)
    assert clock.run(0.3).succeeded()
    assert clock.phase[GaitPhase.SWING_LEG] == 0.0 and clock.phase[GaitPhase.RATE] == 0.0
    status = clock.run(0.5)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition


def test_push_in_a_swing_is_caught_with_a_foot() -> None:
    """The gait stops, a foot is on its way, and the other feet are to stand."""
    clock = caught_in_swing()
    leg, stopped = int(clock.catch[Catch.LEG]), clock.phase[GaitPhase.TIME]
    assert leg > 0 and clock.phase[GaitPhase.RATE] == 0.0
    standing = read(clock.system, clock.context, "contact_state_desired")
    np.testing.assert_array_equal(standing, np.arange(1, 5) != leg)
    before = float(clock.catch[Catch.ELAPSED])
    clock.run(10 * PERIOD)
    assert clock.catch[Catch.ELAPSED] == pytest.approx(before + 10 * PERIOD)
    assert clock.phase[GaitPhase.TIME] == stopped


def test_after_the_catch_it_settles_and_asks_for_a_new_plan_and_goes_on_with_that() -> None:
    """Landed, calm for a while, REPLAN; with the plan's revision the clock begins at its start."""
    clock = caught_in_swing()
    t = float(clock.phase[GaitPhase.TIME])
    clock.run(0.3)
    settled = balance_at(t)
    settled[Balance.COM : Balance.COM + 2] = (
        settled[Balance.FEET : Balance.BODY].reshape(4, 3)[:, :2].mean(axis=0)
    )
    clock.give(contact_state_measured=ALL, balance_estimated=settled)
    clock.run(0.1)
    assert clock.phase[GaitPhase.MODE] == Mode.SETTLE and clock.catch[Catch.LEG] == 0.0
    clock.run(0.5 * CALM_TIME)
    assert clock.phase[GaitPhase.MODE] == Mode.SETTLE
    clock.run(CALM_TIME)
    assert clock.phase[GaitPhase.MODE] == Mode.REPLAN and clock.phase[GaitPhase.REVISION] == 1.0
    clock.run(0.5)
    assert clock.phase[GaitPhase.MODE] == Mode.REPLAN and clock.phase[GaitPhase.RATE] == 0.0
    clock.give(motion_plan=replace(flat_walk(), revision=1), balance_estimated=balance_at(0.0))
    clock.run(10 * PERIOD)
    assert clock.phase[GaitPhase.MODE] == Mode.RUN and 0.0 < clock.phase[GaitPhase.TIME] < 0.1


def test_robot_that_never_comes_to_rest_is_planned_for_all_the_same() -> None:
    """Settling has an end: a foot that hangs in the air would hold it up for ever."""
    clock = caught_in_swing()
    clock.run(1.5)
    assert clock.phase[GaitPhase.MODE] == Mode.SETTLE or clock.phase[GaitPhase.MODE] == Mode.CATCH
    t = float(clock.phase[GaitPhase.TIME])
    clock.give(balance_estimated=balance_at(t, vx=0.06))
    clock.run(LONGEST_SETTLING + 1.0)
    assert clock.phase[GaitPhase.MODE] == Mode.REPLAN


def test_without_a_reflex_nothing_is_caught() -> None:
    """`catch_pushes: false` is what it says."""
    clock = Clock(catches=False)
    clock.give(balance_estimated=balance_at(0.5, vx=2.0))
    clock.run(1.0)
    assert clock.phase[GaitPhase.MODE] == Mode.RUN and clock.catch[Catch.LEG] == 0.0
