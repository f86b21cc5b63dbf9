"""A motion plan as two arrays, and what it has at one time: for the control loop.

`ContactPlan` and `BodySpline` are the plan that is read and tested; here the same numbers lie so
that a compiled kernel takes them in one piece.
"""

from math import cos, sin

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import BoolArray, FloatArray, read_only
from drake_quad.gait.quintic import quintic, quintic_acceleration, quintic_rate
from drake_quad.planning.contact_plan import ContactPlan

# Columns of the table of phases: times [s], who stands (4), the feet (12) [m], the row of the
# swing leg (-1 for none), and its swing: from (3), to (3) [m], how long, when the apex [s], its
# height [m], and its arc: pivot (2) [m], turn [rad] (0: it goes straight), end over start distance.
START, END, STANDING, FEET, SWING, FROM, TO, DURATION, APEX_TIME, APEX_Z, PIVOT, TURN, FARTHER = (
    0, 1, 2, 6, 18, 19, 22, 25, 26, 27, 28, 30, 31,
)  # fmt: skip
COLUMNS = 32

_quintic, _rate, _acceleration = (
    compiled(f) for f in (quintic, quintic_rate, quintic_acceleration)
)


def phase_table(contacts: ContactPlan) -> FloatArray:
    """The phases of a contact plan as rows (n, COLUMNS), read-only."""
    table = np.zeros((len(contacts.phases), COLUMNS))
    for row, phase in zip(table, contacts.phases, strict=True):
        row[START], row[END], row[SWING] = phase.start, phase.end, -1.0
        row[STANDING:FEET] = phase.standing
        row[FEET:SWING] = phase.feet.ravel()
        if phase.step is not None:
            swing = phase.step.swing
            row[SWING] = phase.step.leg.row
            row[FROM:TO], row[TO:DURATION] = swing.p_start, swing.p_end
            row[DURATION:PIVOT] = swing.duration, swing.apex_time, swing.apex_z
            row[PIVOT:] = swing.arc
    return read_only(table)


@compiled
def phase_index(phases: FloatArray, t: float) -> int:
    """Index of the phase at time `t` [s]; the first or last one outside of the plan."""
    low, high = 0, len(phases)
    while low < high:
        middle = (low + high) // 2
        if t < phases[middle, START]:
            high = middle
        else:
            low = middle + 1
    return max(low - 1, 0)


@compiled
def sample_feet(
    phases: FloatArray, t: float
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray, float]:
    """The feet at time `t` [s].

    Args:
        phases: See `phase_table`.
        t: Gait time.

    Returns:
        Places [m], velocities and accelerations in W (4, 3) by gait time, who stands (4,), and
        the phase of the swing in [0, 1], nan if nobody swings.
    """
    row = phases[phase_index(phases, t)]
    place, velocity, acceleration = np.empty((4, 3)), np.zeros((4, 3)), np.zeros((4, 3))
    standing = np.empty(4, dtype=np.bool_)
    for k in range(4):
        standing[k] = row[STANDING + k] > 0.5
        for i in range(3):
            place[k, i] = row[FEET + 3 * k + i]
    k = int(row[SWING])
    if k < 0:
        return place, velocity, acceleration, standing, np.nan
    since = min(max(t - row[START], 0.0), row[DURATION])
    scale = 1.0 / row[DURATION]
    s = since * scale
    for i in range(2):
        way = row[TO + i] - row[FROM + i]
        place[k, i] = row[FROM + i] + way * _quintic(s)
        velocity[k, i] = way * (_rate(s) * scale)
        acceleration[k, i] = way * (_acceleration(s) * scale * scale)
    if row[TURN] != 0.0:
        _round_pivot(row, s, scale, place[k], velocity[k], acceleration[k])
    apex_time, apex = row[APEX_TIME], row[APEX_Z]
    if since <= apex_time:
        scale, base, rise = 1.0 / apex_time, row[FROM + 2], apex - row[FROM + 2]
    else:
        scale, base, rise = 1.0 / (row[DURATION] - apex_time), apex, row[TO + 2] - apex
        since -= apex_time
    s = since * scale
    place[k, 2] = base + rise * _quintic(s)
    velocity[k, 2] = rise * _rate(s) * scale
    acceleration[k, 2] = rise * _acceleration(s) * scale * scale
    return place, velocity, acceleration, standing, (t - row[START]) / (row[END] - row[START])


@compiled
def _round_pivot(
    row: FloatArray,
    s: float,
    scale: float,
    place: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> None:
    """Writes x and y of a swing along an arc at phase `s`, see `gait.swing.Swing.sample`."""
    turn, more = row[TURN], row[FARTHER] - 1.0
    q, dq, ddq = _quintic(s), _rate(s) * scale, _acceleration(s) * scale * scale
    grown, c, n = 1.0 + more * q, cos(turn * q), sin(turn * q)
    x0, y0 = row[FROM] - row[PIVOT], row[FROM + 1] - row[PIVOT + 1]
    out_x, out_y = c * x0 - n * y0, n * x0 + c * y0  # as far out as it began
    rate_x, rate_y = more * out_x - turn * grown * out_y, more * out_y + turn * grown * out_x
    bend_x = -turn * turn * grown * out_x - 2.0 * turn * more * out_y
    bend_y = -turn * turn * grown * out_y + 2.0 * turn * more * out_x
    place[0], place[1] = row[PIVOT] + grown * out_x, row[PIVOT + 1] + grown * out_y
    velocity[0], velocity[1] = rate_x * dq, rate_y * dq
    acceleration[0] = bend_x * dq * dq + rate_x * ddq
    acceleration[1] = bend_y * dq * dq + rate_y * ddq


@compiled
def sample_body(control: FloatArray, knot: float, t: float) -> FloatArray:
    """A `BodySpline` at time `t` [s]: (3, 5) value, velocity, acceleration; at rest outside.

    Args:
        control: Control points (n, 5).
        knot: Knot spacing [s].
        t: Gait time [s].
    """
    r, h = t / knot, 1.0 / knot
    i = min(max(int(r), 0), len(control) - 4)
    u = min(max(r - i, 0.0), 1.0)
    motion = np.empty((3, 5))
    for j in range(5):
        p0, p1, p2, p3 = control[i, j], control[i + 1, j], control[i + 2, j], control[i + 3, j]
        # By powers of u: the uniform cubic B-spline's basis.
        a, b = (p0 + 4.0 * p1 + p2) / 6.0, (p2 - p0) / 2.0
        c, d = (p0 - 2.0 * p1 + p2) / 2.0, (p3 - p0 + 3.0 * (p1 - p2)) / 6.0
        motion[0, j] = a + u * (b + u * (c + u * d))
        motion[1, j] = h * (b + u * (2.0 * c + 3.0 * d * u))
        motion[2, j] = h * h * (2.0 * c + 6.0 * d * u)
    return motion
