"""The exact projection of a polytope to the plane, corner by corner, from linear programs.

    { C x + d :  lower ≤ A x ≤ upper }

Each program finds the farthest point of the projection in one direction: a corner, or the proof
that a side is one. A side between two corners found is tried along its outward normal, and split
where there is more beyond it (Bretl and Lall, "Testing static equilibrium for legged robots", IEEE
Transactions on Robotics 24(4), 2008, section IV). A polygon of k corners takes 2 k programs.
"""

from math import hypot, isfinite

import daqp
import numpy as np

from drake_quad.common import FloatArray

Point = tuple[float, float]
EXACT = 1e-8  # [m] by which the projection may reach beyond a side; at sharp corners some more
NEAR = 10.0  # times that: two corners so near are one, apart from rounding
MOST_PROGRAMS = 1000  # of an outline: a guard, many times what any stance has taken
NONE = 1e30  # a bound that is none
EQUALITY = 5  # DAQP's mark of a row that always binds
FREE = 0
SOLVED = 1  # its exit flag
# Its own 1e-6 left 3 of 2500 random stances off by 0.3 to 1.4 µm; with 1e-9 it takes some regions
# that are a point or a line for empty.
TIGHT = {"primal_tol": 1e-8}
# What rows may be broken by in the end, of forces in weights. Of two feet whose region is a point,
# a few times 1e-8 beyond the rows' bounds reach as far as 0.8 mm beyond the point.
BROKEN = 1e-8
AXES: tuple[Point, ...] = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))


class PolytopeProjection:
    """A polytope and its view, solved by DAQP, or by SciPy's HiGHS where DAQP finds nothing.

    Args:
        A: (m, n) rows.
        lower: (m,) lower bounds of the rows; NONE for none. Equal to `upper` for an equation.
        upper: (m,) upper bounds of the rows.
        C: (2, n) the view: the projection is C x + d.
        d: (2,) offset of the view.
    """

    def __init__(
        self, A: FloatArray, lower: FloatArray, upper: FloatArray, C: FloatArray, d: FloatArray
    ) -> None:
        self._A, self._lower, self._upper, self._C = A, lower, upper, C
        self._least, self._most = lower - BROKEN, upper + BROKEN
        self._d: Point = (float(d[0]), float(d[1]))
        self._ahead, self._left = -C[0], -C[1]
        self._model: daqp.Model | None = None
        self.programs = 0

    def farthest(self, x: float, y: float) -> Point | None:
        """The point of the projection farthest along (x, y); None if there is none at all."""
        found = self.forces(x, y)
        if found is None:
            return None
        a, b = (self._C @ found).tolist()
        return a + self._d[0], b + self._d[1]

    def forces(self, x: float, y: float) -> FloatArray | None:
        """The point of the polytope (n,) over that one; None if there is none."""
        self.programs += 1
        cost = x * self._ahead + y * self._left
        if self._model is None:
            n = self._A.shape[1]
            sense = np.where(self._lower == self._upper, EQUALITY, FREE).astype(np.int32)
            self._model = daqp.Model()
            flag = self._model.setup(
                np.zeros((n, n)), cost, self._A, self._upper, self._lower, sense
            )[0]
            self._model.settings = TIGHT
        else:
            flag = self._model.update(f=cost)
        if flag >= 0:
            found, _, flag, _ = self._model.solve()
            if flag == SOLVED and isfinite(sum(found.tolist())) and self._holds(found):
                return found
        return self._solve_by_highs(cost)

    def _holds(self, point: FloatArray) -> bool:
        """Whether a point of the polytope is one: DAQP may say so of others, if it is very thin."""
        rows = self._A @ point
        return bool((rows < self._most).all() and (rows > self._least).all())

    def _solve_by_highs(self, cost: FloatArray) -> FloatArray | None:
        """The solution by HiGHS, which takes a hundred times as long; it decides what is empty."""
        from scipy.optimize import linprog  # a third of a second, and hardly any stance needs it

        self._model = None
        A, lower, upper = self._A, self._lower, self._upper
        same = lower == upper
        above, below = ~same & (upper < NONE), ~same & (lower > -NONE)
        found = linprog(
            cost,
            A_ub=np.concatenate([A[above], -A[below]]),
            b_ub=np.concatenate([upper[above], -lower[below]]),
            A_eq=A[same],
            b_eq=upper[same],
            bounds=(None, None),
            method="highs",
        )
        return np.asarray(found.x) if found.status == 0 else None


def project_polygon(shadow: PolytopeProjection, *, exact: float = EXACT) -> list[Point]:
    """The projection's corners counterclockwise; two for a line, one for a point, none if empty.

    Args:
        shadow: The polytope and its view; bounded.
        exact: Distance that the projection may reach beyond the polygon [m].
    """
    ends = []
    for x, y in AXES:
        end = shadow.farthest(x, y)
        if end is None:
            return []
        ends.append(end)
    corners: list[Point] = []
    for k, end in enumerate(ends):
        corners.append(end)
        _split(shadow, end, ends[(k + 1) % 4], exact, corners)
    return _apart(corners, exact)


def _split(
    shadow: PolytopeProjection, a: Point, b: Point, exact: float, corners: list[Point]
) -> None:
    """Adds the corners between a and b, which follow one another counterclockwise."""
    pending = [b]
    while pending:
        b = pending[-1]
        x, y = b[1] - a[1], a[0] - b[0]
        length = hypot(x, y)
        if length > exact:
            x, y = x / length, y / length
            p = shadow.farthest(x, y) if shadow.programs < MOST_PROGRAMS else None
            # A corner that is there already lies beyond the side by rounding alone.
            if p is not None and (
                x * (p[0] - a[0]) + y * (p[1] - a[1]) > exact
                and hypot(p[0] - a[0], p[1] - a[1]) > NEAR * exact
                and hypot(p[0] - b[0], p[1] - b[1]) > NEAR * exact
            ):
                pending.append(p)
                continue
        a = pending.pop()
        if pending:
            corners.append(a)


def _apart(corners: list[Point], exact: float) -> list[Point]:
    """The corners without those that are where the one before is."""
    kept: list[Point] = []
    for x, y in corners:
        if not kept or hypot(x - kept[-1][0], y - kept[-1][1]) > exact:
            kept.append((x, y))
    while len(kept) > 1 and hypot(kept[0][0] - kept[-1][0], kept[0][1] - kept[-1][1]) <= exact:
        kept.pop()
    return kept
