"""The robot in MuJoCo: what it senses there, and its drives."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from benchmarks.mujoco_model import GRAVITY, STEP, build_model
from drake_quad.common import BoolArray, FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import Stance, pose_robot
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.stability.support_polygon import stability_margin
from drake_quad.terrain.course import Course

IMU_PERIOD = 0.002  # [s] over which the unit integrates
NO_SUPPORT = -9.0  # [m] instead of -inf where no foot bears


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
        **real: Any,
    ) -> None:
        """`real`: friction and what else of it the controller is not told, as of build_model."""
        self.robot, self.control = robot, control
        self.model = build_model(robot, plant, course, control, **real)
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
        return max(stability_margin((x, y), feet), NO_SUPPORT)

    @property
    def ground(self) -> float:
        """Height of the lowest foot that bears in W [m]; where none does, of all, as last known."""
        feet = self.contacts.position[:, 2]
        return float(np.min(feet[self.bearing] if self.bearing.any() else feet))

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
