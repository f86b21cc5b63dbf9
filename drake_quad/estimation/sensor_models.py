"""Noise models of the IMU and the encoders, and the kernels that apply them.

Each axis reads truth + turn-on bias + walking bias + white noise, clipped to its range (the model
of IEEE Std 952 without its quantisation and ramp). The figures shipped are those of one unit.

`ImuErrors.apply` and `JointErrors.apply` say what the errors are; tests hold these equal to them.
"""

from dataclasses import dataclass
from math import floor

import numpy as np

from drake_quad.common import GRAVITY, FloatArray, IntArray
from drake_quad.estimation.imu_units import ImuNoise
from drake_quad.jit import copy_vector, jit
from drake_quad.math.rotations import (
    multiply,
    quaternion_matrix,
    rotation_exp,
    rotation_log,
)

WHITE_ROWS = 2**17  # 262 s at 500 Hz before the same noise comes again
BIAS_ROWS = 4096  # [s]: a row a second, between which the bias is drawn straight


@dataclass(frozen=True, eq=False)
class ImuErrors:
    """The errors of one unit in one run.

    Attributes:
        white: (WHITE_ROWS, 6) white noise of each sample, used in a circle.
        bias: (BIAS_ROWS, 6) bias at each full second, used in a circle.
        limit: (6,) the greatest readings.
        period: Period of the samples [s].
    """

    white: FloatArray
    bias: FloatArray
    limit: FloatArray
    period: float

    @property
    def tables(self) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """All of them, as `sense_imu` takes them."""
        return self.white, self.bias, self.limit, self.period

    def calc_bias(self, tick: int) -> FloatArray:
        """The true bias (6,) at a tick: rate [rad/s], then specific force [m/s^2]."""
        second = tick * self.period
        row = int(second)
        part = second - row
        here, there = self.bias[row % BIAS_ROWS], self.bias[(row + 1) % BIAS_ROWS]
        return here + part * (there - here)

    def apply(self, ideal: FloatArray, tick: int) -> FloatArray:
        """What the unit shows (6,) at a tick where it ought to show `ideal` (6,)."""
        shown = ideal + self.white[tick % WHITE_ROWS] + self.calc_bias(tick)
        return np.minimum(np.maximum(shown, -self.limit), self.limit)


def draw_imu_errors(noise: ImuNoise, period: float, generator: np.random.Generator) -> ImuErrors:
    """Draws the errors of a unit that is sampled every `period` [s]."""
    n = noise

    def each(gyro: float, accel: float) -> FloatArray:
        return np.repeat([gyro, accel], 3)

    # A mean over the interval: white noise of density N has the deviation N / sqrt(period).
    white = generator.standard_normal((WHITE_ROWS, 6)) * each(
        n.gyro_density / np.sqrt(period), n.accel_density / np.sqrt(period)
    )
    turn_on = generator.standard_normal(6) * each(n.gyro_turn_on, n.accel_turn_on)
    steps = generator.standard_normal((BIAS_ROWS, 6))
    keep = np.exp(-1.0 / n.correlation_time)
    wander = np.empty((BIAS_ROWS, 6))
    value = np.zeros(6)  # the turn-on bias is the whole bias at the start
    for row in range(BIAS_ROWS):
        wander[row] = value
        value = keep * value + np.sqrt(1.0 - keep**2) * steps[row]
    bias = turn_on + wander * each(n.gyro_instability, n.accel_instability)
    for table in (white, bias):
        table.setflags(write=False)
    return ImuErrors(white, bias, each(n.gyro_range, n.accel_range), period)


ROWS = 2**15  # 65 s at 500 Hz before the same noise comes again


@dataclass(frozen=True, kw_only=True)
class JointNoise:
    """Figures of a joint's drive; all zero is the ideal one.

    Attributes:
        name: Name of the drive.
        counts: Counts of the encoder in a revolution of the joint; 0 for no quantisation.
        angle: White noise of the angle [rad].
        speed: White noise of the speed [rad/s].
        zero: Deviation of where each joint's zero is taken to be [rad].
    """

    name: str = "ideal"
    counts: int = 0
    angle: float = 0.0
    speed: float = 0.0
    zero: float = 0.0


IDEAL_JOINTS = JointNoise()

# Open Dynamic Robot Initiative, "Brushless Actuator Module Core": Broadcom AEDT-9810, 5000 pulses a
# channel, 20000 counts a motor revolution, belts 9:1: 180000 counts a revolution of the joint (17.5
# bits). Noise of the angle is about a count's, that of the speed what remains of differenced counts
# after the drive's filter, and the zero that of a careful calibration: assumptions.
ODRI_DRIVE = JointNoise(
    name="ODRI actuator module",
    counts=180_000,
    angle=3.5e-5,
    speed=0.015,
    zero=5.0e-4,
)


@dataclass(frozen=True, eq=False)
class JointErrors:
    """The errors of twelve drives in one run.

    Attributes:
        white: (ROWS, 24) of angles, then speeds, used in a circle.
        zero: (12,) errors of the joints' zeros [rad].
        count: Resolution of the encoder [rad]; 0 for no quantisation.
    """

    white: FloatArray
    zero: FloatArray
    count: float

    @property
    def tables(self) -> tuple[FloatArray, FloatArray, float]:
        """All of them, as `sense_joints` takes them."""
        return self.white, self.zero, self.count

    def apply(self, ideal: FloatArray, tick: int) -> FloatArray:
        """What the drives show (24,) at a tick where they ought to show `ideal` (24,)."""
        shown = ideal + self.white[tick % ROWS]
        shown[:12] += self.zero
        if self.count > 0.0:
            shown[:12] = np.floor(shown[:12] / self.count + 0.5) * self.count
        return shown


def draw_joint_errors(noise: JointNoise, generator: np.random.Generator) -> JointErrors:
    """Draws the errors of twelve drives."""
    white = generator.standard_normal((ROWS, 24)) * np.repeat([noise.angle, noise.speed], 12)
    zero = generator.standard_normal(12) * noise.zero
    for table in (white, zero):
        table.setflags(write=False)
    return JointErrors(white, zero, 2.0 * np.pi / noise.counts if noise.counts else 0.0)


@dataclass(frozen=True, eq=False)
class TorqueErrors:
    """The errors of the torques that twelve drives measure, in one run.

    Attributes:
        white: (ROWS, 12) white noise of each sample, leg by leg [Nm], used in a circle.
    """

    white: FloatArray

    def apply(self, ideal: FloatArray, tick: int) -> FloatArray:
        """What the drives show (12,) at a tick where they ought to show `ideal` (12,) [Nm]."""
        return np.asarray(ideal + self.white[tick % ROWS])


def draw_torque_errors(deviation: FloatArray, generator: np.random.Generator) -> TorqueErrors:
    """Draws the errors of torques with these standard deviations, leg by leg (12,) [Nm]."""
    white = generator.standard_normal((ROWS, 12)) * deviation
    white.setflags(write=False)
    return TorqueErrors(white)


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """What the sensors are like, and what their errors are drawn from.

    Attributes:
        imu: Noise of the IMU.
        joints: Noise of the joints' drives.
        imu_generator: Generator of the IMU's random numbers.
        joint_generator: Generator of the drives' random numbers.
    """

    imu: ImuNoise
    joints: JointNoise
    imu_generator: np.random.Generator
    joint_generator: np.random.Generator


@jit
def imu_increments(before: FloatArray, now: FloatArray, dt: float) -> FloatArray:
    """Mean rate [rad/s] and specific force [m/s^2] in B (6,) between two samples.

    Args:
        before: Quaternion w, x, y, z of R_WB, then v_WB [m/s], at the last sample (7,).
        now: Quaternion and velocity at this sample (7,).
        dt: Time between them [s].
    """
    R = quaternion_matrix(before[:4])
    turn = rotation_log(multiply(np.ascontiguousarray(R.T), quaternion_matrix(now[:4])))
    # B turns within the interval: the mean force is given in B as it is half way.
    middle = multiply(R, rotation_exp(0.5 * turn[0], 0.5 * turn[1], 0.5 * turn[2]))
    a = (now[4:7] - before[4:7]) / dt
    a[2] += GRAVITY
    out = np.empty(6)
    for i in range(3):
        out[i] = turn[i] / dt
        out[3 + i] = middle[0, i] * a[0] + middle[1, i] * a[1] + middle[2, i] * a[2]
    return out


@jit
def sense_imu(
    state: FloatArray,
    q_base: int,
    v_base: int,
    before: FloatArray,
    tick: int,
    errors: tuple[FloatArray, FloatArray, FloatArray, float],
    shown: FloatArray,
) -> None:
    """What an IMU shows (6,), and what it has to remember.

    Args:
        state: True state [q; v].
        q_base: Index of the base's quaternion in it.
        v_base: Index of the base's angular velocity in it; its velocity follows.
        before: Quaternion and velocity at the last sample (7,); those of this one replace them.
        tick: Number of the sample.
        errors: `ImuErrors.tables` of the unit.
        shown: Result: rate [rad/s], then specific force [m/s^2].
    """
    white, bias, limit, period = errors
    now = np.empty(7)
    copy_vector(now[:4], state[q_base : q_base + 4])
    copy_vector(now[4:], state[v_base + 3 : v_base + 6])
    ideal = imu_increments(before, now, period)
    copy_vector(before, now)
    second = tick * period
    row = int(second)
    part = second - row
    here, there = bias[row % len(bias)], bias[(row + 1) % len(bias)]
    noise = white[tick % len(white)]
    for i in range(6):
        value = ideal[i] + noise[i] + (here[i] + part * (there[i] - here[i]))
        shown[i] = min(max(value, -limit[i]), limit[i])


@jit
def sense_joints(
    state: FloatArray,
    places: IntArray,
    tick: int,
    errors: tuple[FloatArray, FloatArray, float],
    shown: FloatArray,
) -> None:
    """What the joints' encoders show (24,).

    Args:
        state: True state [q; v].
        places: Indices of the joints' angles in it, then of their speeds (24,).
        tick: Number of the sample.
        errors: `JointErrors.tables` of the drives.
        shown: Result: angles [rad], then speeds [rad/s].
    """
    white, zero, count = errors
    noise = white[tick % len(white)]
    for i in range(24):
        shown[i] = state[places[i]] + noise[i]
    for i in range(12):
        shown[i] += zero[i]
        if count > 0.0:
            shown[i] = floor(shown[i] / count + 0.5) * count


# Columns of the sums, a row a foot: force in W (3) [N]; normal force times place in W (3) [N m];
# normal force [N]; the greatest slip [m/s]. The last row is for all that is no foot: how many
# contacts [0], and the greatest normal force among them [N] [1].
FORCE, MOMENT, WEIGHT, SLIP = 0, 3, 6, 7
SUMS = (5, 8)
NO_FOOT = 4


@jit
def add_contact(
    sums: FloatArray,
    row: int,
    sign: float,
    force: FloatArray,
    normal: FloatArray,
    place: FloatArray,
    slip: float,
) -> None:
    """Adds one contact.

    Args:
        sums: The sums so far, of the shape SUMS.
        row: Row of the foot; NO_FOOT if the contact is of no foot.
        sign: 1 if `force` acts on the foot, -1 if on what it touches.
        force: Contact force in W (3,) [N].
        normal: The contact's normal in W (3,).
        place: Point of contact in W (3,) [m].
        slip: Tangential speed [m/s].
    """
    pressed = abs(force[0] * normal[0] + force[1] * normal[1] + force[2] * normal[2])
    if row == NO_FOOT:
        sums[row, 0] += 1.0
        sums[row, 1] = max(sums[row, 1], pressed)
        return
    for i in range(3):
        sums[row, FORCE + i] += sign * force[i]
        sums[row, MOMENT + i] += pressed * place[i]
    sums[row, WEIGHT] += pressed
    sums[row, SLIP] = max(sums[row, SLIP], slip)


# Places in the measured contacts: 1 where a foot bears (4) from 0 on; forces on the feet in W (12)
# [N]; points where these act, in W (12) [m]; greatest slip of each foot (4) [m/s]; number of
# contacts of anything but feet, and greatest force there [N].
FORCES, PLACES, SLIPS, OTHERS, CONTACTS_SIZE = 4, 16, 28, 32, 34


@jit
def conclude(sums: FloatArray, threshold: float, contacts: FloatArray) -> None:
    """Writes what the sums come to; the place of a foot that touches nothing stays.

    Args:
        sums: The sums of all contacts, of the shape SUMS.
        threshold: Normal force above which a foot bears [N].
        contacts: Result (CONTACTS_SIZE,), see FORCES and the other places.
    """
    for k in range(4):
        weight = sums[k, WEIGHT]
        contacts[k] = 1.0 if weight > threshold else 0.0
        contacts[SLIPS + k] = sums[k, SLIP]
        for i in range(3):
            contacts[FORCES + 3 * k + i] = sums[k, FORCE + i]
            if weight > 1e-9:
                contacts[PLACES + 3 * k + i] = sums[k, MOMENT + i] / weight
    contacts[OTHERS], contacts[OTHERS + 1] = sums[NO_FOOT, 0], sums[NO_FOOT, 1]
