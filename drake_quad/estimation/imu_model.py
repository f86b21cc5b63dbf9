"""The errors of an inertial measurement unit, drawn once for a run.

Each axis reads truth + turn-on bias + walking bias + white noise, clipped to its range (the model
of IEEE Std 952 without its quantisation and ramp). The figures shipped are those of one unit.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import FloatArray

WHITE_ROWS = 2**17  # 262 s at 500 Hz before the same noise comes again
BIAS_ROWS = 4096  # [s]: a row a second, between which the bias is drawn straight


@dataclass(frozen=True, kw_only=True)
class ImuNoise:
    """Figures of an IMU; all zero (and no range) is the ideal one.

    Attributes:
        name: The unit.
        gyro_density: White noise [rad/s/sqrt(Hz)].
        gyro_turn_on: Deviation of the bias from one start to the next [rad/s].
        gyro_instability: Deviation of what the bias wanders in a run [rad/s].
        gyro_range: Greatest rate [rad/s].
        accel_density: White noise [m/s^2/sqrt(Hz)].
        accel_turn_on: Deviation of the bias from one start to the next [m/s^2].
        accel_instability: Deviation of what the bias wanders in a run [m/s^2].
        accel_range: Greatest specific force [m/s^2].
        correlation_time: Over which the biases wander [s].
    """

    name: str = "ideal"
    gyro_density: float = 0.0
    gyro_turn_on: float = 0.0
    gyro_instability: float = 0.0
    gyro_range: float = float("inf")
    accel_density: float = 0.0
    accel_turn_on: float = 0.0
    accel_instability: float = 0.0
    accel_range: float = float("inf")
    correlation_time: float = 300.0


IDEAL_IMU = ImuNoise()

# Movella, "MTi-300" leaflet, May 2023: 0.01 deg/s/sqrt(Hz), 10 deg/h, 450 deg/s; 60 ug/sqrt(Hz),
# 15 ug, 20 g. Xsens knowledge base, "Bias repeatability of gyroscopes": 0.5 deg/s, here two sigma.
# The accelerometer's bias from start to start (3 mg) is an assumption for units of this grade.
MTI_300 = ImuNoise(
    name="Xsens MTi-300",
    gyro_density=float(np.radians(0.01)),
    gyro_turn_on=float(np.radians(0.25)),
    gyro_instability=float(np.radians(10.0 / 3600.0)),
    gyro_range=float(np.radians(450.0)),
    accel_density=60e-6 * GRAVITY,
    accel_turn_on=3e-3 * GRAVITY,
    accel_instability=15e-6 * GRAVITY,
    accel_range=20.0 * GRAVITY,
)


@dataclass(frozen=True, eq=False)
class ImuErrors:
    """The errors of one unit in one run.

    Attributes:
        white: (WHITE_ROWS, 6) white noise of each sample, used in a circle.
        bias: (BIAS_ROWS, 6) bias at each full second, used in a circle.
        limit: (6,) the ranges.
        period: Of the samples [s].
    """

    white: FloatArray
    bias: FloatArray
    limit: FloatArray
    period: float

    def calc_bias(self, tick: int) -> FloatArray:
        """The true bias (6,) at a tick: rate [rad/s], then specific force [m/s^2]."""
        second = tick * self.period
        row = int(second)
        part = second - row
        here, there = self.bias[row % BIAS_ROWS], self.bias[(row + 1) % BIAS_ROWS]
        return here + part * (there - here)

    def apply(self, ideal: FloatArray, tick: int) -> FloatArray:
        """What the unit shows (6,) at a tick where it ought to show `ideal` (6,)."""
        shown = ideal + self.white[tick % WHITE_ROWS] + self.calc_bias(tick)
        return np.minimum(np.maximum(shown, -self.limit), self.limit)


def draw_imu_errors(noise: ImuNoise, period: float, generator: np.random.Generator) -> ImuErrors:
    """Draws all that is random of a unit that is sampled every `period` [s]."""
    n = noise

    def each(gyro: float, accel: float) -> FloatArray:
        return np.repeat([gyro, accel], 3)

    # A mean over the interval: white noise of density N has the deviation N / sqrt(period).
    white = generator.standard_normal((WHITE_ROWS, 6)) * each(
        n.gyro_density / np.sqrt(period), n.accel_density / np.sqrt(period)
    )
    turn_on = generator.standard_normal(6) * each(n.gyro_turn_on, n.accel_turn_on)
    steps = generator.standard_normal((BIAS_ROWS, 6))
    keep = np.exp(-1.0 / n.correlation_time)
    wander = np.empty((BIAS_ROWS, 6))
    value = np.zeros(6)  # the turn-on bias is the whole bias at the start
    for row in range(BIAS_ROWS):
        wander[row] = value
        value = keep * value + np.sqrt(1.0 - keep**2) * steps[row]
    bias = turn_on + wander * each(n.gyro_instability, n.accel_instability)
    for table in (white, bias):
        table.setflags(write=False)
    return ImuErrors(white, bias, each(n.gyro_range, n.accel_range), period)
