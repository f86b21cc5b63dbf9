"""A body is brought to rest, and back to its clock, with its centre of pressure kept in."""

import numpy as np
import pytest
from control_rig import TICK, Controller, phase_at, state_on
from hypothesis import given, strategies as st
from rig import flat_walk

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.control.base_tracking import CATCH_UP, height_over, next_body_rate, pendulum_rate
from drake_quad.control.ports import Balance
from drake_quad.control.settings import ControlSettings
from drake_quad.systems.tracking_controller import IkController

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


def pressure_of(lead: FloatArray, change: FloatArray, height: float) -> FloatArray:
    """How far the centre of pressure is ahead, on a straight, level path of speed 1 m/s [m].

    It is the centre of mass, less its acceleration by the pendulum's rate squared.
    """
    return lead - change / pendulum_rate(height) ** 2


@given(st.sampled_from([0.0, 0.3, 1.0]), heights)
def test_under_a_steady_clock_the_body_is_with_it(rate: float, height: float) -> None:
    """From the first tick on, whatever the rate."""
    found, lead, change = follow(np.full(50, rate), height)
    assert np.all(found == rate) and not lead.any() and not change.any()


@given(heights)
def test_pressure_begins_on_the_capture_point_and_comes_back_from_there(height: float) -> None:
    """Under a clock that stops: never a twelfth beyond it, and never behind the clock."""
    pendulum = pendulum_rate(height)
    assert pendulum == pytest.approx(np.sqrt(GRAVITY / height))
    _, lead, change = follow(np.r_[1.0, np.zeros(6000)], height)
    pressure = pressure_of(lead, change, height)
    assert pressure[1] == pytest.approx(1.0 / pendulum, rel=0.02)
    assert np.max(pressure) < (1.0 + 1.0 / 12.0) / pendulum
    assert np.min(pressure) > -1e-6 and pressure[-1] < 2e-3
    assert np.max(lead) < 0.75 / pendulum


@given(heights)
def test_a_body_ahead_of_a_clock_that_stands_goes_back_once(height: float) -> None:
    """It comes to rest where the clock is, and never behind it."""
    rate, lead, _ = follow(np.r_[1.0, np.zeros(8000)], height)
    assert np.all(lead >= -1e-9) and lead[-1] < 1e-3 and abs(rate[-1]) < 1e-3
    assert np.sum(np.diff(np.sign(np.diff(lead))) != 0) == 1  # ahead, and back


@given(heights, st.floats(0.05, 2.0))
def test_a_clock_that_runs_again_catches_up(height: float, wait: float) -> None:
    """The body is slower until then; its way from rest to full speed is all it is ever behind.

    So is its centre of pressure: at most a quarter more than the capture point is ahead.
    """
    stops = np.zeros(round(wait / PERIOD))
    rate, lead, change = follow(np.r_[1.0, stops, np.ones(6000)], height)
    again, pendulum = len(stops) + 1, pendulum_rate(height)
    assert abs(lead[-1]) < 1e-3 and rate[-1] == pytest.approx(1.0, abs=1e-2)
    assert -0.8 / pendulum < np.min(lead[again:])
    assert -1.25 / pendulum < np.min(pressure_of(lead, change, height)[again:])
    assert np.max(lead) < 1.0 / CATCH_UP  # else it would go back from rest
    running = rate[again:]
    assert np.all(running[np.argmax(running > 0.0) :] > 0.0)


@given(heights, st.floats(0.0, 0.1))
def test_a_clock_that_creeps_is_hardly_other_than_one_that_stands(
    height: float, rate: float
) -> None:
    """As where a demanded margin slows it down: the same way to rest, a little farther on."""
    standing, creeping = (follow(np.r_[1.0, np.full(3000, r)], height) for r in (0.0, rate))
    for a, b, scale in zip(standing, creeping, (1.0, 1.0, pendulum_rate(height)), strict=True):
        assert np.max(np.abs(a - b)) <= 2.0 * rate * scale + 1e-12


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=6), heights)
def test_the_rate_has_no_jumps(rates: list[float], height: float) -> None:
    """However the clock jumps, and its change is what the rate changes by."""
    rate, lead, change = follow(np.repeat(rates, 200), height)
    np.testing.assert_allclose(np.diff(rate), change[1:] * PERIOD, atol=1e-12)
    assert np.max(np.abs(change)) < 2.5 * pendulum_rate(height)
    assert np.all(np.isfinite(lead))


def test_a_fallen_bodys_pendulum_is_finite() -> None:
    """Below its own feet a body has no height; braking is then as of a low one."""
    assert pendulum_rate(-0.2) == pendulum_rate(0.0) < 20.0


@given(st.lists(st.floats(-1.0, 1.0), min_size=5, max_size=5))
def test_height_is_over_the_feet_wherever_the_ground_is(z: list[float]) -> None:
    """Over their mean; on ground that is so much higher it is the same."""
    feet = np.zeros((4, 3))
    feet[:, 2], mean = z[:4], sum(z[:4]) / 4.0
    assert height_over(mean + 0.7, feet) == pytest.approx(0.7)
    feet[:, 2] += z[4]
    assert height_over(mean + z[4] + 0.7, feet) == pytest.approx(0.7)


def test_a_controller_brakes_its_body_as_its_clock_stops() -> None:
    """What it wants of the base is the plan's ahead of the clock, at the rate and as it changes."""
    plan, t = flat_walk(), 6.0
    at = state_on(plan, t)
    robot = Controller(IkController, plan, at, control=ControlSettings(), t=t).tick()
    pendulum = pendulum_rate(height_over(plan.sample(t).body[0, 2], plan.sample(t).feet))
    body_rate, lead = 1.0, 0.0
    for _ in range(40):
        robot.give(plan, at, phase_at(t, rate=0.0))
        robot.tick()
        body_rate, lead, change = next_body_rate(body_rate, lead, 0.0, pendulum, TICK)
        body = plan.sample(t + lead).body
        np.testing.assert_allclose(robot.out("body_desired"), body[0], atol=1e-9)
        balance = robot.out("balance_estimated")
        wanted = body_rate**2 * body[2, :2] + change * body[1, :2]
        found = balance[Balance.ACCELERATION : Balance.ACCELERATION + 2]
        np.testing.assert_allclose(found, wanted, atol=1e-6)
        np.testing.assert_allclose(
            balance[Balance.VELOCITY_ERROR : Balance.FEET], -body_rate * body[1, :2], atol=1e-9
        )
        np.testing.assert_allclose(
            balance[Balance.PLACE_ERROR :], (plan.sample(t).body[0] - body[0])[:2], atol=1e-9
        )
    assert lead > 0.1 and np.max(np.abs(body[1, :2])) > 0.02  # there was something to brake


def test_a_plan_begins_with_the_body_where_its_clock_is() -> None:
    """What it was ahead in the task before does not count in the next."""
    plan, t = flat_walk(), 6.0
    robot = Controller(IkController, plan, state_on(plan, t), control=ControlSettings(), t=t).tick()
    robot.give(plan, state_on(plan, t), phase_at(t, rate=0.0))
    robot.tick(40)
    robot.give(plan, state_on(plan, 0.0), phase_at(0.0))
    robot.tick()
    np.testing.assert_allclose(robot.out("body_desired"), plan.sample(0.0).body[0], atol=1e-9)
