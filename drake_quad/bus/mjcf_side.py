"""A robot's side of a bus in MuJoCo: the robot's own MJCF, with its masses, friction and feet.

The file is the robot's maker's or another's; its joints have the names, zeros and senses of the
robot's file that drake_quad read (`drake-quad inspect`). Nothing of it is taken for the controller.
"""

from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.bus.joint_map import joint_map
from drake_quad.bus.messages import DRIVES_DAMP, DRIVES_FOLLOW, CommandMessage, StateMessage
from drake_quad.bus.postures import lowest_stance
from drake_quad.bus.trace import BEARS
from drake_quad.common import GRAVITY, FloatArray
from drake_quad.errors import InputError
from drake_quad.estimation.sensor_models import draw_joint_errors
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.legs import LEGS
from drake_quad.robot.mapping import read_mapping
from drake_quad.scenario.build import sensor_errors
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.systems.disturbances import Disturbances
from drake_quad.util.files import check_given

CLEAR = 0.01  # [m] higher than planned that it is put down: its feet may be thicker than ours
STEP = 0.002  # [s]: MuJoCo's own default, and that of many makers' files
MOST_MJCF = 64_000_000  # bytes; a maker's has 20 000
SAME_FOOT = 0.05  # [m] from where our model has the middle of a foot, within which its shape is


def check_mjcf(path: Path) -> Any:
    """Checks what can be checked of a file before anything is planned.

    Returns:
        The package `mujoco`.

    Raises:
        InputError: The package is not installed, or the file cannot be read.
    """
    try:
        import mujoco
    except ImportError:
        remedy = "needs the package mujoco: pip install mujoco"
        raise InputError(source="--mjcf", field="mjcf", value=str(path), remedy=remedy) from None
    try:
        check_given(path, most=MOST_MJCF)
    except OSError as error:
        raise _wrong(path, "mjcf", str(path), f"cannot be read: {error}") from None
    return mujoco


class MjcfSide:
    """The robot as far as its drives and its sensors, with the sensors' noise of the scenario.

    It begins on folded legs, damped, where the scenario has it begin.

    Args:
        path: The robot's MJCF, with an actuator for each joint. Of the actuators only the joints
            are taken: drives have the scenario's gains, and the limits of drake_quad's model.
        prepared: The scenario.
        step: Time step of MuJoCo's [s].
        friction: Coulomb's coefficient between feet and course; None: the scenario's.

    Attributes:
        period: Time from one `advance` to the next [s].
        others: Names of the bodies that have touched anything and are no feet.

    Raises:
        InputError: The package `mujoco` is not installed, the file cannot be read or is not of this
            robot, or the scenario has what only Drake's physics can do.
    """

    def __init__(
        self,
        path: Path,
        prepared: PreparedScenario,
        *,
        step: float = STEP,
        friction: float | None = None,
    ) -> None:
        self._mujoco = mujoco = check_mjcf(path)
        scenario, robot = prepared.scenario, prepared.robot
        if prepared.disturbances != Disturbances():
            raise InputError(
                source="--mjcf", field="disturbances", value="some",
                remedy="they act in Drake's physics alone: take them out, or leave out --mjcf",
            )  # fmt: skip
        self._control, self._own = scenario.controller, joint_map(robot)
        self.period, self._step = self._control.period, step
        if friction is None:
            friction = scenario.simulation.friction
        self._model = _build(mujoco, path, prepared, step=step, friction=friction)
        self._data = mujoco.MjData(self._model)
        joints = [self._model.joint(name) for name in robot.joint_names]
        self._q = np.array([joint.qposadr[0] for joint in joints])
        self._v = np.array([joint.dofadr[0] for joint in joints])
        drives = {int(self._model.actuator(k).trnid[0]): k for k in range(self._model.nu)}
        self._drive = np.array([drives[joint.id] for joint in joints])
        trunk = read_mapping(robot).get("trunk", {})
        self._p_TB = np.array(trunk.get("p_TB", (0.0, 0.0, 0.0)), dtype=float)
        errors = sensor_errors(scenario)
        assert errors is not None  # on a bus the state is estimated, see `prepare_for_bus`
        imu, self._rng = errors.imu, errors.imu_generator
        self._bias = self._rng.normal(size=6) * np.repeat([imu.gyro_turn_on, imu.accel_turn_on], 3)
        density = np.repeat([imu.gyro_density, imu.accel_density], 3)
        self._imu_noise = density / np.sqrt(self.period)
        self._joints = draw_joint_errors(errors.joints, errors.joint_generator)
        self._noise = scenario.sensors.torque_noise * robot.effort
        self._least = BEARS * robot.mass * GRAVITY
        self._put(prepared)
        self._feet = self._find_feet(path, prepared)
        self._body_of = self._model.geom_bodyid.tolist()
        self._steps, self._velocity = 0, np.zeros(3)
        self.others: set[str] = set()

    def _put(self, prepared: PreparedScenario) -> None:
        """Puts it on folded legs where the scenario has it begin."""
        robot = prepared.robot
        stance = lowest_stance(robot, prepared.stance)
        q, _, _ = pose_robot(robot, stance.body[None], stance.feet[None])
        R_WB, data = rotations(stance.body), self._data
        R_WT = R_WB @ self._own.R_BT
        self._mujoco.mju_mat2Quat(data.qpos[3:7], R_WT.ravel())
        data.qpos[:3] = stance.body[:3] - R_WT @ self._p_TB + [0.0, 0.0, CLEAR]
        data.qpos[self._q] = self._own.sign * (q.ravel() + self._own.turn)
        data.ctrl[self._drive] = data.qpos[self._q]
        self._mujoco.mj_forward(self._model, data)

    def _find_feet(self, path: Path, prepared: PreparedScenario) -> dict[int, int]:
        """The feet's shapes and their legs' rows, found as the robot stands on folded legs.

        Raises:
            InputError: No shape is where a foot is.
        """
        robot, stance = prepared.robot, lowest_stance(prepared.robot, prepared.stance)
        solid = np.flatnonzero((self._model.geom_contype | self._model.geom_conaffinity) != 0)
        feet = {}
        for leg in LEGS:
            shank = self._model.joint(robot.joint_names[3 * leg.row + 2]).bodyid[0]
            own = [k for k in solid if self._is_part(self._model.geom_bodyid[k], shank)]
            foot = stance.feet[leg.row] + [0.0, 0.0, CLEAR]
            off = np.linalg.norm(self._data.geom_xpos[own] - foot, axis=1)
            if not own or off.min() > SAME_FOOT:
                raise _wrong(
                    path, "geom", leg.short,
                    f"no shape that collides is within {SAME_FOOT:g} m of where the model of "
                    f"{robot.name} has this leg's foot; give an MJCF of that robot",
                )  # fmt: skip
            feet[int(own[int(off.argmin())])] = leg.row
        return feet

    def _is_part(self, body: int, of: int) -> bool:
        """Whether a body is another one, or hangs on it."""
        while body not in (0, of):
            body = self._model.body_parentid[body]
        return bool(body == of)

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
        self._mujoco.mju_quat2Mat(R, self._data.qpos[3:7])
        return R.reshape(3, 3)

    def truth(self) -> dict[str, FloatArray]:
        """Where it is, as `trace.ROBOT` has its parts `pose`, `feet` and `bearing`."""
        quaternion, feet = np.zeros(4), np.zeros((4, 3))
        R = self._R_WT @ self._own.R_BT.T
        self._mujoco.mju_mat2Quat(quaternion, R.ravel())
        for geom, row in self._feet.items():
            feet[row] = self._data.geom_xpos[geom]
        return {
            "pose": np.concatenate([self.base, quaternion]),
            "feet": feet,
            "bearing": (self._foot_force() > self._least).astype(float),
        }

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
            self._mujoco.mj_step(self._model, data)
            self._steps += 1
            self._note_contacts()

    def _note_contacts(self) -> None:
        """Notes what touches anything that is no foot."""
        contact = self._data.contact
        for (a, b), address in zip(
            contact.geom.tolist(), contact.efc_address.tolist(), strict=True
        ):
            part = b if self._body_of[a] == 0 else a
            if address >= 0 and part not in self._feet:
                self.others.add(self._model.body(self._body_of[part]).name)

    def sense(self, session: int, sequence: int, time_ns: int, drives: int) -> StateMessage:
        """What it senses now."""
        data, own, rng = self._data, self._own, self._rng
        R_WT, v = self._R_WT, np.array(data.qvel[:3])
        w_T = np.array(data.qvel[3:6])
        (wx, wy, wz), (x, y, z) = w_T.tolist(), self._p_TB.tolist()
        v = v + R_WT @ np.array(
            [wy * z - wz * y, wz * x - wx * z, wx * y - wy * x]
        )  # of B's origin
        force = (v - self._velocity) / self.period
        force[2] += GRAVITY
        self._velocity = v
        noise = self._bias + rng.normal(size=6) * self._imu_noise
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


def _wrong(path: Path, field: str, value: object, remedy: str) -> InputError:
    return InputError(source=str(path), field=field, value=value, remedy=remedy)


def _build(
    mujoco: Any, path: Path, prepared: PreparedScenario, *, step: float, friction: float
) -> Any:
    """An MjModel of the file on the scenario's course, with drives of the scenario's gains.

    Raises:
        InputError: The file cannot be read, or is not of this robot.
    """
    robot, control = prepared.robot, prepared.scenario.controller
    effort = dict(zip(robot.joint_names, robot.effort, strict=True))
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, OSError) as error:
        raise _wrong(path, "mjcf", str(path), _one_line(error)) from None
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
    for drive in spec.actuators:
        if drive.target not in effort:
            continue
        # force = clip(kp (ctrl - q) - kd v), implicit in its damping as a drive's own loop is.
        drive.gaintype, drive.gainprm = mujoco.mjtGain.mjGAIN_FIXED, [control.kp] + [0.0] * 9
        drive.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        drive.biasprm = [0.0, -control.kp, -control.kd] + [0.0] * 7
        drive.ctrllimited, drive.forcelimited = False, True
        drive.forcerange = [-effort[drive.target], effort[drive.target]]
    driven = [drive.target for drive in spec.actuators]
    for name in robot.joint_names:
        if driven.count(name) != 1:
            raise _wrong(
                path, "actuator", name,
                f"{driven.count(name)} actuators have this joint: give an MJCF of {robot.name} "
                "with one for each",
            )  # fmt: skip
    try:
        model = spec.compile()
    except ValueError as error:
        raise _wrong(path, "mjcf", str(path), _one_line(error)) from None
    free = mujoco.mjtJoint.mjJNT_FREE
    if model.jnt_type[0] != free or np.count_nonzero(model.jnt_type == free) != 1:
        raise _wrong(path, "freejoint", model.njnt, "its trunk, and nothing else, must be free")
    return model


def _one_line(error: Exception) -> str:
    """What MuJoCo says, in a line."""
    return "MuJoCo says: " + " ".join(str(error).split())
