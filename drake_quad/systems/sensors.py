"""The sensors: an IMU on the trunk, encoders and torques of the joints, and tilt under the feet."""

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem, State

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.estimation.ground_normals import feel_normals
from drake_quad.estimation.imu_units import IDEAL_IMU, ImuNoise
from drake_quad.estimation.sensor_models import (
    IDEAL_JOINTS,
    ImuErrors,
    JointErrors,
    JointNoise,
    TorqueErrors,
    draw_imu_errors,
    draw_joint_errors,
    sense_imu,
    sense_joints,
)
from drake_quad.math.rotations import quaternion_matrix
from drake_quad.robot.kinematics import leg_constants
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.systems.leaf_system import DeclareStateOutput


class Imu(LeafSystem):
    """A strapdown IMU whose axes are B's, at B's origin.

    Like a real one it integrates at a rate of its own and gives the means over the sample: the
    rotation and the change of velocity since the last sample, over the period. Those are exact
    for a discrete plant, whose accelerations within a step have no meaning.

    Input ports:
        robot_state: [q; v] of the robot, the truth.
    Output ports:
        imu_measured: (6,) angular rate [rad/s] and specific force [m/s^2] in B.
    """

    def __init__(
        self,
        *,
        layout: StateLayout,
        generator: np.random.Generator,
        noise: ImuNoise = IDEAL_IMU,
        period: float = 0.002,
    ) -> None:
        super().__init__()
        self.set_name("imu")
        self._base, self._period = (int(layout.q_base), int(layout.v_base)), period
        # All that is random is drawn here; which of it is due, the time says.
        self._errors = draw_imu_errors(noise, period, generator)
        self._input = self.DeclareVectorInputPort("robot_state", layout.size)
        self._before = int(
            self.DeclareDiscreteState(7)
        )  # quaternion and velocity at the last sample
        still = np.array([0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY])
        self._measured = DeclareStateOutput(self, "imu_measured", still)
        self.DeclareInitializationDiscreteUpdateEvent(self._initialize)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    @property
    def errors(self) -> ImuErrors:
        """The unit's errors in this run: for monitors and tests alone."""
        return self._errors

    def _initialize(self, context: Context, state: DiscreteValues) -> None:
        x, (i, j) = self._input.Eval(context), self._base
        state.set_value(self._before, np.concatenate([x[i : i + 4], x[j + 3 : j + 6]]))

    def _update(self, context: Context, state: DiscreteValues) -> None:
        i, j = self._base
        # The kernel works in place: `state` begins as a copy of the Context's values.
        sense_imu(
            self._input.Eval(context), i, j, state.get_mutable_value(self._before),
            round(context.get_time() / self._period), self._errors.tables,
            state.get_mutable_value(self._measured),
        )  # fmt: skip


class JointSensor(LeafSystem):
    """The encoders of the twelve drives.

    Input ports:
        robot_state: [q; v] of the robot, the truth.
    Output ports:
        joint_state_measured: (24,) angles [rad], then speeds [rad/s]; leg by leg (FL, FR, RL, RR),
            abduction, hip pitch, knee.
    """

    def __init__(
        self,
        *,
        layout: StateLayout,
        generator: np.random.Generator,
        noise: JointNoise = IDEAL_JOINTS,
        period: float = 0.002,
    ) -> None:
        super().__init__()
        self.set_name("joint_sensor")
        self._period = period
        self._errors = draw_joint_errors(noise, generator)
        self._places = np.concatenate([layout.q_joints, layout.v_joints])
        self._input = self.DeclareVectorInputPort("robot_state", layout.size)
        self._measured = DeclareStateOutput(self, "joint_state_measured", 24)
        self.DeclareInitializationDiscreteUpdateEvent(self._update)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    @property
    def errors(self) -> JointErrors:
        """The drives' errors in this run: for monitors and tests alone."""
        return self._errors

    def _update(self, context: Context, state: DiscreteValues) -> None:
        tick = round(context.get_time() / self._period)
        sense_joints(
            self._input.Eval(context), self._places, tick, self._errors.tables,
            state.get_mutable_value(self._measured),
        )  # fmt: skip


class TorqueSensor(LeafSystem):
    """What the twelve drives measure of their own torques.

    Input ports:
        net_actuation: (12,) torques that the drives give, in the plant's actuator order [Nm].
    Output ports:
        joint_torque_measured: (12,) torques [Nm]; leg by leg (FL, FR, RL, RR), abduction, hip
            pitch, knee.
    """

    def __init__(
        self,
        *,
        layout: StateLayout,
        errors: TorqueErrors,
        initial: FloatArray,
        period: float = 0.002,
    ) -> None:
        """Declares ports and state.

        Args:
            layout: The state's layout, which has the actuators' order.
            errors: The errors of the drives in this run.
            initial: (12,) what it shows until its first sample, leg by leg [Nm].
            period: Period of the samples [s].
        """
        super().__init__()
        self.set_name("torque_sensor")
        self._period, self._errors, self._order = period, errors, layout.actuators
        self._input = self.DeclareVectorInputPort("net_actuation", 12)
        self._measured = DeclareStateOutput(self, "joint_torque_measured", initial)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        tick = round(context.get_time() / self._period)
        torque = self._input.Eval(context)[self._order]
        state.set_value(self._measured, self._errors.apply(torque, tick))


class GroundNormalSensor(LeafSystem):
    """Which way the ground under each foot is tilted, without error: see `feel_normals`.

    Input ports:
        robot_state: [q; v] of the robot, the truth.
        contact_state: (4,) 1 where a foot bears.
        foot_contact_position: (12,) where the force on each foot acts, in W [m].
    Output ports:
        ground_normal_measured: (12,) unit normals in B, leg by leg; zeros for a foot that does not
            bear.
    """

    def __init__(self, *, robot: RobotModel, layout: StateLayout, period: float = 0.002) -> None:
        super().__init__()
        self.set_name("ground_normal_sensor")
        self._legs, self._layout = leg_constants(robot.geometry), layout
        self._state = self.DeclareVectorInputPort("robot_state", layout.size)
        self._bearing = self.DeclareVectorInputPort("contact_state", 4)
        self._places = self.DeclareVectorInputPort("foot_contact_position", 12)
        self._measured = DeclareStateOutput(self, "ground_normal_measured", 12)
        # As in ContactMonitor: before the plant's step, so that places and state are of one time.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: State) -> None:
        x, base = self._state.Eval(context), int(self._layout.q_base)
        normals = feel_normals(
            self._legs,
            x[base + 4 : base + 7],
            quaternion_matrix(x[base : base + 4]),
            x[self._layout.q_joints],
            self._places.Eval(context),
            self._bearing.Eval(context),
        )
        state.get_mutable_discrete_state().set_value(self._measured, normals)
