"""IkController: the plan's body and feet to joint targets and feed-forward torques."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.force_distribution import distribute
from drake_quad.planning.motion_plan import MotionPlan, PlanSample, rotations
from drake_quad.robot.leg_kinematics import calc_feet, calc_jacobians, solve_legs
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.robot_state import RobotState, StateLayout
from drake_quad.systems.control_settings import ControlSettings
from drake_quad.systems.gait_phase import SIZE, GaitPhase
from drake_quad.systems.scratch import DeclareScratch, EvalScratch

GRAVITY = 9.81


class IkController(LeafSystem):
    """Joint targets by inverse kinematics, with gravity and stance forces fed forward.

    The base is fed back twice: feet under load are placed, in the *desired* body, where they stand
    as measured, so that the joints' stiffness pulls the body to its plan; and the wrench that the
    feet share holds a term on the base's error. Swing feet are placed in the body as measured, so
    that they land where they should in the world.

    Input ports:
        motion_plan: MotionPlan of the task under way (abstract).
        gait_phase: See GaitPhase.
        robot_state_estimated: [q; v] of the robot.
    Output ports:
        joint_state_desired: (24,) joint angles, then speeds, in the plant's actuator order.
        joint_torque_feedforward: (12,) in the plant's actuator order [Nm].
        body_desired: (5,) x, y, z, pitch, yaw that the plan has now.
        feet_desired: (12,) foot centres that the plan has now, in W [m].
    """

    def __init__(
        self,
        *,
        robot: RobotModel,
        layout: StateLayout,
        model: MultibodyPlant,
        control: ControlSettings,
    ) -> None:
        super().__init__()
        self.set_name("ik_controller")
        self._robot, self._layout, self._model = robot, layout, model
        self._gains, self._period = control, control.period
        self._order = np.argsort(layout.actuators)
        self._plan_port = self.DeclareAbstractInputPort("motion_plan", AbstractValue.Make(object()))
        self._phase_port = self.DeclareVectorInputPort("gait_phase", SIZE)
        self._state_port = self.DeclareVectorInputPort("robot_state_estimated", layout.size)
        self._target = self.DeclareDiscreteState(24)
        self._torque = self.DeclareDiscreteState(12)
        self._body = self.DeclareDiscreteState(5)
        self._feet = self.DeclareDiscreteState(12)
        self._footholds = self.DeclareDiscreteState(12)
        self._offset = self.DeclareDiscreteState(12)  # foot less its planned place at lift-off [m]
        self._search = self.DeclareDiscreteState(1)  # depth searched below the plan [m]
        self.DeclareStateOutputPort("joint_state_desired", self._target)
        self.DeclareStateOutputPort("joint_torque_feedforward", self._torque)
        self.DeclareStateOutputPort("body_desired", self._body)
        self.DeclareStateOutputPort("feet_desired", self._feet)
        self._scratch = DeclareScratch(self, model)
        self.DeclareInitializationDiscreteUpdateEvent(self._initialize)
        self.DeclarePeriodicDiscreteUpdateEvent(self._period, 0.0, self._update)

    def _initialize(self, context: Context, state: DiscreteValues) -> None:
        measured = self._layout.read(self._state_port.Eval(context))
        feet = measured.p_WB + calc_feet(self._robot.geometry, measured.q) @ measured.R_WB.T
        state.set_value(self._footholds, feet.ravel())
        angles = measured.q.reshape(12)[self._order]
        state.set_value(self._target, np.concatenate([angles, np.zeros(12)]))

    def _update(self, context: Context, state: DiscreteValues) -> None:
        plan: MotionPlan = self._plan_port.Eval(context)
        phase = self._phase_port.Eval(context)
        x = self._state_port.Eval(context)
        measured = self._layout.read(x)
        asked = int(phase[GaitPhase.TASK]) == plan.index
        t = float(phase[GaitPhase.TIME]) if asked else plan.duration
        rate = float(phase[GaitPhase.RATE])
        wanted = plan.sample(t)

        feet = measured.p_WB + calc_feet(self._robot.geometry, measured.q) @ measured.R_WB.T
        footholds = np.array(context.get_discrete_state(self._footholds).value()).reshape(4, 3)
        lifted_from = np.array(context.get_discrete_state(self._offset).value()).reshape(4, 3)
        follow = self._period / max(self._gains.foothold_time, self._period)
        footholds += follow * (feet - footholds)
        standing, swing = wanted.standing, ~wanted.standing
        lifted_from[standing] = footholds[standing] - wanted.feet[standing]
        depth = 0.0
        if np.any(swing):
            s = wanted.swing_phase
            searched = float(context.get_discrete_state(self._search).value()[0])
            waiting = rate == 0.0 and s > 0.5
            depth = searched + self._gains.search_speed * self._period if waiting else 0.0
            # A swing starts where the foot really stood and ends where it was planned to.
            footholds[swing] = wanted.feet[swing] + (1.0 - smooth(1.5 * s)) * lifted_from[swing]
            footholds[swing, 2] -= self._gains.touchdown_press * smooth(5.0 * s - 4.0) + depth

        load = foot_load(plan.contacts, t, self._gains.unload_time)
        q, qd = self._joint_targets(wanted, measured, footholds, load, rate)
        torque = self._feed_forward(context, x, wanted, measured, feet, load, rate)
        state.set_value(self._footholds, footholds.ravel())
        state.set_value(self._offset, lifted_from.ravel())
        state.set_value(self._search, [depth])
        state.set_value(
            self._target, np.concatenate([q.reshape(12)[self._order], qd.reshape(12)[self._order]])
        )
        state.set_value(self._torque, torque.reshape(12)[self._order])
        state.set_value(self._body, wanted.body[0])
        state.set_value(self._feet, wanted.feet.ravel())

    def _joint_targets(
        self,
        wanted: PlanSample,
        measured: RobotState,
        footholds: FloatArray,
        load: FloatArray,
        rate: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Joint angles and speeds (4, 3) that put the feet where they belong.

        A foot under load is placed in the body as desired, one without in the body as measured;
        between the two the target moves with the load, so that a foot about to lift off lets go.
        """
        R_desired = rotations(wanted.body[0])
        in_desired = (footholds - wanted.body[0, :3]) @ R_desired
        in_measured = (footholds - measured.p_WB) @ measured.R_WB
        p_BF = in_measured + load[:, None] * (in_desired - in_measured)
        q, _ = solve_legs(self._robot.geometry, p_BF)
        q = np.clip(q.reshape(12), self._robot.q_lower, self._robot.q_upper).reshape(4, 3)
        v, w = velocity_of(wanted.body, rate)
        relative = rate * wanted.feet_velocity - v - np.cross(w, footholds - wanted.body[0, :3])
        J = calc_jacobians(self._robot.geometry, q)
        qd = np.linalg.solve(J, (relative @ R_desired)[..., None])[..., 0]
        limit = self._robot.speed.reshape(4, 3)
        return q, np.clip(qd, -limit, limit)

    def _feed_forward(
        self,
        context: Context,
        x: FloatArray,
        wanted: PlanSample,
        measured: RobotState,
        feet: FloatArray,
        load: FloatArray,
        rate: float,
    ) -> FloatArray:
        """Torques (4, 3) that carry the legs' weight and the standing feet's forces."""
        scratch = EvalScratch(self._scratch, context)
        self._model.SetPositions(scratch, x[: self._layout.num_positions])
        com = self._model.CalcCenterOfMassPositionInWorld(scratch)
        gravity = self._model.CalcGravityGeneralizedForces(scratch)
        joints = gravity[self._layout.v_joints - self._layout.num_positions].reshape(4, 3)
        g, mass = self._gains, self._robot.mass
        v, w = velocity_of(wanted.body, rate)
        force = (
            mass * (rate * wanted.body[2, :3] + np.array([0.0, 0.0, GRAVITY]))
            + g.base_stiffness * (wanted.body[0, :3] - measured.p_WB)
            + g.base_damping * (v - measured.v_WB)
        )
        moment = g.base_rotation_stiffness * rotation_error(
            rotations(wanted.body[0]), measured.R_WB
        ) + g.base_rotation_damping * (w - measured.w_WB)
        f = distribute(np.concatenate([force, moment]), feet - com, load, least=g.least_force)
        J = calc_jacobians(self._robot.geometry, measured.q)
        torque = -joints - np.einsum("lij,li->lj", J, f @ measured.R_WB)
        limit = self._robot.effort.reshape(4, 3)
        return np.clip(torque, -limit, limit)


def velocity_of(body: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """Velocity [m/s] and angular velocity [rad/s] of B in W from a path's sample (3, 5)."""
    yaw = body[0, 4]
    pitch_rate, yaw_rate = rate * body[1, 3], rate * body[1, 4]
    w = np.array([-np.sin(yaw) * pitch_rate, np.cos(yaw) * pitch_rate, yaw_rate])
    return rate * body[1, :3], w


def rotation_error(R_desired: FloatArray, R: FloatArray) -> FloatArray:
    """The rotation vector, in W, that takes `R` to `R_desired` (small angles) [rad]."""
    E = R_desired @ R.T
    return 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])


def foot_load(contacts: ContactPlan, t: float, unload_time: float) -> FloatArray:
    """How much each foot may carry, (4,), at time `t`: none in the air, all in mid-stance.

    A foot takes its load up after touchdown, and gives it away before lift-off, over
    `unload_time` or the time there is on four feet, whichever is shorter.
    """
    index = contacts.phase_index(t)
    phase = contacts.phases[index]
    load = phase.standing.astype(float)
    if phase.step is None:
        before = contacts.phases[index - 1].step if index > 0 else None
        after = contacts.phases[index + 1].step if index + 1 < len(contacts.phases) else None
        ramp = min(unload_time, phase.end - phase.start)
        if before is not None:
            load[before.leg.row] *= smooth((t - phase.start) / ramp)
        if after is not None:
            load[after.leg.row] *= smooth((phase.end - t) / ramp)
    return np.maximum(load, 1e-4 * phase.standing)


def smooth(x: float) -> float:
    """A cubic step from 0 at 0 to 1 at 1."""
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)
