"""The base's part of a control tick: velocity, rotation error, target."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RollPitchYaw, RotationMatrix
from rig import flat_walk, rotations

from drake_quad.control.base_task import (
    base_target,
    body_motion,
    rotation_error,
    shorten,
    smooth,
    smooth_step,
)


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
