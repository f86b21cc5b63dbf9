"""The robot as measured: base, joints, feet with their Jacobians, and the ground under them."""

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
from drake_quad.jit import copy_matrix, copy_stack, copy_vector, jit
from drake_quad.math.rotations import quaternion_rotation
from drake_quad.robot.kinematics import foot_and_jacobian, leg_row
from drake_quad.robot.state import StateLayout
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import EDGE

COLUMNS = 10  # of a box: its two axes (2, 2), its middle (2), half its extent (2), top, gradient


def ground_table(course: Course | None) -> FloatArray:
    """The tops of a course's boxes (n, COLUMNS), writable; none if all of them are level.

    Contact sensors say whether a foot bears, not which way it is pushed, so the map alone tells
    the ground's tilt.
    """
    boxes = [] if course is None else list(course.boxes)
    if not any(box.gradient for box in boxes):
        return np.zeros((0, COLUMNS))
    return np.array(
        [
            [*box.axes.ravel(), *box.middle, *(0.5 * box.extent), box.top, box.gradient]
            for box in boxes
        ]
    )


@jit
def normal_at(ground: FloatArray, x: float, y: float) -> tuple[float, float, float]:
    """The unit normal in W of the ground at a place [m]; upright off the course.

    The same as `terrain.course.ground_normals`, for one place.

    Args:
        ground: See `ground_table`.
        x: In W [m].
        y: In W [m].
    """
    highest, gx, gy = -np.inf, 0.0, 0.0
    for k in range(len(ground)):
        box = ground[k]
        dx, dy = x - box[4], y - box[5]
        along, across = box[0] * dx + box[1] * dy, box[2] * dx + box[3] * dy
        if abs(along) > box[6] + EDGE or abs(across) > box[7] + EDGE:
            continue
        z = box[8] + box[9] * along
        if z > highest:
            highest, gx, gy = z, box[9] * box[0], box[9] * box[1]
    if gx == 0.0 and gy == 0.0:
        return 0.0, 0.0, 1.0
    length = np.sqrt(gx * gx + gy * gy + 1.0)
    return -gx / length, -gy / length, 1.0 / length


STEP = 1e-5  # [s] of the central difference that gives the Jacobian's rate


class Feet(NamedTuple):
    """The feet at one instant, all in W.

    Attributes:
        place: Foot sphere centres (4, 3) [m].
        velocity: Theirs (4, 3) [m/s].
        drift: Their acceleration while base and joints have none (4, 3) [m/s^2].
        jacobian: Of the centres by each leg's joints (4, 3, 3) [m/rad].
        contact_jacobian: Of the material points where ground pushes, a radius off the centres
            against the ground's normal.
        normal: Of the ground under them, by the map: unit vectors (4, 3).
    """

    place: FloatArray
    velocity: FloatArray
    drift: FloatArray
    jacobian: FloatArray
    contact_jacobian: FloatArray
    normal: FloatArray


@jit
def measure_feet(
    legs: FloatArray,
    radius: float,
    p: FloatArray,
    R: FloatArray,
    w: FloatArray,
    v: FloatArray,
    q: FloatArray,
    qd: FloatArray,
    ground: FloatArray,
) -> Feet:
    """The feet of a state.

    Args:
        legs: See `robot.kinematics.leg_array`.
        radius: Of the foot spheres [m].
        p: p_WB (3,) [m].
        R: R_WB (3, 3).
        w: w_WB (3,) in W [rad/s].
        v: v_WB (3,) in W [m/s].
        q: Joint angles (12,), leg by leg [rad].
        qd: Joint speeds (12,) [rad/s].
        ground: See `ground_table`.
    """
    place, velocity, drift = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    jacobian, contact = np.empty((4, 3, 3)), np.empty((4, 3, 3))
    normal = np.empty((4, 3))
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
        nx, ny, nz = normal_at(ground, place[k, 0], place[k, 1])
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
    return Feet(place, velocity, drift, jacobian, contact, normal)


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
        feet: See Feet.
        known: Whether this is the state now; if not, the last that was known.
    """

    state: FloatArray
    p: FloatArray
    R: FloatArray
    w: FloatArray
    v: FloatArray
    q: FloatArray
    qd: FloatArray
    feet: Feet
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
) -> None:
    """Takes a state apart, and measures its feet.

    Args:
        measured: Result, of the type MEASURED; its `known` is 1 or 0.
        estimated: [q; v]. Where it has no numbers (a lost estimate), `last` serves instead: the
            model plant must not be given such a state.
        last: The last state with numbers; now that of these two that serves.
        places: See `state_indices`.
        legs: See `leg_array`.
        radius: Of the foot spheres [m].
        ground: See `ground_table`.
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
    R, q, qd = np.empty((3, 3)), np.empty(12), np.empty(12)
    for a in range(3):
        for b in range(3):
            R[a, b] = rows[a][b]
    for a in range(12):
        q[a], qd[a] = last[places[2 + a]], last[places[14 + a]]
    p, w, v = last[i + 4 : i + 7], last[j : j + 3], last[j + 3 : j + 6]
    copy_vector(measured.p, p)
    copy_vector(measured.w, w)
    copy_vector(measured.v, v)
    copy_matrix(measured.R, R)
    copy_vector(measured.q, q)
    copy_vector(measured.qd, qd)
    feet, into = measure_feet(legs, radius, p, R, w, v, q, qd, ground), measured.feet
    copy_matrix(into.place, feet.place)
    copy_matrix(into.velocity, feet.velocity)
    copy_matrix(into.drift, feet.drift)
    copy_stack(into.jacobian, feet.jacobian)
    copy_stack(into.contact_jacobian, feet.contact_jacobian)
    copy_matrix(into.normal, feet.normal)


def measure(
    layout: StateLayout,
    legs: FloatArray,
    radius: float,
    estimated: FloatArray,
    last: FloatArray,
    ground: FloatArray | None = None,
) -> RobotMeasurement:
    """The same where there is no hurry; nothing that is given changes.

    Args:
        layout: Where what is in the state.
        legs: See `leg_array`.
        radius: Of the foot spheres [m].
        estimated: See `measure_into`.
        last: See there.
        ground: See `ground_table`; level if none is given.
    """
    ground = ground_table(None) if ground is None else ground
    record, state = new_record(MEASURED), np.array(last, dtype=np.float64)
    robot = np.zeros(1, dtype=ROBOT)
    robot[0]["places"], robot[0]["legs"] = state_indices(layout), legs
    _measure_one(record, np.asarray(estimated, np.float64), state, robot, radius, ground)
    m = fields_of(record)
    feet = Feet(*(m.feet[name] for name in Feet._fields))
    return RobotMeasurement(state, m.p, m.R, m.w, m.v, m.q, m.qd, feet, bool(m.known))


@jit
def _measure_one(
    record: Records,
    estimated: FloatArray,
    last: FloatArray,
    robot: Records,
    radius: float,
    ground: FloatArray,
) -> None:
    measure_into(record[0], estimated, last, robot[0].places, robot[0].legs, radius, ground)
