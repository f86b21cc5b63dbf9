"""The robot and the course in MuJoCo, and the controller's Diagram driven there in lock step.

Nothing of the controller is here: its Diagram is given, and its ports are asked for by name. The
robot is read from the same URDF by MuJoCo's own reader; what that format leaves to Drake's tags
(the rotors' inertia) and what is a setting (the drives' gains) comes from where Drake has it from.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Diagram, FixedInputPortValue

from drake_quad.control.ports import GaitPhase
from drake_quad.control.settings import ControlSettings
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.gait.support import margin_of_floats
from drake_quad.planning.motion_plan import MotionPlan, Stance, pose_robot, rotations
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.robot_state import StateLayout, make_layout
from drake_quad.terrain import Course

mujoco = pytest.importorskip(
    "mujoco", reason="drives the controller in MuJoCo: install drake_quad[mujoco]"
)

GRAVITY = 9.81
STEP = 0.001  # [s]
IMU_PERIOD = 0.002  # [s] over which the unit integrates
NO_SUPPORT = -9.0  # [m] instead of -inf where no foot bears
TILT_LIMIT = np.radians(40.0)  # beyond it the robot fell
PACKAGE = "package://drake_quad_models/"

# Contacts stiffer than MuJoCo's defaults (two steps are the least): a foot sinks by a quarter of a
# millimetre instead of three, and creeps by less than one while it bears instead of by seven.
CONTACT_TIME = 0.004  # [s]
FRICTION_STIFFER = 20.0  # friction against normal constraints


def build_model(
    robot: RobotModel,
    plant: MultibodyPlant,
    course: Course,
    control: ControlSettings,
    *,
    friction: float = 0.8,
) -> Any:
    """An MjModel of the robot on the course, its joints driven as Drake's plant drives them.

    Args:
        robot: Of the shipped models.
        plant: The robot alone, for its rotors' inertia.
        course: In W.
        control: Of which the drives' gains are taken.
        friction: Coulomb's coefficient.
    """
    path = resources.files("drake_quad_models").joinpath(robot.url.removeprefix(PACKAGE))
    spec = mujoco.MjSpec.from_string(path.read_text(encoding="utf-8"))
    spec.option.timestep = STEP
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    # Implicit in the drives' damping, and in their stiffness explicit: at 1 ms far from its limit.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = FRICTION_STIFFER
    spec.body(robot.trunk).add_freejoint(name="base")
    for box in course.boxes:
        half = 0.5 * box.yaw
        spec.worldbody.add_geom(
            name=box.name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=box.centre,
            size=0.5 * box.size,
            quat=[np.cos(half), 0.0, 0.0, np.sin(half)],
        )
    for geom in spec.geoms:
        geom.friction = [friction, 0.0, 0.0]
        geom.solref = [CONTACT_TIME, 1.0]
        geom.condim = 3
    rotors = [plant.get_joint_actuator(k) for k in plant.GetJointActuatorIndices()]
    inertia = {
        a.joint().name(): a.default_rotor_inertia() * a.default_gear_ratio() ** 2 for a in rotors
    }
    for name, effort in zip(robot.joint_names, robot.effort, strict=True):
        spec.joint(name).armature = inertia[name]
        # force = clip(kp (ctrl - q) - kd v): `command` puts the other terms into ctrl.
        spec.add_actuator(
            name=name,
            target=name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[control.kp] + [0.0] * 9,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[0.0, -control.kp, -control.kd] + [0.0] * 7,
            forcelimited=True,
            forcerange=[-effort, effort],
        )
    return spec.compile()


@dataclass(frozen=True)
class Contacts:
    """What touches what.

    Attributes:
        force: (4,) normal force on each foot from the course [N].
        position: (4, 3) where it acts, in W [m]; the last place known while there is none.
        touched: Names of the course's boxes that a foot presses on.
        others: Names of the pairs of which one is not a foot, or none the course.
    """

    force: FloatArray
    position: FloatArray
    touched: frozenset[str]
    others: frozenset[tuple[str, str]]


class MujocoRobot:
    """The simulated robot: what it senses, and its drives."""

    def __init__(
        self,
        robot: RobotModel,
        plant: MultibodyPlant,
        course: Course,
        control: ControlSettings,
        stance: Stance,
        *,
        friction: float = 0.8,
    ) -> None:
        self.robot, self.control = robot, control
        self.model = build_model(robot, plant, course, control, friction=friction)
        self.data = mujoco.MjData(self.model)
        self.layout: StateLayout = make_layout(plant, robot)
        joints = [self.model.joint(name) for name in robot.joint_names]
        self._q = np.array([j.qposadr[0] for j in joints])
        self._v = np.array([j.dofadr[0] for j in joints])
        # Commands come in the plant's actuator order; the model's actuators are leg by leg.
        self._rank = np.argsort(np.argsort(self.layout.actuators))
        self._trunk = self.model.body(robot.trunk).id
        self._names = [self.model.geom(k).name for k in range(self.model.ngeom)]
        feet = [name.split("::")[-1] for name in robot.foot_geometry]  # Drake's have a scope
        self._row = [feet.index(n) if n in feet else -1 for n in self._names]
        self._of_course = (self.model.geom_bodyid == 0).tolist()
        self._threshold = 0.01 * robot.mass * GRAVITY  # 1 % of the weight
        self._stand(stance)
        self.steps = 0
        self._force_at = (stance.feet - [0.0, 0.0, robot.foot_radius]).tolist()
        self._imu = np.array([0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY])
        self._imu_velocity = np.zeros(3)
        self.contacts = self._sense_contacts()

    def _stand(self, stance: Stance) -> None:
        q, excess, _ = pose_robot(self.robot, stance.body[None], stance.feet[None])
        assert excess.max() < 1e-9
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, rotations(stance.body).ravel())
        self.data.qpos[:3], self.data.qpos[3:7] = stance.body[:3], quaternion
        self.data.qpos[self._q] = q.ravel()
        self.data.ctrl[:] = q.ravel()
        mujoco.mj_forward(self.model, self.data)

    @property
    def time(self) -> float:
        """Simulated time [s], without the sum's rounding."""
        return self.steps * STEP

    @property
    def R_WB(self) -> FloatArray:
        """The trunk's orientation (3, 3), of the state as it is now."""
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, self.data.qpos[3:7])
        return R.reshape(3, 3)

    @property
    def com(self) -> FloatArray:
        """The whole robot's centre of mass (3,) in W [m]."""
        return np.array(self.data.subtree_com[self._trunk])

    @property
    def bearing(self) -> BoolArray:
        """(4,) which feet bear, as the project's logs have it."""
        return np.asarray(self.contacts.force > self._threshold)

    @property
    def margin(self) -> float:
        """Static margin of the centre of mass over the bearing feet [m]."""
        x, y, _ = self.com.tolist()
        feet = self.contacts.position[self.bearing, :2].tolist()
        return max(margin_of_floats(x, y, feet), NO_SUPPORT)

    # What the controller's input ports may ask for, by the ports' names.

    def robot_state_estimated(self) -> FloatArray:
        """[q; v] in the order of Drake's model plant: velocities in W, the angular one first."""
        x, layout, R = np.zeros(self.layout.size), self.layout, self.R_WB
        i, j, d = layout.q_base, layout.v_base, self.data
        x[i : i + 4], x[i + 4 : i + 7] = d.qpos[3:7], d.qpos[:3]
        x[j : j + 3], x[j + 3 : j + 6] = R @ d.qvel[3:6], d.qvel[:3]
        x[layout.q_joints], x[layout.v_joints] = d.qpos[self._q], d.qvel[self._v]
        return x

    def joint_state_measured(self) -> FloatArray:
        """(24,) joint angles, then speeds, leg by leg."""
        return np.concatenate([self.data.qpos[self._q], self.data.qvel[self._v]])

    def imu_measured(self) -> FloatArray:
        """(6,) angular velocity [rad/s] and specific force [m/s²] in B, over the unit's period."""
        return self._imu

    def contact_state_measured(self) -> FloatArray:
        """(4,) 1 where a foot bears."""
        return self.bearing.astype(float)

    # What it does.

    def command(self, desired: FloatArray, torque: FloatArray) -> None:
        """Tells the drives: angles and speeds (24,), torques (12,), in Drake's actuator order.

        The drives' own law is clip(torque + kp (q_desired - q) + kd (v_desired - v)).
        """
        c = self.control
        feed = (c.kd * desired[12:] + torque) / c.kp
        self.data.ctrl[:] = (desired[:12] + feed)[self._rank]

    def step(self) -> None:
        """One step of MuJoCo's, and what is sensed of it."""
        mujoco.mj_step(self.model, self.data)
        self.steps += 1
        self.contacts = self._sense_contacts()
        per_sample = round(IMU_PERIOD / STEP)
        if self.steps % per_sample == 0:
            v, gained = self.data.qvel[:3], self.data.qvel[:3] - self._imu_velocity
            force = gained / IMU_PERIOD + [0.0, 0.0, GRAVITY]
            self._imu = np.concatenate([self.data.qvel[3:6], self.R_WB.T @ force])
            self._imu_velocity = np.array(v)

    def _sense_contacts(self) -> Contacts:
        # Plain floats: a handful of contacts, a thousand times a second.
        contact, efc = self.data.contact, self.data.efc_force
        force, moment = [0.0] * 4, [[0.0] * 3 for _ in range(4)]
        touched, others = set(), set()
        addresses, places = contact.efc_address.tolist(), contact.pos.tolist()
        for (a, b), address, p_W in zip(contact.geom.tolist(), addresses, places, strict=True):
            if address < 0:  # near, but not touching
                continue
            if self._of_course[b]:
                a, b = b, a
            row = self._row[b]
            if not self._of_course[a] or row < 0:
                others.add((self._names[a], self._names[b]))
                continue
            normal = float(efc[address])  # an elliptic cone's first constraint
            force[row] += normal
            moment[row] = [m + normal * x for m, x in zip(moment[row], p_W, strict=True)]
            if normal > self._threshold:
                touched.add(self._names[a])
        position = [
            [m / f for m in moment[row]] if (f := force[row]) > 1e-9 else self._force_at[row]
            for row in range(4)
        ]
        self._force_at = position
        return Contacts(np.array(force), np.array(position), frozenset(touched), frozenset(others))


@dataclass(frozen=True, eq=False)
class Drive:
    """A run in MuJoCo, a row each controller period.

    Attributes:
        outcome: `goal_reached`, or why not.
        times: (N,) [s].
        place: (N, 3) the trunk in W [m].
        yaw: (N,) its heading [rad].
        base_error: (N,) its distance from where the plan has it [m].
        margin: (N,) static margin over the feet that bear [m].
        force: (N, 4) normal force on each foot [N].
        torque_ratio: (N,) the drives' largest torque to its limit.
        touched: The course's boxes that feet pressed on.
        others: Contacts of anything but a foot with the course, at any of MuJoCo's steps.
        waited: How long the gait clock waited in all [s].
        plan: The last task's.
    """

    outcome: str
    times: FloatArray
    place: FloatArray
    yaw: FloatArray
    base_error: FloatArray
    margin: FloatArray
    force: FloatArray
    torque_ratio: FloatArray
    touched: frozenset[str]
    others: frozenset[tuple[str, str]]
    waited: float
    plan: MotionPlan


def drive(
    controller: Diagram,
    body: MujocoRobot,
    *,
    limit: float,
    exchange: float | None = None,
    deaf: frozenset[str] = frozenset(),
) -> Drive:
    """Runs `controller`, a Diagram by itself with its own Context, on the robot in MuJoCo.

    In lock step: the controller's input ports are given what the robot senses, the controller
    does what its clocks have it do then, and the drives are told what it puts out.

    Args:
        controller: Any Diagram whose input ports are named as methods of MujocoRobot are.
        body: At its start.
        limit: When to give up [s].
        exchange: Between exchanges [s], of which every clock in the controller is a multiple;
            the controllers' period unless told.
        deaf: Input ports that keep what they were given at the start.
    """
    simulator = Simulator(controller)
    context = simulator.get_mutable_context()
    senses: list[tuple[Callable[[], FloatArray], FixedInputPortValue]] = []
    for k in range(controller.num_input_ports()):
        port = controller.get_input_port(k)
        sense = getattr(body, port.get_name())
        value = port.FixValue(context, sense())
        if port.get_name() not in deaf:
            senses.append((sense, value))
    ports = {
        name: controller.GetOutputPort(name)
        for name in ("joint_state_desired", "joint_torque_feedforward", "body_desired")
    }
    simulator.Initialize()
    logged = round(body.control.period / STEP)
    exchanged = round((exchange or body.control.period) / STEP)
    rows: list[list[float]] = []
    touched, others = set(body.contacts.touched), set(body.contacts.others)
    outcome = f"not at the goal after {limit:g} s"
    while body.time < limit:
        if body.steps % exchanged == 0:
            for sense, value in senses:
                value.GetMutableData().get_mutable_value().SetFromVector(sense())
            # Half a step on: rounding cannot decide on which side of a clock's tick this is.
            status = simulator.AdvanceTo(body.time + 0.5 * STEP)
            body.command(
                ports["joint_state_desired"].Eval(context),
                ports["joint_torque_feedforward"].Eval(context),
            )
            if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                found = re.search(r'message: "(.*)"', status.FormatMessage(), re.DOTALL)
                outcome = found.group(1) if found else status.FormatMessage()
                break
        if body.steps % logged == 0:
            place, R = body.data.qpos[:3], body.R_WB
            yaw = float(np.arctan2(R[1, 0], R[0, 0]))
            error = float(np.linalg.norm(place - ports["body_desired"].Eval(context)[:3]))
            ratio = float(np.max(np.abs(body.data.actuator_force) / body.robot.effort))
            rows.append([body.time, *place, yaw, error, body.margin, *body.contacts.force, ratio])
            if not R[2, 2] > np.cos(TILT_LIMIT):  # nor if it is not a number
                outcome = "fell"
                break
        body.step()
        touched |= body.contacts.touched
        others |= body.contacts.others
    table = np.array(rows)
    phase = controller.GetOutputPort("gait_phase").Eval(context)
    return Drive(
        outcome,
        times=table[:, 0],
        place=table[:, 1:4],
        yaw=table[:, 4],
        base_error=table[:, 5],
        margin=table[:, 6],
        force=table[:, 7:11],
        torque_ratio=table[:, 11],
        touched=frozenset(touched),
        others=frozenset(others),
        waited=float(phase[GaitPhase.WAITED]),
        plan=controller.GetOutputPort("motion_plan").Eval(context),
    )
