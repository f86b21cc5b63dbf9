"""The body's horizontal path as one quadratic program.

Unknown are the control points of x(t) and y(t), the smallest static margin m and the smallest
margin of the zero-moment point. For every sampled time t and every side (inward unit normal n
through p) of the support polygon,

    n · (c(t) - p) >= m              c: the whole robot's centre of mass
    n · (c(t) - h/g c̈(t) - p) >= m_z

with m <= the margin desired; `body_sides.py` says which sides, and where m is eased. The cost is
the acceleration, a little of the distance from the nominal path, and -m. The legs' own part of the
centre of mass comes in as a given offset from the body and is corrected by whoever calls this again
with the path found (`body_path.py`).
"""

from dataclasses import dataclass

import numpy as np
import piqp
from scipy import sparse

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.body_sides import make_sides
from drake_quad.planning.body_spline import knot_count, weights
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.leg_limits import LegLimits

GRAVITY = 9.81
FAR = 5.0  # [m]: a limit beyond it is none
REACH_STRIDE = 4  # a foot's place in its box changes slowly: every so many samples will do


@dataclass(frozen=True, kw_only=True)
class BodyProblem:
    """What the quadratic program is given. Arrays over `times` have one row a time.

    Attributes:
        contacts: Who stands where, when.
        times: Sampled times (N,) [s].
        nominal: Nominal places of the body's centre, (N, 2) [m].
        heading: Unit vector of the body's x in W, (N, 2).
        com_gain: How much of a shift of the body, the feet standing, the whole robot's centre of
            mass makes, along x and y of W (2,).
        com_offset: The centre of mass less `com_gain` times the body's centre, (N, 2) [m].
        com_offset_acceleration: Its second time derivative, (N, 2) [m/s^2].
        com_height: Above the feet, (N,) [m].
        reach_centres: Workspace centres of the feet in B, (4, 2) [m].
        reach: Half-sizes of the legs' boxes along and across the heading, (2,) [m].
        max_shift: How far the body may be from its nominal place: across its heading always,
            along it where the nominal place stands still [m].
        max_ahead: The same along its heading where the nominal place moves [m].
        margin_desired: No more static margin than this is asked for [m].
        zmp_margin_desired: The same for the zero-moment point [m].
        static: Whether the static margin is asked for at all.
        guard: For how long before lift-off and after touchdown three feet have to do already [s].
        knot: Knot spacing [s].
        limits: Of the legs, where they are in the way.
    """

    contacts: ContactPlan
    times: FloatArray
    nominal: FloatArray
    heading: FloatArray
    com_gain: FloatArray
    com_offset: FloatArray
    com_offset_acceleration: FloatArray
    com_height: FloatArray
    reach_centres: FloatArray
    reach: FloatArray
    max_shift: float
    max_ahead: float
    margin_desired: float
    zmp_margin_desired: float
    static: bool = True
    guard: float = 0.15
    knot: float = 0.2
    limits: LegLimits | None = None


@dataclass(frozen=True)
class BodySolution:
    """The control points (n, 2) [m] and the margins that the program believes in [m]."""

    control: FloatArray
    margin: float
    zmp_margin: float


def solve_body(problem: BodyProblem) -> BodySolution:
    """Solves for the path.

    Raises:
        PlanningError: If the solver finds none (it always should: the margins may be negative).
    """
    p = problem
    count = knot_count(p.contacts.duration, p.knot)
    index, basis = _basis_at(p.times, p.knot, count)
    sides = make_sides(p.contacts, p.times, p.guard)
    zmp = p.com_height / GRAVITY

    # Static margin and ZMP rows: unknowns are [x (n), y (n), m, m_z, excess of reach].
    k, n, offset = sides.sample, sides.normal, sides.offset
    static = basis[k, 0]
    dynamic = basis[k, 0] - zmp[k, None] * basis[k, 2]
    given = np.einsum("ij,ij->i", n, p.com_offset[k])
    given_dynamic = given - zmp[k] * np.einsum("ij,ij->i", n, p.com_offset_acceleration[k])
    total = 2 * count + (3 if p.limits is None else 4)
    m_z = (2 * count + 1, -sides.weight)
    rows = [_rows(dynamic, n * p.com_gain, index[k], count, total, extra=m_z)]
    lower = [offset - given_dynamic]
    if p.static:
        margin = (2 * count, -sides.weight)
        rows.insert(0, _rows(static, n * p.com_gain, index[k], count, total, extra=margin))
        lower.insert(0, offset - given)

    reach_rows, reach_lower = _reach(p, basis, index, count, total)
    shift_rows, shift_lower = _shifts(p, basis, index, count, total)
    rows += [reach_rows, shift_rows]
    lower += [reach_lower, shift_lower]
    if p.limits is not None:
        k = p.limits.sample
        beyond = (2 * count + 3, 1.0)
        rows.append(_rows(basis[k, 0], p.limits.normal, index[k], count, total, extra=beyond))
        lower.append(p.limits.offset)
    G = sparse.vstack(rows, format="csc")
    h_lower = np.concatenate(lower)

    weight = _trapezoid(p.times)
    accelerate = _scalar_rows(basis[:, 2], index, count)
    follow = _scalar_rows(basis[:, 0], index, count)
    W = sparse.diags(weight)
    axis = accelerate.T @ W @ accelerate + 0.02 * (follow.T @ W @ follow)
    extra = total - 2 * count
    P = sparse.block_diag([2 * axis, 2 * axis, 1e-6 * sparse.eye(extra)], format="csc")
    pull = -0.04 * (follow.T @ (weight[:, None] * p.nominal))
    prices = [-200.0, -100.0, 400.0, 4000.0]  # a leg's limits are hard, if they can be kept
    c = np.concatenate([pull[:, 0], pull[:, 1], prices[:extra]])

    fixed = [0, 1, 2, count - 3, count - 2, count - 1]
    start, end = p.nominal[0], p.nominal[-1]
    b = np.concatenate([[s] * 3 + [e] * 3 for s, e in zip(start, end, strict=True)])
    columns = fixed + [count + f for f in fixed]
    A = sparse.csc_matrix((np.ones(12), (np.arange(12), columns)), shape=(12, total))

    x_lower = np.full(total, -np.inf)
    x_upper = np.full(total, np.inf)
    x_upper[2 * count] = p.margin_desired
    x_upper[2 * count + 1] = p.zmp_margin_desired
    x_lower[2 * count + 2 :] = 0.0

    solver = piqp.SparseSolver()
    solver.settings.eps_abs = 1e-5
    solver.settings.eps_rel = 1e-5
    solver.settings.kkt_solver = piqp.KKTSolver.sparse_ldlt_cond  # twice as fast: many rows
    solver.setup(P, c, A, b, G, h_lower, np.full(len(h_lower), np.inf), x_lower, x_upper)
    status = solver.solve()
    if status != piqp.PIQP_SOLVED:
        raise PlanningError(f"the body path's program was not solved: {status}", status=str(status))
    x = np.array(solver.result.x)
    control = np.stack([x[:count], x[count : 2 * count]], axis=-1)
    least = float(sides.weight.min())
    return BodySolution(control, least * float(x[2 * count]), least * float(x[2 * count + 1]))


def _reach(
    p: BodyProblem, basis: FloatArray, index: FloatArray, count: int, total: int
) -> tuple[sparse.csr_matrix, FloatArray]:
    """Every standing foot stays in its box, but for one shared excess that costs dearly."""
    feet, standing = p.contacts.feet_at(p.times)
    across = np.stack([-p.heading[:, 1], p.heading[:, 0]], axis=-1)
    blocks, lower = [], []
    for leg in range(4):
        k = np.flatnonzero(standing[:, leg])[::REACH_STRIDE]
        for axis, e in enumerate((p.heading, across)):
            at = np.einsum("ij,ij->i", e[k], feet[k, leg, :2]) - p.reach_centres[leg, axis]
            for sign in (1.0, -1.0):  # sign * e·(body) <= sign * at + reach
                rows = _rows(basis[k, 0], -sign * e[k], index[k], count, total,
                             extra=(2 * count + 2, 1.0))  # fmt: skip
                blocks.append(rows)
                lower.append(-sign * at - p.reach[axis])
    return sparse.vstack(blocks, format="csr"), np.concatenate(lower)


def _shifts(
    p: BodyProblem, basis: FloatArray, index: FloatArray, count: int, total: int
) -> tuple[sparse.csr_matrix, FloatArray]:
    """The body stays within `max_shift` of its nominal place, but for the excess of reach."""
    across = np.stack([-p.heading[:, 1], p.heading[:, 0]], axis=-1)
    moved = np.linalg.norm(np.gradient(p.nominal, axis=0), axis=1)
    blocks, lower = [], []
    always, still = np.ones(len(moved), dtype=bool), moved < 1e-9
    for e, where, most in (
        (across, always, p.max_shift),
        (p.heading, still, p.max_shift),
        (p.heading, ~still, p.max_ahead),
    ):
        if most > FAR:
            continue
        k = np.flatnonzero(where)[::2]
        at = np.einsum("ij,ij->i", e[k], p.nominal[k])
        for sign in (1.0, -1.0):
            blocks.append(_rows(basis[k, 0], sign * e[k], index[k], count, total,
                                extra=(2 * count + 2, 1.0)))  # fmt: skip
            lower.append(sign * at - most)
    return sparse.vstack(blocks, format="csr"), np.concatenate(lower)


def _basis_at(times: FloatArray, knot: float, count: int) -> tuple[FloatArray, FloatArray]:
    """First control point (N,) and weights (N, 3, 4) at each time."""
    r = times / knot
    i = np.clip(np.floor(r + 1e-9).astype(int), 0, count - 4)
    return i, weights(np.clip(r - i, 0.0, 1.0), knot)


def _scalar_rows(basis: FloatArray, index: FloatArray, count: int) -> sparse.csr_matrix:
    """Rows that evaluate one spline: (N, n)."""
    row = np.repeat(np.arange(len(index)), 4)
    column = (index[:, None] + np.arange(4)).ravel()
    return sparse.csr_matrix((basis.ravel(), (row, column)), shape=(len(index), count))


def _rows(
    basis: FloatArray,
    normal: FloatArray,
    index: FloatArray,
    count: int,
    total: int,
    *,
    extra: tuple[int, float | FloatArray],
) -> sparse.csr_matrix:
    """Rows n · (x, y)(t) + extra: the same basis for x and y, weighed by the normal."""
    size = len(index)
    row = np.arange(size)
    x_columns = index[:, None] + np.arange(4)
    data = np.concatenate(
        [(basis * normal[:, :1]).ravel(), (basis * normal[:, 1:]).ravel(), np.full(size, extra[1])]
    )
    rows = np.concatenate([np.repeat(row, 4), np.repeat(row, 4), row])
    columns = np.concatenate(
        [x_columns.ravel(), (x_columns + count).ravel(), np.full(size, extra[0])]
    )
    return sparse.csr_matrix((data, (rows, columns)), shape=(size, total))


def _trapezoid(times: FloatArray) -> FloatArray:
    """Integration weights [s] of the samples."""
    gaps = np.diff(times)
    return np.asarray(0.5 * (np.concatenate([[0.0], gaps]) + np.concatenate([gaps, [0.0]])))
