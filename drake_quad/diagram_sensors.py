"""The robot's own sensors beside the simulated plant, for a controller that estimates its state."""

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_quad.estimation.sensor_errors import SensorErrors
from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.robot_state import StateLayout
from drake_quad.systems.imu import Imu
from drake_quad.systems.joint_sensor import JointSensor


def AddSensors(
    builder: DiagramBuilder,
    state: OutputPort,
    *,
    layout: StateLayout,
    errors: SensorErrors,
    period: float,
) -> dict[str, OutputPort]:
    """Adds an IMU and the joints' encoders, which alone see the simulated state.

    Returns:
        Their outputs by the controller's names for them.
    """
    imu = builder.AddNamedSystem(
        "imu",
        Imu(layout=layout, generator=errors.imu_generator, noise=errors.imu, period=period),
    )
    joints = builder.AddNamedSystem(
        "joint_sensor",
        JointSensor(
            layout=layout, generator=errors.joint_generator, noise=errors.joints, period=period
        ),
    )
    for sensor in (imu, joints):
        builder.Connect(state, sensor.GetInputPort("robot_state"))
    return {
        "imu_measured": imu.GetOutputPort("imu_measured"),
        "joint_state_measured": joints.GetOutputPort("joint_state_measured"),
    }


def at_rest(q: FloatArray) -> dict[str, FloatArray]:
    """What they say of a robot at rest on level ground with joint angles `q` (12,) [rad]."""
    return {
        "imu_measured": np.array([0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY]),
        "joint_state_measured": np.concatenate([q, np.zeros(12)]),
    }
