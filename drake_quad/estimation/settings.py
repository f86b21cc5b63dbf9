"""What the filter assumes about sensors and feet: one frozen value."""

from dataclasses import astuple, dataclass

import numpy as np

from drake_quad.common import FloatArray


@dataclass(frozen=True, kw_only=True)
class EstimatorSettings:
    """Noise and patience of the filter. Deviations are one sigma, densities per sqrt(Hz).

    The sensors' own figures are in `imu_model` and `joint_model`; those here are greater, for they
    stand in as well for what no model has: ground that gives, delays, structure that bends.

    Attributes:
        gyro_density: White noise of the gyroscope [rad/s/sqrt(Hz)].
        accel_density: White noise of the accelerometer [m/s^2/sqrt(Hz)].
        gyro_walk: How fast the gyroscope's bias walks [rad/s/sqrt(s)].
        accel_walk: How fast the accelerometer's bias walks [m/s^2/sqrt(s)].
        foot_walk: How fast a firm foot's centre may creep [m/sqrt(s)].
        foot_noise: Deviation of a foot's place in B by the joints [m].
        settle_time: How long a foot must bear before it counts as firm [s].
        release_time: How long a firm foot may seem not to bear before it is let go [s]: contact
            flags chatter.
        gate: Greatest squared Mahalanobis distance (3 degrees of freedom) of a firm foot's
            innovation; beyond it the foot has slipped.
        still_speed: A foot faster than this [m/s], and than three deviations of the base's velocity
            more, is not taken as firm.
        doubt: How fast the velocity grows uncertain while feet bear and all of them seem to slide
            [m/s/sqrt(s)].
        initial_tilt: Deviation of the first roll and pitch [rad].
        initial_yaw: Deviation of the first yaw [rad].
        initial_velocity: Deviation of the first velocity [m/s].
        initial_position: Deviation of the first position [m].
        initial_gyro_bias: Deviation of the gyroscope's turn-on bias [rad/s].
        initial_accel_bias: Deviation of the accelerometer's turn-on bias [m/s^2].
        shock: Velocity that a knock beyond the accelerometer's range may hide [m/s].
        gyro_range: Greatest rate that the gyroscope shows [rad/s].
        accel_range: Greatest specific force that the accelerometer shows [m/s^2].
        lost_velocity: Deviation of the velocity from which the estimate is not healthy [m/s].
        level_start: Deviation of the ground's height under the feet where the robot is put [m];
            0 if the ground there is not known to be level.
    """

    gyro_density: float = 2.0e-4
    accel_density: float = 1.0e-3
    gyro_walk: float = 5.0e-6
    accel_walk: float = 1.0e-4
    foot_walk: float = 1.0e-4
    foot_noise: float = 5.0e-4
    settle_time: float = 0.02
    release_time: float = 0.006
    gate: float = 16.3
    still_speed: float = 0.15
    doubt: float = 0.2
    initial_tilt: float = 0.02
    initial_yaw: float = 1.0e-3
    initial_velocity: float = 0.05
    initial_position: float = 1.0e-3
    initial_gyro_bias: float = 5.0e-3
    initial_accel_bias: float = 0.05
    shock: float = 0.5
    gyro_range: float = 7.85
    accel_range: float = 196.0
    lost_velocity: float = 0.3
    level_start: float = 0.0


DEFAULT_SETTINGS = EstimatorSettings()


def settings_array(settings: EstimatorSettings) -> FloatArray:
    """The settings as the kernels take them: in the order of the fields."""
    return np.array(astuple(settings), dtype=np.float64)


# Places in `settings_array`, in the order of the fields (a test holds the two together).
(
    GYRO_DENSITY,
    ACCEL_DENSITY,
    GYRO_WALK,
    ACCEL_WALK,
    FOOT_WALK,
    FOOT_NOISE,
    SETTLE_TIME,
    RELEASE_TIME,
    GATE,
    STILL_SPEED,
    DOUBT,
    INITIAL_TILT,
    INITIAL_YAW,
    INITIAL_VELOCITY,
    INITIAL_POSITION,
    INITIAL_GYRO_BIAS,
    INITIAL_ACCEL_BIAS,
    SHOCK,
    GYRO_RANGE,
    ACCEL_RANGE,
    LOST_VELOCITY,
    LEVEL_START,
) = range(22)
