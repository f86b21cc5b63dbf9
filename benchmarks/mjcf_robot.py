"""A robot's own MJCF as the robot's side of a bus: its masses, friction and drives, not ours.

The file is the robot's maker's or another's; its joints have the names, zeros and senses of the
robot's file that drake_quad read (`drake-quad inspect`). Nothing of it is taken for the controller.
"""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from drake_quad.bus.messages import DRIVES_DAMP, DRIVES_FOLLOW, CommandMessage, StateMessage
from drake_quad.bus.postures import lowest_stance
from drake_quad.bus.processes import joint_map
from drake_quad.common import GRAVITY, FloatArray
from drake_quad.estimation.sensor_models import draw_joint_errors
from drake_quad.feasibility.inspect_robot import read_mapping
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.scenario.build import sensor_errors
from drake_quad.simulation.prepare import PreparedScenario

CLEAR = 0.01  # [m] higher than planned that it is put down: its feet may be thicker than ours
FOOT_OF = ("FL", "FR", "RL", "RR")  # names of the feet's shapes


def build_model(path: Path, prepared: PreparedScenario, *, step: float, friction: float) -> Any:
    """An MjModel of the file on the scenario's course, with drives of the scenario's gains.

    Args:
        path: The robot's MJCF, whose actuators are motors of one joint each.
        prepared: The scenario.
        step: Time step [s].
        friction: Coulomb's coefficient between feet and course.
    """
    spec = mujoco.MjSpec.from_file(str(path))
    spec.option.timestep = step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    for box in prepared.world.boxes:
        turn, tilt, both = np.zeros(4), np.zeros(4), np.zeros(4)
        mujoco.mju_axisAngle2Quat(turn, [0.0, 0.0, 1.0], box.yaw)
        mujoco.mju_axisAngle2Quat(tilt, [0.0, 1.0, 0.0], box.pitch)
        mujoco.mju_mulQuat(both, turn, tilt)
        spec.worldbody.add_geom(
            name=box.name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=box.centre, size=0.5 * box.size,
            quat=both, friction=[friction, 0.005, 0.0001], priority=1,
        )  # fmt: skip
    control = prepared.scenario.controller
    effort = dict(zip(prepared.robot.joint_names, prepared.robot.effort, strict=True))
    for drive in spec.actuators:
        # force = clip(kp (ctrl - q) - kd v), implicit in its damping as a drive's own loop is.
        drive.gaintype, drive.gainprm = mujoco.mjtGain.mjGAIN_FIXED, [control.kp] + [0.0] * 9
        drive.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        drive.biasprm = [0.0, -control.kp, -control.kd] + [0.0] * 7
        drive.ctrllimited, drive.forcelimited = False, True
        limit = effort[drive.target]
        drive.forcerange = [-limit, limit]
    return spec.compile()


class MjcfSide:
    """The robot as far as its drives and its sensors, with the sensors' noise of the scenario.

    Args:
        path: The robot's MJCF.
        prepared: The scenario.
        step: Time step of MuJoCo's [s].
        friction: Coulomb's coefficient between feet and course.
    """

    def __init__(
        self, path: Path, prepared: PreparedScenario, *, step: float = 0.002, friction: float = 0.6
    ) -> None:
        robot = prepared.robot
        self._control, self._own = prepared.scenario.controller, joint_map(robot)
        self.period, self._step = self._control.period, step
        self._model = build_model(path, prepared, step=step, friction=friction)
        self._data = mujoco.MjData(self._model)
        joints = [self._model.joint(name) for name in robot.joint_names]
        self._q = np.array([joint.qposadr[0] for joint in joints])
        self._v = np.array([joint.dofadr[0] for joint in joints])
        drives = {int(self._model.actuator(k).trnid[0]): k for k in range(self._model.nu)}
        self._drive = np.array([drives[joint.id] for joint in joints])
        trunk = read_mapping(robot).get("trunk", {})
        self._p_TB = np.array(trunk.get("p_TB", (0.0, 0.0, 0.0)), dtype=float)
        self._trunk = self._model.body(trunk.get("link", robot.trunk)).id
        self._feet = {self._model.geom(name).id: k for k, name in enumerate(FOOT_OF)}
        errors = sensor_errors(prepared.scenario)
        assert errors is not None
        self._imu, self._rng = errors.imu, errors.imu_generator
        self._bias = self._rng.normal(size=6) * np.repeat(
            [self._imu.gyro_turn_on, self._imu.accel_turn_on], 3
        )
        self._joints = draw_joint_errors(errors.joints, errors.joint_generator)
        self._noise = prepared.scenario.sensors.torque_noise * robot.effort
        self._put(prepared)
        self._steps, self._velocity = 0, np.zeros(3)
        self.others: set[str] = set()

    def _put(self, prepared: PreparedScenario) -> None:
        """Puts it on folded legs where the scenario has it begin."""
        robot = prepared.robot
        stance = lowest_stance(robot, prepared.stance)
        q, _, _ = pose_robot(robot, stance.body[None], stance.feet[None])
        R_WB, data = rotations(stance.body), self._data
        R_WT = R_WB @ self._own.R_BT
        mujoco.mju_mat2Quat(data.qpos[3:7], R_WT.ravel())
        data.qpos[:3] = stance.body[:3] - R_WT @ self._p_TB + [0.0, 0.0, CLEAR]
        data.qpos[self._q] = self._own.sign * (q.ravel() + self._own.turn)
        data.ctrl[self._drive] = data.qpos[self._q]
        mujoco.mj_forward(self._model, data)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._steps * self._step

    @property
    def base(self) -> FloatArray:
        """Where B is, (3,) in W [m], the truth."""
        return np.asarray(self._data.qpos[:3] + self._R_WT @ self._p_TB)

    @property
    def _R_WT(self) -> FloatArray:
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, self._data.qpos[3:7])
        return R.reshape(3, 3)

    def advance(self, drives: int, command: CommandMessage | None) -> None:
        """Goes on by a period; the drives' law is τ + k (q_d - q) + d (v_d - v)."""
        c, own, data = self._control, self._own, self._data
        for _ in range(round(self.period / self._step)):
            q, v = data.qpos[self._q], data.qvel[self._v]
            if drives == DRIVES_DAMP or command is None:
                ctrl = q + self._step * v  # MuJoCo's own drives damp by kd
            else:
                told = command.velocity if drives == DRIVES_FOLLOW else np.zeros(12)
                k, d = command.stiffness / c.kp, command.damping / c.kd
                ctrl = q + k * (own.sign * (command.position + own.turn) - q)
                push = own.sign * (command.effort + c.kd * d * told) + c.kd * (1.0 - d) * v
                ctrl = ctrl + push / c.kp
            data.ctrl[self._drive] = ctrl
            mujoco.mj_step(self._model, data)
            self._steps += 1
            self._note_contacts()

    def _note_contacts(self) -> None:
        """Notes what touches the course that is no foot."""
        contact = self._data.contact
        for (a, b), address in zip(
            contact.geom.tolist(), contact.efc_address.tolist(), strict=True
        ):
            part = b if self._model.geom_bodyid[a] == 0 else a
            if address >= 0 and part not in self._feet:
                self.others.add(self._model.body(self._model.geom_bodyid[part]).name)

    def sense(self, session: int, sequence: int, time_ns: int, drives: int) -> StateMessage:
        """What it senses now."""
        data, own, rng = self._data, self._own, self._rng
        R_WT, v = self._R_WT, np.array(data.qvel[:3])
        w_T = np.array(data.qvel[3:6])
        v = v + R_WT @ np.cross(w_T, self._p_TB)  # of B's origin
        force = (v - self._velocity) / self.period + [0.0, 0.0, GRAVITY]
        self._velocity = v
        scale = np.repeat([self._imu.gyro_density, self._imu.accel_density], 3)
        noise = self._bias + rng.normal(size=6) * scale / np.sqrt(self.period)
        imu = np.concatenate([own.R_BT @ w_T, own.R_BT @ R_WT.T @ force]) + noise
        q = own.sign * data.qpos[self._q] - own.turn
        joints = self._joints.apply(np.concatenate([q, own.sign * data.qvel[self._v]]), sequence)
        effort = own.sign * data.actuator_force[self._drive] + self._noise * rng.normal(size=12)
        return StateMessage(
            session, sequence, time_ns, drives, joints[:12], joints[12:], effort, imu[:3], imu[3:],
            self._foot_force(),
        )  # fmt: skip

    def _foot_force(self) -> FloatArray:
        """Normal force on each foot (4,) [N]."""
        force, contact = np.zeros(4), self._data.contact
        for pair, address in zip(contact.geom.tolist(), contact.efc_address.tolist(), strict=True):
            for part in pair:
                if address >= 0 and part in self._feet:
                    force[self._feet[part]] += self._data.efc_force[address]
        return force
