"""The body path's quadratic program: problem, rows, cost and solution.

A row says of the body's centre p at one sampled time, or of p with the body's lift and tilt,

    n · (p - lean p̈) + weight * slack >= lower

where `slack` is one of the program's scalars. Written out it has 9 or 17 coefficients; here it
has none until it is asked for, for most rows are never near to holding anything.

Unknown are the control points of x(t) and y(t), where legs are at their limits also those of the
body's lift and tilt (see BodyProblem), the smallest static margin m and the smallest
margin of the zero-moment point. For every sampled time t and every side (inward unit normal n
through p) of the support polygon,

    n · (c(t) - p) >= m              c: the whole robot's centre of mass
    n · (c(t) - h/g c̈(t) - p) >= m_z

with m <= the margin desired; `body_constraints.py` says which sides, and where m is eased. The cost
is the acceleration, a little of the distance from the nominal path, and -m. The legs' own part of
the centre of mass comes in as a given offset from the body and is corrected by whoever calls this
again with the path found (`body_path.py`).

One row in twenty holds the path. The program is solved with a few rows, those that its path breaks
or nearly breaks come in, and so on until none of all is broken: the optimum is then that of the
program with all rows (an outer approximation; Kelley, "The cutting-plane method for solving convex
programs", 1960).
"""

from dataclasses import dataclass, field, fields, replace

import numpy as np
import piqp
from scipy import sparse

from drake_quad.common import GRAVITY, FloatArray, IntArray
from drake_quad.errors import PlanningError
from drake_quad.math.curves import knot_count, weights
from drake_quad.planning.body_constraints import LegLimits, Sides, make_sides
from drake_quad.planning.contact_plan import ContactPlan


@dataclass(frozen=True, kw_only=True)
class BodyProblem:
    """What the quadratic program is given. Arrays over `times` have one row a time.

    Where legs are at their limits, the body may also lift and tilt: rise above its route, and pitch
    more than the route does, the angle times a leg's length [m]. Both are 0 at both ends.

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
        max_ahead: How far it may be from that along its heading where the place moves [m].
        margin_desired: Static margin beyond which more is worth nothing [m].
        zmp_margin_desired: Margin of the zero-moment point beyond which more is worth nothing [m].
        static: Whether the program has rows of the static margin.
        guard: Time before lift-off and after touchdown in which three feet have to do already [s].
        knot: Knot spacing [s].
        limits: The legs' limits, where a path has come near them; else None.
        lift_range: Least and greatest lift, and tilt, of every control point (2, 2, n) [m]; the
            same for all of them if n is 1.
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
    lift_range: FloatArray = field(default_factory=lambda: np.zeros((2, 2, 1)))

    @property
    def axes(self) -> int:
        """Number of the path's coordinates: x and y, or these and lift and tilt."""
        return 2 if self.limits is None else 4

    @property
    def scalars(self) -> int:
        """Number of the program's scalars."""
        return FIRST_PHASE + (0 if self.limits is None else len(self.contacts.phases))


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


FAR = 5.0  # [m]: a limit beyond it is none
REACH_STRIDE = 4  # a foot's place in its box changes slowly: every so many samples will do
SHIFT_STRIDE = 2
# Behind the control points: one each, then that of shanks in every phase of the contacts. Where
# shanks cannot be far enough away at one time, they are to be so at others all the same; SHANKS is
# the greatest of these.
MARGIN, ZMP_MARGIN, EXCESS, BEYOND, SHANKS, FIRST_PHASE = range(6)


@dataclass(frozen=True, eq=False)
class Rows:
    """Inequalities (r,), see above.

    Attributes:
        sample: Index of the sampled time, (r,).
        normal: n, (r, axes), axes being 2 or 4.
        lean: Height over gravity of each row (r,) [s^2].
        scalar: Which scalar, (r,).
        weight: Its coefficient, (r,).
        lower: [m], (r,).
    """

    sample: IntArray
    normal: FloatArray
    lean: FloatArray
    scalar: IntArray
    weight: FloatArray
    lower: FloatArray

    def excess(self, path: FloatArray, scalars: FloatArray) -> FloatArray:
        """By how much each is kept (r,) [m] by a path (N, 3, axes): value and two derivatives."""
        kept = self.weight * scalars[self.scalar] - self.lower
        for axis in range(min(path.shape[2], self.normal.shape[1])):
            at = path[self.sample, 0, axis] - self.lean * path[self.sample, 2, axis]
            kept += self.normal[:, axis] * at
        return np.asarray(kept)

    def matrix(
        self, chosen: IntArray, basis: "Basis", scalars: int
    ) -> tuple[sparse.csc_matrix, FloatArray]:
        """The chosen rows written out, (k, axes n + scalars), and their lower bounds (k,)."""
        k, size, axes = self.sample[chosen], len(chosen), self.normal.shape[1]
        along = basis.weights[k, 0] - self.lean[chosen, None] * basis.weights[k, 2]
        many = 4 * axes
        data = np.empty((size, many + 1))
        data[:, :many] = (along[:, :, None] * self.normal[chosen, None, :]).reshape(size, many)
        data[:, many] = self.weight[chosen]
        columns = np.empty((size, many + 1), dtype=np.int32)
        columns[:, :many] = axes * basis.first[k, None] + np.arange(many)
        columns[:, many] = axes * basis.count + self.scalar[chosen]
        starts = np.arange(0, (many + 1) * size + 1, many + 1, dtype=np.int32)
        rows = sparse.csr_matrix(
            (data.ravel(), columns.ravel(), starts), shape=(size, axes * basis.count + scalars)
        )
        if axes > 2:
            rows.eliminate_zeros()
        return rows.tocsc(), self.lower[chosen]

    def with_axes(self, axes: int) -> "Rows":
        """The same rows for a path with more axes, which have no coefficients in them."""
        if axes == self.normal.shape[1]:
            return self
        more = np.zeros((len(self.normal), axes - self.normal.shape[1]))
        return replace(self, normal=np.concatenate([self.normal, more], axis=1))


@dataclass(frozen=True, eq=False)
class Basis:
    """The spline at the sampled times: first control point (N,), weights (N, 3, 4), how many."""

    first: IntArray
    weights: FloatArray
    count: int

    def at(self, control: FloatArray) -> FloatArray:
        """Value, velocity and acceleration (N, 3, axes) of control points (n, axes)."""
        return np.asarray(self.weights @ control[self.first[:, None] + np.arange(4)])


def make_basis(times: FloatArray, knot: float, count: int) -> Basis:
    """The spline of `count` control points `knot` [s] apart at `times` (N,) [s]."""
    r = times / knot
    i = np.clip(np.floor(r + 1e-9).astype(int), 0, count - 4)
    return Basis(i, weights(np.clip(r - i, 0.0, 1.0), knot), count)


def join_rows(parts: list[Rows]) -> Rows:
    """All of them, in order."""
    return Rows(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Rows)))


def margin_rows(p: BodyProblem, sides: Sides) -> Rows:
    """The whole robot's centre of mass, and its zero-moment point, inside every side."""
    k, n = sides.sample, sides.normal
    lean = (p.com_height / GRAVITY)[k]
    given = np.einsum("ij,ij->i", n, p.com_offset[k])
    leant = given - lean * np.einsum("ij,ij->i", n, p.com_offset_acceleration[k])
    normal, size = n * p.com_gain, len(k)
    parts = []
    if p.static:
        which = np.full(size, MARGIN)
        zero = np.zeros(size)
        parts.append(Rows(k, normal, zero, which, -sides.weight, sides.offset - given))
    which = np.full(size, ZMP_MARGIN)
    parts.append(Rows(k, normal, lean, which, -sides.weight, sides.offset - leant))
    return join_rows(parts)


def reach_rows(p: BodyProblem) -> list[Rows]:
    """Every standing foot stays in its box, but for one shared excess that costs dearly."""
    feet, standing = p.contacts.feet_at(p.times)
    parts = []
    for leg in range(4):
        k = np.flatnonzero(standing[:, leg])[::REACH_STRIDE]
        for axis, e in enumerate((p.heading, _across(p.heading))):
            at = np.einsum("ij,ij->i", e[k], feet[k, leg, :2]) - p.reach_centres[leg, axis]
            parts.append(_within(k, e[k], at, p.reach[axis]))
    return parts


def shift_rows(p: BodyProblem) -> list[Rows]:
    """The body stays within `max_shift` of its nominal place, but for the excess of reach."""
    moved = np.linalg.norm(np.gradient(p.nominal, axis=0), axis=1)
    still = moved < 1e-9
    parts = []
    for e, where, most in (
        (_across(p.heading), np.ones_like(still), p.max_shift),
        (p.heading, still, p.max_shift),
        (p.heading, ~still, p.max_ahead),
    ):
        if most > FAR:
            continue
        k = np.flatnonzero(where)[::SHIFT_STRIDE]
        parts.append(_within(k, e[k], np.einsum("ij,ij->i", e[k], p.nominal[k]), most))
    return parts


def limit_rows(limits: LegLimits, phases: IntArray) -> Rows:
    """The legs' own limits, and the shanks' clearance: hard, each if it can be kept.

    Args:
        limits: The sides.
        phases: The phase of the contacts at each sampled time (N,).
    """
    size = len(limits.sample)
    return Rows(
        limits.sample,
        limits.normal,
        np.zeros(size),
        np.where(limits.shank, FIRST_PHASE + phases[limits.sample], BEYOND),
        np.ones(size),
        limits.offset,
    )


def _within(sample: IntArray, e: FloatArray, at: FloatArray, most: float) -> Rows:
    """The body's centre along `e` no further than `most` from `at`, to either side."""
    size = 2 * len(sample)
    return Rows(
        np.tile(sample, 2),
        np.concatenate([e, -e]),
        np.zeros(size),
        np.full(size, EXCESS),
        np.ones(size),
        np.concatenate([at - most, -at - most]),
    )


def _across(heading: FloatArray) -> FloatArray:
    """Unit vectors to the left of headings (N, 2)."""
    return np.stack([-heading[:, 1], heading[:, 0]], axis=-1)


FOLLOW = 0.02  # what a distance from the nominal path costs; an acceleration costs 1 [1/s^4]
SETTLE = 1.0  # the same of lift and tilt
# The scalars' costs: of both margins, of the excess of reach, of legs beyond their limits and of
# shanks too near to the stairs, where they are nearest. The last two are hard if they can be kept.
PRICES = (-200.0, -100.0, 400.0, 4000.0, 1500.0)
PHASE_PRICE = 150.0  # of shanks too near in each phase: less than margin costs, see MARGIN
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
        limits: Rows of reach and shift.
        P: The quadratic cost, (axes n + scalars, axes n + scalars).
        c: The linear cost, (axes n + scalars,).
        A: Picks the control points at both ends, which are given, (6 axes, axes n + scalars).
        axes: Number of the path's coordinates, see BodyProblem.
    """

    basis: Basis
    sides: Sides
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
    sides = make_sides(p.contacts, p.times, p.guard)
    return BodyFrame(basis, sides, limits, P, c, A, p.axes)


def with_sides(frame: BodyFrame, problem: BodyProblem) -> BodyFrame:
    """The same program where the feet have rolled by another path."""
    if frame.axes != problem.axes:
        return make_frame(problem)
    return replace(frame, sides=make_sides(problem.contacts, problem.times, problem.guard))


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
    frame = frame or make_frame(problem)
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
    for axis in range(2, axes):
        mine = slice(axis, first, axes)
        x_lower[mine], x_upper[mine] = p.lift_range[axis - 2]
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
    weight = 0.5 * (np.append(gaps, 0.0) + np.insert(gaps, 0, 0.0))  # the trapezoidal rule
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
    phases = np.full(p.scalars - FIRST_PHASE, PHASE_PRICE)
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
