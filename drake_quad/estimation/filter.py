"""One update of the contact-aided invariant extended Kalman filter, and what it puts out.

The specific force shows the tilt no better than the accelerometer's bias lets it; three contrasts
of the four feet's heights show it to what the ground's own evenness is.
"""

from math import atan2, isfinite, sqrt

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.estimation.correction import (
    correct,
    feet_in_body,
    let_go,
    retract,
    roll,
    track_contacts,
)
from drake_quad.estimation.filter_state import (
    ACCEL_BIAS,
    ANGLES,
    COVARIANCE,
    E_FEET,
    E_POSITION,
    E_ROTATION,
    E_VELOCITY,
    ERRORS,
    FEET,
    FIRM,
    GYRO_BIAS,
    LEVELLED,
    POSITION,
    RATE,
    ROTATION,
    SLIP,
    STARTED,
    VELOCITY,
    Record,
)
from drake_quad.estimation.prediction import predict
from drake_quad.jit import copy_matrix, copy_vector, jit
from drake_quad.math.rotations import multiply, rotation_exp, write_quaternion
from drake_quad.terrain.course import top_at


@jit
def innovation_covariance(m: FloatArray, h: FloatArray, noise: float) -> tuple[FloatArray, float]:
    """How the errors go with a measurement's, P h (ERRORS,), and the innovation's variance.

    Args:
        m: The filter's memory.
        h: What the measurement changes by with each error (ERRORS,).
        noise: Variance of the measurement.
    """
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    column = np.empty(ERRORS)
    variance = noise
    for a in range(ERRORS):
        column[a] = 0.0
        for b in range(ERRORS):
            column[a] += P[a, b] * h[b]
    for a in range(ERRORS):
        variance += h[a] * column[a]
    return column, variance


@jit
def correct_with(
    m: FloatArray, gain: FloatArray, column: FloatArray, variance: float, y: float
) -> None:
    """Corrects the memory by one measurement with any gain, the covariance in Joseph's form.

    Args:
        m: The filter's memory.
        gain: How much each error is corrected by a unit of `y` (ERRORS,).
        column: P h, see `innovation_covariance`.
        variance: The innovation's, see there.
        y: The estimate less what is measured.
    """
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    for a in range(ERRORS):
        for b in range(ERRORS):  # in an order of terms that keeps it symmetric to the bit
            P[a, b] += variance * (gain[a] * gain[b]) - (gain[a] * column[b] + column[a] * gain[b])
    retract(m, gain * y)


@jit
def correct_height(m: FloatArray, h: FloatArray, y: float, noise: float, gate: float) -> None:
    """Base and feet go up or down together by one measurement; nothing else is corrected.

    The other errors are considered as they are, neither corrected nor known better, as in the
    filter of S. F. Schmidt ("Application of state-space methods to navigation problems", 1966).

    Args:
        m: The filter's memory.
        h: What the measurement changes by with each error (ERRORS,).
        y: The estimate less what is measured.
        noise: Variance of the measurement.
        gate: Greatest squared Mahalanobis distance that is believed.
    """
    column, variance = innovation_covariance(m, h, noise)
    if y * y / variance > gate:
        return
    # The base's own gain in height, whose error is ξ_z + θ_x y - θ_y x, for all five places.
    along, across = m[POSITION], m[POSITION + 1]
    z = column[E_POSITION + 2] + across * column[E_ROTATION] - along * column[E_ROTATION + 1]
    gain = np.zeros(ERRORS)
    for k in range(5):
        gain[E_POSITION + 3 * k + 2] = z / variance
    correct_with(m, gain, column, variance, y)


@jit
def level_start(m: FloatArray, s: Record) -> None:
    """Once, when all four feet are firm for the first time: they stand at one height.

    In right-invariant errors a foot's height is off by ξ_z + θ_x y - θ_y x.
    """
    if s.level_start <= 0.0 or m[LEVELLED] > 0.5:
        return
    if m[FIRM] + m[FIRM + 1] + m[FIRM + 2] + m[FIRM + 3] < 3.5:
        return
    m[LEVELLED] = 1.0
    sign, h = np.empty(4), np.empty(ERRORS)
    # Orthonormal contrasts, so that their noises are independent: front, left, and diagonal.
    for contrast in range(3):
        for k in range(4):
            front, left = (0.5 if k < 2 else -0.5), (1.0 if k % 2 == 0 else -1.0)
            sign[k] = front if contrast == 0 else 0.5 * left if contrast == 1 else front * left
        h[:] = 0.0
        y = 0.0
        for k in range(4):
            d = FEET + 3 * k
            y += sign[k] * m[d + 2]
            h[0] += sign[k] * m[d + 1]
            h[1] -= sign[k] * m[d]
            h[E_FEET + 3 * k + 2] = sign[k]
        column, variance = innovation_covariance(m, h, s.level_start**2)
        if y * y / variance <= s.gate:  # else they are not level after all
            correct_with(m, column / variance, column, variance, y)


AROUND = 0.02  # [m] around a foot in which it may stand
APART = 4.0  # times as far as its height is off the other heights there must be
TREADS = 0.04  # [m] between heights that can be told apart by the estimate's own


@jit
def stand_on_map(m: FloatArray, k: int, tops: FloatArray, radius: float, s: Record) -> None:
    """Leg k's foot, firm from this tick on, stands as high as the map has the ground there.

    Without it every foot that is set down adds what it sinks in as it is loaded, and the height
    drifts. Beside an edge the foot is on the side whose height is nearest, if the other side's is
    far enough from that to be out of the question; else, and where the ground slopes, the map is
    not asked.

    It corrects the height alone. What feet sink in is no noise: each step adds a millimetre of the
    same sign, and after some metres a pitch that is wrong by a degree would explain it best.

    Args:
        m: The filter's memory.
        k: Index of the leg.
        tops: The map, see `terrain.course.top_at`.
        radius: Radius of the feet [m].
        s: The settings, a record of the type SETTINGS.
    """
    # What the foot sinks in may have carried base and feet along, with every step again.
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    for a in range(5):
        for b in range(5):
            P[E_POSITION + 3 * a + 2, E_POSITION + 3 * b + 2] += s.foot_sink**2
    d = FEET + 3 * k
    x, y, z = m[d], m[d + 1], m[d + 2] - radius
    beside, ground = np.empty(5), np.nan
    for side in range(5):
        dx = 0.0 if side == 4 else AROUND if side < 2 else -AROUND
        dy = 0.0 if side == 4 else AROUND if side % 2 == 0 else -AROUND
        beside[side], gx, gy = top_at(tops, x + dx, y + dy)
        if not isfinite(beside[side]) or gx != 0.0 or gy != 0.0:
            return
        if not abs(z - beside[side]) >= abs(z - ground):
            ground = beside[side]
    for side in range(5):
        apart = abs(beside[side] - ground)
        if apart > 0.0 and (apart < TREADS or apart < APART * abs(z - ground)):
            return
    h = np.zeros(ERRORS)
    h[0], h[1], h[E_FEET + 3 * k + 2] = y, -x, 1.0  # as in `level_start`
    correct_height(m, h, z - ground, s.map_height**2, s.gate)


@jit
def drift_by_step(m: FloatArray, s: Record) -> None:
    """A foot is firm from this tick on: base and feet may have gone astray together by its step."""
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    for a in range(5):
        for b in range(5):
            for i in range(2):
                P[E_POSITION + 3 * a + i, E_POSITION + 3 * b + i] += s.step_drift**2


# Beyond these a reading is a fault, not a motion; the filter's own numbers stay far from overflow.
RATE_LIMIT, FORCE_LIMIT, ANGLE_LIMIT, SPEED_LIMIT = 100.0, 5000.0, 100.0, 1000.0


@jit
def sound(values: Record, first: float, second: float) -> bool:
    """Whether all of `values` are finite, the first half within `first`, the rest in `second`."""
    half = len(values) // 2
    for i in range(len(values)):
        if not isfinite(values[i]) or abs(values[i]) > (first if i < half else second):
            return False
    return True


Readings = tuple[FloatArray, FloatArray, FloatArray]  # IMU, joints, contacts: see `step`
Estimates = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]  # see `run_filter`


@jit
def step(m: FloatArray, readings: Readings, model: Record, tops: FloatArray) -> bool:
    """One tick, in place in the memory `m` (SIZE,); returns whether the estimate is healthy.

    A reading that is not sound is left out: without the IMU the last estimate holds and grows
    uncertain, without the joints the IMU alone carries on, without the contacts likewise.

    Args:
        m: The filter's memory (SIZE,).
        readings: Mean rate [rad/s] and specific force [m/s^2] in B since the last tick (6,); joint
            angles [rad], then joint speeds [rad/s], leg by leg (24,); 1 for each foot that bears,
            else 0 (4,).
        model: A record of the type MODEL.
        tops: The map, see `terrain.course.top_at`; none (0, 10) if there is none.
    """
    imu, joints, contacts = readings
    legs, radius, dt, s = model.legs, model.radius, model.dt, model.settings
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    imu_sound = sound(imu, RATE_LIMIT, FORCE_LIMIT)
    joints_sound = sound(joints, ANGLE_LIMIT, SPEED_LIMIT)
    contacts_sound = sound(contacts, 2.0, 2.0)
    if not imu_sound:
        for i in range(3):
            P[E_VELOCITY + i, E_VELOCITY + i] += (20.0 * s.shock * dt) ** 2
            P[E_ROTATION + i, E_ROTATION + i] += dt**2
        return False
    if m[STARTED] < 0.5:
        if not joints_sound:
            return False
        start(m, imu, joints)
    else:
        predict(m, imu, dt, s)
    if joints_sound:
        gyro = imu[:3] - m[GYRO_BIAS : GYRO_BIAS + 3]
        roll(m, gyro, joints, dt, radius)
        copy_vector(m[ANGLES : ANGLES + 12], joints[:12])
        if contacts_sound:
            p_BF, v_BF, held = np.empty((4, 3)), np.empty((4, 3)), np.empty(4)
            feet_in_body(legs, joints, p_BF, v_BF)
            copy_vector(held, m[FIRM : FIRM + 4])
            track_contacts(m, p_BF, v_BF, contacts, dt, s)
            level_start(m, s)
            if s.map_height > 0.0:
                for k in range(4):
                    if m[FIRM + k] > held[k]:
                        stand_on_map(m, k, tops, radius, s)
            if s.step_drift > 0.0:
                for k in range(4):
                    if m[FIRM + k] > held[k]:
                        drift_by_step(m, s)
            gated = correct(m, p_BF, contacts, s)
            for k in range(4):
                if gated[k] > 0.5:
                    let_go(m, k)
                    m[SLIP + k] = 1.0
    variance = 0.0
    for i in range(3):
        variance = max(variance, P[E_VELOCITY + i, E_VELOCITY + i])
    return joints_sound and contacts_sound and sqrt(variance) < s.lost_velocity


@jit
def start(m: FloatArray, imu: FloatArray, joints: Record) -> None:
    """Takes roll and pitch from the first specific force; place and heading stay as given.

    A tilt that the force cannot show (a robot in free fall) stays as given too.
    """
    x, y, z = imu[3] - m[ACCEL_BIAS], imu[4] - m[ACCEL_BIAS + 1], imu[5] - m[ACCEL_BIAS + 2]
    if x * x + y * y + z * z > 1.0:
        yaw = atan2(m[ROTATION + 3], m[ROTATION])
        pitch, roll_angle = atan2(-x, sqrt(y * y + z * z)), atan2(y, z)
        R = m[ROTATION : ROTATION + 9].reshape(3, 3)
        level = multiply(rotation_exp(0.0, pitch, 0.0), rotation_exp(roll_angle, 0.0, 0.0))
        copy_matrix(R, multiply(rotation_exp(0.0, 0.0, yaw), level))
    copy_vector(m[ANGLES : ANGLES + 12], joints[:12])
    m[STARTED] = 1.0


@jit
def write_state(m: FloatArray, joints: FloatArray, model: Record, x: FloatArray) -> None:
    """Writes [q; v] to `x`; where a joint's reading is not sound, all joints stay as they were.

    Args:
        m: The filter's memory.
        joints: Joint angles [rad], then joint speeds [rad/s], leg by leg, (24,).
        model: A record of the type MODEL.
        x: Result: [q; v].
    """
    q_base, v_base = model.q_base, model.v_base
    write_quaternion(m[ROTATION : ROTATION + 9].reshape(3, 3), x[q_base : q_base + 4])
    for i in range(3):
        x[q_base + 4 + i] = m[POSITION + i]
        x[v_base + i] = m[RATE + i]
        x[v_base + 3 + i] = m[VELOCITY + i]
    if sound(joints, ANGLE_LIMIT, SPEED_LIMIT):
        for i in range(24):
            x[model.places[i]] = joints[i]


@jit
def write_deviation(m: FloatArray, out: FloatArray) -> None:
    """Writes deviations (9,) of orientation [rad], velocity [m/s] and position [m], axes of W.

    The filter's errors of velocity and position are invariant ones, which a turn about W's origin
    is part of; here they are those of the vectors themselves: δx = ξ_x - x × ξ_R.
    """
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    for i in range(3):
        out[i] = sqrt(max(P[i, i], 0.0))
    row = np.empty(3)
    for block in range(2):
        at, error = (VELOCITY, E_VELOCITY) if block == 0 else (POSITION, E_POSITION)
        x, y, z = m[at], m[at + 1], m[at + 2]
        for i in range(3):
            row[0], row[1], row[2] = (
                (0.0, z, -y) if i == 0 else (-z, 0.0, x) if i == 1 else (y, -x, 0.0)
            )
            n = error + i
            total = P[n, n]
            for a in range(3):
                total += 2.0 * row[a] * P[a, n]
                for b in range(3):
                    total += row[a] * row[b] * P[a, b]
            out[error + i] = sqrt(max(total, 0.0))


@jit
def run_filter(
    m: FloatArray,
    readings: Readings,
    models: NDArray[np.void],
    tops: FloatArray,
    out: Estimates,
) -> None:
    """`step`, then all outputs, in one call.

    Args:
        m: The filter's memory; goes on a tick.
        readings: Readings as for `step`.
        models: The filter's constants, see `filter_model`.
        tops: The map, as for `step`.
        out: Results: the state [q; v], which stays as it was until the filter has started; the
            standard deviations (9,) of `write_deviation`; the bias of the rate [rad/s] and of the
            specific force [m/s^2] (6,); 1 for each foot that slipped (4,); 1 if healthy (1,).
    """
    x, deviation, bias, slip, healthy = out
    model = models[0]
    healthy[0] = 1.0 if step(m, readings, model, tops) else 0.0
    write_deviation(m, deviation)
    copy_vector(bias, m[GYRO_BIAS : ACCEL_BIAS + 3])
    copy_vector(slip, m[SLIP : SLIP + 4])
    if m[STARTED] > 0.5:
        write_state(m, readings[1], model, x)
