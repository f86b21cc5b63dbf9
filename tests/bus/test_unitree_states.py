"""LowStates of senders that leave out their clock or their CRC, and of those that do not."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.bus.joint_map import SAME
from drake_quad.bus.messages import DRIVES_DAMP, DRIVES_FOLLOW, Received, StateMessage
from drake_quad.bus.unitree_messages import LOW_STATE, Wire, encode_low_state
from drake_quad.bus.unitree_states import NO_CLOCK, NO_CRC, SLOW, LowStateReader
from drake_quad.bus.watch import StateWatch
from drake_quad.common import GRAVITY

MS = 1_000_000
EPOCH = 1_790_000_000_000_000_000  # a wall clock's, far from where ticks begin


def low_state(tick: int, *, crc: bool = True, shake: float = 0.0) -> bytes:
    """A LowState with this tick, its CRC left out or not."""
    state = StateMessage(
        0, 0, tick * MS, 1, np.full(12, 0.1 + shake), np.zeros(12), np.zeros(12), np.full(3, shake),
        np.array([0.0, 0.0, GRAVITY]), np.zeros(4),
    )  # fmt: skip
    data = encode_low_state(state, SAME)
    return data if crc else data[:-4] + bytes(4)


def read(
    reader: LowStateReader, data: bytes, k: int, *, sender: int = 7, period: int = 5 * MS
) -> Received[StateMessage]:
    return reader.read(data, k * period, sender=sender, sent_ns=EPOCH + k * period)


def test_the_crc_is_a_low_states_last_word() -> None:
    """What is cut off above is the CRC and nothing else."""
    whole, fault = Wire(LOW_STATE).decode(low_state(3, crc=False), unsigned=True)
    assert whole is not None and not fault
    row = whole.view(LOW_STATE)[0]
    assert int(row["crc"]) == 0 and int(row["tick"]) == 3


@given(st.lists(st.integers(1, 40 * MS), min_size=2, max_size=20))
def test_a_sender_without_clock_and_crc_is_understood(gaps: list[int]) -> None:
    """Its states come in order, by the time stamps of DDS, and what it leaves out is told."""
    reader, watch, sent, seen = LowStateReader(SAME), StateWatch(), EPOCH, []
    for k, gap in enumerate(gaps):
        sent += gap
        data = low_state(0, crc=False, shake=1e-3 * k)
        come = reader.read(data, sent - EPOCH, sender=7, sent_ns=sent)
        good, fault = watch.take([come])
        assert not fault and len(good) == 1
        assert NO_CRC in come.remarks and (NO_CLOCK in come.remarks) == (k > 0)
        seen.append(good[0].time_ns)
    assert np.diff(seen).tolist() == gaps[1:]


def swinging(time: float, error: np.ndarray | None = None) -> bytes:
    """A LowState without a clock of joints that swing as those of a walk do, at a time [s].

    Args:
        time: The robot's own time [s].
        error: Errors of the encoders (2, 12): of angles [rad], and of speeds [rad/s].
    """
    phase, (of_q, of_v) = 3.0 * time + np.arange(12), np.zeros((2, 12)) if error is None else error
    q, v = 0.4 * np.sin(phase) + of_q, 1.2 * np.cos(phase) + of_v
    state = StateMessage(
        0, 0, 0, 1, q, v, np.zeros(12), np.zeros(3),
        np.array([0.0, 0.0, GRAVITY]), np.zeros(4),
    )  # fmt: skip
    return encode_low_state(state, SAME)


@given(pace=st.floats(0.4, 1.2), stall=st.integers(0, 20))
@settings(max_examples=12)  # of five seconds of states each
def test_the_time_of_a_sender_without_a_clock_is_that_of_its_joints(
    pace: float, stall: int
) -> None:
    """A simulator slower than its stamps keeps its own time, and one that stalls does, too."""
    reader, times, real = LowStateReader(SAME), [], 0.0
    for k in range(1000):
        if not 600 <= k < 600 + stall:  # in these its publisher alone goes on
            real += 0.005 * pace
        come = read(reader, swinging(real), k)
        assert come.message is not None
        times.append(come.message.time_ns)
        if k == 400:
            settled = k, real
    assert np.all(np.diff(times) > 0)
    passed = (times[-1] - times[settled[0]]) * 1e-9
    assert abs(passed - (real - settled[1])) < 0.02 * passed
    assert (SLOW in come.remarks) == (pace < 0.9) or abs(pace - 0.9) < 0.01


def test_noise_of_the_encoders_does_not_slow_the_robots_time() -> None:
    """Speeds off by a sixth of what they are make 40 s of a slow robot's time no shorter: 0.5 %."""
    reader, rng, pace = LowStateReader(SAME), np.random.default_rng(5), 0.8
    times = []
    for k in range(8000):
        error = rng.normal(size=(2, 12)) * np.array([[2e-4], [0.2]])
        come = read(reader, swinging(0.005 * pace * k, error), k)
        assert come.message is not None
        times.append(1e-9 * come.message.time_ns)
    assert times[-1] - times[1000] == pytest.approx(0.005 * pace * 6999, rel=0.005)


def test_a_robot_at_rest_says_nothing_of_its_time() -> None:
    """Its time stamps count, and what its joints' speeds have of noise is passed over."""
    reader = LowStateReader(SAME)
    times = [
        read(reader, low_state(0, shake=1e-4 * (k % 7)), k).message.time_ns  # type: ignore[union-attr]
        for k in range(200)
    ]
    assert np.diff(times).tolist() == [5 * MS] * 199


def test_who_gives_a_crc_has_to_go_on() -> None:
    """A wrong CRC is a fault always, and none is one after the first that was right."""
    reader = LowStateReader(SAME)
    wrong = low_state(1)[:-4] + b"\x01\x02\x03\x04"
    assert "CRC" in read(reader, wrong, 0).fault
    assert not read(reader, low_state(2, crc=False), 1).fault
    assert not read(reader, low_state(3), 2).fault
    assert "CRC" in read(reader, low_state(4, crc=False), 3).fault
    assert not read(reader, low_state(5, crc=False), 4, sender=8).fault  # another sender


def test_a_clock_that_begins_at_zero_goes_on() -> None:
    """States before and after its first tick are in order, as far apart as they were sent."""
    reader, watch = LowStateReader(SAME), StateWatch()
    times = []
    for k, tick in enumerate([0, 0, 5, 10, 15]):
        come = read(reader, low_state(tick, shake=1e-3 * k), k)
        good, fault = watch.take([come])
        assert not fault and len(good) == 1
        times.append(good[0].time_ns)
    assert np.diff(times).tolist() == [5 * MS] * 4


def test_a_clock_that_stops_or_goes_back_brings_no_new_state() -> None:
    """Neither is taken for a sender without a clock: its states are old, and time runs out."""
    reader, watch = LowStateReader(SAME), StateWatch()
    for k, tick in enumerate([20, 25, 25, 0, 0]):
        good, _ = watch.take([read(reader, low_state(tick, shake=1e-3 * k), k)])
        assert len(good) == (k < 2)


def test_a_clock_of_32_bits_goes_on_where_it_begins_again() -> None:
    """After 49.7 days a tick is 0 once more: its states are new, and as far apart as before."""
    reader, watch = LowStateReader(SAME), StateWatch()
    times = []
    for k, tick in enumerate([2**32 - 10, 2**32 - 5, 0, 5, 10]):
        good, fault = watch.take([read(reader, low_state(tick, shake=1e-3 * k), k)])
        assert not fault and len(good) == 1
        times.append(good[0].time_ns)
    assert np.diff(times).tolist() == [5 * MS] * 4 and watch.lost == 0


def test_two_robots_on_one_topic_are_a_fault() -> None:
    """They are told apart by DDS's numbers of their writers, LowState naming no robot."""
    reader, watch = LowStateReader(SAME), StateWatch()
    _, fault = watch.take([read(reader, low_state(20), 0)])
    assert not fault
    _, fault = watch.take([read(reader, low_state(25), 1, sender=8)])
    assert fault == "two robots' states"


def test_who_has_driven_motors_and_drives_none_damps() -> None:
    """A sender that leaves the motors' mode at zero always is not taken to."""
    damped = StateMessage(
        0, 0, 5 * MS, DRIVES_DAMP, np.full(12, 0.1), np.zeros(12), np.zeros(12), np.zeros(3),
        np.array([0.0, 0.0, GRAVITY]), np.zeros(4),
    )  # fmt: skip
    reader, seen = LowStateReader(SAME), []
    for k, data in enumerate(
        [encode_low_state(damped, SAME), low_state(10), encode_low_state(damped, SAME)]
    ):
        message = read(reader, data, k).message
        assert message is not None
        seen.append(message.drives)
    assert seen == [DRIVES_FOLLOW, DRIVES_FOLLOW, DRIVES_DAMP]
