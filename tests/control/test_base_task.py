"""The base's part of a control tick: velocity, rotation error, target."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pydrake.math import RollPitchYaw, RotationMatrix
from rig import flat_walk, rotations

from drake_quad.common import FloatArray
from drake_quad.control.base_tracking import (
    base_target,
    rotation_error,
    shorten,
    smooth_step,
    wanted_acceleration,
)
from drake_quad.control.kernel_state import TARGET, BaseGains, Record, fields_of, new_record


@given(st.floats(-2.0, 3.0), st.floats(1e-6, 0.5))
def test_smooth_is_a_step_that_rises_and_is_symmetric(x: float, dx: float) -> None:
    """0 until 0, 1 from 1 on, never falling, and turned about its middle onto itself."""
    assert smooth_step(x + dx) >= smooth_step(x)
    assert smooth_step(x) + smooth_step(1.0 - x) == pytest.approx(1.0)
    assert smooth_step(min(x, 0.0)) == 0.0 and smooth_step(max(x, 1.0)) == 1.0


def target_of(body: FloatArray, rate: float, change: float, height: float) -> Record:
    """The target that `base_target` writes."""
    target = fields_of(new_record(TARGET))
    base_target(body, rate, change, height, target)
    return target


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
    target = target_of(motion, 1.0, 0.0, 0.0)
    np.testing.assert_allclose(target.w, [W[2, 1], W[0, 2], W[1, 0]], atol=1e-8)
    np.testing.assert_allclose(target.v, rates[:3])
    target = target_of(motion, 0.0, 0.0, 0.0)
    assert not target.v.any() and not target.w.any()


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
    target = target_of(sample.body, rate, change, height)
    np.testing.assert_allclose(target.body, before[0] + [0.0, 0.0, height, 0.0, 0.0])
    np.testing.assert_allclose(target.R, rotations(before[0]), atol=1e-12)
    np.testing.assert_allclose(target.v, rate * before[1, :3])
    acceleration = rate**2 * before[2] + change * before[1]
    np.testing.assert_allclose(target.acceleration[3:], acceleration[:3])
    np.testing.assert_allclose(target.acceleration[2], acceleration[4])
    np.testing.assert_array_equal(sample.body, before)


GAINS = BaseGains(30.0, 11.0, 20.0, 7.0, most_shift=0.05, most_turn=0.03, most_acceleration=3.0)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("error", "size", "wanted"),
    [
        ("shift", 0.04, 30.0 * 0.04),
        ("shift", 0.2, 30.0 * 0.05),  # no more counts
        ("speed", 0.1, 11.0 * 0.1),
        ("turn", 0.02, 20.0 * 0.02),
        ("turn", 0.1, 20.0 * 0.03),
        ("spin", 0.5, 7.0 * 0.5),
    ],
)
def test_an_error_is_corrected_along_its_own_axis(
    axis: int, sign: float, error: str, size: float, wanted: float
) -> None:
    """Each by its gain, and by what counts of it, besides the plan's own acceleration."""
    plan = np.array([0.1, -0.2, 0.3, -0.4, 0.5, 0.6])
    errors = {name: np.zeros(3) for name in ("shift", "speed", "turn", "spin")}
    errors[error][axis] = sign * size
    shift, speed, turn, spin = errors.values()
    found = wanted_acceleration(plan, shift, speed, turn, spin, GAINS) - plan
    expected = np.zeros(6)
    expected[axis + 3 * (error in ("shift", "speed"))] = sign * wanted
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_the_base_is_asked_for_no_more_than_it_may_sideways() -> None:
    """Horizontally, in all; up and down, and in turning, what is wanted is asked for."""
    speed, spin, zero = np.array([3.0, 4.0, 2.0]), np.array([1.0, 2.0, 3.0]), np.zeros(3)
    found = wanted_acceleration(np.zeros(6), zero, speed, zero, spin, GAINS)
    np.testing.assert_allclose(found, [7.0, 14.0, 21.0, 1.8, 2.4, 22.0], atol=1e-12)
