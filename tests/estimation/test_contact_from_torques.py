"""Feet felt by the joints: the residual follows what pushes, and touchdowns are told apart."""

import numpy as np
from hypothesis import given, strategies as st

from drake_quad.common import GRAVITY
from drake_quad.estimation.contact_from_torques import (
    JointDynamics,
    TouchMemory,
    TouchSettings,
    foot_forces,
    observe,
    torque_ripple,
)

MASS, PERIOD = 20.0, 0.002
JACOBIAN = np.tile(np.diag([0.3, 0.25, 0.2]), (4, 1, 1))
SETTINGS = TouchSettings()


def step(memory: np.ndarray, momentum: np.ndarray, torque: np.ndarray) -> None:
    now = JointDynamics(momentum, np.zeros(12), torque, JACOBIAN, np.zeros(12))
    observe(memory, now, MASS, PERIOD, SETTINGS)


@given(st.floats(-200.0, 200.0), st.floats(-30.0, 30.0))
def test_the_residual_comes_to_the_push_whatever_the_drives_do(force: float, drive: float) -> None:
    """With p' = τ + J^T f exactly, the force found comes to f within a few time constants."""
    push = np.einsum("kji,kj->ki", JACOBIAN, np.tile([0.0, 0.0, force], (4, 1))).ravel()
    torque, momentum = np.full(12, drive), np.zeros(12)
    memory = np.zeros(TouchMemory.SIZE)
    for _ in range(60):
        step(memory, momentum, torque)
        momentum = momentum + PERIOD * (torque + push)
    found = memory[TouchMemory.FORCE].reshape(4, 3)
    assert np.allclose(found, [0.0, 0.0, force], atol=1e-3 * max(abs(force), 50.0))


def test_the_residual_has_the_time_constant_asked_for() -> None:
    """After a foot's force jumps, 63 % of it is felt after `time`, to a period."""
    memory, momentum = np.zeros(TouchMemory.SIZE), np.zeros(12)
    weight = 0.25 * MASS * GRAVITY
    base = np.einsum("kji,kj->ki", JACOBIAN, np.tile([0.0, 0.0, weight], (4, 1))).ravel()
    felt = []
    for k in range(60):
        step(memory, momentum, -base)  # at rest
        momentum = momentum + PERIOD * (base if k > 20 else 0.0)
        felt.append(memory[TouchMemory.FORCE][2])
    share = (np.array(felt) - weight) / weight
    reached = int(np.argmax(share > 1.0 - np.exp(-1.0)))
    assert abs((reached - 21) * PERIOD - SETTINGS.time) <= 2 * PERIOD


def test_a_foot_lifts_and_lands_with_hysteresis() -> None:
    """Below `leave` it bears no more, between the two as before, above `touch` it is believed."""
    memory, momentum = np.zeros(TouchMemory.SIZE), np.zeros(12)
    standing = -np.einsum("kji,kj->ki", JACOBIAN, np.tile([0, 0, MASS * GRAVITY], (4, 1)))
    seen = []
    below, between = 0.4 * SETTINGS.leave, 0.5 * (SETTINGS.leave + SETTINGS.touch)
    for share in (0.25, below, between, 0.25, between, below):
        for _ in range(100):
            step(memory, momentum, share * standing.ravel())  # at rest: drives hold what pushes
        seen.append(bool(memory[TouchMemory.BEARING][0]))
    assert seen == [True, False, False, True, True, False]


@given(st.integers(1, 20))
def test_a_foot_that_eases_for_a_moment_bears_on(periods: int) -> None:
    """Less than `leave` is believed only after `confirm_leave`: a noisy sample lifts no foot."""
    memory, momentum = np.zeros(TouchMemory.SIZE), np.zeros(12)
    standing = -np.einsum("kji,kj->ki", JACOBIAN, np.tile([0, 0, MASS * GRAVITY], (4, 1))).ravel()
    weight = MASS * GRAVITY

    def below() -> bool:
        return bool(memory[TouchMemory.FORCE][2] < SETTINGS.leave * weight)

    for _ in range(round(SETTINGS.hold / PERIOD) + 60):
        step(memory, momentum, 0.25 * standing)
    eased = 0
    for _ in range(periods):
        step(memory, momentum, np.zeros(12))
        eased = eased + 1 if below() else 0
    bears = bool(memory[TouchMemory.BEARING][0])
    assert bears == (eased * PERIOD < SETTINGS.confirm_leave - 1e-9)


def test_a_foot_that_has_landed_bears_for_a_while() -> None:
    """Felt to land and then not felt at all, it bears for `hold`, to two periods, and no longer."""
    memory, momentum = np.zeros(TouchMemory.SIZE), np.zeros(12)
    standing = -np.einsum("kji,kj->ki", JACOBIAN, np.tile([0, 0, MASS * GRAVITY], (4, 1))).ravel()
    for share, ticks in ((0.0, 120), (0.1, 10)):
        for _ in range(ticks):
            step(memory, momentum, share * standing)
    assert memory[TouchMemory.BEARING][0] == 1.0
    landed = round(memory[TouchMemory.HELD][0] / PERIOD)
    bore = landed
    while memory[TouchMemory.BEARING][0] == 1.0:
        step(memory, momentum, np.zeros(12))
        bore += 1
    assert abs(bore * PERIOD - SETTINGS.hold) <= 2 * PERIOD


def test_a_stretched_leg_keeps_its_force() -> None:
    """Where a leg's Jacobian is singular the force is that of before, not a huge one."""
    singular = np.tile(np.diag([0.3, 0.25, 1e-4]), (4, 1, 1))
    before = np.full((4, 3), 7.0)
    assert np.array_equal(foot_forces(np.ones(12), singular, before, np.ones(12))[0], before)


@given(
    st.lists(st.floats(-8.0, 8.0), min_size=12, max_size=12),
    st.floats(10.0, 2000.0),
    st.integers(1, 8),
)
def test_the_mean_torque_is_within_its_uncertainty_however_often_it_is_computed(
    speeds: list[float], kp: float, times: int
) -> None:
    """At a constant speed, of drives that compute it 1 to 8 times a period; exactly so of 2."""
    speed = np.array(speeds)
    moments = PERIOD * np.arange(times) / times  # from the command on
    torques = -kp * np.outer(moments, speed)
    ripple = torque_ripple(speed, speed, kp=kp, kd=3.0, period=PERIOD)
    error = torques.mean(axis=0) - (torques[-1] + ripple)
    assert np.all(np.abs(error) <= np.abs(ripple) + 1e-9 * kp)
    if times == 2:
        assert np.allclose(error, 0.0, atol=1e-9 * kp)


@given(st.floats(0.0, 0.05), st.floats(0.0, 0.05))
def test_a_push_that_friction_may_feign_is_no_touchdown(push: float, friction: float) -> None:
    """A foot lands if it is pressed with more than `touch` beyond what its joints may feign."""
    memory, weight = np.zeros(TouchMemory.SIZE), MASS * GRAVITY
    vertical = np.linalg.solve(JACOBIAN[0], [0.0, 0.0, 1.0])
    uncertainty = np.zeros(12)
    uncertainty[2] = friction * weight / abs(vertical[2])
    legs = np.einsum("kji,kj->ki", JACOBIAN, np.tile([0.0, 0.0, push * weight], (4, 1))).ravel()
    for torque, ticks in ((np.zeros(12), 80), (-legs, 40)):
        for _ in range(ticks):
            now = JointDynamics(
                momentum=np.zeros(12), velocity_terms=np.zeros(12), torque=torque,
                jacobian=JACOBIAN, uncertainty=uncertainty,
            )  # fmt: skip
            observe(memory, now, MASS, PERIOD, SETTINGS)
    beyond = push - friction - SETTINGS.touch
    if abs(beyond) > 1e-4:
        assert bool(memory[TouchMemory.BEARING][0]) == (beyond > 0.0)
