"""The errors of all of a robot's sensors together."""

from dataclasses import dataclass

import numpy as np

from drake_quad.estimation.imu_model import ImuNoise
from drake_quad.estimation.joint_model import JointNoise


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """What the sensors are like, and what their errors are drawn from.

    Attributes:
        imu: Of the IMU.
        joints: Of the joints' drives.
        imu_generator: Random numbers of the IMU.
        joint_generator: Random numbers of the drives.
    """

    imu: ImuNoise
    joints: JointNoise
    imu_generator: np.random.Generator
    joint_generator: np.random.Generator
