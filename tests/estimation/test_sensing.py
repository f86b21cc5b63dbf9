"""The compiled sensors show what the errors' own description says, to the bit."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.common import FloatArray
from drake_quad.estimation.imu_units import IDEAL_IMU, MTI_300, ImuNoise
from drake_quad.estimation.sensor_models import (
    IDEAL_JOINTS,
    ODRI_DRIVE,
    JointNoise,
    draw_imu_errors,
    draw_joint_errors,
    imu_increments,
    sense_imu,
    sense_joints,
)

PERIOD = 0.002
Q_BASE, V_BASE, SIZE = 3, 22, 37
seeds = st.integers(0, 2**32 - 1)
ticks = st.integers(0, 2**22)  # beyond where every table begins again
examples = settings(max_examples=40, deadline=None)
IMUS = {n.name: draw_imu_errors(n, PERIOD, np.random.default_rng(1)) for n in (IDEAL_IMU, MTI_300)}
DRIVES = {
    n.name: draw_joint_errors(n, np.random.default_rng(2)) for n in (IDEAL_JOINTS, ODRI_DRIVE)
}


def two_samples(seed: int, size: float) -> tuple[FloatArray, FloatArray]:
    """A state, and quaternion and velocity of a sample before it that differ by about `size`."""
    rng = np.random.default_rng(seed)
    state = rng.normal(size=SIZE)
    before = np.concatenate([state[Q_BASE : Q_BASE + 4], state[V_BASE + 3 : V_BASE + 6]])
    return state, before + size * rng.normal(size=7)


@pytest.mark.parametrize("noise", [IDEAL_IMU, MTI_300], ids=lambda n: n.name)
@examples
@given(seed=seeds, tick=ticks, size=st.sampled_from([0.0, 1e-4, 0.05]))
def test_imu_shows_the_increments_with_its_errors(
    noise: ImuNoise, seed: int, tick: int, size: float
) -> None:
    """At any tick and far beyond its ranges; then it remembers this sample for the next."""
    errors, (state, before) = IMUS[noise.name], two_samples(seed, size)
    now = np.concatenate([state[Q_BASE : Q_BASE + 4], state[V_BASE + 3 : V_BASE + 6]])
    expected = errors.apply(imu_increments(before, now, PERIOD), tick)
    shown = np.zeros(6)
    sense_imu(state, Q_BASE, V_BASE, before, tick, errors.tables, shown)
    np.testing.assert_array_equal(shown, expected)
    np.testing.assert_array_equal(before, now)


@pytest.mark.parametrize("noise", [IDEAL_JOINTS, ODRI_DRIVE], ids=lambda n: n.name)
@examples
@given(seed=seeds, tick=ticks)
def test_encoders_show_the_joints_with_their_errors(
    noise: JointNoise, seed: int, tick: int
) -> None:
    """Wherever the joints are in the state."""
    errors, rng = DRIVES[noise.name], np.random.default_rng(seed)
    state, places, shown = rng.normal(size=SIZE), rng.permutation(SIZE)[:24], np.zeros(24)
    sense_joints(state, places, tick, errors.tables, shown)
    np.testing.assert_array_equal(shown, errors.apply(state[places], tick))
