"""The body path's quadratic program: its cost, and its solution.

Unknown are the control points of x(t) and y(t), where legs are at their limits also those of the
body's lift and tilt (see BodyProblem), the smallest static margin m and the smallest
margin of the zero-moment point. For every sampled time t and every side (inward unit normal n
through p) of the support polygon,

    n · (c(t) - p) >= m              c: the whole robot's centre of mass
    n · (c(t) - h/g c̈(t) - p) >= m_z

with m <= the margin desired; `body_sides.py` says which sides, and where m is eased. The cost is
the acceleration, a little of the distance from the nominal path, and -m. What adds up over the time
counts for less if the way has many steps (LONG), for m does not add up. While two feet stand it is
also the squared distance of the zero-moment point from their line, at a price that leaves hardly
any: hard rows there may have no solution, for a spline does not follow all that swings do. The
legs' own part of the centre of mass comes in as a given offset from the body and is corrected by
whoever calls this again with the path found (`body_path.py`).

One row in twenty holds the path. The program is solved with a few rows, those that its path breaks
or nearly breaks come in, and so on until none of all is broken: the optimum is then that of the
program with all rows (an outer approximation; Kelley, "The cutting-plane method for solving convex
programs", 1960).
"""

from dataclasses import dataclass, replace

import numpy as np
import piqp
from scipy import sparse

from drake_quad.common import FloatArray, IntArray
from drake_quad.errors import PlanningError
from drake_quad.math.curves import knot_count
from drake_quad.planning.body_problem import (
    BEYOND,
    FIRST_PHASE,
    MARGIN,
    SHANKS,
    ZMP_MARGIN,
    Basis,
    BodyProblem,
    Rows,
    join_rows,
    limit_rows,
    line_rows,
    make_basis,
    margin_rows,
    reach_rows,
    shift_rows,
)
from drake_quad.planning.body_sides import Sides, make_sides


@dataclass(frozen=True, eq=False)
class BodySolution:
    """What the program found.

    Attributes:
        control: The control points (n, axes) [m].
        margin: The static margin that the program believes in [m].
        zmp_margin: The margin of the zero-moment point that the program believes in [m].
        path: Value, velocity, acceleration at the sampled times, (N, 3, axes).
        scalars: The program's scalars, MARGIN to SHANKS, then, where legs are at their limits, one
            for every phase of the contacts (5,) or (5 + phases,) [m].
    """

    control: FloatArray
    margin: float
    zmp_margin: float
    path: FloatArray
    scalars: FloatArray

    @property
    def beyond(self) -> float:
        """How far legs are beyond their limits, or shanks too near, at most [m]."""
        return float(self.scalars[[BEYOND, SHANKS]].max())


FOLLOW = 0.02  # what a distance from the nominal path costs; an acceleration costs 1 [1/s^4]
SETTLE = 1.0  # the same of lift and tilt
OFF_LINE = 1e4  # the same of the zero-moment point's distance from the line of two feet
# The scalars' costs: of both margins, of the excess of reach, of legs beyond their limits and of
# shanks too near to the stairs, where they are nearest. The last two are hard if they can be kept.
PRICES = (-200.0, -100.0, 400.0, 4000.0, 1500.0)
PHASE_PRICE = 150.0  # of shanks too near in each phase: less than margin costs, see MARGIN
# A plan of more steps of its feet than these pays for its path, and for its phases, as if it had so
# many: a margin is the least of all times, and would be given up for a way that is longer. A plan
# that is balanced by its motion pays in full; its margin is hardly given up.
LONG = 40
NEAR = 0.01  # [m] from being broken, at which a row comes in
BROKEN = 1e-6  # [m] more than that and a row is broken
SEED_STRIDE = 4  # every so many samples' sides begin
SETTLED = 3  # rounds after which no row goes any more
ROUNDS = 10  # in the last of which all rows are in
# Of the solver; its own 1e-9 takes a fortieth more of all planning.
DUALITY_GAP = 1e-7


@dataclass(frozen=True, eq=False)
class BodyFrame:
    """What stays of a program however the legs' share in the centre of mass is corrected.

    Attributes:
        basis: The spline at the sampled times.
        sides: Sides of the support polygons.
        line: The lines of two feet.
        limits: Rows of reach and shift.
        P: The quadratic cost, (axes n + scalars, axes n + scalars).
        c: The linear cost, (axes n + scalars,).
        A: Picks the control points at both ends, which are given, (6 axes, axes n + scalars).
        axes: Number of the path's coordinates, see BodyProblem.
    """

    basis: Basis
    sides: Sides
    line: Sides
    limits: Rows
    P: sparse.csc_matrix
    c: FloatArray
    A: sparse.csc_matrix
    axes: int


def make_frame(problem: BodyProblem) -> BodyFrame:
    """Prepares a program.

    Raises:
        PlanningError: If the standing feet are on one line.
    """
    p = problem
    basis = make_basis(p.times, p.knot, knot_count(p.contacts.duration, p.knot))
    P, c = _cost(p, basis)
    limits = join_rows([*reach_rows(p), *shift_rows(p)])
    ends = np.array([0, 1, 2, basis.count - 3, basis.count - 2, basis.count - 1])
    columns = (p.axes * ends[:, None] + np.arange(p.axes)).ravel()
    many = len(columns)
    A = sparse.csc_matrix((np.ones(many), (np.arange(many), columns)), shape=(many, len(c)))
    sides, line = make_sides(p.contacts, p.times, p.guard)
    return BodyFrame(basis, sides, line, limits, P, c, A, p.axes)


def with_sides(frame: BodyFrame, problem: BodyProblem) -> BodyFrame:
    """The same program where the feet have rolled by another path."""
    if frame.axes != problem.axes:
        return make_frame(problem)
    sides, line = make_sides(problem.contacts, problem.times, problem.guard)
    return replace(frame, sides=sides, line=line)


def solve_body(
    problem: BodyProblem,
    *,
    frame: BodyFrame | None = None,
    start: BodySolution | None = None,
    broken: float = BROKEN,
) -> BodySolution:
    """Solves for the path.

    Args:
        problem: The program.
        frame: `make_frame` of this problem, or of one that differs in the legs' share and limits.
        start: A solution of such a problem, whose rows to begin with.
        broken: Violation of a row that is tolerated [m].

    Raises:
        PlanningError: If the solver finds none (it always should: the margins may be negative).
    """
    frame = _with_line(problem, frame or make_frame(problem))
    parts = [margin_rows(problem, frame.sides), frame.limits]
    if problem.limits is not None:
        phases = problem.contacts.phase_indices(problem.times)
        parts.append(limit_rows(problem.limits, phases))
    rows = join_rows([part.with_axes(problem.axes) for part in parts])
    if start is None:
        chosen = np.zeros(len(rows.sample), dtype=bool)
        chosen[: len(frame.sides.sample)] = frame.sides.sample % SEED_STRIDE == 0
    else:
        scalars = np.append(start.scalars[:SHANKS], np.zeros(problem.scalars - SHANKS))
        chosen = rows.excess(start.path, scalars) < NEAR
    for k in range(ROUNDS):
        x = _solve(problem, frame, rows, np.flatnonzero(chosen))
        control, scalars = np.split(x, [len(x) - problem.scalars])
        control = control.reshape(-1, problem.axes)
        path = frame.basis.at(control)
        excess = rows.excess(path, scalars)
        if np.all(excess[~chosen] >= -broken):
            break
        # At first rows also go that are far from holding the path, as it still moves a lot.
        chosen = (excess < NEAR) | (chosen & (k >= SETTLED)) | (k == ROUNDS - 2)
    least = float(frame.sides.weight.min())
    margins = least * scalars[[MARGIN, ZMP_MARGIN]]
    return BodySolution(control, float(margins[0]), float(margins[1]), path, scalars)


def _with_line(p: BodyProblem, frame: BodyFrame) -> BodyFrame:
    """The frame with the cost of the distance from the lines of two feet, if there are any."""
    if len(frame.line.sample) == 0:
        return frame
    rows = line_rows(p, frame.line).with_axes(p.axes)
    R, at = rows.matrix(np.arange(len(rows.sample)), frame.basis, p.scalars)
    # A sample has one row, and within the guard of two swings one for each.
    price = 2.0 * OFF_LINE * np.gradient(p.times)[rows.sample]
    P = frame.P + R.T @ sparse.diags_array(price) @ R
    return replace(frame, P=sparse.csc_matrix(P), c=frame.c - R.T @ (price * at))


def _solve(p: BodyProblem, frame: BodyFrame, rows: Rows, chosen: IntArray) -> FloatArray:
    """The path's control points, their axes in turn, and the scalars (axes n + scalars,)."""
    total, axes, scalars = len(frame.c), p.axes, p.scalars
    G, lower = rows.matrix(chosen, frame.basis, scalars)
    if scalars > FIRST_PHASE:
        greatest = _greatest_shank(total, scalars - FIRST_PHASE)
        G = sparse.vstack([G, greatest], format="csc")
        lower = np.append(lower, np.zeros(greatest.shape[0]))
    still = np.zeros(axes - 2)
    ends = [np.append(p.nominal[0], still), np.append(p.nominal[-1], still)]
    b = np.repeat(ends, 3, axis=0).ravel()
    x_lower, x_upper = np.full(total, -np.inf), np.full(total, np.inf)
    first = total - scalars
    x_upper[first : first + 2] = p.margin_desired, p.zmp_margin_desired
    x_lower[first + 2 :] = 0.0
    x_lower[:first], x_upper[:first] = p.ranges(first // axes).reshape(2, -1)
    solver = piqp.SparseSolver()
    solver.settings.eps_abs = 1e-5
    solver.settings.eps_rel = 1e-5
    solver.settings.eps_duality_gap_rel = DUALITY_GAP
    solver.settings.preconditioner_scale_cost = True  # a fifth fewer iterations
    solver.settings.preconditioner_iter = 3
    solver.setup(
        frame.P, frame.c, frame.A, b, G, lower, np.full(len(lower), np.inf), x_lower, x_upper
    )
    status = solver.solve()
    if status != piqp.PIQP_SOLVED:
        raise PlanningError(f"the body path's program was not solved: {status}", status=str(status))
    return np.array(solver.result.x)


def _greatest_shank(total: int, phases: int) -> sparse.csr_matrix:
    """Rows that hold the scalar SHANKS above that of every phase (phases, total)."""
    k = np.arange(phases)
    first = total - phases
    rows, columns = np.tile(k, 2), np.append(np.full(phases, first - 1), first + k)
    data = np.repeat([1.0, -1.0], phases)
    return sparse.csr_matrix((data, (rows, columns)), shape=(phases, total))


def _cost(p: BodyProblem, basis: Basis) -> tuple[sparse.csc_matrix, FloatArray]:
    """The acceleration squared and some of the distance from the nominal path, over time."""
    gaps = np.diff(p.times)
    long = min(LONG / max(len(p.contacts.steps), 1), 1.0) if p.static else 1.0
    weight = 0.5 * long * (np.append(gaps, 0.0) + np.insert(gaps, 0, 0.0))  # the trapezoidal rule
    follow = basis.weights[:, 0]
    n, axes = basis.count, p.axes
    at = basis.first[:, None] + np.arange(4)
    ways = [_bands(basis, at, weight, pull) for pull in (FOLLOW, SETTLE)]
    bands = []
    for d in range(4):  # above the diagonal; the same below
        band = np.stack([ways[axis >= 2][d] for axis in range(axes)], axis=-1).ravel()
        bands.append(np.append(band, np.full(p.scalars, 1e-6 if d == 0 else 0.0)))
    offsets = [axes * d for d in (0, 1, 2, 3, -1, -2, -3)]
    P = sparse.diags_array([*bands, *bands[1:]], offsets=offsets, format="csc")
    pull = weight[:, None, None] * follow[:, :, None] * p.nominal[:, None, :]
    c = np.zeros((n, axes))
    for axis in range(2):
        c[:, axis] = -2.0 * FOLLOW * np.bincount(at.ravel(), pull[..., axis].ravel(), minlength=n)
    phases = np.full(p.scalars - FIRST_PHASE, long * PHASE_PRICE)
    return P, np.concatenate([c.ravel(), PRICES, phases])


def _bands(basis: Basis, at: IntArray, weight: FloatArray, pull: float) -> list[FloatArray]:
    """The diagonals of one axis's cost on and above the main one; the d-th is n - d long."""
    follow, accelerate = basis.weights[:, 0], basis.weights[:, 2]
    square = (
        2.0
        * weight[:, None, None]
        * (
            accelerate[:, :, None] * accelerate[:, None, :]
            + pull * follow[:, :, None] * follow[:, None, :]
        )
    )
    bands = []
    for d in range(4):
        pairs = np.stack([square[:, a, a + d] for a in range(4 - d)], axis=-1)
        band = np.bincount(at[:, : 4 - d].ravel(), pairs.ravel(), minlength=basis.count)
        bands.append(np.asarray(band[: basis.count - d], dtype=np.float64))
    return bands
