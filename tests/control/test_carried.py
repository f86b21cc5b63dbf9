"""An unknown load: what is learned of it is what it is, and the body stands aside for it."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.control.kernel_state import PayloadUpdate
from drake_quad.control.payload_observer import (
    IGNORED,
    MOST_ARM,
    MOST_FORCE,
    MOST_SHIFT,
    at_rest,
    compensating_shift,
    payload_com_shift,
    payload_wrench,
    update_payload,
)

WEIGHT = 60.0 * GRAVITY
HOW = PayloadUpdate(force_rate=6000.0, moment_rate=2000.0, weight=WEIGHT, period=0.002)
angles = st.floats(-3.0, 3.0)
places = st.floats(-0.4, 0.4)


def turned(heading: float) -> FloatArray:
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, -s], [s, c]])


def load_of(mass: float, x: float, y: float) -> FloatArray:
    """What a mass [kg] at x, y of the heading frame [m] needs: minus the wrench of its weight."""
    moment = np.cross([x, y, 0.0], [0.0, 0.0, -mass * GRAVITY])
    return np.array([mass * GRAVITY, -moment[0], -moment[1]])


@given(st.floats(0.0, 25.0), places, places, angles, places, places)
@settings(max_examples=50)
def test_centre_of_mass_moves_as_that_of_two_bodies(
    mass: float, x: float, y: float, heading: float, cx: float, cy: float
) -> None:
    """The whole's centre is the robot's and the load's, weighed, but for what is ignored."""
    p_BScm = np.array([cx, cy, 0.0])
    p_load = turned(heading) @ [x, y]
    expected = mass * (p_load - p_BScm[:2]) / (60.0 + mass)
    found = payload_com_shift(load_of(mass, x, y), p_BScm, heading, WEIGHT)
    assert np.linalg.norm(found - expected) <= IGNORED + 1e-9
    assert np.linalg.norm(found) <= np.linalg.norm(expected) + 1e-9


@given(st.floats(-20.0, 20.0), places, places, angles, angles)
@settings(max_examples=30)
def test_wrench_turns_with_the_heading(
    mass: float, x: float, y: float, heading: float, more: float
) -> None:
    """A load on the robot turns with it, and its weight stays what it is."""
    before = payload_wrench(load_of(mass, x, y), heading)
    after = payload_wrench(load_of(mass, x, y), heading + more)
    np.testing.assert_allclose(after[:2], turned(more) @ before[:2], atol=1e-9)
    assert after[5] == before[5] == pytest.approx(mass * GRAVITY)


@given(places, places, angles)
@settings(max_examples=30)
def test_what_is_learned_counters_the_error(height: float, tilt: float, heading: float) -> None:
    """Too low asks for a force up; a tilt asks for a moment about the way it has to be righted."""
    axis = turned(heading) @ [1.0, 0.0]
    tilts = np.array([*(tilt * axis), 0.0])
    found = update_payload(np.zeros(3), height, tilts, heading, HOW)
    expected = [HOW.force_rate * height, HOW.moment_rate * tilt, 0.0]
    np.testing.assert_allclose(found, np.array(expected) * HOW.period, atol=1e-9)
    np.testing.assert_array_equal(update_payload(np.zeros(3), 0.0, np.zeros(3), heading, HOW), 0.0)


def test_what_is_learned_is_bounded() -> None:
    """However long an error lasts, no load is believed that no robot could carry."""
    carried = np.zeros(3)
    for _ in range(20000):
        carried = update_payload(carried, 0.5, np.array([0.5, -0.5, 0.0]), 0.0, HOW)
    limit = [MOST_FORCE * WEIGHT, MOST_ARM * WEIGHT, -MOST_ARM * WEIGHT]
    np.testing.assert_allclose(carried, limit)


@given(places, places)
@settings(max_examples=30)
def test_body_stands_aside_by_as_much_but_not_too_far(x: float, y: float) -> None:
    """Against the shift, as far as makes up for it, and never farther than the legs may."""
    found, gain = compensating_shift(np.array([x, y]), 0.8), 0.8
    wanted = -np.array([x, y]) / gain
    assert np.linalg.norm(found) == pytest.approx(min(np.linalg.norm(wanted), MOST_SHIFT), abs=1e-9)
    assert found @ wanted >= -1e-12


@pytest.mark.parametrize("which", range(3))
def test_a_push_is_no_load(which: int) -> None:
    """Moving, tilting or turning otherwise than told, the robot is not at rest; else it is."""
    errors = [np.zeros(3) for _ in range(3)]
    assert at_rest(*errors)
    errors[which][1] = 0.3
    assert not at_rest(*errors)
