"""The joints' encoders show angles and speeds leg by leg, quantised and noisy as the drive's."""

import numpy as np
from pydrake.systems.analysis import Simulator
from rig import fix_inputs, model_layout, read

from drake_quad.common import FloatArray
from drake_quad.estimation.sensor_models import IDEAL_JOINTS, ODRI_DRIVE, JointNoise
from drake_quad.systems.sensors import JointSensor

DT = 0.002


def shown(
    angles: FloatArray,
    speeds: FloatArray,
    *,
    noise: JointNoise = IDEAL_JOINTS,
    seed: int = 0,
    ticks: int = 1,
) -> FloatArray:
    """What the sensor shows (ticks, 24) of joints that stay so (leg by leg)."""
    layout = model_layout()
    sensor = JointSensor(
        layout=layout, generator=np.random.default_rng(seed), noise=noise, period=DT
    )
    simulator = Simulator(sensor)
    context = simulator.get_mutable_context()
    x = np.zeros(layout.size)
    x[layout.q_joints], x[layout.v_joints] = angles, speeds
    fix_inputs(sensor, context, robot_state=x)
    simulator.Initialize()
    rows = []
    for k in range(ticks):
        simulator.AdvanceTo((k + 0.5) * DT)
        rows.append(read(sensor, context, "joint_state_measured"))
    assert not sensor.HasAnyDirectFeedthrough()
    return np.array(rows)


ANGLES, SPEEDS = np.linspace(-1.0, 1.0, 12), np.linspace(3.0, -2.0, 12)


def test_ideal_drives_show_the_truth_leg_by_leg() -> None:
    """Whatever the plant's own order, leg by leg comes out."""
    np.testing.assert_array_equal(shown(ANGLES, SPEEDS)[0], np.concatenate([ANGLES, SPEEDS]))


def test_angles_are_whole_counts() -> None:
    """An encoder shows nothing between two counts, and the nearest one."""
    noise = JointNoise(counts=1000)
    counts = shown(ANGLES, SPEEDS, noise=noise)[0, :12] * 1000 / (2.0 * np.pi)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.abs(counts - ANGLES * 1000 / (2.0 * np.pi)).max() <= 0.5


def test_noise_is_the_drives_own() -> None:
    """Speeds scatter as the drive's; an angle's mean is off by its zero, which stays."""
    rows = shown(ANGLES, SPEEDS, noise=ODRI_DRIVE, ticks=3000)
    np.testing.assert_allclose(rows[:, 12:].std(axis=0), ODRI_DRIVE.speed, rtol=0.1)
    np.testing.assert_allclose(
        rows[:, 12:].mean(axis=0), SPEEDS, atol=4e-3 * ODRI_DRIVE.speed / 0.015
    )
    off = rows[:, :12].mean(axis=0) - ANGLES
    assert 0.3 * ODRI_DRIVE.zero < off.std() < 3.0 * ODRI_DRIVE.zero
    assert np.all(rows[:, :12].std(axis=0) < 3.0 * ODRI_DRIVE.angle)


def test_seed_decides_everything() -> None:
    """One seed, one run to the bit; another seed, another zero."""
    first, again, other = (
        shown(ANGLES, SPEEDS, noise=ODRI_DRIVE, seed=s, ticks=20) for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first.mean(axis=0) - other.mean(axis=0)).max() > 1e-4
