"""JointContactEstimator: which feet bear, by the joints' torques alone."""

import math

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.estimation.contact_from_torques import (
    ObserverModel,
    TouchMemory,
    TouchSettings,
    update_observer,
)
from drake_quad.robot.from_plant import joint_damping
from drake_quad.robot.kinematics import calc_jacobians, leg_array
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


class MomentumObserver:
    """The momentum observer of `contact_from_torques`, with the dynamics of a model plant.

    Args:
        robot: The robot.
        layout: Layout of its state.
        model: The robot without ground.
        control: Controller whose gains the drives have, and whose commands they hold.
        settings: How it listens; its defaults unless given.
        friction: Coulomb friction of the joints (12,) [Nm]; none unless given, as in Drake.

    Attributes:
        before_shape: Shape of what it keeps of the dynamics from one period to the next.
    """

    def __init__(
        self,
        robot: RobotModel,
        layout: StateLayout,
        model: MultibodyPlant,
        *,
        control: ControlSettings,
        settings: TouchSettings | None = None,
        friction: FloatArray | None = None,
    ) -> None:
        self._model, self._settings = model, settings or TouchSettings()
        self.before_shape = (12, model.num_velocities() + 1)
        self._robot = ObserverModel(
            legs=leg_array(robot.geometry),
            q_base=int(layout.q_base),
            q_joints=np.array(layout.q_joints, dtype=np.int64),
            v_joints=np.array(layout.v_joints, dtype=np.int64),
            num_positions=int(layout.num_positions),
            damping=joint_damping(model, robot),
            friction=np.zeros(12) if friction is None else np.array(friction),
            mass=float(robot.mass),
            kp=float(control.kp),
            kd=float(control.kd),
            hold=float(control.period),
        )

    def update(
        self, scratch: Context, memory: FloatArray, before: FloatArray, state: FloatArray,
        torque: FloatArray, period: float,
    ) -> None:  # fmt: skip
        """One period.

        Args:
            scratch: A Context of the model, to compute in.
            memory: The observer's, in the slots of TouchMemory; zeros at first. It goes on.
            before: What was kept of the dynamics a period ago, `before_shape`; zeros at first. It
                goes on.
            state: [q; v].
            torque: Torque of each drive at the end of the period, leg by leg (12,) [Nm].
            period: Since the last call [s].
        """
        model = self._model
        model.SetPositionsAndVelocities(scratch, state)
        M, bias = model.CalcMassMatrix(scratch), model.CalcBiasTerm(scratch)
        update_observer(memory, before, M, bias, state, torque, period, self._robot, self._settings)


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
        self._period = control.period
        self._observer = MomentumObserver(robot, layout, model, control=control, settings=settings)
        self._state_port = self.DeclareVectorInputPort("robot_state_estimated", layout.size)
        self._torque_port = self.DeclareVectorInputPort("joint_torque_measured", 12)
        self._bearing = DeclareStateOutput(self, "contact_state_measured", np.ones(4))
        weight = [0.0, 0.0, 0.25 * robot.mass * GRAVITY]
        self._force = DeclareStateOutput(self, "foot_force_estimated", np.tile(weight, 4))
        self._memory = int(self.DeclareDiscreteState(TouchMemory.SIZE))
        self._before = int(self.DeclareDiscreteState(math.prod(self._observer.before_shape)))
        self._scratch = DeclareModelContext(self, model)
        self.DeclarePeriodicDiscreteUpdateEvent(control.period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        # `state` begins as a copy of the Context's values: the kernel goes on from it in place.
        memory = state.get_mutable_value(self._memory)
        before = state.get_mutable_value(self._before).reshape(self._observer.before_shape)
        self._observer.update(
            EvalModelContext(self._scratch, context), memory, before,
            self._state_port.Eval(context), self._torque_port.Eval(context), self._period,
        )  # fmt: skip
        state.set_value(self._bearing, memory[TouchMemory.BEARING])
        state.set_value(self._force, memory[TouchMemory.FORCE])
