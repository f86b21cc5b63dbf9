"""How much load feet may carry: it ramps, but where a foot lands or is lost."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import flat_walk

from drake_quad.common import FloatArray
from drake_quad.control.contact_load import (
    LANDED_LOAD,
    LOST_LOAD,
    SURE_SHARE,
    caught_load,
    correct_load,
    foot_load,
    hold_load,
    leaving_feet,
)
from drake_quad.gait.swing import Swing
from drake_quad.planning.contact_plan import ContactPlan, Step
from drake_quad.planning.phase_table import phase_table
from drake_quad.robot.legs import LEGS, SIGNS


def load_history(contacts: ContactPlan, count: int = 6000) -> tuple[FloatArray, FloatArray]:
    times, phases = np.linspace(0.0, contacts.duration, count), phase_table(contacts)
    return times, np.array([foot_load(phases, float(t), 0.25) for t in times])


def test_foot_load_is_full_in_stance_none_in_the_air_and_ramps_between() -> None:
    """A foot gives its load away before lift-off and takes it up after touchdown, smoothly.

    It begins with what it has carried since it landed. From nothing it would lift off again: an
    ANYmal B's feet did, at every other touchdown, for up to 50 ms.
    """
    contacts = flat_walk().contacts
    times, load = load_history(contacts)
    _, standing = contacts.feet_at(times)
    assert np.all(load[~standing] == 0.0)
    assert np.all(load[standing] > 0.0) and np.all(load <= 1.0)
    for step in contacts.steps:
        row = step.leg.row
        before = times[(times > step.lift_off - 0.25) & (times < step.lift_off)]
        after = times[(times >= step.touchdown) & (times < step.touchdown + 0.25)]
        down = load[np.isin(times, before), row]
        up = load[np.isin(times, after), row]
        assert np.all(np.diff(down) <= 0.0) and down[-1] < 0.01
        assert np.all(np.diff(up) >= 0.0) and up[0] == LANDED_LOAD
    landed = np.where(standing, load, LANDED_LOAD)  # as a swing ends
    jumps = np.abs(np.diff(load, axis=0))
    touched = ~standing[:-1] & standing[1:]
    jumps[touched] = np.abs(np.diff(landed, axis=0))[touched]
    assert jumps.max() <= 1.5 / 0.2 * (times[1] - times[0]) + 2e-4


@given(st.floats(0.02, 0.4), st.floats(0.05, 1.0))
def test_ramps_share_the_time_that_there_is_on_four_feet(gap: float, unload: float) -> None:
    """With little time between a touchdown and a lift-off both ramps take just that time."""
    plan = flat_walk().contacts
    first, second = plan.steps[0], plan.steps[1]
    close = Step(second.leg, first.touchdown + gap, second.touchdown, second.swing)
    contacts = phase_table(ContactPlan(plan.feet, (first, close), second.touchdown + 1.0))
    middle = foot_load(contacts, first.touchdown + 0.5 * gap, unload)
    if unload >= gap:
        assert middle[first.leg.row] == pytest.approx(0.5)
        assert middle[second.leg.row] == pytest.approx(0.5)
    start = foot_load(contacts, first.touchdown + 1e-9, unload)
    end = foot_load(contacts, first.touchdown + gap - 1e-9, unload)
    assert start[first.leg.row] == LANDED_LOAD and end[second.leg.row] < 1e-3


@pytest.mark.parametrize("bears", [False, True])
def test_load_of_a_foot_that_was_lost_never_jumps_up(bears: bool) -> None:
    """LOST_LOAD till it bears, then it rises with what it has regained; the others keep theirs."""
    loads = []
    for regained in np.linspace(0.0, 1.0, 11):
        load, back = np.array([1.0, 1.0, 0.8, 0.0]), np.array([1.0, regained, 1.0, 1.0])
        bearing = np.array([1.0, float(bears), 1.0, 0.0])
        correct_load(load, np.array([True, True, True, False]), bearing, np.zeros(4), back)
        np.testing.assert_array_equal(load[[0, 2, 3]], [1.0, 0.8, 0.0])
        loads.append(load[1])
    assert loads[0] == pytest.approx(LOST_LOAD)
    assert np.diff(loads) == pytest.approx(0.1 * (1.0 - LOST_LOAD) * bears)


def test_a_foot_that_landed_early_carries_what_a_landed_foot_does() -> None:
    """While the plan still has it in the air; the others carry on."""
    load, standing = np.array([1.0, 0.0, 1.0, 1.0]), np.array([True, False, True, True])
    correct_load(load, standing, np.ones(4), np.ones(4), np.ones(4))
    np.testing.assert_array_equal(load, [1.0, LANDED_LOAD, 1.0, 1.0])


def test_the_last_foot_that_holds_keeps_its_load() -> None:
    """Of feet that are all lost nothing is taken: somebody has to carry."""
    load = np.array([1.0, 1e-4, 1.0, 1.0])
    before = load.copy()
    correct_load(
        load, np.ones(4, dtype=bool), np.array([0.0, 1.0, 0.0, 0.0]), np.zeros(4), np.zeros(4)
    )
    np.testing.assert_array_equal(load, before)


@pytest.mark.parametrize(
    ("bearing", "wanted"),
    [([1, 0, 1, 1], [1, 0, 1, 0]), ([0, 0, 0, 1], [1, 1, 1, 0]), ([0, 0, 0, 0], [1, 1, 1, 0])],
)
def test_in_a_push_those_carry_that_stand_and_bear(bearing: list[int], wanted: list[int]) -> None:
    """If none does, all that are to stand are ready."""
    standing = np.array([True, True, True, False])
    np.testing.assert_array_equal(caught_load(standing, np.array(bearing, dtype=float)), wanted)


def test_two_swing_feet_carry_nothing_and_both_ramp() -> None:
    """A pair's loads fall together before its lift-off, are none in the air, and come back."""
    feet = np.column_stack([SIGNS * 0.3, np.zeros(4)])
    pair = tuple(
        Step(leg, 1.0, 1.5, Swing(feet[leg.row], feet[leg.row] + 0.1, 0.5, 0.25, 0.2))
        for leg in (LEGS[0], LEGS[3])
    )
    contacts = ContactPlan(feet, pair, 3.0)
    times, load = load_history(contacts)
    np.testing.assert_array_equal(load[:, 0], load[:, 3])
    np.testing.assert_array_equal(load[:, 1:3], 1.0)
    air = (times >= 1.0) & (times < 1.5)
    assert np.all(load[air, 0] == 0.0) and np.all(load[~air, 0] > 0.0)
    assert load[np.argmax(times >= 1.5), 0] < 0.5 < load[-1, 0]


def test_two_feet_keep_their_loads_while_the_clock_waits_to_lift_them_and_one_does_not() -> None:
    """The other two hold no robot that stands; the other three do, over which it was to be."""
    feet = np.column_stack([SIGNS * 0.3, np.zeros(4)])
    swings = [
        Step(leg, 1.0, 1.5, Swing(feet[leg.row], feet[leg.row] + 0.1, 0.5, 0.25, 0.2))
        for leg in (LEGS[0], LEGS[3])
    ]
    for count, waiting in ((2, 1.0), (1, 0.0)):
        phases = phase_table(ContactPlan(feet, tuple(swings[:count]), 3.0))
        load, leaving = foot_load(phases, 1.0 - 1e-6, 0.25), leaving_feet(phases, 1.0 - 1e-6)
        assert load[0] < 1e-3 and np.count_nonzero(leaving) == count and leaving[0]
        x, y = 0.1 * (feet[1:].sum(axis=0) - feet[0])[:2]  # well within the other three
        hold_load(load, leaving.astype(float), feet, x, y)
        assert load[0] == pytest.approx(waiting, abs=1e-3)
    assert not leaving_feet(phases, 1.2).any() and not leaving_feet(phases, 2.0).any()


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(1e-4, 0.9))
def test_a_foot_takes_back_what_the_other_three_cannot_bear(
    x: float, y: float, left: float
) -> None:
    """All of it where they do not hold the robot, none where each bears a good share of it."""
    places = np.column_stack([SIGNS * 0.3, np.zeros(4)])
    load = np.array([left, 1.0, 1.0, 1.0])
    hold_load(load, np.array([1.0, 0.0, 0.0, 0.0]), places, x, y)
    # The others' triangle, FR, RL and RR: shares of the weight are barycentric coordinates.
    fr, rl, rr = places[1:, :2]
    share = np.linalg.solve(
        np.array([[fr[0], rl[0], rr[0]], [fr[1], rl[1], rr[1]], [1.0, 1.0, 1.0]]), [x, y, 1.0]
    ).min()
    np.testing.assert_array_equal(load[1:], 1.0)
    assert load[0] >= left
    if share < 0.0:
        assert load[0] == 1.0
    if share > SURE_SHARE:
        assert load[0] == left


def test_loads_of_feet_that_stay_are_not_touched() -> None:
    """Least of all one that lost the ground: it is not to press on what is not there."""
    places = np.column_stack([SIGNS * 0.3, np.zeros(4)])
    before = np.array([LOST_LOAD, 1.0, LANDED_LOAD, 0.0])
    for leaving in (np.zeros(4), np.array([0.0, 1.0, 0.0, 0.0])):
        load = before.copy()
        hold_load(load, leaving, places, 0.5, 0.5)
        np.testing.assert_array_equal(load, before)
