"""JointContactEstimator: which feet bear, by the joints' torques alone."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.estimation.contact_from_torques import (
    JointDynamics,
    TouchMemory,
    TouchSettings,
    observe,
)
from drake_quad.robot.kinematics import calc_jacobians
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.systems.leaf_system import DeclareModelContext, DeclareStateOutput, EvalModelContext


class TorqueDynamics:
    """The terms of a momentum observer, from the model plant.

    Args:
        robot: The robot.
        layout: Layout of its state.
        model: The robot without ground.
    """

    def __init__(self, robot: RobotModel, layout: StateLayout, model: MultibodyPlant) -> None:
        self._robot, self._layout, self._model = robot, layout, model
        self._joints = layout.v_joints - layout.num_positions
        joints = [model.GetJointByName(name) for name in robot.joint_names]
        self._damping = np.array([joint.default_damping() for joint in joints])

    def calc(
        self, scratch: Context, mass_before: FloatArray, state: FloatArray, torque: FloatArray,
        period: float,
    ) -> tuple[JointDynamics, FloatArray]:  # fmt: skip
        """The dynamics at a state, and the mass matrix's joint rows there (12, 18).

        Args:
            scratch: A Context of the model, to compute in.
            mass_before: The mass matrix's joint rows a period ago; zeros if there is none.
            state: [q; v].
            torque: Torque of each drive, leg by leg (12,) [Nm].
            period: Since then [s].
        """
        model, layout, joints = self._model, self._layout, self._joints
        model.SetPositionsAndVelocities(scratch, state)
        v = state[layout.num_positions :]
        mass = np.ascontiguousarray(model.CalcMassMatrix(scratch)[joints])
        h = model.CalcBiasTerm(scratch) - model.CalcGravityGeneralizedForces(scratch)
        h = h[joints] + self._damping * v[joints]  # the bias term is without it
        change = (mass - mass_before) @ v / period if mass_before.any() else np.zeros(12)
        read = layout.read(state)
        jacobian = read.R_WB @ calc_jacobians(self._robot.geometry, read.q)
        return JointDynamics(
            momentum=mass @ v, velocity_terms=change - h, torque=torque, jacobian=jacobian
        ), mass

    def standing_torque(self, state: FloatArray) -> FloatArray:
        """Torques that hold the robot still with a quarter of its weight on each foot.

        Args:
            state: [q; v].

        Returns:
            Leg by leg (12,) [Nm].
        """
        scratch, read = self._model.CreateDefaultContext(), self._layout.read(state)
        self._model.SetPositionsAndVelocities(scratch, state)
        gravity = self._model.CalcGravityGeneralizedForces(scratch)[self._joints]
        jacobian = read.R_WB @ calc_jacobians(self._robot.geometry, read.q)
        feet = 0.25 * self._robot.mass * GRAVITY * jacobian[:, 2].ravel()
        return np.asarray(-gravity - feet)


class JointContactEstimator(LeafSystem):
    """Feels the ground with the joints, for robots without reliable sensors in their feet.

    See `drake_quad.estimation.contact_from_torques`. It takes the drives' torques as exact, and
    the model's masses: friction in the joints and an unknown load are felt as forces on the feet.

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
        period: float = 0.002,
        settings: TouchSettings | None = None,
    ) -> None:
        """Declares ports and state.

        Args:
            robot: The robot.
            layout: Layout of its state.
            model: The robot without ground.
            period: Period of the observer [s].
            settings: How it listens; its defaults unless given.
        """
        super().__init__()
        self.set_name("joint_contact_estimator")
        self._robot, self._period = robot, period
        self._settings = settings or TouchSettings()
        self._dynamics = TorqueDynamics(robot, layout, model)
        self._state_port = self.DeclareVectorInputPort("robot_state_estimated", layout.size)
        self._torque_port = self.DeclareVectorInputPort("joint_torque_measured", 12)
        self._bearing = DeclareStateOutput(self, "contact_state_measured", np.ones(4))
        weight = [0.0, 0.0, 0.25 * robot.mass * GRAVITY]
        self._force = DeclareStateOutput(self, "foot_force_estimated", np.tile(weight, 4))
        self._memory = int(self.DeclareDiscreteState(TouchMemory.SIZE))
        self._mass = int(self.DeclareDiscreteState(12 * (layout.size - layout.num_positions)))
        self._scratch = DeclareModelContext(self, model)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        before = context.get_discrete_state(self._mass).value().reshape(12, -1)
        now, mass = self._dynamics.calc(
            EvalModelContext(self._scratch, context), before, self._state_port.Eval(context),
            self._torque_port.Eval(context), self._period,
        )  # fmt: skip
        memory = state.get_mutable_value(self._memory)
        observe(memory, now, self._robot.mass, self._period, self._settings)
        state.set_value(self._mass, mass.ravel())
        state.set_value(self._bearing, memory[TouchMemory.BEARING])
        state.set_value(self._force, memory[TouchMemory.FORCE])
