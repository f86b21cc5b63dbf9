"""The robot as measured: base, joints, feet with their Jacobians, and the ground under them."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from drake_quad.common import FloatArray, IntArray
from drake_quad.control.kernel_state import (
    MEASURED,
    ROBOT,
    Record,
    Records,
    fields_of,
    new_record,
    state_indices,
)
from drake_quad.jit import copy_vector, jit
from drake_quad.math.rotations import quaternion_rotation
from drake_quad.robot.kinematics import foot_and_jacobian, leg_row
from drake_quad.robot.state import StateLayout
from drake_quad.terrain.course import Course, box_tops, top_at
from drake_quad.terrain.elements import STEEPEST


def ground_table(course: Course | None) -> FloatArray:
    """A course's `box_tops`; none (0, 10) if all of them are level.

    Contact sensors say whether a foot bears, not which way it is pushed, so the ground's
    tilt is the map's, unless the feet feel it: see `normal_under`.
    """
    if course is None or not any(box.gradient for box in course.boxes):
        return np.zeros((0, 10))
    return box_tops(course)


@jit
def normal_at(ground: FloatArray, x: float, y: float) -> tuple[float, float, float]:
    """The unit normal in W of the ground at a place [m]; upright off the course.

    Args:
        ground: The map's ground, see `ground_table`.
        x: Place in W [m].
        y: Place in W [m].
    """
    _, gx, gy = top_at(ground, x, y)
    if gx == 0.0 and gy == 0.0:
        return 0.0, 0.0, 1.0
    length = np.sqrt(gx * gx + gy * gy + 1.0)
    return -gx / length, -gy / length, 1.0 / length


# A normal's z below which it is of an edge or a riser, not of ground to stand on: see STEEPEST.
UPRIGHT = 1.0 / sqrt(1.0 + STEEPEST**2)


@jit
def normal_under(
    felt: FloatArray, R: FloatArray, ground: FloatArray, x: float, y: float
) -> tuple[float, float, float]:
    """The unit normal in W of what a foot stands on: as it feels it, else the map's.

    Args:
        felt: Normal in B that its sensor shows (3,); zeros if it touches nothing, or has none.
        R: R_WB (3, 3).
        ground: The map's ground, see `ground_table`.
        x: The foot's place in W [m].
        y: The foot's place in W [m].
    """
    a, b, c = felt[0], felt[1], felt[2]
    if a != 0.0 or b != 0.0 or c != 0.0:
        nz = R[2, 0] * a + R[2, 1] * b + R[2, 2] * c
        if nz > UPRIGHT:
            nx = R[0, 0] * a + R[0, 1] * b + R[0, 2] * c
            ny = R[1, 0] * a + R[1, 1] * b + R[1, 2] * c
            return nx, ny, nz
    return normal_at(ground, x, y)


STEP = 1e-5  # [s] of the central difference that gives the Jacobian's rate


@jit
def measure_feet(
    measured: Record, legs: FloatArray, radius: float, ground: FloatArray, felt: FloatArray
) -> None:
    """Writes the feet of a state.

    Args:
        measured: The state, of the type MEASURED; its `feet` are the result.
        legs: Leg lengths, see `robot.kinematics.leg_array`.
        radius: Radius of the foot spheres [m].
        ground: The map's ground, see `ground_table`.
        felt: Normals of the ground in B that the feet feel, leg by leg (12,), see `normal_under`.
    """
    p, R, w, v, q, qd = measured.p, measured.R, measured.w, measured.v, measured.q, measured.qd
    place, velocity, drift = measured.feet.place, measured.feet.velocity, measured.feet.drift
    jacobian, contact = measured.feet.jacobian, measured.feet.contact_jacobian
    normal = measured.feet.normal
    for k in range(4):
        leg = leg_row(legs, k)
        a, b, c = q[3 * k], q[3 * k + 1], q[3 * k + 2]
        da, db, dc = qd[3 * k], qd[3 * k + 1], qd[3 * k + 2]
        f, J = foot_and_jacobian(leg, a, b, c)
        _, J0 = foot_and_jacobian(leg, a - STEP * da, b - STEP * db, c - STEP * dc)
        _, J1 = foot_and_jacobian(leg, a + STEP * da, b + STEP * db, c + STEP * dc)
        rate = (da, db, dc)
        for i in range(3):
            arm = 0.0
            for j in range(3):
                arm += R[i, j] * f[j]
                jacobian[k, i, j] = R[i, 0] * J[0][j] + R[i, 1] * J[1][j] + R[i, 2] * J[2][j]
            place[k, i] = arm
        for i in range(3):
            relative, bend = 0.0, 0.0
            for j in range(3):
                relative += jacobian[k, i, j] * rate[j]
                for m in range(3):
                    bend += R[i, m] * (J1[m][j] - J0[m][j]) / (2.0 * STEP) * rate[j]
            velocity[k, i] = relative
            drift[k, i] = bend
        r0, r1, r2 = place[k, 0], place[k, 1], place[k, 2]
        u0, u1, u2 = velocity[k, 0], velocity[k, 1], velocity[k, 2]
        s0, s1, s2 = w[1] * r2 - w[2] * r1, w[2] * r0 - w[0] * r2, w[0] * r1 - w[1] * r0
        t0, t1, t2 = s0 + 2.0 * u0, s1 + 2.0 * u1, s2 + 2.0 * u2
        drift[k, 0] += w[1] * t2 - w[2] * t1
        drift[k, 1] += w[2] * t0 - w[0] * t2
        drift[k, 2] += w[0] * t1 - w[1] * t0
        velocity[k, 0] = v[0] + s0 + u0
        velocity[k, 1] = v[1] + s1 + u1
        velocity[k, 2] = v[2] + s2 + u2
        for i in range(3):
            place[k, i] += p[i]
        own = felt[3 * k : 3 * k + 3]
        nx, ny, nz = normal_under(own, R, ground, place[k, 0], place[k, 1])
        normal[k, 0], normal[k, 1], normal[k, 2] = nx, ny, nz
        # The joints' axes: x of B, then y of B turned about it by the abduction, twice. The point
        # of the sphere that touches moves by axis x (-radius normal) more than the centre.
        ca, sa = np.cos(a), np.sin(a)
        for j in range(3):
            if j == 0:
                x, y, z = R[0, 0], R[1, 0], R[2, 0]
            else:
                x, y = R[0, 1] * ca + R[0, 2] * sa, R[1, 1] * ca + R[1, 2] * sa
                z = R[2, 1] * ca + R[2, 2] * sa
            contact[k, 0, j] = jacobian[k, 0, j] - radius * (y * nz - z * ny)
            contact[k, 1, j] = jacobian[k, 1, j] + radius * (x * nz - z * nx)
            contact[k, 2, j] = jacobian[k, 2, j] - radius * (x * ny - y * nx)


class RobotMeasurement(NamedTuple):
    """One state of the robot. W world, B body.

    Attributes:
        state: [q; v], in numbers all of it.
        p: p_WB (3,) [m].
        R: R_WB (3, 3).
        w: w_WB (3,) in W [rad/s].
        v: v_WB (3,) in W [m/s].
        q: Joint angles (12,), leg by leg [rad].
        qd: Joint speeds (12,) [rad/s].
        feet: The feet, see FEET.
        known: Whether this is the state now; if not, the last that was known.
    """

    state: FloatArray
    p: FloatArray
    R: FloatArray
    w: FloatArray
    v: FloatArray
    q: FloatArray
    qd: FloatArray
    feet: Record
    known: bool


@jit
def measure_into(
    measured: Record,
    estimated: FloatArray,
    last: FloatArray,
    places: IntArray,
    legs: FloatArray,
    radius: float,
    ground: FloatArray,
    felt: FloatArray,
) -> None:
    """Takes a state apart, and measures its feet.

    Args:
        measured: Result, of the type MEASURED; its `known` is 1 or 0.
        estimated: The state [q; v]. Where it is not finite (a lost estimate), `last` serves
            instead: the model plant must not be given such a state.
        last: The last finite state; afterwards the one of these two that serves.
        places: Indices in the state, see `state_indices`.
        legs: Leg lengths, see `leg_array`.
        radius: Radius of the foot spheres [m].
        ground: The map's ground, see `ground_table`.
        felt: Normals that the feet feel, see `measure_feet`.
    """
    total = 0.0
    for i in range(len(estimated)):
        total += estimated[i]
    measured.known = 0.0
    if np.isfinite(total):  # one that is not a number spoils the sum
        measured.known = 1.0
        copy_vector(last, estimated)
    i, j = places[0], places[1]
    rows = quaternion_rotation(last[i], last[i + 1], last[i + 2], last[i + 3])
    for a in range(3):
        for b in range(3):
            measured.R[a, b] = rows[a][b]
        measured.p[a], measured.w[a], measured.v[a] = last[i + 4 + a], last[j + a], last[j + 3 + a]
    for a in range(12):
        measured.q[a], measured.qd[a] = last[places[2 + a]], last[places[14 + a]]
    measure_feet(measured, legs, radius, ground, felt)


def measure(
    layout: StateLayout,
    legs: FloatArray,
    radius: float,
    estimated: FloatArray,
    last: FloatArray,
    ground: FloatArray | None = None,
) -> RobotMeasurement:
    """Takes a state apart as `measure_into` does, outside of the control loop.

    Args:
        layout: The state's layout.
        legs: Leg lengths, see `leg_array`.
        radius: Radius of the foot spheres [m].
        estimated: The state [q; v] as estimated; it does not change.
        last: The last finite state, which serves where `estimated` is not; it does not change.
        ground: The map's ground, see `ground_table`; level if None.
    """
    ground = ground_table(None) if ground is None else ground
    record, state = new_record(MEASURED), np.array(last, dtype=np.float64)
    robot = np.zeros(1, dtype=ROBOT)
    robot[0]["places"], robot[0]["legs"] = state_indices(layout), legs
    _measure_one(record, np.asarray(estimated, np.float64), state, robot, radius, ground)
    m = fields_of(record)
    return RobotMeasurement(state, m.p, m.R, m.w, m.v, m.q, m.qd, m.feet, bool(m.known))


@jit
def _measure_one(
    record: Records,
    estimated: FloatArray,
    last: FloatArray,
    robot: Records,
    radius: float,
    ground: FloatArray,
) -> None:
    felt = np.zeros(12)
    measure_into(record[0], estimated, last, robot[0].places, robot[0].legs, radius, ground, felt)
