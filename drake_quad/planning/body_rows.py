"""The inequalities of the body's program, kept small: a side's normal and a sampled time each.

A row says of the body's centre p at one sampled time, or of p with the body's lift and tilt,

    n · (p - lean p̈) + weight * slack >= lower

where `slack` is one of the program's scalars. Written out it has 9 or 17 coefficients; here it
has none until it is asked for, for most rows are never near to holding anything.
"""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.body_problem import BodyProblem
from drake_quad.planning.body_sides import Sides
from drake_quad.planning.body_spline import weights
from drake_quad.planning.leg_limits import LegLimits

FAR = 5.0  # [m]: a limit beyond it is none
REACH_STRIDE = 4  # a foot's place in its box changes slowly: every so many samples will do
SHIFT_STRIDE = 2
Indices = NDArray[Any]  # of whole numbers
SCALARS = 5  # behind the control points:
MARGIN, ZMP_MARGIN, EXCESS, BEYOND, SHANKS = range(SCALARS)


@dataclass(frozen=True, eq=False)
class Rows:
    """Inequalities (r,), see above.

    Attributes:
        sample: Index of the sampled time, (r,).
        normal: n, (r, axes), axes being 2 or 4.
        lean: In s^2, (r,).
        scalar: Which scalar, (r,).
        weight: Its coefficient, (r,).
        lower: [m], (r,).
    """

    sample: Indices
    normal: FloatArray
    lean: FloatArray
    scalar: Indices
    weight: FloatArray
    lower: FloatArray

    def excess(self, path: FloatArray, scalars: FloatArray) -> FloatArray:
        """By how much each is kept (r,) [m] by a path (N, 3, axes): value and two derivatives."""
        kept = self.weight * scalars[self.scalar] - self.lower
        for axis in range(min(path.shape[2], self.normal.shape[1])):
            at = path[self.sample, 0, axis] - self.lean * path[self.sample, 2, axis]
            kept += self.normal[:, axis] * at
        return np.asarray(kept)

    def matrix(self, chosen: Indices, basis: "Basis") -> tuple[sparse.csc_matrix, FloatArray]:
        """The chosen rows written out, (k, axes n + SCALARS), and their lower bounds (k,)."""
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
            (data.ravel(), columns.ravel(), starts), shape=(size, axes * basis.count + SCALARS)
        )
        if axes > 2:
            rows.eliminate_zeros()
        return rows.tocsc(), self.lower[chosen]

    def with_axes(self, axes: int) -> "Rows":
        """The same rows of a path with more axes, which they do not mind."""
        if axes == self.normal.shape[1]:
            return self
        more = np.zeros((len(self.normal), axes - self.normal.shape[1]))
        return replace(self, normal=np.concatenate([self.normal, more], axis=1))


@dataclass(frozen=True, eq=False)
class Basis:
    """The spline at the sampled times: first control point (N,), weights (N, 3, 4), how many."""

    first: Indices
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


def join(parts: list[Rows]) -> Rows:
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
    return join(parts)


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


def limit_rows(limits: LegLimits) -> Rows:
    """The legs' own limits, and the shanks' room: hard, each if it can be kept."""
    size = len(limits.sample)
    return Rows(
        limits.sample,
        limits.normal,
        np.zeros(size),
        np.where(limits.shank, SHANKS, BEYOND),
        np.ones(size),
        limits.offset,
    )


def _within(sample: Indices, e: FloatArray, at: FloatArray, most: float) -> Rows:
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
