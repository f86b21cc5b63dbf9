"""Faults of a bus: each damps the robot at once, from either side, without a jump."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bus_rig import PERIOD_NS, PuppetShow, short_walk

from drake_quad.bus.bus_controller import BusController
from drake_quad.bus.control_loop import LISTENS, WOULD_STAND_UP
from drake_quad.bus.faults import BusFaults, FaultyBus
from drake_quad.bus.messages import (
    DRIVES_DAMP,
    DRIVES_FOLLOW,
    DRIVES_HOLD,
    CommandMessage,
    StateMessage,
    encode_command,
    encode_state,
)
from drake_quad.bus.postures import sit_to_stand
from drake_quad.bus.real_time import NS, ManualClock
from drake_quad.bus.robot_bus import LoopbackBus
from drake_quad.bus.robot_side import DriveGuard
from drake_quad.bus.safety import SafetyMode
from drake_quad.common import GRAVITY

FAULTS = (
    "nan",
    "crc",
    "commander",
    "clock_back",
    "clock_stands",
    "clock_ahead",
    "frozen",
    "gyroscope",
    "impossible",
    "silence",
    "stop",
    "tilt",
)
MOMENTS = 20


def command(session: int, sequence: int, mode: SafetyMode = SafetyMode.STANDING) -> CommandMessage:
    return CommandMessage(session, sequence, sequence, mode, 0, *(np.zeros(12) for _ in range(5)))


def spoil(show: PuppetShow, fault: str) -> bool:
    """Does one tick's worth of a fault; whether the puppet's own state is still sent."""
    puppet = show.puppet
    if fault == "nan":
        state = puppet.state()
        puppet.send(replace(state, velocity=np.full(12, np.nan)))
    elif fault == "crc":
        data = bytearray(encode_state(puppet.state()))
        data[100] ^= 1
        show.bus.state_bytes.append(bytes(data))
    elif fault == "commander":
        show.others.append(encode_command(command(77, 1)))
        return True
    elif fault == "clock_back":
        puppet.send(replace(puppet.state(), time_ns=show.clock.now_ns() - NS))
    elif fault == "clock_stands":
        newest = show.loop._states.newest
        assert newest is not None
        puppet.send(replace(puppet.state(), time_ns=newest.time_ns))
    elif fault == "clock_ahead":
        newest = show.loop._states.newest
        assert newest is not None
        puppet.send(replace(puppet.state(), time_ns=newest.time_ns + NS))
    elif fault == "gyroscope":
        newest = show.loop._states.newest
        assert newest is not None
        puppet.send(replace(puppet.state(), angular_rate=newest.angular_rate))
    elif fault == "impossible":
        puppet.send(replace(puppet.state(), velocity=np.full(12, 500.0)))
    elif fault == "frozen":
        newest = show.loop._states.newest
        assert newest is not None
        puppet.sequence += 1
        puppet.send(replace(newest, sequence=puppet.sequence, time_ns=show.clock.now_ns()))
    elif fault == "stop":
        show.loop.stop("interrupted")
        return True
    elif fault == "tilt":
        puppet.up = np.array([0.8, 0.0, 0.6])
        return True
    return False


def damped_after(show: PuppetShow, fault: str) -> float:
    """How long after the fault's first message the robot is damped [s]."""
    begun = show.clock.now_ns()
    for _ in range(500):
        show.tick(send=spoil(show, fault))
        if show.loop.mode == SafetyMode.DAMPING:
            return (show.clock.now_ns() - begun) / NS
    raise AssertionError(f"{fault}: not damped in a second")


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize(
    "moments",
    [2, pytest.param(MOMENTS, marks=pytest.mark.slow)],  # 6 s for each fault
)
def test_each_fault_damps_at_any_moment(fault: str, moments: int) -> None:
    """At moments drawn at random, in all modes: damped, 100 ms after the fault at most, no jump.

    A tilt is another matter: the IMU's filter has to see it, which takes half a second.
    """
    prepared = short_walk()
    rng = np.random.default_rng(FAULTS.index(fault))
    modes = set()
    for moment in rng.uniform(0.6, 3.4, moments):
        show = PuppetShow(prepared)
        while show.loop.time < moment:
            show.tick()
        assert show.loop.mode != SafetyMode.DAMPING
        modes.add(show.loop.mode)
        # A frozen sensor shows itself only by staying so, for 50 ms; silence likewise, for 100 ms.
        frozen = dict.fromkeys(("frozen", "gyroscope"), 0.06)
        allowed = {**frozen, "silence": 0.1, "tilt": 0.7}.get(fault, 0.002)
        took = damped_after(show, fault)
        assert took <= allowed + 1e-9
        before = show.loop.commanded.q
        for _ in range(20):
            show.tick(send=False)
            assert show.loop.commanded.stiffness == 0.0
            assert np.abs(show.loop.commanded.q - before).max() <= 0.05
            before = show.loop.commanded.q
        assert show.loop.largest_step <= 0.05
    if moments == MOMENTS:
        assert {SafetyMode.STANDING_UP, SafetyMode.STANDING, SafetyMode.WALKING} <= modes


def walking_show() -> PuppetShow:
    """A show that has come to walk."""
    show = PuppetShow(short_walk())
    while show.loop.mode != SafetyMode.WALKING:
        show.tick()
    return show


@pytest.mark.parametrize("fails", ["take", "wanted"])
def test_an_error_of_the_controller_damps_the_robot(
    fails: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever Python raises in a walk: no stiffness from the same tick on, and it is said why."""
    show = walking_show()
    assert show.loop.commanded.stiffness > 0.0

    def fail(*_: object) -> None:
        raise IndexError("leg 5 is none")

    monkeypatch.setattr(show.loop.controller, fails, fail)
    show.tick()
    assert show.loop.mode == SafetyMode.DAMPING and show.loop.commanded.stiffness == 0.0
    while not show.loop.outcome:
        show.tick()
    assert show.loop.outcome == "damped: the controller failed: IndexError: leg 5 is none"


@pytest.mark.parametrize("field", ["q", "v", "torque", "stiffness"])
def test_a_controller_that_wants_no_number_damps_the_robot(
    field: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One NaN among what it wants: no stiffness from the same tick on, and it is said why."""
    show = walking_show()
    wanted = show.loop.controller.wanted()
    assert wanted is not None
    value = getattr(wanted, field)
    spoilt: Any = (
        float("nan") if field == "stiffness" else np.where(np.arange(12) == 4, np.nan, value)
    )
    monkeypatch.setattr(show.loop.controller, "wanted", lambda: replace(wanted, **{field: spoilt}))
    show.tick()
    assert show.loop.mode == SafetyMode.DAMPING and show.loop.commanded.stiffness == 0.0
    assert show.loop.reason == "the controller wants what is not a number"
    assert np.isfinite(show.loop.commanded.q).all()


@pytest.mark.parametrize("wrong", ["stuck", "backwards"])
def test_joints_that_do_not_go_where_they_are_told_damp_the_robot(wrong: str) -> None:
    """Stuck, or with a sign wrong, as it begins to stand up: damped at 0.3 rad, not at the end."""
    show = PuppetShow(short_walk())
    start = show.puppet.q.copy()
    while show.loop.mode == SafetyMode.DAMPING:
        show.tick()
    farthest = 0.0
    while show.loop.mode == SafetyMode.STANDING_UP:
        show.tick()
        went = show.puppet.q - start
        show.puppet.q = start if wrong == "stuck" else start - went
        farthest = max(farthest, float(np.abs(show.loop.commanded.q - show.puppet.q).max()))
        if wrong == "backwards":
            start = start.copy()
    assert show.loop.events[-1].mode == "damping"
    assert "rad from where it is wanted" in show.loop.reason
    limits = show.loop.limits
    assert farthest <= limits.astray + 2.0 * limits.astray_time * float(limits.speed.max())


def test_who_comes_second_says_nothing_and_leaves() -> None:
    """A controller that hears another's commands as it begins publishes none, and never arms."""
    show = PuppetShow(short_walk())
    for k in range(1, 3000):
        if k < 500:  # the other leaves a second later
            show.others.append(encode_command(command(77, k)))
        show.tick()
        if show.loop.outcome:
            break
    assert show.loop.outcome == "stopped: a second commander"
    modes = {SafetyMode(one.mode) for one in show.puppet.commands}
    assert not show.loop.events and modes <= {SafetyMode.DAMPING}


def test_nothing_is_said_before_it_has_listened() -> None:
    """For half a second there is no command, and then one in each tick."""
    show = PuppetShow(short_walk())
    while show.loop.time < LISTENS - 0.003:
        show.tick()
    assert show.puppet.commands == []
    for _ in range(10):
        show.tick()
    assert 8 <= len(show.puppet.commands) <= 10


def test_a_silent_loop_says_nothing_and_goes_on_listening() -> None:
    """It tells what it would do, for as long as one listens, and the bus hears no command."""
    show = PuppetShow(short_walk(), silent=True)
    for _ in range(3000):
        show.tick()
    assert show.bus.command_bytes == type(show.bus.command_bytes)() and not show.puppet.commands
    assert show.loop.would_arm and not show.loop.events
    assert show.loop.reason == WOULD_STAND_UP
    show.others.append(encode_command(command(77, 1)))  # of whom it may listen to
    show.tick()
    assert show.loop.reason == "not armed: a second commander"
    show.puppet.up = np.array([0.6, 0.0, 0.8])
    for _ in range(1500):
        show.tick()
        assert not show.loop.outcome
    assert "tilted" in show.loop.reason and np.degrees(show.loop.tilt) == pytest.approx(37, abs=1)
    show.loop.stop("interrupted")
    show.tick()
    for _ in range(600):
        show.tick()
    assert show.loop.outcome == "stopped: interrupted"


def test_a_soft_stop_sits_down_first_and_then_damps() -> None:
    """In a walk: it sits down with stiff drives, damps, and leaves; no wanted angle jumps."""
    show = walking_show()
    for _ in range(200):
        show.tick()
    show.loop.stop("interrupted", sit=True)
    show.tick()
    assert show.loop.events[-1].mode == "sitting_down" and show.loop.commanded.stiffness > 0.0
    while not show.loop.outcome:
        show.tick()
    assert [event.mode for event in show.loop.events][-2:] == ["sitting_down", "damping"]
    assert show.loop.outcome == "stopped: interrupted" and show.loop.largest_step <= 0.05


def test_a_second_stop_damps_at_once() -> None:
    """While it sits down, and while it stands up, where there is nothing to sit down from."""
    show = walking_show()
    show.loop.stop("interrupted", sit=True)
    for _ in range(50):
        show.tick()
    show.loop.stop("interrupted")
    show.tick()
    assert show.loop.commanded.stiffness == 0.0
    rising = PuppetShow(short_walk())
    while rising.loop.mode != SafetyMode.STANDING_UP:
        rising.tick()
    rising.loop.stop("interrupted", sit=True)
    rising.tick()
    assert rising.loop.commanded.stiffness == 0.0


def test_drives_that_damp_by_themselves_end_the_walk() -> None:
    """They do so where commands came late: the loop damps within 0.1 s."""
    show = walking_show()
    for _ in range(20):  # a moment of it is borne: commands and states take their time
        show.tick()
    show.puppet.drives, begun = DRIVES_DAMP, show.loop.time
    while not show.loop.outcome:
        show.tick()
    assert show.loop.events[-1].time - begun <= 0.1 and show.loop.events[-1].mode == "damping"
    assert show.loop.outcome == "damped: the robot's drives damp, whatever they are told"


def test_a_trunk_that_sinks_ends_the_walk() -> None:
    """A robot whose legs fold under it in a walk is damped, by half its height at the latest."""
    prepared = short_walk()
    controller = BusController(prepared, prepared.scenario.controller)
    postures = sit_to_stand(prepared.robot, prepared.stance)[::-1]
    fine = 0  # ticks without a fault
    for k in range(6 * len(postures)):
        q = postures[max(0, min(k // 4 - 10, len(postures) - 1))]
        state = StateMessage(
            1, k + 1, (k + 1) * PERIOD_NS, DRIVES_FOLLOW, q, np.zeros(12), np.zeros(12),
            np.zeros(3), np.array([0.0, 0.0, GRAVITY]), np.full(4, 150.0),
        )  # fmt: skip
        controller.take(state)
        if controller.fault:
            break
        fine += 1
    assert fine > 60  # as long as it stands, and a while on, nothing is wrong
    assert re.fullmatch(r"the trunk is 0\.\d+ m above its feet, planned is .* m", controller.fault)


def test_a_loop_that_cannot_go_on_tells_the_drives_to_damp() -> None:
    """By one message, at any moment: no stiffness, no torque, and no other angles."""
    show = walking_show()
    before = show.loop.commanded
    show.loop.release()
    show.puppet.obey()
    command = show.loop.commanded
    assert (
        command.stiffness == 0.0 and not command.torque.any() and command.damping == before.damping
    )
    assert show.loop.mode == SafetyMode.DAMPING and np.array_equal(command.q, before.q)


def test_a_show_without_faults_ends_well() -> None:
    """With nothing wrong the same loop stands up, walks, sits down and says so."""
    show = PuppetShow(short_walk())
    while not show.loop.outcome:
        show.tick()
    assert show.loop.outcome == "goal_reached"
    assert [e.mode for e in show.loop.events] == [
        "standing_up", "standing", "walking", "standing", "sitting_down", "damping"
    ]  # fmt: skip


def test_messages_lost_and_late_are_borne() -> None:
    """A fifth of the states lost and the rest 5 ms late: it holds now and then, and goes on."""
    show = PuppetShow(short_walk())
    show.bus = faulty = FaultyBus(  # type: ignore[assignment]
        show.bus, BusFaults(loss=0.2, delay=0.005, reorder=0.05), show.clock,
        np.random.default_rng(1),
    )  # fmt: skip
    while not show.loop.outcome:
        faulty.publish_state(show.puppet.state())
        show.tick(send=False)
    assert show.loop.outcome == "goal_reached"
    assert show.loop.lost > 0


def test_only_what_is_lost_after_arming_counts() -> None:
    """A gap while the controller is made ready is nothing that a bus lost; a later one is."""
    show = PuppetShow(short_walk())
    for _ in range(30):  # the watch has to know how often states come
        show.tick()
    assert show.loop.mode == SafetyMode.DAMPING
    for missing in (40, 3):
        show.clock.sleep_until(show.clock.now_ns() + missing * PERIOD_NS)
        show.puppet.sequence += missing
        while show.loop.mode == SafetyMode.DAMPING:
            show.tick()
        show.tick()
    assert show.loop.lost == 3


class Commander:
    """Commands to a guard, tick by tick."""

    def __init__(self) -> None:
        self.clock, self.sequence = ManualClock(), 0
        self.bus, self.guard = LoopbackBus(self.clock.now_ns), DriveGuard()

    def tick(self, mode: SafetyMode | None = SafetyMode.WALKING, session: int = 1) -> int:
        """A tick, with a command of that mode unless None; what the drives do then."""
        self.clock.sleep_until(self.clock.now_ns() + PERIOD_NS)
        if mode is not None:
            self.sequence += 1
            self.bus.publish_command(command(session, self.sequence, mode))
        return self.guard.judge(self.bus, self.clock.now_ns())


def test_drives_hold_and_then_damp_when_the_commander_is_gone() -> None:
    """Killed at once: the drives hold after 20 ms and damp within 100 ms."""
    commander = Commander()
    assert [commander.tick() for _ in range(5)] == [DRIVES_FOLLOW] * 5
    drives = [commander.tick(None) for _ in range(60)]
    assert drives[:9] == [DRIVES_FOLLOW] * 9
    assert drives[11:44] == [DRIVES_HOLD] * 33
    assert drives[46:] == [DRIVES_DAMP] * 14
    assert commander.guard.reason == "the commander is silent"


def test_damped_drives_stay_so_until_they_are_told_to_damp() -> None:
    """A commander that comes back walking is not obeyed before it has said damping."""
    commander = Commander()
    commander.tick()
    for _ in range(60):
        commander.tick(None)
    assert commander.tick(SafetyMode.WALKING) == DRIVES_DAMP
    assert commander.tick(SafetyMode.DAMPING) == DRIVES_DAMP
    assert commander.tick(SafetyMode.STANDING_UP) == DRIVES_FOLLOW


def test_a_second_commander_damps_the_drives() -> None:
    """Two who command at the same time are obeyed by nobody, but for the first's damping."""
    commander = Commander()
    commander.tick(session=1)
    commander.bus.publish_command(command(2, 1, SafetyMode.WALKING))
    assert commander.tick(session=1) == DRIVES_DAMP
    assert commander.guard.reason == "a second commander"
    assert commander.tick(session=1) == DRIVES_DAMP


def test_a_mode_that_there_is_not_damps_the_drives() -> None:
    """A sound message of another program's mode is a fault, and is not taken for a command."""
    commander = Commander()
    commander.tick()
    commander.bus.publish_command(replace(command(1, 9), mode=99))
    assert commander.tick(None) == DRIVES_DAMP
    assert "mode 99" in commander.guard.reason
    assert commander.guard.command is not None and commander.guard.command.mode != 99


def test_spoilt_commands_damp_the_drives() -> None:
    """A CRC that is wrong, and a value that is no number, damp at once."""
    for spoilt in ("crc", "nan"):
        commander = Commander()
        commander.tick()
        one = command(1, 9)
        if spoilt == "nan":
            one = replace(one, effort=np.full(12, np.inf))
        data = bytearray(encode_command(one))
        if spoilt == "crc":
            data[50] ^= 4
        commander.bus.command_bytes.append(bytes(data))
        assert commander.tick(None) == DRIVES_DAMP


def test_a_robot_of_slow_drives_is_told_lower_gains() -> None:
    """States every 6 ms: a third of the gains in all of a walk, and it is said."""
    show = PuppetShow(short_walk())
    control = show.loop.limits
    for k in range(1500):
        show.tick(send=k % 3 == 0)
    told = [one for one in show.puppet.commands if one.mode == SafetyMode.WALKING]
    assert len(told) > 100
    for one in told:
        assert one.stiffness == pytest.approx(control.stiffness / 3.0)
        assert np.all(one.damping <= control.damping / 3.0 + 1e-9)
    assert [remark for remark in show.loop.remarks if "33 % of the planned gains" in remark]
