"""Phases of a plan as a table of numbers, and where the feet are in them: read at every tick."""

from math import cos, sin
from typing import NamedTuple

import numpy as np

from drake_quad.common import BoolArray, FloatArray, read_only
from drake_quad.jit import jit
from drake_quad.math.curves import (
    quintic_acceleration_kernel,
    quintic_kernel,
    quintic_rate_kernel,
)
from drake_quad.planning.contact_plan import MOST_SWINGS, ContactPlan

# Columns of the table of phases: times [s], who stands (4), the feet (12) [m], and from SWING on
# the swings of MOST_SWINGS legs, SWING_COLUMNS each.
START, END, STANDING, FEET, SWING = 0, 1, 2, 6, 18
# Columns of one swing, from its first on: the row of the leg (-1 for none), from (3), to (3) [m],
# how long, when the apex [s], its height [m], and its arc: pivot (2) [m], turn [rad] (0: it goes
# straight), end over start distance.
FROM, TO, DURATION, APEX_TIME, APEX_Z, PIVOT, TURN, FARTHER = 1, 4, 7, 8, 9, 10, 12, 13
SWING_COLUMNS = 14
COLUMNS = SWING + MOST_SWINGS * SWING_COLUMNS


def phase_table(contacts: ContactPlan) -> FloatArray:
    """The phases of a contact plan as rows (n, COLUMNS), read-only."""
    table = np.zeros((len(contacts.phases), COLUMNS))
    for row, phase in zip(table, contacts.phases, strict=True):
        row[START], row[END] = phase.start, phase.end
        row[STANDING:FEET] = phase.standing
        row[FEET:SWING] = phase.feet.ravel()
        swings = row[SWING:].reshape(MOST_SWINGS, SWING_COLUMNS)
        swings[:, 0] = -1.0
        for mine, step in zip(swings, phase.steps, strict=False):
            swing = step.swing
            mine[0] = step.leg.row
            mine[FROM:TO], mine[TO:DURATION] = swing.p_start, swing.p_end
            mine[DURATION:PIVOT] = swing.duration, swing.apex_time, swing.apex_z
            mine[PIVOT:] = swing.arc
    return read_only(table)


@jit
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


class PlannedFeet(NamedTuple):
    """The feet of a plan at one gait time, in W.

    Attributes:
        place: Places (4, 3) [m].
        velocity: First derivatives by gait time (4, 3).
        acceleration: Second derivatives by gait time (4, 3).
        standing: Which feet stand (4,).
        swing_phase: Phase of the swing, or of both, in [0, 1], nan if nobody swings.
        phase_rate: Its derivative by gait time [1/s], 0 if nobody swings.
    """

    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    standing: BoolArray
    swing_phase: float
    phase_rate: float


@jit
def sample_feet(phases: FloatArray, t: float) -> PlannedFeet:
    """The feet at gait time `t` [s] of a plan with these phases, see `phase_table`."""
    row = phases[phase_index(phases, t)]
    place, velocity, acceleration = np.empty((4, 3)), np.zeros((4, 3)), np.zeros((4, 3))
    standing = np.empty(4, dtype=np.bool_)
    for k in range(4):
        standing[k] = row[STANDING + k] > 0.5
        for i in range(3):
            place[k, i] = row[FEET + 3 * k + i]
    if row[SWING] < 0.0:
        return PlannedFeet(place, velocity, acceleration, standing, np.nan, 0.0)
    for n in range(MOST_SWINGS):
        swing = row[SWING + n * SWING_COLUMNS : SWING + (n + 1) * SWING_COLUMNS]
        k = int(swing[0])
        if k >= 0:
            _sample_swing(swing, t - row[START], place[k], velocity[k], acceleration[k])
    rate = 1.0 / (row[END] - row[START])
    phase = (t - row[START]) * rate
    return PlannedFeet(place, velocity, acceleration, standing, phase, rate)


@jit
def swing_rows(row: FloatArray) -> tuple[int, int]:
    """The rows of the legs that swing in a phase of the table, -1 for none."""
    return int(row[SWING]), int(row[SWING + SWING_COLUMNS])


@jit
def _sample_swing(
    row: FloatArray,
    since: float,
    place: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> None:
    """Writes a foot's place (3,) and its derivatives, `since` [s] its lift-off, of one swing."""
    since = min(max(since, 0.0), row[DURATION])
    scale = 1.0 / row[DURATION]
    s = since * scale
    for i in range(2):
        way = row[TO + i] - row[FROM + i]
        place[i] = row[FROM + i] + way * quintic_kernel(s)
        velocity[i] = way * (quintic_rate_kernel(s) * scale)
        acceleration[i] = way * (quintic_acceleration_kernel(s) * scale * scale)
    if row[TURN] != 0.0:
        _round_pivot(row, s, scale, place, velocity, acceleration)
    apex_time, apex = row[APEX_TIME], row[APEX_Z]
    if since <= apex_time:
        scale, base, rise = 1.0 / apex_time, row[FROM + 2], apex - row[FROM + 2]
    else:
        scale, base, rise = 1.0 / (row[DURATION] - apex_time), apex, row[TO + 2] - apex
        since -= apex_time
    s = since * scale
    place[2] = base + rise * quintic_kernel(s)
    velocity[2] = rise * quintic_rate_kernel(s) * scale
    acceleration[2] = rise * quintic_acceleration_kernel(s) * scale * scale


@jit
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
    q, dq, ddq = (
        quintic_kernel(s),
        quintic_rate_kernel(s) * scale,
        quintic_acceleration_kernel(s) * scale * scale,
    )
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
