"""IkController: the plan's body and feet to joint targets and feed-forward torques."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.force_distribution import distribute
from drake_quad.planning.motion_plan import MotionPlan, PlanSample
from drake_quad.robot.leg_scalar import (
    Matrix,
    Vector,
    foot_and_jacobian,
    leg_constants,
    quaternion_rotation,
    rotate,
    rotate_back,
    solve_leg,
    solve_rates,
    yaw_pitch_rotation,
)
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.robot_state import StateLayout
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
        self._robot, self._layout, self._model, self._control = robot, layout, model, control
        self._legs = leg_constants(robot.geometry)
        self._order = np.argsort(layout.actuators)
        self._torque_rows = layout.v_joints - layout.num_positions
        self._plan_port = self.DeclareAbstractInputPort("motion_plan", AbstractValue.Make(object()))
        self._phase_port = self.DeclareVectorInputPort("gait_phase", SIZE)
        self._state_port = self.DeclareVectorInputPort("robot_state_estimated", layout.size)
        self._target = self.DeclareDiscreteState(24)
        self._torque = self.DeclareDiscreteState(12)
        self._body = self.DeclareDiscreteState(5)
        self._feet = self.DeclareDiscreteState(12)
        # Not for others: footholds as they are (12), foot less its planned place when it lifted
        # off (12), and how deep a foot has searched below the plan for ground (1), all in W [m].
        self._memory = self.DeclareDiscreteState(25)
        self.DeclareStateOutputPort("joint_state_desired", self._target)
        self.DeclareStateOutputPort("joint_torque_feedforward", self._torque)
        self.DeclareStateOutputPort("body_desired", self._body)
        self.DeclareStateOutputPort("feet_desired", self._feet)
        self._scratch = DeclareScratch(self, model)
        self.DeclareInitializationDiscreteUpdateEvent(self._initialize)
        self.DeclarePeriodicDiscreteUpdateEvent(control.period, 0.0, self._update)

    def _initialize(self, context: Context, state: DiscreteValues) -> None:
        x = self._state_port.Eval(context)
        p, R, _, _ = self._base(x.tolist())
        feet, _ = self._measure(x, p, R)
        state.set_value(self._memory, [*np.array(feet).ravel(), *np.zeros(13)])
        angles = x[self._layout.q_joints][self._order]
        state.set_value(self._target, np.concatenate([angles, np.zeros(12)]))

    def _update(self, context: Context, state: DiscreteValues) -> None:
        plan: MotionPlan = self._plan_port.Eval(context)
        phase = self._phase_port.Eval(context)
        x = self._state_port.Eval(context)
        asked = int(phase[GaitPhase.TASK]) == plan.index
        t = float(phase[GaitPhase.TIME]) if asked else plan.duration
        rate = float(phase[GaitPhase.RATE])
        wanted = plan.sample(t)
        load = foot_load(plan.contacts, t, self._control.unload_time)

        p, R, w, v = self._base(x.tolist())
        feet, jacobians = self._measure(x, p, R)
        memory = context.get_discrete_state(self._memory).value().tolist()
        footholds, memory = self._footholds(wanted, feet, memory, rate)

        body, body_rate, body_acceleration = wanted.body.tolist()
        R_desired = yaw_pitch_rotation(body[3], body[4])
        v_desired, w_desired = velocity_of(body, body_rate, rate)
        target = self._joint_targets(
            footholds, load, (p, R), (body, R_desired), (v_desired, w_desired), wanted, rate
        )
        torque = self._feed_forward(context, x, feet, jacobians, load, R, wrench=self._wrench(
            body, body_acceleration, rate, p, v, v_desired),
            moment=self._moment(R_desired, R, w_desired, w))  # fmt: skip
        state.set_value(self._memory, memory)
        state.set_value(self._target, target)
        state.set_value(self._torque, torque)
        state.set_value(self._body, body)
        state.set_value(self._feet, wanted.feet.ravel())

    def _base(self, x: list[float]) -> tuple[Vector, Matrix, Vector, Vector]:
        """p_WB [m], R_WB, w_WB [rad/s] and v_WB [m/s] of a state."""
        i, j = self._layout.q_base, self._layout.v_base
        return (
            (x[i + 4], x[i + 5], x[i + 6]),
            quaternion_rotation(*x[i : i + 4]),
            (x[j], x[j + 1], x[j + 2]),
            (x[j + 3], x[j + 4], x[j + 5]),
        )

    def _measure(self, x: FloatArray, p: Vector, R: Matrix) -> tuple[list[Vector], list[Matrix]]:
        """The feet in W [m] and their Jacobians in B, from the joints as measured."""
        q = x[self._layout.q_joints].tolist()
        feet, jacobians = [], []
        for k, leg in enumerate(self._legs):
            p_BF, J = foot_and_jacobian(leg, *q[3 * k : 3 * k + 3])
            f = rotate(R, p_BF)
            feet.append((p[0] + f[0], p[1] + f[1], p[2] + f[2]))
            jacobians.append(J)
        return feet, jacobians

    def _footholds(
        self, wanted: PlanSample, feet: list[Vector], memory: list[float], rate: float
    ) -> tuple[list[Vector], list[float]]:
        """Where the feet are to be in W [m], and what to remember."""
        control = self._control
        follow = min(control.period / max(control.foothold_time, control.period), 1.0)
        planned = wanted.feet.tolist()
        footholds: list[Vector] = []
        lifted_from = memory[12:24]
        depth = 0.0
        for k in range(4):
            x, y, z = planned[k]
            if wanted.standing[k]:
                held = memory[3 * k : 3 * k + 3]
                hold = [h + follow * (f - h) for h, f in zip(held, feet[k], strict=True)]
                lifted_from[3 * k : 3 * k + 3] = [hold[0] - x, hold[1] - y, hold[2] - z]
                footholds.append((hold[0], hold[1], hold[2]))
                continue
            s = wanted.swing_phase
            if rate == 0.0 and s > 0.5:
                depth = memory[24] + control.search_speed * control.period
            # A swing starts where the foot really stood and ends where it was planned to.
            rest = 1.0 - smooth(1.5 * s)
            press = control.touchdown_press * smooth(5.0 * s - 4.0) + depth
            dx, dy, dz = lifted_from[3 * k : 3 * k + 3]
            footholds.append((x + rest * dx, y + rest * dy, z + rest * dz - press))
        return footholds, [c for f in footholds for c in f] + lifted_from + [depth]

    def _joint_targets(
        self,
        footholds: list[Vector],
        load: list[float],
        measured: tuple[Vector, Matrix],
        desired: tuple[list[float], Matrix],
        velocity: tuple[Vector, Vector],
        wanted: PlanSample,
        rate: float,
    ) -> FloatArray:
        """Joint angles and speeds (24,) that put the feet where they belong.

        A foot under load is placed in the body as desired, one without in the body as measured;
        between the two the target moves with the load, so that a foot about to lift off lets go.
        """
        (p, R), (body, R_desired), (v, w) = measured, desired, velocity
        foot_velocity = wanted.feet_velocity.tolist()
        q: list[float] = []
        qd: list[float] = []
        for k, leg in enumerate(self._legs):
            fx, fy, fz = footholds[k]
            dx, dy, dz = fx - body[0], fy - body[1], fz - body[2]
            a = rotate_back(R_desired, (dx, dy, dz))
            b = rotate_back(R, (fx - p[0], fy - p[1], fz - p[2]))
            m = load[k]
            angles = solve_leg(leg, *(b[i] + m * (a[i] - b[i]) for i in range(3)))
            q += angles
            relative = (
                rate * foot_velocity[k][0] - v[0] - (w[1] * dz - w[2] * dy),
                rate * foot_velocity[k][1] - v[1] - (w[2] * dx - w[0] * dz),
                rate * foot_velocity[k][2] - v[2] - (w[0] * dy - w[1] * dx),
            )
            _, J = foot_and_jacobian(leg, *angles)
            qd += solve_rates(J, rotate_back(R_desired, relative))
        robot = self._robot
        limited = np.minimum(np.maximum(np.array(q), robot.q_lower), robot.q_upper)
        speeds = np.minimum(np.maximum(np.array(qd), -robot.speed), robot.speed)
        return np.concatenate([limited[self._order], speeds[self._order]])

    def _wrench(
        self,
        body: list[float],
        acceleration: list[float],
        rate: float,
        p: Vector,
        v: Vector,
        v_desired: Vector,
    ) -> Vector:
        """The force that the feet are to make together [N]."""
        c, mass = self._control, self._robot.mass
        fx, fy, fz = (
            mass * rate * acceleration[i]
            + c.base_stiffness * (body[i] - p[i])
            + c.base_damping * (v_desired[i] - v[i])
            for i in range(3)
        )
        return fx, fy, fz + mass * GRAVITY

    def _moment(self, R_desired: Matrix, R: Matrix, w_desired: Vector, w: Vector) -> Vector:
        """The moment about the centre of mass that the feet are to make together [Nm]."""
        c = self._control
        error = rotation_error(R_desired, R)
        mx, my, mz = (
            c.base_rotation_stiffness * error[i] + c.base_rotation_damping * (w_desired[i] - w[i])
            for i in range(3)
        )
        return mx, my, mz

    def _feed_forward(
        self,
        context: Context,
        x: FloatArray,
        feet: list[Vector],
        jacobians: list[Matrix],
        load: list[float],
        R: Matrix,
        *,
        wrench: Vector,
        moment: Vector,
    ) -> FloatArray:
        """Torques (12,) that carry the legs' weight and the standing feet's forces."""
        scratch = EvalScratch(self._scratch, context)
        self._model.SetPositions(scratch, x[: self._layout.num_positions])
        cx, cy, cz = self._model.CalcCenterOfMassPositionInWorld(scratch).tolist()
        torque = -self._model.CalcGravityGeneralizedForces(scratch)[self._torque_rows]
        arms = [(fx - cx, fy - cy, fz - cz) for fx, fy, fz in feet]
        forces = distribute(wrench, moment, arms, load, least=self._control.least_force)
        stance: list[float] = []
        for J, force in zip(jacobians, forces, strict=True):
            f = rotate_back(R, force)
            stance += rotate_back(J, f)
        limit = self._robot.effort
        torque = np.minimum(np.maximum(torque - np.array(stance), -limit), limit)
        return np.asarray(torque[self._order])


def velocity_of(
    body: Sequence[float], body_rate: Sequence[float], rate: float
) -> tuple[Vector, Vector]:
    """Velocity [m/s] and angular velocity [rad/s] of B in W.

    Args:
        body: x, y, z, pitch, yaw of the plan.
        body_rate: Their derivatives by gait time.
        rate: How fast the gait clock runs.
    """
    pitch_rate, yaw_rate = rate * body_rate[3], rate * body_rate[4]
    s, c = np.sin(body[4]), np.cos(body[4])
    v = (rate * body_rate[0], rate * body_rate[1], rate * body_rate[2])
    return v, (float(-s * pitch_rate), float(c * pitch_rate), yaw_rate)


def rotation_error(R_desired: Matrix, R: Matrix) -> Vector:
    """The rotation vector, in W, that takes `R` to `R_desired` (small angles) [rad]."""
    e = [[sum(a * b for a, b in zip(row, other, strict=True)) for other in R] for row in R_desired]
    return 0.5 * (e[2][1] - e[1][2]), 0.5 * (e[0][2] - e[2][0]), 0.5 * (e[1][0] - e[0][1])


def foot_load(contacts: ContactPlan, t: float, unload_time: float) -> list[float]:
    """How much each of the four feet may carry at time `t`: none in the air, all in mid-stance.

    A foot takes its load up after touchdown, and gives it away before lift-off, over
    `unload_time` or the time there is on four feet, whichever is shorter.
    """
    index = contacts.phase_index(t)
    phase = contacts.phases[index]
    if phase.step is not None:
        return [1.0 if stands else 0.0 for stands in phase.standing]
    load = [1.0, 1.0, 1.0, 1.0]
    ramp = min(unload_time, phase.end - phase.start)
    before = contacts.phases[index - 1].step if index > 0 else None
    after = contacts.phases[index + 1].step if index + 1 < len(contacts.phases) else None
    if before is not None:
        load[before.leg.row] *= smooth((t - phase.start) / ramp)
    if after is not None:
        load[after.leg.row] *= smooth((phase.end - t) / ramp)
    return [max(m, 1e-4) for m in load]


def smooth(x: float) -> float:
    """A cubic step from 0 at 0 to 1 at 1."""
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)
