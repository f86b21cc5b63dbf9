"""JointContactEstimator: which feet bear, by the joints' torques alone."""

import math

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.estimation.contact_from_torques import (
    JointDynamics,
    TouchMemory,
    TouchSettings,
    observe,
    torque_ripple,
)
from drake_quad.robot.from_plant import joint_damping
from drake_quad.robot.kinematics import calc_jacobians, jacobians_in_world, leg_array
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.systems.leaf_system import DeclareModelContext, DeclareStateOutput, EvalModelContext


def standing_torque(
    robot: RobotModel, layout: StateLayout, model: MultibodyPlant, state: FloatArray
) -> FloatArray:
    """Torques that hold the robot still with a quarter of its weight on each foot.

    Args:
        robot: The robot.
        layout: Layout of its state.
        model: The robot without ground.
        state: [q; v].

    Returns:
        Leg by leg (12,) [Nm].
    """
    scratch, read = model.CreateDefaultContext(), layout.read(state)
    model.SetPositionsAndVelocities(scratch, state)
    joints = layout.v_joints - layout.num_positions
    gravity = model.CalcGravityGeneralizedForces(scratch)[joints]
    jacobian = read.R_WB @ calc_jacobians(robot.geometry, read.q)
    feet = 0.25 * robot.mass * GRAVITY * jacobian[:, 2].ravel()
    return np.asarray(-gravity - feet)


class TorqueDynamics:
    """The terms of a momentum observer, from the model plant.

    Args:
        robot: The robot.
        layout: Layout of its state.
        model: The robot without ground.
        control: Controller whose gains the drives have, and whose commands they hold.
        friction: Coulomb friction of the joints (12,) [Nm]; none unless given, as in Drake.

    Attributes:
        memory_shape: Shape of what `calc` keeps from one period to the next.
    """

    def __init__(
        self,
        robot: RobotModel,
        layout: StateLayout,
        model: MultibodyPlant,
        *,
        control: ControlSettings,
        friction: FloatArray | None = None,
    ) -> None:
        self._layout, self._model, self._control = layout, model, control
        self._legs = leg_array(robot.geometry)
        self.memory_shape = (12, model.num_velocities() + 1)
        self._joints = layout.v_joints - layout.num_positions
        self._friction = np.zeros(12) if friction is None else friction
        self._damping = joint_damping(model, robot)

    def calc(
        self, scratch: Context, before: FloatArray, state: FloatArray, torque: FloatArray,
        period: float,
    ) -> tuple[JointDynamics, FloatArray]:  # fmt: skip
        """The dynamics at a state, and what is to be kept of it for the next.

        Args:
            scratch: A Context of the model, to compute in.
            before: What was kept a period ago, `memory_shape`: the mass matrix's joint rows, and
                the joints' speeds; zeros if there is none.
            state: [q; v].
            torque: Torque of each drive at the end of the period, leg by leg (12,) [Nm].
            period: Since then [s].
        """
        model, layout, joints = self._model, self._layout, self._joints
        model.SetPositionsAndVelocities(scratch, state)
        v = state[layout.num_positions :]
        mass = np.ascontiguousarray(model.CalcMassMatrix(scratch)[joints])
        h = model.CalcBiasTerm(scratch) - model.CalcGravityGeneralizedForces(scratch)
        h = h[joints] + self._damping * v[joints]
        now, speed = np.column_stack([mass, v[joints]]), v[joints]
        change, ripple = np.zeros(12), np.zeros(12)
        if before.any():
            change = (mass - before[:, :-1]) @ v / period
            c = self._control
            ripple = torque_ripple(speed, before[:, -1], kp=c.kp, kd=c.kd, period=c.period)
        wxyz = state[layout.q_base : layout.q_base + 4]
        jacobian = jacobians_in_world(self._legs, wxyz, state[layout.q_joints])
        return JointDynamics(
            momentum=mass @ v, velocity_terms=change - h, torque=torque + ripple,
            jacobian=jacobian, uncertainty=self._friction + np.abs(ripple),
        ), now  # fmt: skip


class JointContactEstimator(LeafSystem):
    """Feels the ground with the joints, for robots without reliable sensors in their feet.

    See `drake_quad.estimation.contact_from_torques`. It takes the drives' torques as exact, and
    the model's masses: friction in the joints, of which Drake simulates none, and an unknown load
    are felt as forces on the feet.

    Input ports:
        robot_state_estimated: [q; v] of the robot.
        joint_torque_measured: (12,) torques of the drives, leg by leg [Nm].
    Output ports:
        contact_state_measured: (4,) 1 where a foot is felt to bear.
        foot_force_estimated: (12,) force on each foot in W [N].
    """

    def __init__(
        self,
        *,
        robot: RobotModel,
        layout: StateLayout,
        model: MultibodyPlant,
        control: ControlSettings,
        settings: TouchSettings | None = None,
    ) -> None:
        """Declares ports and state.

        Args:
            robot: The robot.
            layout: Layout of its state.
            model: The robot without ground.
            control: Controller that it serves, with whose period it listens.
            settings: How it listens; its defaults unless given.
        """
        super().__init__()
        self.set_name("joint_contact_estimator")
        self._robot, self._period = robot, control.period
        self._settings = settings or TouchSettings()
        self._dynamics = TorqueDynamics(robot, layout, model, control=control)
        self._state_port = self.DeclareVectorInputPort("robot_state_estimated", layout.size)
        self._torque_port = self.DeclareVectorInputPort("joint_torque_measured", 12)
        self._bearing = DeclareStateOutput(self, "contact_state_measured", np.ones(4))
        weight = [0.0, 0.0, 0.25 * robot.mass * GRAVITY]
        self._force = DeclareStateOutput(self, "foot_force_estimated", np.tile(weight, 4))
        self._memory = int(self.DeclareDiscreteState(TouchMemory.SIZE))
        self._before = int(self.DeclareDiscreteState(math.prod(self._dynamics.memory_shape)))
        self._scratch = DeclareModelContext(self, model)
        self.DeclarePeriodicDiscreteUpdateEvent(control.period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        before = context.get_discrete_state(self._before).value()
        now, kept = self._dynamics.calc(
            EvalModelContext(self._scratch, context), before.reshape(self._dynamics.memory_shape),
            self._state_port.Eval(context), self._torque_port.Eval(context), self._period,
        )  # fmt: skip
        memory = state.get_mutable_value(self._memory)
        observe(memory, now, self._robot.mass, self._period, self._settings)
        state.set_value(self._before, kept.ravel())
        state.set_value(self._bearing, memory[TouchMemory.BEARING])
        state.set_value(self._force, memory[TouchMemory.FORCE])
