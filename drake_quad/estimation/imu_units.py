"""IMUs by their data sheets, and what a filter is to assume of them."""

from dataclasses import dataclass, replace

import numpy as np

from drake_quad.common import GRAVITY
from drake_quad.estimation.filter_state import DEFAULT_SETTINGS, EstimatorSettings


@dataclass(frozen=True, kw_only=True)
class ImuNoise:
    """Figures of an IMU; all zero (and no range) is the ideal one.

    Attributes:
        name: Name of the unit.
        gyro_density: White noise [rad/s/sqrt(Hz)].
        gyro_turn_on: Deviation of the bias from one start to the next [rad/s].
        gyro_instability: Deviation of what the bias wanders in a run [rad/s].
        gyro_range: Greatest rate [rad/s].
        accel_density: White noise [m/s^2/sqrt(Hz)].
        accel_turn_on: Deviation of the bias from one start to the next [m/s^2].
        accel_instability: Deviation of what the bias wanders in a run [m/s^2].
        accel_range: Greatest specific force [m/s^2].
        correlation_time: Correlation time of the biases' wandering [s].
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


# Analog Devices, "ADIS16495" data sheet, rev. C, 2020: 0.8 deg/h, 0.09 deg/sqrt(h), 3.2 ug, 8 g.
# What differs from start to start, and the accelerometer's noise, are assumptions.
ADIS_16495 = ImuNoise(
    name="Analog Devices ADIS16495, tactical grade",
    gyro_density=float(np.radians(0.09 / 60.0)),
    gyro_turn_on=float(np.radians(0.07)),
    gyro_instability=float(np.radians(0.8 / 3600.0)),
    gyro_range=float(np.radians(450.0)),
    accel_density=20e-6 * GRAVITY,
    accel_turn_on=1.5e-3 * GRAVITY,
    accel_instability=3.2e-6 * GRAVITY,
    accel_range=8.0 * GRAVITY,
)

# Bosch Sensortec, "BMI088" data sheet: 0.014 deg/s/sqrt(Hz), 175 ug/sqrt(Hz), 2000 deg/s, 24 g. The
# offsets of 1 deg/s and 20 mg are taken as two sigma. What wanders in a run, as with the unit's
# temperature, is an assumption: 0.01 deg/s, 0.1 mg.
BMI_088 = ImuNoise(
    name="Bosch BMI088, a cheap MEMS unit",
    gyro_density=float(np.radians(0.014)),
    gyro_turn_on=float(np.radians(0.5)),
    gyro_instability=float(np.radians(0.01)),
    gyro_range=float(np.radians(2000.0)),
    accel_density=175e-6 * GRAVITY,
    accel_turn_on=10e-3 * GRAVITY,
    accel_instability=1e-4 * GRAVITY,
    accel_range=24.0 * GRAVITY,
)

IMUS: dict[str, ImuNoise] = {"mti_300": MTI_300, "adis_16495": ADIS_16495, "bmi_088": BMI_088}


def settings_for(imu: ImuNoise) -> EstimatorSettings:
    """What a filter is to assume of an IMU: more noise than it has, as for the MTi-300.

    It never assumes less than there, for ground and structure give under any robot.

    Args:
        imu: The unit.
    """
    given = DEFAULT_SETTINGS

    def scaled(default: float, name: str) -> float:
        ratio = float(getattr(imu, name)) / float(getattr(MTI_300, name))
        return default * max(1.0, ratio)

    return replace(
        given,
        gyro_density=scaled(given.gyro_density, "gyro_density"),
        accel_density=scaled(given.accel_density, "accel_density"),
        gyro_walk=scaled(given.gyro_walk, "gyro_instability"),
        accel_walk=scaled(given.accel_walk, "accel_instability"),
        initial_gyro_bias=scaled(given.initial_gyro_bias, "gyro_turn_on"),
        initial_accel_bias=scaled(given.initial_accel_bias, "accel_turn_on"),
        gyro_range=given.gyro_range if imu is MTI_300 else imu.gyro_range,
        accel_range=given.accel_range if imu is MTI_300 else imu.accel_range,
    )
