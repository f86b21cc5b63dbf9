"""The controllers: what they share, from plan to joint targets; by statics; by inverse dynamics."""

from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.common import GRAVITY, FloatArray, Vector
from drake_quad.control.base_tracking import rotation_error
from drake_quad.control.kernel_state import (
    MEMORY_SIZE,
    WORK,
    Record,
    Records,
    make_constants,
    new_memory,
    new_record,
)
from drake_quad.control.measurement import ground_table, measure
from drake_quad.control.ports import BALANCE_SIZE, CATCH_SIZE, SIZE, Balance
from drake_quad.control.settings import ControlSettings
from drake_quad.control.tracking import (
    MODE,
    RUN,
    Commands,
    Inputs,
    compute_commands,
    compute_targets,
)
from drake_quad.control.whole_body_qp import plan_forces, solve, torques_of
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.wrench_distribution import distribute_wrench
from drake_quad.robot.from_plant import joint_damping
from drake_quad.robot.kinematics import leg_array
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.systems.leaf_system import (
    DeclareModelContext,
    DeclareStateOutput,
    EvalModelContext,
    StateParts,
)
from drake_quad.terrain.course import Course

# Places in a controller's own state: after the kernels' memory the last torques, then the state.
LAST_STATE = MEMORY_SIZE + 12
# Rows of what it shows together, of both classes below.
BODY, FEET, QP = slice(0, 5), slice(5, 17), slice(17, 19)
PAYLOAD, FRICTION = slice(19, 22), slice(22, 26)


UNFELT = np.zeros(12)  # normals of the ground where the feet do not feel them


class Tick(NamedTuple):
    """What a tick has found when the torques are asked for.

    Attributes:
        scratch: Context of the model plant, which holds the measured state.
        running: Whether the clock follows the plan.
        work: Tick's results, in the slots of WORK.
        parts: What is shown together, in the rows BODY to FRICTION; goes on a tick.
        torque: The last torques to feed forward, leg by leg (12,) [Nm]; goes on a tick.
    """

    scratch: Context
    running: bool
    work: Records
    parts: FloatArray
    torque: FloatArray


class Effort(NamedTuple):
    """What a subclass has to say.

    Attributes:
        torque: The joint torques to feed forward, leg by leg (12,) [Nm].
        com: The model's centre of mass in W (3,) [m].
    """

    torque: FloatArray
    com: FloatArray


class TrackingController(LeafSystem):
    """The plan's body and feet to joint targets; a subclass says which torques are fed forward.

    The base is fed back: feet under load are placed, in the *desired* body, where they stand as
    measured, so that the joints' stiffness pulls the body to its plan. Swing feet are placed in
    the body as measured, so that they land where they should in the world.

    Input ports:
        motion_plan: MotionPlan of the task under way (abstract).
        gait_phase: See GaitPhase.
        catch: See Catch.
        robot_state_estimated: [q; v] of the robot.
        contact_state_measured: (4,) 1 where a foot bears.
        ground_normal_measured: (12,) see GroundNormalSensor; need not be connected: the ground's
            tilt is then the map's.
    Output ports:
        joint_state_desired: (24,) joint angles, then speeds, in the plant's actuator order.
        joint_torque_feedforward: (12,) in the plant's actuator order [Nm].
        body_desired: (5,) x, y, z, pitch, yaw that are wanted now: the plan's, a little ahead of
            the gait clock or behind it where that has just stopped or gone on.
        feet_desired: (12,) foot centres that the plan has now, in W [m].
        balance_estimated: See Balance.
        tracking: Those that only logs ask for, one after the other: body_desired, feet_desired, and
            what a subclass has beyond these.
    """

    NAME = "tracking_controller"

    def __init__(
        self,
        *,
        robot: RobotModel,
        layout: StateLayout,
        model: MultibodyPlant,
        control: ControlSettings,
        course: Course | None = None,
    ) -> None:
        """Declares ports and state.

        Args:
            robot: The robot.
            layout: The state's layout.
            model: The robot without ground.
            control: Settings of the controllers.
            course: The map; level ground if none is given.
        """
        super().__init__()
        self.set_name(self.NAME)
        self._robot, self._layout, self._model, self._control = robot, layout, model, control
        self._constants = make_constants(
            robot, layout, control, stiffness=self._stance_stiffness(),
            inertia=_rotational_inertia(model, layout), damping=joint_damping(model, robot),
        )  # fmt: skip
        self._ground = ground_table(course)
        self._velocities = layout.v_joints - layout.num_positions
        self._plan_port = self.DeclareAbstractInputPort("motion_plan", AbstractValue.Make(object()))
        self._phase_port = self.DeclareVectorInputPort("gait_phase", SIZE)
        self._catch_port = self.DeclareVectorInputPort("catch", CATCH_SIZE)
        self._state_port = self.DeclareVectorInputPort("robot_state_estimated", layout.size)
        self._contact_port = self.DeclareVectorInputPort("contact_state_measured", 4)
        self._normal_port = self.DeclareVectorInputPort("ground_normal_measured", 12)
        self._target = DeclareStateOutput(self, "joint_state_desired", 24)
        self._torque = DeclareStateOutput(self, "joint_torque_feedforward", 12)
        self._balance = DeclareStateOutput(self, "balance_estimated", BALANCE_SIZE)
        desired = {"body_desired": np.zeros(5), "feet_desired": np.zeros(12)}
        self.parts = StateParts(self, "tracking", desired | self._own_parts())
        # Not for others: the kernels' memory, the last torques, and the last state that was known.
        default = model.GetPositionsAndVelocities(model.CreateDefaultContext())
        self._memory = int(
            self.DeclareDiscreteState(np.concatenate([np.zeros(LAST_STATE), default]))
        )
        self._scratch = DeclareModelContext(self, model, lambda: new_record(WORK))
        self.DeclareInitializationDiscreteUpdateEvent(self._initialize)
        self.DeclarePeriodicDiscreteUpdateEvent(control.period, 0.0, self._update)

    def _stance_stiffness(self) -> float:
        """Share of the joints' stiffness that a loaded leg keeps."""
        return 1.0

    def _own_parts(self) -> dict[str, FloatArray]:
        """The first values of what a subclass shows beyond the ports here, by the ports' names."""
        return {}

    def _calc_torque(self, tick: Tick) -> Effort:
        """The joint torques to feed forward; a subclass has them.

        It may change the target in `tick.work`.
        """
        raise NotImplementedError

    def _initialize(self, context: Context, state: DiscreteValues) -> None:
        last = context.get_discrete_state(self._memory).value()[LAST_STATE:]
        estimated, robot = self._state_port.Eval(context), self._robot
        legs = leg_array(robot.geometry)
        measured = measure(self._layout, legs, robot.foot_radius, estimated, last)
        feet, order = measured.feet.place, np.argsort(self._layout.actuators)
        balance = np.zeros(BALANCE_SIZE)
        balance[:3] = balance[Balance.BODY : Balance.BODY + 3] = measured.p
        balance[Balance.FEET : Balance.BODY] = feet.ravel()
        memory = [new_memory(feet), np.zeros(12), measured.state]
        state.set_value(self._memory, np.concatenate(memory))
        state.set_value(self._target, np.concatenate([measured.q[order], np.zeros(12)]))
        state.set_value(self._balance, balance)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        plan: MotionPlan = self._plan_port.Eval(context)
        scratch, work = EvalModelContext(self._scratch, context)
        feel = self._normal_port.HasValue(context)
        inputs = Inputs(
            self._phase_port.Eval(context), self._catch_port.Eval(context),
            self._contact_port.Eval(context), self._state_port.Eval(context),
            self._normal_port.Eval(context) if feel else UNFELT,
        )  # fmt: skip
        # `state` begins as a copy of the Context's values: the kernels go on from it in place.
        value = state.get_mutable_value
        memory, parts = value(self._memory), value(self.parts.index)
        last = memory[LAST_STATE:]
        compute_targets(
            plan.tables, inputs, self._constants, memory[:MEMORY_SIZE], last, work, self._ground
        )
        self._model.SetPositionsAndVelocities(scratch, last)
        running = bool(inputs.phase[MODE] == RUN)
        tick = Tick(scratch, running, work, parts, memory[MEMORY_SIZE:LAST_STATE])
        torque, com = self._calc_torque(tick)
        commands = Commands(
            value(self._target), value(self._torque), parts[BODY], parts[FEET],
            value(self._balance),
        )  # fmt: skip
        compute_commands(torque, com, self._constants, work, commands)


def _rotational_inertia(model: MultibodyPlant, layout: StateLayout) -> float:
    """About B, the robot as the file has it: the mean of its three moments [kg m^2]."""
    M = model.CalcMassMatrix(model.CreateDefaultContext())
    i = layout.v_base - layout.num_positions
    return float(np.mean(np.diag(M)[i : i + 3]))


LEAST_LOAD = 0.01  # of a full one, with which a foot counts as one of three


class IkController(TrackingController):
    """Joint targets by inverse kinematics, with gravity and stance forces fed forward.

    Beyond what every TrackingController does, the wrench that the feet share holds a term on the
    base's error.
    """

    NAME = "ik_controller"

    def _calc_torque(self, tick: Tick) -> Effort:
        """Torques (12,) that carry the legs' weight and the standing feet's forces."""
        com = self._model.CalcCenterOfMassPositionInWorld(tick.scratch)
        cx, cy, cz = com.tolist()
        torque = -self._model.CalcGravityGeneralizedForces(tick.scratch)[self._velocities]
        # By their names in brackets: as attributes they take ten times as long.
        found = tick.work[0]
        measured, target = found["measured"], found["target"]
        feet, load = measured["feet"], target["load"]
        # The shares need three feet: thrown off some of them, all are to be ready.
        load = load if np.sum(load > LEAST_LOAD) > 2 else np.ones(4)
        forces = distribute_wrench(
            self._force(measured, target),
            self._moment(measured, target),
            [(fx - cx, fy - cy, fz - cz) for fx, fy, fz in feet["place"].tolist()],
            load.tolist(),
            least=self._control.least_force,
            friction=self._control.friction,
            normals=feet["normal"].tolist(),
        )
        stance = np.einsum("kji,kj->ki", feet["jacobian"], np.array(forces))
        return Effort(torque - stance.ravel(), com)

    def _force(self, measured: Record, target: Record) -> Vector:
        """The force that the feet are to make together [N]."""
        c, mass = self._control, self._robot.mass
        fx, fy, fz = (
            mass * target["acceleration"][3:]
            + c.base_stiffness * (target["body"][:3] - measured["p"])
            + c.base_damping * (target["v"] - measured["v"])
        ).tolist()
        return fx, fy, fz + mass * GRAVITY

    def _moment(self, measured: Record, target: Record) -> Vector:
        """The moment about the centre of mass that the feet are to make together [Nm]."""
        c = self._control
        error = rotation_error(target["R"], measured["R"])
        mx, my, mz = (
            c.base_rotation_stiffness * error
            + c.base_rotation_damping * (target["w"] - measured["w"])
        ).tolist()
        return mx, my, mz


REUSES = 10  # ticks for which the last solution serves; then the robot is held still


class WholeBodyController(TrackingController):
    """Inverse dynamics of the floating base, with the feet's forces from a quadratic program.

    The base's acceleration is what the plan has, corrected by its errors; the feet's is the
    plan's, or none where they stand. The program (`control/whole_body_qp.py`) finds the forces
    within friction, torque and joint limits. An unsolved program, or an estimate that is not
    finite, is survived: for REUSES ticks with the last torques, then with those that carry the
    robot's weight; it is counted.

    Output ports, beyond TrackingController's:
        qp_state: (2,) programs not solved so far; and in a row.
        carried_estimated: (3,) what an unknown load needs: a force upwards [N], and moments about
            x and y of the heading [Nm].
        friction_estimated: (4,) coefficient that each foot's force stays within: less after a slip.
    """

    NAME = "whole_body_controller"

    def _stance_stiffness(self) -> float:
        return self._control.stance_stiffness

    def _own_parts(self) -> dict[str, FloatArray]:
        return {
            "qp_state": np.zeros(2),
            "carried_estimated": np.zeros(3),
            "friction_estimated": np.full(4, self._control.friction),
        }

    def _calc_torque(self, tick: Tick) -> Effort:
        model, work, parts, torque = self._model, tick.work, tick.parts, tick.torque
        M, bias = model.CalcMassMatrix(tick.scratch), model.CalcBiasTerm(tick.scratch)
        program, sound, com = plan_forces(
            M, bias, tick.running, self._constants, work, parts[PAYLOAD], parts[FRICTION]
        )
        x = solve(program) if sound else None
        qp = parts[QP]
        if x is not None:
            torques_of(x, work, torque)
            qp[1] = 0.0
            return Effort(torque, com)
        qp += 1.0
        return Effort(torque if qp[1] <= REUSES else self._hold_still(M, tick), com)

    def _hold_still(self, M: FloatArray, tick: Tick) -> FloatArray:
        """Torques (12,) that carry the weight on the loaded feet; joint stiffness does the rest."""
        found = tick.work[0]
        load, jacobian = found["target"]["load"], found["measured"]["feet"]["contact_jacobian"]
        share = load / max(load.sum(), 1e-9) * self._robot.mass * GRAVITY
        legs = M[self._velocities, 5] * GRAVITY  # see `plan_forces`
        return np.asarray(legs - (jacobian[:, 2] * share[:, None]).ravel())
