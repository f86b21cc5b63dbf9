"""The clock's common tick does what the whole scheduler would, or leaves the tick to it."""

import numpy as np
import pytest
from control_rig import phase_at
from hypothesis import given, settings, strategies as st
from rig import flat_walk

from drake_quad.common import FloatArray
from drake_quad.control.gait_clock import advance_if_uneventful
from drake_quad.control.ports import BALANCE_SIZE, Balance, GaitPhase, Mode

PERIOD, PUSH = 0.002, 0.12
PLAN = flat_walk()
share = st.floats(0.0, 1.0)


def ran(phase: FloatArray, *, speed: float = 0.0, until: float = PLAN.duration) -> bool:
    """Whether the clock went on by itself."""
    balance = np.zeros(BALANCE_SIZE)
    balance[Balance.VELOCITY_ERROR + 1] = speed
    return advance_if_uneventful(
        phase, PLAN.tables.phases, PLAN.index, until, PERIOD, balance, PUSH
    )


@given(share)
@settings(max_examples=200)
def test_it_goes_on_within_a_phase_of_the_contacts_alone(part: float) -> None:
    """By a period, with the swing's phase of the plan; across a switch nothing changes."""
    t = part * PLAN.duration
    phase = phase_at(t)
    before, contacts = phase.copy(), PLAN.contacts
    same = contacts.phase_index(t) == contacts.phase_index(t + PERIOD)
    went_on = ran(phase)
    assert went_on == (same and t > 0.0 and t + PERIOD < PLAN.duration - PERIOD)
    if not went_on:
        np.testing.assert_array_equal(phase, before)
        return
    assert phase[GaitPhase.TIME] == t + PERIOD
    current = contacts.phase(t + PERIOD)
    if current.step is not None:
        expected = (t + PERIOD - current.start) / (current.end - current.start)
        assert phase[GaitPhase.SWING_PHASE] == expected
    for place in set(GaitPhase) - {GaitPhase.TIME, GaitPhase.SWING_PHASE}:
        assert phase[place] == before[place]


@pytest.mark.parametrize("place", [GaitPhase.RATE, GaitPhase.TASK, GaitPhase.MODE])
def test_what_is_to_be_decided_is_left(place: GaitPhase) -> None:
    """A clock that waited, another task, another mode: nothing changes."""
    phase = phase_at(0.5 * PLAN.duration)
    assert ran(phase)
    phase[place] = {GaitPhase.RATE: 0.0, GaitPhase.TASK: 7.0}.get(place, float(Mode.CATCH))
    before = phase.copy()
    assert not ran(phase)
    np.testing.assert_array_equal(phase, before)


@given(st.one_of(st.floats(-1.0, 1.0), st.just(float("nan"))))
def test_a_push_is_left(speed: float) -> None:
    """It goes on only where the base's velocity is known to be nearly the plan's."""
    assert ran(phase_at(0.5 * PLAN.duration), speed=speed) == (abs(speed) < PUSH)


def test_the_end_of_a_segment_is_left() -> None:
    """So that its index, which only the whole scheduler looks for, is right from the first tick."""
    t = 0.5 * PLAN.duration
    assert not ran(phase_at(t), until=t + PERIOD)
    assert ran(phase_at(t), until=t + 3.0 * PERIOD)
