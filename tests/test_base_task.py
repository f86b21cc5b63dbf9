"""The base's part of a control tick: loads of the feet, velocity, rotation error, target."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RollPitchYaw, RotationMatrix
from rig import flat_walk, rotations

from drake_quad.control.base_task import (
    LANDED_LOAD,
    base_target,
    body_motion,
    foot_load,
    rotation_error,
    shorten,
    smooth,
    smooth_step,
)
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.contact_plan import ContactPlan, Step
from drake_quad.planning.plan_table import phase_table


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


@given(st.floats(-2.0, 3.0), st.floats(1e-6, 0.5))
def test_smooth_is_a_step_that_rises_and_is_symmetric(x: float, dx: float) -> None:
    """0 until 0, 1 from 1 on, never falling, and turned about its middle onto itself."""
    assert smooth(x + dx) >= smooth(x)
    assert smooth(x) + smooth(1.0 - x) == pytest.approx(1.0)
    assert smooth(min(x, 0.0)) == 0.0 and smooth(max(x, 1.0)) == 1.0


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_velocity_of_the_plans_angles_is_the_bodys(seed: int) -> None:
    """Rates of yaw and pitch make the angular velocity that the rotation really has."""
    rng = np.random.default_rng(seed)
    body, rates = rng.uniform(-1.0, 1.0, 5), rng.uniform(-1.0, 1.0, 5)
    h = 1e-6
    before, after = (rotations(body + sign * h * rates) for sign in (-1.0, 1.0))
    W = (after - before) / (2 * h) @ rotations(body).T
    motion = np.stack([body, rates, np.zeros(5)])
    _, _, v, w, _ = body_motion(motion, 1.0, 0.0, 0.0)
    np.testing.assert_allclose(w, [W[2, 1], W[0, 2], W[1, 0]], atol=1e-8)
    np.testing.assert_allclose(v, rates[:3])
    _, _, v, w, _ = body_motion(motion, 0.0, 0.0, 0.0)
    assert not v.any() and not w.any()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_rotation_error_is_the_small_turn_that_is_missing(seed: int) -> None:
    """Turning by it, in W, takes the one rotation to the other, to first order."""
    rng = np.random.default_rng(seed)
    R = RollPitchYaw(rng.uniform(-1.0, 1.0, 3)).ToRotationMatrix()
    turn = rng.uniform(-0.01, 0.01, 3)
    desired = RotationMatrix(RollPitchYaw(turn)).multiply(R)
    error = rotation_error(desired.matrix(), R.matrix())
    np.testing.assert_allclose(error, turn, atol=1e-4)


@given(st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=3), st.floats(1e-3, 20.0))
def test_shorten_keeps_the_direction_and_bounds_the_length(v: list[float], most: float) -> None:
    """A vector short enough is left as it is; a longer one is as long as it may be."""
    found = shorten(np.array(v), most)
    length = float(np.linalg.norm(v))
    assert np.linalg.norm(found) == pytest.approx(min(length, most), abs=1e-9)
    np.testing.assert_allclose(found * length, np.array(v) * np.linalg.norm(found), atol=1e-8)


@given(st.floats(-1.0, 2.0))
def test_the_two_smooth_steps_are_one(x: float) -> None:
    """The compiled one of the feet and the plain one of the loads are the same function."""
    assert smooth_step(x) == smooth(x)


@given(
    st.floats(0.0, 1.0),
    st.sampled_from([0.0, 0.5, 1.0]),
    st.floats(-5.0, 5.0),
    st.floats(-0.1, 0.1),
)
@settings(max_examples=30)
def test_base_target_is_the_plans_body_by_the_rate(
    share: float, rate: float, change: float, height: float
) -> None:
    """Pose from the plan and the ground's height, velocity and acceleration by the rate.

    The acceleration is that of a path whose rate changes; the plan's own sample is left as it was.
    """
    sample = flat_walk().sample(share * flat_walk().duration)
    before = sample.body.copy()
    target = base_target(sample.body, rate, change, height, np.ones((4, 3)), np.ones(4))
    np.testing.assert_allclose(target.body, before[0] + [0.0, 0.0, height, 0.0, 0.0])
    np.testing.assert_allclose(target.R, rotations(before[0]), atol=1e-12)
    np.testing.assert_allclose(target.v, rate * before[1, :3])
    acceleration = rate**2 * before[2] + change * before[1]
    np.testing.assert_allclose(target.acceleration[3:], acceleration[:3])
    np.testing.assert_allclose(target.acceleration[2], acceleration[4])
    np.testing.assert_array_equal(sample.body, before)
