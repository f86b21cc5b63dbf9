"""StateWatch alone: which way is up, and how many states did not come."""

from dataclasses import replace

import numpy as np
import pytest
from bus_rig import PERIOD_NS
from hypothesis import given, settings, strategies as st

from drake_quad.bus.messages import DRIVES_FOLLOW, Received, StateMessage
from drake_quad.bus.real_time import NS
from drake_quad.bus.watch import StateWatch
from drake_quad.common import GRAVITY, FloatArray
from drake_quad.math.rotations import rotation_exp


def seen(tick: int, rate: FloatArray, force: FloatArray) -> Received[StateMessage]:
    """A state of a robot that turns so [rad/s], and feels such a specific force [m/s^2]."""
    time_ns = (tick + 1) * PERIOD_NS
    q = np.full(12, 1e-6 * tick)  # sensors never show the same
    still, feet = np.zeros(12), np.zeros(4)
    state = StateMessage(1, tick + 1, time_ns, DRIVES_FOLLOW, q, still, still, rate, force, feet)
    return Received(state, time_ns)


@given(st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3))
def test_up_turns_as_the_gyroscope_tells(rate: list[float]) -> None:
    """In a fall, where nothing is felt, up stays in the world as the body turns, to 1 %."""
    watch, w = StateWatch(), np.array(rate)
    watch.take([seen(0, w, np.array([0.0, 0.0, GRAVITY]))])
    for tick in range(1, 251):
        assert watch.take([seen(tick, w, np.zeros(3))])[1] == ""
    R = rotation_exp(*(250 * 1e-9 * PERIOD_NS * w))
    np.testing.assert_allclose(watch.up, R.T @ [0.0, 0.0, 1.0], atol=0.01)


@settings(max_examples=25)  # of four seconds of states each
@given(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))
def test_up_is_drawn_to_what_is_felt(roll: float, pitch: float) -> None:
    """At rest it comes to the direction of the specific force; a knock of 5 g is passed over."""
    up = np.array([np.sin(pitch), np.sin(roll), 1.0])
    up /= np.linalg.norm(up)
    watch = StateWatch()
    watch.take([seen(0, np.zeros(3), np.array([0.0, 0.0, GRAVITY]))])
    for tick in range(1, 2001):
        knock = tick % 100 == 0
        force = np.array([5.0 * GRAVITY, 0.0, 0.0]) if knock else GRAVITY * up
        watch.take([seen(tick, np.zeros(3), force)])
    np.testing.assert_allclose(watch.up, up, atol=1e-3)


@given(st.integers(1, 5), st.integers(0, 3))
def test_of_a_slower_robot_only_what_is_missing_is_lost(periods: int, missing: int) -> None:
    """Its states may come every 2 ms or every 10: those that lack among them are counted."""
    watch, up, tick = StateWatch(), np.array([0.0, 0.0, GRAVITY]), 0
    for k in range(40):
        watch.take([seen(tick, np.zeros(3), up)])
        tick += periods * (1 + (missing if k == 30 else 0))
    assert watch.interval == pytest.approx(periods * PERIOD_NS * 1e-9)
    assert watch.lost == missing


def test_messages_that_nobody_read_are_no_jump_of_the_clock() -> None:
    """A loop that stood still finds a state 0.8 s on, for those between are gone: no fault.

    A clock that is a second on from one message to the next is one.
    """
    watch, still, up = StateWatch(), np.zeros(3), np.array([0.0, 0.0, GRAVITY])
    for tick in range(200):
        assert watch.take([seen(tick, still, up)])[1] == ""
    late = replace(seen(600, still, up), time_ns=seen(201, still, up).time_ns)
    assert watch.take([late])[1] == "" and watch.lost == 400
    after = seen(601, still, up)
    assert after.message is not None
    jumped = replace(after.message, time_ns=after.message.time_ns + NS)
    _, fault = watch.take([replace(after, message=jumped)])
    assert fault == "the robot's clock jumped ahead"
