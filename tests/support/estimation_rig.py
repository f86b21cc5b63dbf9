"""What the tests of sensors and estimator share: a crawl made of kinematics alone, and a filter."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from rig import GRAVITY, model_layout, paper_robot, stand_plan

from drake_quad.common import FloatArray
from drake_quad.estimation import filter_state as at
from drake_quad.estimation.filter import step, write_deviation
from drake_quad.estimation.filter_state import (
    COVARIANCE,
    ERRORS,
    EstimatorSettings,
    filter_model,
    initial_memory,
)
from drake_quad.estimation.imu_units import IDEAL_IMU, ImuNoise
from drake_quad.estimation.sensor_models import (
    IDEAL_JOINTS,
    JointNoise,
    draw_imu_errors,
    draw_joint_errors,
    imu_increments,
)
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.kinematics import calc_feet, leg_array

DT = 0.002


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion at every tick: states (N, 37) in `model_layout`, and which feet bear (N, 4)."""

    states: FloatArray
    contacts: FloatArray

    @property
    def position(self) -> FloatArray:
        """p_WB (N, 3) [m]."""
        i = model_layout().q_base
        return self.states[:, i + 4 : i + 7]

    @property
    def velocity(self) -> FloatArray:
        """v_WB (N, 3) [m/s]."""
        j = model_layout().v_base
        return self.states[:, j + 3 : j + 6]

    @property
    def rotation(self) -> FloatArray:
        """R_WB (N, 3, 3)."""
        return np.array([model_layout().read(x).R_WB for x in self.states])

    @property
    def feet(self) -> FloatArray:
        """The feet's centres in W (N, 4, 3) [m]."""
        reads = [model_layout().read(x) for x in self.states]
        geometry = paper_robot().geometry
        return np.array([r.p_WB + calc_feet(geometry, r.q) @ r.R_WB.T for r in reads])

    def moved(self, *, yaw: float, shift: FloatArray) -> "Motion":
        """The same motion elsewhere: turned about W's z [rad], then shifted (3,) [m]."""
        layout = model_layout()
        i, j = layout.q_base, layout.v_base
        Z = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        states = self.states.copy()
        c, s = np.cos(0.5 * yaw), np.sin(0.5 * yaw)
        w, x, y, z = self.states[:, i : i + 4].T
        states[:, i : i + 4] = np.stack(
            [c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w]
        ).T
        states[:, i + 4 : i + 7] = states[:, i + 4 : i + 7] @ Z.T + shift
        for k in (j, j + 3):
            states[:, k : k + 3] = states[:, k : k + 3] @ Z.T
        return Motion(states, self.contacts)


def smooth(n: int) -> FloatArray:
    """0 to 1 in `n` ticks, at rest at both ends."""
    s = np.arange(1, n + 1) / n
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def differences(body: FloatArray, feet: FloatArray, contacts: FloatArray) -> Motion:
    """The motion of bodies (N, 5) on feet (N, 4, 3), its velocities by central differences."""
    layout = model_layout()
    n = len(body)
    q, excess, _ = pose_robot(paper_robot(), body, feet)
    assert excess.max() < 1e-9
    q = q.reshape(n, 12)
    states = np.zeros((n, layout.size))
    i, j = layout.q_base, layout.v_base
    cp, sp = np.cos(0.5 * body[:, 3]), np.sin(0.5 * body[:, 3])
    cy, sy = np.cos(0.5 * body[:, 4]), np.sin(0.5 * body[:, 4])
    states[:, i : i + 4] = np.stack([cy * cp, -sy * sp, cy * sp, sy * cp]).T
    states[:, i + 4 : i + 7] = body[:, :3]
    states[:, layout.q_joints] = q
    states[:, layout.v_joints] = np.gradient(q, DT, axis=0)
    rates = np.gradient(body, DT, axis=0)
    yaw = body[:, 4]
    states[:, j : j + 3] = np.stack(
        [-np.sin(yaw) * rates[:, 3], np.cos(yaw) * rates[:, 3], rates[:, 4]]
    ).T
    states[:, j + 3 : j + 6] = rates[:, :3]
    return Motion(states, contacts)


@cache
def stand(seconds: float = 2.0) -> Motion:
    """The first stance, at rest."""
    stance, n = stand_plan().end, round(seconds / DT)
    return differences(
        np.tile(stance.body, (n, 1)), np.tile(stance.feet, (n, 1, 1)), np.ones((n, 4))
    )


@cache
def crawl(strides: int = 3, *, radius: float = 0.0, turn: float = 0.0, sink: float = 0.0) -> Motion:
    """The base goes on 0.2 m on four feet, then the feet follow one by one; again and again.

    Args:
        strides: How often.
        radius: Of the feet, which roll as balls do [m] (without a turn alone).
        turn: Yaw in each stride [rad].
        sink: By how much each foot goes down in the 0.2 s after it has been set down [m].
    """
    stance = stand_plan().end
    body, feet = [np.array(stance.body)] * 250, [np.array(stance.feet)] * 250
    contacts = [np.ones(4)] * 250
    for _ in range(strides):
        first = body[-1]
        for s in smooth(300):
            body.append(first + s * np.array([0.2, 0.02, 0.0, 0.05, turn]))
            feet.append(feet[-1])
            contacts.append(np.ones(4))
        there = body[-1]
        for s in smooth(100):
            body.append(there + s * np.array([0.0, -0.02, 0.0, -0.05, 0.0]))
            feet.append(feet[-1])
            contacts.append(np.ones(4))
        Z = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        for row in range(4):
            start = feet[-1][row].copy()
            goal = start.copy()
            goal[:2] = body[-1][:2] + Z @ (start[:2] - first[:2])
            for s in smooth(100):
                now = feet[-1].copy()
                now[row] = start + s * (goal - start) + [0.0, 0.0, 0.32 * s * (1.0 - s)]
                body.append(body[-1])
                feet.append(now)
                contacts.append(np.array([float(k != row) for k in range(4)]))
            contacts[-1] = np.ones(4)
    place, poses, bears = np.array(feet), np.array(body), np.array(contacts)
    return differences(poses, sunk(rolled(poses, place, bears, radius), bears, sink), bears)


def sunk(feet: FloatArray, contacts: FloatArray, sink: float) -> FloatArray:
    """The feet's centres if each goes down by `sink` once it has been set down."""
    result = feet.copy()
    for k in range(4):
        for start in np.flatnonzero(np.diff(contacts[:, k]) > 0.5) + 1:
            end = start + int(np.argmin(np.append(contacts[start:, k], 0.0)))
            down = np.minimum(np.arange(end - start) / 100, 1.0)
            result[start:end, k, 2] -= sink * down
            swing = result[end : end + 100, k, 2]  # and comes up again as it is lifted
            swing -= (
                sink * np.linspace(1.0, 0.0, 100)[: len(swing)] * (down[-1] if end > start else 0)
            )
    return result


def rolled(body: FloatArray, feet: FloatArray, contacts: FloatArray, radius: float) -> FloatArray:
    """The feet's centres if the feet roll while they bear: on by radius x the shank's pitch."""
    if radius == 0.0:
        return feet
    result = feet
    for _ in range(6):  # the shank's pitch hangs on where the centre is, weakly
        q, _, _ = pose_robot(paper_robot(), body, result)
        q = q.reshape(len(body), 4, 3)
        pitch = q[..., 1] + q[..., 2] + body[:, None, 3]
        on = np.zeros((len(body), 4))
        for k in range(1, len(body)):
            turn = pitch[k] - pitch[k - 1]
            on[k] = on[k - 1] + np.where(contacts[k] * contacts[k - 1] > 0.5, radius * turn, 0.0)
        result = feet.copy()
        result[..., 0] += on
    return result


@dataclass(frozen=True, eq=False)
class Estimate:
    """What the filter made of a motion, tick by tick.

    Attributes:
        memory: (N, COVARIANCE) all but the covariance.
        deviation: (N, 9).
        healthy: (N,).
        covariance: (27, 27) at the end.
    """

    memory: FloatArray
    deviation: FloatArray
    healthy: FloatArray
    covariance: FloatArray

    @property
    def position(self) -> FloatArray:
        """p_WB (N, 3) [m]."""
        return self.memory[:, at.POSITION : at.POSITION + 3]

    @property
    def velocity(self) -> FloatArray:
        """v_WB (N, 3) [m/s]."""
        return self.memory[:, at.VELOCITY : at.VELOCITY + 3]

    @property
    def rotation(self) -> FloatArray:
        """R_WB (N, 3, 3)."""
        return self.memory[:, at.ROTATION : at.ROTATION + 9].reshape(-1, 3, 3)

    @property
    def bias(self) -> FloatArray:
        """Of the rate and of the specific force, (N, 6)."""
        return self.memory[:, at.GYRO_BIAS : at.ACCEL_BIAS + 3]

    @property
    def slip(self) -> FloatArray:
        """(N, 4)."""
        return self.memory[:, at.SLIP : at.SLIP + 4]


def readings(
    motion: Motion,
    *,
    imu_noise: ImuNoise = IDEAL_IMU,
    joint_noise: JointNoise = IDEAL_JOINTS,
    seed: int = 0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """IMU (N, 6), joints (N, 24) and true biases (N, 6) of a motion."""
    layout = model_layout()
    of_imu, of_joints = np.random.default_rng(seed).spawn(2)
    unit, drives = draw_imu_errors(imu_noise, DT, of_imu), draw_joint_errors(joint_noise, of_joints)
    i, j = layout.q_base, layout.v_base
    seen = np.hstack([motion.states[:, i : i + 4], motion.states[:, j + 3 : j + 6]])
    joints = np.hstack([motion.states[:, layout.q_joints], motion.states[:, layout.v_joints]])
    n = len(seen)
    imu = [unit.apply(imu_increments(seen[max(k - 1, 0)], seen[k], DT), k) for k in range(n)]
    angles = [drives.apply(joints[k], k) for k in range(n)]
    return np.array(imu), np.array(angles), np.array([unit.calc_bias(k) for k in range(n)])


def legs_array() -> FloatArray:
    """The shipped robot's legs as the kernels take them."""
    return leg_array(paper_robot().geometry)


def estimate(
    motion: Motion,
    imu: FloatArray,
    joints: FloatArray,
    *,
    contacts: FloatArray | None = None,
    settings: EstimatorSettings | None = None,
    radius: float = 0.0,
    yaw: float | None = None,
    p_WB: FloatArray | None = None,
    tops: FloatArray | None = None,
) -> Estimate:
    """Runs the filter over readings, from the motion's own start unless told another.

    `tops` is the map that it has, none unless given.
    """
    settings = settings or EstimatorSettings()
    R = motion.rotation[0]
    memory = initial_memory(
        settings,
        motion.position[0] if p_WB is None else p_WB,
        float(np.arctan2(R[1, 0], R[0, 0])) if yaw is None else yaw,
        0.0,
        np.zeros(12),
    )
    feet = motion.contacts if contacts is None else contacts
    model = filter_model(paper_robot(), settings, radius=radius, period=DT, layout=model_layout())[
        0
    ]
    rows, deviations, healthy = [], [], []
    tops = np.zeros((0, 10)) if tops is None else tops
    for k in range(len(imu)):
        sound = step(memory, (imu[k], joints[k], feet[k]), model, tops)
        deviation = np.zeros(9)
        write_deviation(memory, deviation)
        rows.append(memory[:COVARIANCE].copy())
        deviations.append(deviation)
        healthy.append(float(sound))
    return Estimate(
        np.array(rows),
        np.array(deviations),
        np.array(healthy),
        memory[COVARIANCE:].reshape(ERRORS, ERRORS).copy(),
    )


def angle_between(R: FloatArray, other: FloatArray) -> FloatArray:
    """The angle between rotations, (N,) [rad]."""
    cosine = 0.5 * (np.einsum("nij,nij->n", R, other) - 1.0)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


__all__ = [
    "DT",
    "GRAVITY",
    "Estimate",
    "Motion",
    "angle_between",
    "crawl",
    "differences",
    "estimate",
    "legs_array",
    "readings",
    "smooth",
    "stand",
]
