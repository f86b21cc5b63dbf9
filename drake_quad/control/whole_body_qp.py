"""The contact forces' quadratic program, and the whole-body controller's update around it.

    minimise    |a_b(f) - a_wanted|_W^2 + sum of w_n f_n^2 + w_t |f_t|^2
    subject to  friction pyramids, least and greatest normal forces     (hard)
                joint torques, joint accelerations within their limits  (soft)
                centre of pressure inside the support polygon           (soft)

Each foot's force is given in axes of its own, two along the ground and its normal
(`inverse_dynamics.contact_axes`): so pyramids and normal forces stand on the ground as it is. On
level ground these are W's axes, and the pyramid has four sides; on a slope, where standing alone
takes a part of the friction, it has eight, with an edge straight down the slope, and leaves 8 % of
the cone out at most.

Forces along the ground cost more than normal ones, and those of light feet most
(`contact_load.py`). At one price for all, feet of different heights would push against each other
along the ground, for that makes the normal forces more even; a light foot then slips on less
friction than is assumed.

Soft rows may give way when there is no other way, so that a program always has a solution. DAQP
can cycle among many that contradict each other; then all of them are given up at once.
"""

from math import atan2, isfinite
from typing import NamedTuple

import daqp
import numpy as np

from drake_quad.common import GRAVITY, FloatArray, IntArray
from drake_quad.control.base_tracking import (
    height_over,
    pendulum_rate,
    rotation_error,
    wanted_acceleration,
)
from drake_quad.control.contact_load import (
    MOST_TIMES,
    hold_load,
    min_normal_forces,
    static_load_shares,
    tangential_prices,
    update_friction,
)
from drake_quad.control.inverse_dynamics import Dynamics, contact_axes, reduce_dynamics, turn_forces
from drake_quad.control.kernel_state import Records, Weights
from drake_quad.control.payload_observer import (
    at_rest,
    compensating_shift,
    payload_com_shift,
    payload_wrench,
    update_payload,
)
from drake_quad.jit import copy_matrix, copy_vector, jit

SOFT = 8  # DAQP's mark of a constraint that may give way
NONE = 1e30  # its bound that is none
SOLVED = (1, 2)  # its exit flags: solved; solved with soft constraints giving way


class Program(NamedTuple):
    """A quadratic program: minimise x'Hx/2 + g'x, bounds on x and on A x.

    Attributes:
        H: (n, n).
        g: (n,).
        A: (m, n).
        lower: (n + m,) of x, then of A x.
        upper: (n + m,).
        sense: (n + m,) DAQP's kinds of constraints.
    """

    H: FloatArray
    g: FloatArray
    A: FloatArray
    lower: FloatArray
    upper: FloatArray
    sense: IntArray


class FootBounds(NamedTuple):
    """What the program knows of the four feet.

    Attributes:
        load: How much each foot may carry, 0 to 1, (4,).
        place: The feet's centres in W (4, 3) [m].
        friction: Friction coefficient that each foot's force stays within (4,).
        least: Least normal force of each foot (4,) [N].
        axes: Axes of each foot's force (4, 3, 3), see `contact_axes`.
        along: Factors on `Weights.along`, see `tangential_prices` (4,).
    """

    load: FloatArray
    place: FloatArray
    friction: FloatArray
    least: FloatArray
    axes: FloatArray
    along: FloatArray


class JointBounds(NamedTuple):
    """Limits of the twelve joints, leg by leg.

    Attributes:
        effort: Torque limits (12,) [Nm].
        lower: Least accelerations (12,) [rad/s^2].
        upper: Greatest accelerations (12,) [rad/s^2].
    """

    effort: FloatArray
    lower: FloatArray
    upper: FloatArray


@jit
def make_program(
    dynamics: Dynamics, wanted: FloatArray, feet: FootBounds, joints: JointBounds, weights: Weights
) -> Program:
    """Assembles the program of the feet that carry load.

    Args:
        dynamics: The dynamics from `reduce_dynamics`, after `turn_forces`.
        wanted: The base's acceleration, angular then linear, (6,).
        feet: The feet's loads, places and limits.
        joints: The joints' limits.
        weights: The program's weights.

    Returns:
        The program; its variables are the forces in the feet's axes.
    """
    load, places, axes = feet.load, feet.place, feet.axes
    friction, effort = feet.friction, joints.effort
    standing, count = np.empty(4, dtype=np.int64), 0
    for k in range(4):
        if load[k] > 0.0:
            standing[count] = k
            count += 1
    standing = standing[:count]
    n = 3 * count
    columns = np.empty(n, dtype=np.int64)
    for i in range(n):
        columns[i] = 3 * standing[i // 3] + i % 3
    # Loops all along: a call of a library for matrices this small takes longer than its work.
    H, g = np.zeros((n, n)), np.zeros(n)
    for row in range(6):
        weight = weights.angular if row < 3 else weights.linear
        missing = wanted[row] - dynamics.base_offset[row]
        for i in range(n):
            weighed = weight * dynamics.base[row, columns[i]]
            g[i] -= weighed * missing
            for j in range(n):
                H[i, j] += weighed * dynamics.base[row, columns[j]]
    for i in range(n):
        k = standing[i // 3]
        H[i, i] += (weights.force if i % 3 == 2 else weights.along * feet.along[k]) / load[k]

    sides = _support_sides(places, standing)
    edges = 0
    for i in range(count):
        edges += 4 if axes[standing[i], 2, 2] == 1.0 else 8
    m = edges + 24 + len(sides)
    A = np.zeros((m, n))
    lower, upper = np.full(n + m, -NONE), np.full(n + m, NONE)
    sense = np.zeros(n + m, dtype=np.int32)
    row = 0
    for i in range(len(standing)):
        x, z = 3 * i, 3 * i + 2
        lower[z] = feet.least[standing[i]]
        upper[z] = max(weights.greatest_force * load[standing[i]], lower[z])
        if axes[standing[i], 2, 2] == 1.0:
            mu = friction[standing[i]] / np.sqrt(2.0)
            for axis in range(2):
                A[row + 2 * axis, x + axis], A[row + 2 * axis, z] = 1.0, -mu
                A[row + 2 * axis + 1, x + axis], A[row + 2 * axis + 1, z] = -1.0, -mu
            row += 4
        else:
            mu = friction[standing[i]] * np.cos(np.pi / 8.0)
            for side in range(8):
                angle = (side + 0.5) * np.pi / 4.0
                A[row, x], A[row, x + 1], A[row, z] = np.cos(angle), np.sin(angle), -mu
                row += 1
    upper[n : n + row] = 0.0
    for j in range(12):
        for i in range(n):
            A[row + j, i] = dynamics.torque[j, columns[i]]
            A[row + 12 + j, i] = dynamics.joint[j, columns[i]]
        lower[n + row + j] = -effort[j] - dynamics.torque_offset[j]
        upper[n + row + j] = effort[j] - dynamics.torque_offset[j]
        lower[n + row + 12 + j] = joints.lower[j] - dynamics.joint_offset[j]
        upper[n + row + 12 + j] = joints.upper[j] - dynamics.joint_offset[j]
    sense[n + row :] = SOFT
    row += 24
    for i in range(len(sides)):
        for k in range(len(standing)):
            foot = places[standing[k]]
            inside = sides[i, 0] * foot[0] + sides[i, 1] * foot[1] - sides[i, 2]
            for j in range(3):
                vertical = axes[standing[k], 2, j]
                A[row + i, 3 * k + j] = vertical * (inside - weights.pressure_margin)
        lower[n + row + i] = 0.0
    return Program(H, g, A, lower, upper, sense)


@jit
def _support_sides(places: FloatArray, standing: IntArray) -> FloatArray:
    """Inward normals and offsets (m, 3) of the support polygon of three or four feet.

    A side joins two feet with all others on one side of it.
    """
    found = np.empty((12, 3))
    count = 0
    for a in range(len(standing)):
        for b in range(a):
            i, j = standing[a], standing[b]
            dx, dy = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
            length = np.sqrt(dx * dx + dy * dy)
            if length < 1e-6:
                continue
            nx, ny = -dy / length, dx / length
            offset = nx * places[i, 0] + ny * places[i, 1]
            low, high = 0.0, 0.0
            for c in range(len(standing)):
                k = standing[c]
                if k != i and k != j:
                    inside = nx * places[k, 0] + ny * places[k, 1] - offset
                    low, high = min(low, inside), max(high, inside)
            if low >= 0.0 and high > 0.0:
                found[count, 0], found[count, 1], found[count, 2] = nx, ny, offset
                count += 1
            elif high <= 0.0 and low < 0.0:
                found[count, 0], found[count, 1], found[count, 2] = -nx, -ny, -offset
                count += 1
    return found[:count].copy()


def solve(program: Program) -> FloatArray | None:
    """Solves a finite program (see `has_numbers`); None if it has no solution."""
    x = _solve_once(program)
    if x is None:
        soft = program.sense == SOFT
        lower = np.where(soft, -NONE, program.lower)
        upper = np.where(soft, NONE, program.upper)
        x = _solve_once(program._replace(lower=lower, upper=upper))
    return x


def _solve_once(program: Program) -> FloatArray | None:
    H, g, A, lower, upper, sense = program
    x, _, flag, _ = daqp.solve(H, g, A, upper, lower, sense)
    # What is not finite spoils the sum of squares.
    return x if flag in SOLVED and isfinite(x.dot(x)) else None


@jit
def has_numbers(program: Program) -> bool:
    """Whether all of a program is finite; bounds may be infinite, but not nan.

    DAQP takes a nan in a constraint for one that always holds.
    """
    bad = False
    # Without a way out, so that the processor takes several at a time.
    for part in (program.H.ravel(), program.A.ravel(), program.g):
        for value in part:
            bad |= not abs(value) < np.inf
    for part in (program.lower, program.upper):
        for value in part:
            bad |= value != value
    return not bad


@jit
def spread_variables(x: FloatArray, load: FloatArray) -> FloatArray:
    """The forces of all four feet (12,) from those of the loaded ones."""
    forces = np.zeros(12)
    i = 0
    for k in range(4):
        if load[k] > 0.0:
            copy_vector(forces[3 * k : 3 * k + 3], x[3 * i : 3 * i + 3])
            i += 1
    return forces


COM_PER_SHIFT = 0.8  # how much of a shift of the body the centre of mass makes, feet standing
# Of the least force, while a push is met: light feet would keep the centre of pressure from going
# as far aside as the feet under load allow.
LEAST_SHARE = 0.1


@jit
def plan_forces(
    M: FloatArray,
    bias: FloatArray,
    running: bool,
    constants: Records,
    work: Records,
    payload: FloatArray,
    friction: FloatArray,
) -> tuple[Program, bool, FloatArray]:
    """The program of the feet's forces.

    Args:
        M: The model's mass matrix (18, 18).
        bias: Its Coriolis terms (18,).
        running: Whether the clock follows the plan: then the payload is learned.
        constants: The robot and the settings, see CONSTANTS.
        work: Intermediate results, see WORK. The target's body is moved aside for the payload; the
            torques' map and the shift of the centre of mass are results.
        payload: The payload's wrench, see `update_payload`; goes on a tick.
        friction: Friction assumed at each foot, see `update_friction`; goes on a tick.

    Returns:
        The program; whether it is to be solved, which takes finite numbers and a known state; and
        the model's centre of mass in W (3,) [m].
    """
    c, found = constants[0], work[0]
    m, t = found.measured, found.target
    heading = atan2(m.R[1, 0], m.R[0, 0])
    # The base's turning moves the whole mass by its arm: what couples the two holds the arm.
    com = np.array([M[2, 4] / M[3, 3], M[0, 5] / M[3, 3], M[1, 3] / M[3, 3]])
    com += m.p
    shift = payload_com_shift(payload, com - m.p, heading, c.learning.weight)
    aside = compensating_shift(shift, COM_PER_SHIFT)
    for i in range(2):
        found.com_shift[i] = shift[i]
        t.body[i] += aside[i]
    hold_load(t.load, found.leaving, m.feet.place, com[0] + shift[0], com[1] + shift[1])
    for k in range(4):
        if found.leaving[k] > 0.5:  # a leg that bears is soft
            found.soft[k] = max(found.soft[k], t.load[k])
    h = bias.copy()
    for j in range(12):
        h[c.velocities[j]] += c.damping[j] * m.qd[j]  # no part of the plant's bias term
    for i in range(18):
        h[i] += GRAVITY * M[i, 5]  # weight is what an acceleration upwards would take
    load = payload_wrench(payload, heading)
    for i in range(6):
        h[i] += load[i]
    turn, speed, spin = rotation_error(t.R, m.R), t.v - m.v, t.w - m.w
    calm = running and at_rest(speed, turn, spin)
    if calm and m.known > 0.5 and c.load_time > 0.0:  # a push is no load
        copy_vector(payload, update_payload(payload, t.body[2] - m.p[2], turn, heading, c.learning))
    if calm:
        update_friction(friction, m.feet.velocity, t.load, m.feet.normal, c.friction, c.pace.period)
    dynamics = reduce_dynamics(M, h, c.velocities, m.feet, t.feet_acceleration, m.p, c.radius)
    axes = contact_axes(m.feet.normal)
    turn_forces(dynamics, axes)
    copy_matrix(found.torque, dynamics.torque)
    copy_vector(found.torque_offset, dynamics.torque_offset)
    wanted = wanted_acceleration(t.acceleration, t.body[:3] - m.p, speed, turn, spin, c.gains)
    lower, upper = np.empty(12), np.empty(12)
    for j in range(12):
        within = c.look_ahead[j // 3]
        stop = m.q[j] + m.qd[j] * within
        lower[j] = 2.0 * (c.q_lower[j] - stop) / (within * within)
        upper[j] = max(2.0 * (c.q_upper[j] - stop) / (within * within), lower[j])
    # Where a pendulum comes to rest that moves as the body does beyond its plan.
    pendulum = pendulum_rate(height_over(m.p[2], m.feet.place))
    x, y = com[0] + shift[0] - speed[0] / pendulum, com[1] + shift[1] - speed[1] / pendulum
    shares = static_load_shares(m.feet.place, t.load, x, y)
    least = min_normal_forces(
        shares, t.load, GRAVITY * M[3, 3],
        c.least_force * (1.0 if calm else LEAST_SHARE), MOST_TIMES * c.least_force,
    )  # fmt: skip
    for k in range(4):
        least[k] *= m.feet.normal[k, 2]  # of a weight, what goes along the normal
    # A push takes what there is, of every foot: then all forces cost the same.
    flat = np.full(4, c.weights.force / c.weights.along)
    along = tangential_prices(shares) if calm else flat
    feet = FootBounds(t.load, m.feet.place, friction, least, axes, along)
    program = make_program(dynamics, wanted, feet, JointBounds(c.effort, lower, upper), c.weights)
    return program, m.known > 0.5 and has_numbers(program), com


@jit
def torques_of(forces: FloatArray, work: Records, torque: FloatArray) -> None:
    """Writes the joints' torques (12,), leg by leg [Nm], of the solution of `plan_forces`."""
    found = work[0]
    all_forces = spread_variables(forces, found.target.load)
    for i in range(12):
        total = found.torque_offset[i]
        for j in range(12):
            total += found.torque[i, j] * all_forces[j]
        torque[i] = total
