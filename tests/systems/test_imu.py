"""The IMU feels what it should, with the errors of its unit and no others."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context
from rig import GRAVITY, fix_inputs, model_layout, read

from drake_quad.common import FloatArray
from drake_quad.estimation.imu_units import IDEAL_IMU, MTI_300, ImuNoise
from drake_quad.systems.sensors import Imu

DT = 0.002


class Bench:
    """An IMU by itself, whose robot does what it is told."""

    def __init__(self, noise: ImuNoise = IDEAL_IMU, seed: int = 0) -> None:
        generator = np.random.default_rng(seed)
        self.imu = Imu(layout=model_layout(), generator=generator, noise=noise, period=DT)
        self.simulator = Simulator(self.imu)
        self.context: Context = self.simulator.get_mutable_context()
        self.tick = 0

    def sample(
        self,
        *,
        pitch: float = 0.0,
        yaw: float = 0.0,
        velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> FloatArray:
        """What it shows at the next tick, the robot being so then."""
        layout = model_layout()
        x = np.zeros(layout.size)
        cp, sp, cy, sy = (f(0.5 * angle) for angle in (pitch, yaw) for f in (np.cos, np.sin))
        x[layout.q_base : layout.q_base + 4] = [cy * cp, -sy * sp, cy * sp, sy * cp]
        x[layout.v_base + 3 : layout.v_base + 6] = velocity
        fix_inputs(self.imu, self.context, robot_state=x)
        if self.tick == 0:
            self.simulator.Initialize()
        self.simulator.AdvanceTo((self.tick + 0.5) * DT)
        self.tick += 1
        return read(self.imu, self.context, "imu_measured")


def test_robot_at_rest_feels_gravity_and_no_turn() -> None:
    """Specific force points up, as long as gravity, in B's axes."""
    bench = Bench()
    for _ in range(3):
        shown = bench.sample(pitch=0.3)
    np.testing.assert_allclose(shown[:3], 0.0, atol=1e-12)
    up = [-np.sin(0.3) * GRAVITY, 0.0, np.cos(0.3) * GRAVITY]
    np.testing.assert_allclose(shown[3:], up, atol=1e-9)


def test_free_fall_feels_nothing() -> None:
    """What falls with gravity has no specific force."""
    bench = Bench()
    for k in range(4):
        shown = bench.sample(velocity=(0.0, 0.0, -GRAVITY * k * DT))
    np.testing.assert_allclose(shown, 0.0, atol=1e-9)


def test_turn_is_the_whole_turn_of_the_interval() -> None:
    """Rate times period is the rotation since the last sample, whatever rate was in between."""
    bench = Bench()
    bench.sample(yaw=0.1)
    assert bench.sample(yaw=0.13)[2] == pytest.approx(0.03 / DT)
    assert bench.sample(yaw=0.13)[2] == pytest.approx(0.0, abs=1e-9)


def test_acceleration_is_felt_in_the_bodys_axes() -> None:
    """A robot that looks along W's y and speeds up along it feels it in front."""
    bench = Bench()
    bench.sample(yaw=0.5 * np.pi)
    shown = bench.sample(yaw=0.5 * np.pi, velocity=(0.0, 2.0 * DT, 0.0))
    np.testing.assert_allclose(shown[3:], [2.0, 0.0, GRAVITY], atol=1e-9)


def test_sums_of_readings_are_the_motion() -> None:
    """However the velocity jumps, the readings add up to its change: an IMU integrates."""
    bench, total, steps = Bench(), np.zeros(3), np.random.default_rng(3).normal(size=(50, 3))
    bench.sample()
    for step in steps:
        v = (float(step[0]), float(step[1]), float(step[2]))
        total += (bench.sample(velocity=v)[3:] - [0.0, 0.0, GRAVITY]) * DT
    np.testing.assert_allclose(total, steps[-1], atol=1e-9)


def test_noise_is_the_units_own() -> None:
    """What is left after truth and bias is white, of the density of the data sheet."""
    bench = Bench(MTI_300, seed=5)
    n = 2000
    shown = np.array([bench.sample() for _ in range(n)])
    bias = np.array([bench.imu.errors.calc_bias(k) for k in range(n)])
    rest = shown - [0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY] - bias
    expected = np.repeat([MTI_300.gyro_density, MTI_300.accel_density], 3) / np.sqrt(DT)
    np.testing.assert_allclose(rest.std(axis=0), expected, rtol=0.1)
    assert np.all(np.abs(rest.mean(axis=0)) < 4.0 * expected / np.sqrt(n))
    beside = np.mean(rest[1:] * rest[:-1], axis=0) / expected**2
    assert np.all(np.abs(beside) < 0.1)


def test_reading_ends_at_the_range() -> None:
    """A knock beyond the range shows the range."""
    bench = Bench(MTI_300)
    bench.sample()
    assert bench.sample(velocity=(1.0, 0.0, 0.0))[3] == MTI_300.accel_range


def test_seed_decides_everything() -> None:
    """Two units of one seed show the same to the bit; another seed has another bias."""
    first, again, other = (
        np.array([b.sample() for _ in range(20)])
        for b in (Bench(MTI_300, 1), Bench(MTI_300, 1), Bench(MTI_300, 2))
    )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first.mean(axis=0) - other.mean(axis=0)).max() > 1e-3


def test_contexts_share_nothing() -> None:
    """A second simulation of the same IMU begins with no memory of the first."""
    bench = Bench()
    bench.sample(yaw=0.4)
    bench.sample(yaw=0.8)
    fresh = bench.imu.CreateDefaultContext()
    np.testing.assert_allclose(read(bench.imu, fresh, "imu_measured"), [0, 0, 0, 0, 0, GRAVITY])
    assert not bench.imu.HasAnyDirectFeedthrough()
