"""A body is brought to rest, and back to its clock, with its centre of pressure kept in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_quad.control.body_rate import CATCH_UP, GRAVITY, next_body_rate, pendulum_rate
from drake_quad.gait.legs import FloatArray

PERIOD = 0.001
heights = st.floats(0.2, 1.0)


def follow(rates: FloatArray, height: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rate, lead and the rate's change after each tick, under a clock that runs at `rates`."""
    pendulum = pendulum_rate(height)
    found, body_rate, lead = [], float("nan"), 0.0
    for rate in rates:
        body_rate, lead, change = next_body_rate(body_rate, lead, rate, pendulum, PERIOD)
        found.append((body_rate, lead, change))
    rate, leads, change = np.array(found).T
    return rate, leads, change


@given(st.sampled_from([0.0, 0.3, 1.0]), heights)
def test_under_a_steady_clock_the_body_is_with_it(rate: float, height: float) -> None:
    """From the first tick on, whatever the rate."""
    found, lead, change = follow(np.full(50, rate), height)
    assert np.all(found == rate) and not lead.any() and not change.any()


@given(heights)
def test_centre_of_pressure_stays_by_the_capture_point(height: float) -> None:
    """On a straight path of speed 1 m/s, a clock that stops leaves it within a tenth of that.

    It is the centre of mass, less its acceleration by the pendulum's rate squared.
    """
    pendulum = pendulum_rate(height)
    assert pendulum == pytest.approx(np.sqrt(GRAVITY / height))
    _, lead, change = follow(np.r_[1.0, np.zeros(4000)], height)
    pressure = lead - change / pendulum**2
    capture = 1.0 / pendulum
    assert np.max(pressure) < 1.1 * capture
    assert pressure[1] == pytest.approx(capture, rel=0.02)


@given(heights)
def test_a_body_ahead_of_a_clock_that_stands_goes_back_once(height: float) -> None:
    """It comes to rest where the clock is, and never behind it."""
    rate, lead, _ = follow(np.r_[1.0, np.zeros(8000)], height)
    assert np.all(lead >= -1e-9) and lead[-1] < 1e-3 and abs(rate[-1]) < 1e-3
    assert np.sum(np.diff(np.sign(np.diff(lead))) != 0) == 1  # ahead, and back


@given(heights, st.floats(0.05, 2.0))
def test_a_clock_that_runs_again_catches_up(height: float, wait: float) -> None:
    """The body is slower until then; its way from rest to full speed is all it is ever behind."""
    stops = np.zeros(round(wait / PERIOD))
    rate, lead, _ = follow(np.r_[1.0, stops, np.ones(6000)], height)
    again = len(stops) + 1
    assert abs(lead[-1]) < 1e-3 and rate[-1] == pytest.approx(1.0, abs=1e-2)
    assert -0.8 / pendulum_rate(height) < np.min(lead[again:])
    assert np.max(lead) < 1.0 / CATCH_UP  # else it would go back from rest
    running = rate[again:]
    assert np.all(running[np.argmax(running > 0.0) :] > 0.0)


@given(st.lists(st.sampled_from([0.0, 0.4, 1.0]), min_size=2, max_size=6), heights)
def test_the_rate_has_no_jumps(rates: list[float], height: float) -> None:
    """However the clock jumps, and its change is what the rate changes by."""
    rate, lead, change = follow(np.repeat(rates, 200), height)
    np.testing.assert_allclose(np.diff(rate), change[1:] * PERIOD, atol=1e-12)
    assert np.max(np.abs(change)) < 2.5 * pendulum_rate(height)
    assert np.all(np.isfinite(lead))


def test_a_fallen_bodys_pendulum_is_finite() -> None:
    """Below its own feet a body has no height; braking is then as of a low one."""
    assert pendulum_rate(-0.2) == pendulum_rate(0.0) < 20.0
