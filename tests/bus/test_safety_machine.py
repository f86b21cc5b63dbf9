"""The safety machine: whatever comes, what the drives are told stays within its limits."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.bus.drive_limits import Drives, SafetyLimits, gain_share, within_limits
from drake_quad.bus.safety import Known, Memory, Request, SafetyMode, advance, initial_safety_memory

LIMITS = SafetyLimits(
    q_lower=np.full(12, -1.0), q_upper=np.full(12, 2.0), speed=np.full(12, 10.0),
    effort=np.full(12, 50.0), stiffness=200.0, damping=5.0, arming_time=0.01, fold_time=0.02,
    rise_time=0.02,
)  # fmt: skip
POSTURES = np.linspace(np.full(12, 1.0), np.full(12, 0.6), 5)
BEARING = np.full(12, 4.0)
NEXT = {  # where each mode leads in a tick, but to itself and to damping
    SafetyMode.DAMPING: {SafetyMode.STANDING_UP},
    SafetyMode.STANDING_UP: {SafetyMode.STANDING},
    SafetyMode.STANDING: {SafetyMode.WALKING, SafetyMode.SITTING_DOWN},
    SafetyMode.WALKING: {SafetyMode.STANDING, SafetyMode.SITTING_DOWN},
    SafetyMode.SITTING_DOWN: set(),
}
anything = st.floats(allow_nan=True, allow_infinity=True)
angles = st.floats(-3.0, 3.0)
drives = st.builds(
    lambda q, v, t, k, d: Drives(np.full(12, q), np.full(12, v), np.full(12, t), k, d),
    anything, anything, anything, anything, anything,
)  # fmt: skip
known = st.builds(
    lambda q, v, up, age, fault, request, wanted, ended: Known(
        time=0.0, q=np.full(12, q), v=np.full(12, v), up=np.array([0.0, (1 - up * up) ** 0.5, up]),
        age=age, fault=fault, request=request, wanted=wanted, ended=ended,
    ),
    angles | st.just(float("nan")), st.floats(-2.0, 2.0), st.floats(0.5, 1.0),
    st.sampled_from([0.0, 0.01, 0.03, 0.2]), st.sampled_from(["", "", "", "", "CRC"]),
    st.sampled_from(list(Request)), st.none() | drives, st.sampled_from(["", "", "goal_reached"]),
)  # fmt: skip


def at(known: Known, time: float) -> Known:
    """The same a while later."""
    return Known(**{**{n: getattr(known, n) for n in known.__dataclass_fields__}, "time": time})


def test_stiffness_comes_slowly_to_a_joint_that_armed_beyond_its_limit() -> None:
    """0.09 rad beyond: its torque grows by a tenth of the whole a tick at the most."""
    limits = replace(LIMITS, fold_time=1.0, arming_posture=9.0)  # it arms from anywhere
    beyond = limits.q_upper + 0.09
    memory, before, reached = initial_safety_memory(limits, 0.0), 0.0, 0.0
    for tick in range(1, 800):
        known = Known(time=0.002 * tick, q=beyond, v=np.zeros(12), request=Request.STAND)
        memory, command = advance(memory, known, limits, POSTURES, BEARING)
        spring = command.stiffness * float((command.q - beyond)[0])
        whole = limits.stiffness * 0.09
        if memory.mode == SafetyMode.STANDING_UP and command.stiffness < limits.stiffness:
            assert abs(spring - before) < 0.1 * whole
        before, reached = spring, max(reached, command.stiffness)
    assert memory.mode == SafetyMode.STANDING_UP and reached == limits.stiffness


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(known, st.integers(1, 30)), max_size=12))
def test_any_sequence_keeps_the_limits(sequence: list[tuple[Known, int]]) -> None:
    """Whatever is known, wanted and asked for: finite, within limits, no jump, modes in order."""
    memory, tick = initial_safety_memory(LIMITS, 0.0), 0
    for one, times in sequence:
        for _ in range(times):
            tick += 1
            before = memory
            memory, command = advance(memory, at(one, 0.002 * tick), LIMITS, POSTURES, BEARING)
            assert np.all((command.q >= LIMITS.q_lower) & (command.q <= LIMITS.q_upper))
            assert np.all(np.abs(command.q - before.commanded.q) <= 0.05)
            assert np.all(np.abs(command.v) <= LIMITS.speed)
            assert np.all(np.abs(command.torque) <= LIMITS.effort)
            assert np.all(np.abs(command.torque - before.commanded.torque) <= 0.1 * 50.0 + 1e-9)
            assert 0.0 <= command.stiffness <= 200.0 and 0.0 <= command.damping <= 5.0
            assert memory.mode in {before.mode, SafetyMode.DAMPING, *NEXT[before.mode]}
            assert one.q is not None
            bad = one.fault or one.age > 0.1 or not np.isfinite(one.q).all()
            if bad or one.up[2] < np.cos(LIMITS.tilt):
                assert memory.mode == SafetyMode.DAMPING and command.stiffness == 0.0


@given(drives, drives)
def test_limits_are_idempotent(wanted: Drives, before: Drives) -> None:
    """What is within the limits is left as it is."""
    first = within_limits(before, initial_safety_memory(LIMITS, 0.0).commanded, LIMITS)
    once = within_limits(wanted, first, LIMITS)
    twice = within_limits(once, first, LIMITS)
    assert np.allclose(once.q, twice.q) and np.allclose(once.torque, twice.torque)


def run(memory: Memory, seconds: float, tick: int, **facts: object) -> tuple[Memory, Drives, int]:
    """Some time with the joints where they are wanted."""
    command = memory.commanded
    for _ in range(round(seconds / 0.002)):
        tick += 1
        base: Any = {"q": memory.commanded.q, "v": np.zeros(12), "request": Request.STAND}
        known = Known(time=0.002 * tick, **(base | facts))
        memory, command = advance(memory, known, LIMITS, POSTURES, BEARING)
    return memory, command, tick


def test_it_stands_up_walks_and_sits_down() -> None:
    """With all well, asked for one after the other, it goes through all modes and ends damped."""
    memory, command, tick = run(initial_safety_memory(LIMITS, 0.0), 0.2, 0)
    assert memory.mode == SafetyMode.STANDING and np.allclose(command.q, POSTURES[-1])
    assert np.allclose(command.torque, BEARING)
    wanted = Drives(np.full(12, 0.5), np.zeros(12), np.full(12, 3.0), 100.0, 1.0)
    memory, command, tick = run(memory, 0.1, tick, request=Request.WALK, wanted=wanted)
    assert (
        memory.mode == SafetyMode.WALKING
        and np.allclose(command.q, 0.5)
        and command.stiffness == 100.0
    )
    memory, command, tick = run(memory, 0.01, tick, request=Request.NOTHING, ended="goal_reached")
    assert memory.mode == SafetyMode.STANDING and np.allclose(command.q, 0.5)
    memory, command, _ = run(memory, 0.2, tick, request=Request.SIT)
    assert memory.mode == SafetyMode.DAMPING and memory.reason == "sat down"
    assert command.stiffness == 0.0


@pytest.mark.parametrize(
    ("facts", "why"),
    [
        ({"q": np.full(12, 2.2)}, "beyond its limits"),
        ({"v": np.full(12, 1.5)}, "is moving"),
        ({"up": np.array([0.4, 0.0, 0.9])}, "tilted"),
        ({"age": 0.05}, "is old"),
        ({"fault": "CRC"}, "not armed: CRC"),
    ],
)
def test_it_arms_in_a_sane_posture_alone(facts: dict[str, object], why: str) -> None:
    """Beyond limits, moving, tilted, or of an old or faulty state it stays damped, and says why."""
    memory, command, _ = run(initial_safety_memory(LIMITS, 0.0), 0.2, 0, **facts)
    assert memory.mode == SafetyMode.DAMPING and why in memory.reason and command.stiffness == 0.0


def test_a_robot_that_sinks_does_not_arm_before_it_lies() -> None:
    """Damped it sinks slowly: its joints must be still for the whole of the time of arming."""
    memory, tick = initial_safety_memory(LIMITS, 0.0), 0
    sinking, still = np.full(12, 0.9 * LIMITS.arming_speed), np.zeros(12)
    sinking[4] = 1.1 * LIMITS.arming_speed
    for _ in range(3):
        memory, _, tick = run(memory, LIMITS.arming_time - 0.004, tick, v=still)
        memory, _, tick = run(memory, 0.004, tick, v=sinking)
        assert memory.mode == SafetyMode.DAMPING
    memory, _, _ = run(memory, LIMITS.arming_time + 0.004, tick, v=still)
    assert memory.mode == SafetyMode.STANDING_UP


def test_slow_drives_get_lower_gains() -> None:
    """What makes a leg in the air unstable, damping times the drives' period, is never more."""
    assert gain_share(0.002, 0.002) == gain_share(0.002, 0.001) == gain_share(0.002, 0.0) == 1.0
    for interval in (0.004, 0.005, 0.01):
        assert gain_share(0.002, interval) * interval == pytest.approx(0.002)


def test_a_late_state_makes_the_last_command_hold() -> None:
    """Between 20 and 100 ms the wanted angles stand still, stiff; then the robot is damped."""
    memory, before, tick = run(initial_safety_memory(LIMITS, 0.0), 0.2, 0)
    memory, command, tick = run(memory, 0.02, tick, age=0.05, request=Request.WALK)
    assert memory.mode == SafetyMode.STANDING and memory.holding
    assert np.array_equal(command.q, before.q) and command.stiffness == 200.0
    memory, command, _ = run(memory, 0.002, tick, age=0.11)
    assert memory.mode == SafetyMode.DAMPING and command.stiffness == 0.0


def test_it_arms_from_folded_or_standing_legs_alone() -> None:
    """Of random postures within the limits hardly any is armed from; of those between, each."""
    rng = np.random.default_rng(5)
    random = rng.uniform(LIMITS.q_lower, LIMITS.q_upper, (50, 12))
    between = POSTURES + rng.uniform(-0.3, 0.3, POSTURES.shape)
    armed = []
    for postures in (random, np.clip(between, LIMITS.q_lower, LIMITS.q_upper)):
        count = 0
        for q in postures:
            memory = initial_safety_memory(LIMITS, 0.0)
            for tick in range(1, 400):
                known = Known(time=0.002 * tick, q=q, v=np.zeros(12), request=Request.STAND)
                memory, _ = advance(memory, known, LIMITS, POSTURES, BEARING)
                if memory.mode == SafetyMode.STANDING_UP:
                    count += 1
                    break
            else:
                assert "neither folded" in memory.reason
        armed.append(count / len(postures))
    assert armed[0] <= 0.1 and armed[1] == 1.0


def test_wanted_speeds_change_no_quicker_than_in_the_time_of_a_torque() -> None:
    """From one end to the other it takes twice `torque_time`, whatever the controller wants."""
    memory, _, begun = run(initial_safety_memory(LIMITS, 0.0), 0.2, 0)
    memory, _, begun = run(memory, 0.01, begun, request=Request.WALK)
    speeds = []
    for tick in range(begun + 1, begun + 40):
        way = 1.0 if tick < begun + 20 else -1.0
        q = memory.commanded.q
        wanted = Drives(q, way * LIMITS.speed, np.zeros(12), 100.0, 1.0)
        known = Known(time=0.002 * tick, q=q, v=np.zeros(12), wanted=wanted)
        memory, command = advance(memory, known, LIMITS, POSTURES, BEARING)
        speeds.append(command.v)
    steps = np.abs(np.diff(speeds, axis=0))
    assert steps.max() <= 0.1 * LIMITS.speed.max() + 1e-12
    assert np.array_equal(speeds[18], LIMITS.speed) and np.array_equal(speeds[-1], -LIMITS.speed)
