"""The body path's program as data: what it is given, its spline, and its inequalities.

A row says of the body's centre p at one sampled time, or of p with the body's lift and tilt,

    n · (p - lean p̈) + weight * slack >= lower

where `slack` is one of the program's scalars. Written out it has 9 or 17 coefficients; here it
has none until it is asked for, for most rows are never near to holding anything. `body_qp.py`
solves the program.
"""

from dataclasses import dataclass, field, fields, replace

import numpy as np
from scipy import sparse

from drake_quad.common import GRAVITY, FloatArray, IntArray
from drake_quad.math.curves import weights
from drake_quad.planning.body_sides import Sides
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.leg_limits import LegLimits

FAR = 5.0  # [m]: a limit beyond it is none
REACH_STRIDE = 4  # a foot's place in its box changes slowly: every so many samples will do
SHIFT_STRIDE = 2
# Behind the control points: one each, then that of shanks in every phase of the contacts. Where
# shanks cannot be far enough away at one time, they are to be so at others all the same; SHANKS is
# the greatest of these.
MARGIN, ZMP_MARGIN, EXCESS, BEYOND, SHANKS, FIRST_PHASE = range(6)


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
        start: Control points of the path that the legs' limits were seen along, (n, 2) or
            (n, 4) [m]; None: of any.
        radius: How far each control point may be from `start`, along each axis (n,) [m].
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
    start: FloatArray | None = None
    radius: FloatArray | None = None

    @property
    def axes(self) -> int:
        """Number of the path's coordinates: x and y, or these and lift and tilt."""
        return 2 if self.limits is None else 4

    def ranges(self, count: int) -> FloatArray:
        """Least and greatest value of every control point of each axis, (2, count, axes) [m]."""
        ranges = np.empty((2, count, self.axes))
        ranges[0], ranges[1] = -np.inf, np.inf
        for axis in range(2, self.axes):
            ranges[:, :, axis] = self.lift_range[axis - 2]
        if self.start is not None and self.radius is not None:
            around = np.zeros((count, self.axes))
            around[:, : self.start.shape[1]] = self.start
            free = slice(3, count - 3)  # the others are given
            near = around + np.array([-1.0, 1.0])[:, None, None] * self.radius[:, None]
            ranges[:, free] = np.clip(near, ranges[0], ranges[1])[:, free]
        return ranges

    @property
    def scalars(self) -> int:
        """Number of the program's scalars."""
        return FIRST_PHASE + (0 if self.limits is None else len(self.contacts.phases))


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


def line_rows(p: BodyProblem, line: Sides) -> Rows:
    """The zero-moment point on the line of two feet: what they hold is to be 0, not more."""
    rows = margin_rows(replace(p, static=False), line)
    return replace(rows, weight=np.zeros(len(rows.weight)))


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
