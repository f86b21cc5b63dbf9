"""The robot as estimated, in the terms that the controllers think in."""

from typing import NamedTuple

import numpy as np

from drake_quad.compiled import compiled, copy_matrix, copy_stack, copy_vector
from drake_quad.control.feet import Feet, IntArray, measure_feet
from drake_quad.control.ground import ground_table
from drake_quad.control.records import MEASURED, ROBOT, Record, Records, fields_of, new_record
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.leg_scalar import quaternion_rotation
from drake_quad.robot.robot_state import StateLayout


class Measured(NamedTuple):
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


def places_of(layout: StateLayout) -> IntArray:
    """Where quaternion and angular velocity of the base, joint angles and speeds are (26,)."""
    return np.concatenate([[layout.q_base, layout.v_base], layout.q_joints, layout.v_joints])


@compiled
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
        places: See `places_of`.
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
) -> Measured:
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
    robot[0]["places"], robot[0]["legs"] = places_of(layout), legs
    _measure_one(record, np.asarray(estimated, np.float64), state, robot, radius, ground)
    m = fields_of(record)
    feet = Feet(*(m.feet[name] for name in Feet._fields))
    return Measured(state, m.p, m.R, m.w, m.v, m.q, m.qd, feet, bool(m.known))


@compiled
def _measure_one(
    record: Records,
    estimated: FloatArray,
    last: FloatArray,
    robot: Records,
    radius: float,
    ground: FloatArray,
) -> None:
    measure_into(record[0], estimated, last, robot[0].places, robot[0].legs, radius, ground)
