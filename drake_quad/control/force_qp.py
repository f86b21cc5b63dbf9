"""The whole-body program: forces on the feet that move the base as wanted and can be made.

    minimise    |a_b(f) - a_wanted|_W^2 + sum of w_n f_n^2 + w_t |f_t|^2
    subject to  friction pyramids, least and greatest normal forces     (hard)
                joint torques, joint accelerations within their limits  (soft)
                centre of pressure inside the support polygon           (soft)

Each foot's force is told in axes of its own, two along the ground and its normal (`ground.py`): so
pyramids and normal forces stand on the ground as it is. On level ground these are W's axes, and the
pyramid has four sides; on a slope, where standing alone takes a part of the friction, it has eight,
with an edge straight down the slope, and leaves 8 % of the cone out at most.

Forces along the ground cost more than normal ones, and those of light feet most (`light_feet.py`).
At one price for all, feet of different heights would push against each other along the ground, for
that makes the normal forces more even; a light foot then slips on less friction than is assumed.

Soft rows may give way when there is no other way, so that a program always has a solution. DAQP
can cycle among many that contradict each other; then all of them are given up at once.
"""

from math import isfinite
from typing import NamedTuple

import daqp
import numpy as np

from drake_quad.compiled import compiled, copy_vector
from drake_quad.control.feet import IntArray
from drake_quad.control.inverse_dynamics import Dynamics
from drake_quad.gait.legs import FloatArray

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


class Weights(NamedTuple):
    """What the program weighs and allows.

    Attributes:
        angular: Of the base's angular acceleration's error.
        linear: Of its linear one's.
        force: Of the squared normal forces [1/N^2].
        along: Of the squared forces along the ground, of a foot that bears its even share [1/N^2].
        greatest_force: Of a foot under full load [N].
        pressure_margin: Of the centre of pressure from the support's sides [m].
    """

    angular: float
    linear: float
    force: float
    along: float
    greatest_force: float
    pressure_margin: float


@compiled
def make_program(
    dynamics: Dynamics,
    wanted: FloatArray,
    load: FloatArray,
    places: FloatArray,
    effort: FloatArray,
    joint_lower: FloatArray,
    joint_upper: FloatArray,
    friction: FloatArray,
    least: FloatArray,
    weights: Weights,
    axes: FloatArray,
    along: FloatArray,
) -> Program:
    """Assembles the program of the feet that carry load.

    Args:
        dynamics: From `reduce_dynamics`, after `turn_forces`.
        wanted: The base's acceleration, angular then linear, (6,).
        load: How much each foot may carry, 0 to 1, (4,).
        places: The feet in W (4, 3) [m].
        effort: Torque limits (12,) [Nm].
        joint_lower: Least joint accelerations (12,) [rad/s^2].
        joint_upper: Greatest ones (12,).
        friction: Coefficient that each foot's force stays within (4,).
        least: Normal force that each foot pushes with at least (4,) [N].
        weights: See there.
        axes: Of each foot's force (4, 3, 3), see `contact_axes`.
        along: Of each foot, what `weights.along` is multiplied by, see `along_prices` (4,).

    Returns:
        The program; its variables are the forces in these axes.
    """
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
        H[i, i] += (weights.force if i % 3 == 2 else weights.along * along[k]) / load[k]

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
        lower[z] = least[standing[i]]
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
        lower[n + row + 12 + j] = joint_lower[j] - dynamics.joint_offset[j]
        upper[n + row + 12 + j] = joint_upper[j] - dynamics.joint_offset[j]
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


@compiled
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
    """Solves it; None if it has no solution or holds no numbers."""
    # DAQP takes a nan in a constraint for one that always holds.
    return solve_sound(program) if has_numbers(program) else None


def solve_sound(program: Program) -> FloatArray | None:
    """Solves one that is known to hold numbers; None if it has no solution."""
    H, g, A, lower, upper, sense = program
    x = _solve_once(H, g, A, lower, upper, sense)
    if x is None:
        soft = sense == SOFT
        lower, upper = np.where(soft, -NONE, lower), np.where(soft, NONE, upper)
        x = _solve_once(H, g, A, lower, upper, sense)
    return x


def _solve_once(
    H: FloatArray,
    g: FloatArray,
    A: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    sense: IntArray,
) -> FloatArray | None:
    x, _, flag, _ = daqp.solve(H, g, A, upper, lower, sense)
    # What is not finite spoils the sum.
    return x if flag in SOLVED and isfinite(sum(x.tolist())) else None


@compiled
def has_numbers(program: Program) -> bool:
    """Whether all of it is finite; bounds may be infinite, but not no numbers."""
    for part in (program.H, program.A):
        for row in part:
            for value in row:
                if not np.isfinite(value):
                    return False
    for value in program.g:
        if not np.isfinite(value):
            return False
    for part in (program.lower, program.upper):
        for value in part:
            if np.isnan(value):
                return False
    return True


@compiled
def spread(x: FloatArray, load: FloatArray) -> FloatArray:
    """The forces of all four feet (12,) from those of the loaded ones."""
    forces = np.zeros(12)
    i = 0
    for k in range(4):
        if load[k] > 0.0:
            copy_vector(forces[3 * k : 3 * k + 3], x[3 * i : 3 * i + 3])
            i += 1
    return forces
