"""Rigorous enclosures of smooth functions by affine arithmetic, and Bernstein bounds.

An `Enclosure` says of functions g on stretches of time, for every stretch at once. With tau from -1
to 1 over the stretch, and numbers d_1 to d_P in [-1, 1] that stand for what is not known (none in a
plan as it is; `certificate.tolerances` has some):

    |g(0, d) - (centre + spread . d)| <= error
    |g(tau, d) - (centre + time tau + spread . d)| <= rest

Arithmetic keeps both true: what is linear in tau and d is carried on, so that errors of one cause
that cancel do cancel, and all else is bounded (Stolfi, de Figueiredo: Self-validated numerical
methods and applications, 1997, chapter 4; of elementary functions by Taylor's theorem to the second
order, Moore, Kearfott, Cloud: Introduction to Interval Analysis, 2009, chapter 6). So an
enclosure's excess falls with the square of the stretch and of the spread. Every operation adds what
its own rounding can do, `UNIT` times its terms.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np

from drake_quad.common import FloatArray

UNIT = 2.0**-50  # eight rounding errors of a double: libm's sine and its like are good to one
_GROW = 1.0 + 2.0**-44  # covers the rounding of the bounds' own arithmetic

Number = float | FloatArray


@dataclass(frozen=True, eq=False)
class Enclosure:
    """Functions on stretches of time; all arrays broadcast against one another.

    Attributes:
        centre: About g in the middle of each stretch, with all of d at 0.
        time: What tau multiplies.
        spread: What the numbers d multiply (..., P).
        error: How far g may be off `centre` and `spread` in the middle.
        rest: How far it may be off `centre`, `time` and `spread` in the stretch; inf or nan where
            nothing is known.
    """

    centre: FloatArray
    time: FloatArray
    spread: FloatArray
    error: FloatArray
    rest: FloatArray

    __array_ufunc__ = None  # so that `array * enclosure` asks us, not numpy, element by element

    @cached_property
    def _spreads(self) -> FloatArray:
        """How far all of d take g, at most."""
        return np.asarray(np.abs(self.spread).sum(axis=-1))

    @cached_property
    def here(self) -> FloatArray:
        """How far g may be from `centre` in the middle of the stretch."""
        return np.asarray((self._spreads + self.error) * _GROW)

    @cached_property
    def radius(self) -> FloatArray:
        """How far g may be from `centre` in the stretch."""
        return np.asarray((np.abs(self.time) + self._spreads + self.rest) * _GROW)

    @property
    def lower(self) -> FloatArray:
        """Below g everywhere in the stretch."""
        return np.asarray(self.centre - self.radius - UNIT * np.abs(self.centre))

    @property
    def upper(self) -> FloatArray:
        """Above g everywhere in the stretch."""
        return np.asarray(self.centre + self.radius + UNIT * np.abs(self.centre))

    @property
    def lower_here(self) -> FloatArray:
        """Below g in the middle of the stretch."""
        return np.asarray(self.centre - self.here)

    @property
    def upper_here(self) -> FloatArray:
        """Above g in the middle of the stretch."""
        return np.asarray(self.centre + self.here)

    def __neg__(self) -> "Enclosure":
        return Enclosure(-self.centre, -self.time, -self.spread, self.error, self.rest)

    def __add__(self, other: "Enclosure | Number") -> "Enclosure":
        if not isinstance(other, Enclosure):
            centre = self.centre + other
            pad = UNIT * np.abs(centre)
            return Enclosure(centre, self.time, self.spread, self.error + pad, self.rest + pad)
        return _rounded(
            self.centre + other.centre,
            self.time + other.time,
            self.spread + other.spread,
            self.error + other.error,
            self.rest + other.rest,
        )

    __radd__ = __add__

    def __sub__(self, other: "Enclosure | Number") -> "Enclosure":
        return self + (-other)

    def __rsub__(self, other: Number) -> "Enclosure":
        return (-self) + other

    def __mul__(self, other: "Enclosure | Number") -> "Enclosure":
        if not isinstance(other, Enclosure):
            size = np.abs(other)
            return _rounded(
                self.centre * other,
                self.time * other,
                self.spread * np.asarray(other)[..., None],
                self.error * size,
                self.rest * size,
            )
        a, b = self, other
        A, B = np.abs(a.centre), np.abs(b.centre)
        return _rounded(
            a.centre * b.centre,
            a.centre * b.time + b.centre * a.time,
            a.centre[..., None] * b.spread + b.centre[..., None] * a.spread,
            A * b.error + a.error * B + a.here * b.here,
            A * b.rest + a.rest * B + a.radius * b.radius,
            sizes=A * B + A * b.radius + a.radius * B,
        )

    __rmul__ = __mul__

    def sum(self, axis: int, own: int = 0) -> "Enclosure":
        """The sum along an axis, which is kept with length 1.

        Args:
            axis: The axis.
            own: So many of the numbers d, the last ones, are others for each term.
        """

        def total(values: FloatArray) -> FloatArray:
            return np.asarray(np.sum(values, axis=axis, keepdims=True))

        spread, shared = total(self.spread), max(self.spread.shape[-1] - own, 0)
        spread[..., shared:] = 0.0
        alone = total(np.abs(self.spread[..., shared:]).sum(axis=-1))
        return _rounded(
            total(self.centre),
            total(self.time),
            spread,
            total(self.error) + alone,
            total(self.rest) + alone,
            sizes=total(np.abs(self.centre) + self.radius),
        )

    def sin(self) -> "Enclosure":
        """The sine."""
        s, c = np.sin(self.centre), np.cos(self.centre)
        return self._through(s, c, lambda away: np.minimum(np.abs(s) + away, 1.0))

    def cos(self) -> "Enclosure":
        """The cosine."""
        s, c = np.sin(self.centre), np.cos(self.centre)
        return self._through(c, -s, lambda away: np.minimum(np.abs(c) + away, 1.0))

    def sqrt(self) -> "Enclosure":
        """The square root; nothing is known of it where the argument may be 0 or less."""
        root = np.sqrt(np.maximum(self.centre, 0.0))
        return self._through(
            root, 0.5 / root, lambda away: 0.25 * _positive(self.centre - away) ** -1.5
        )

    def reciprocal(self) -> "Enclosure":
        """1/g; nothing is known of it where g may be 0."""
        inverse, size = 1.0 / self.centre, np.abs(self.centre)
        return self._through(
            inverse, -(inverse**2), lambda away: 2.0 * _positive(size - away) ** -3
        )

    def arccos(self) -> "Enclosure":
        """The arc cosine; nothing is known of it where the argument may leave (-1, 1)."""
        here = np.maximum((1.0 - self.centre) * (1.0 + self.centre), 0.0)
        angle = np.arccos(np.clip(self.centre, -1.0, 1.0))

        def bend(away: FloatArray) -> FloatArray:
            high = np.abs(self.centre) + away
            return np.asarray(high * _positive((1.0 - high) * (1.0 + high)) ** -1.5)

        return self._through(angle, -1.0 / np.sqrt(here), bend)

    def _through(
        self, value: FloatArray, slope: FloatArray, bend: Callable[[FloatArray], FloatArray]
    ) -> "Enclosure":
        """f(g), by f and f' at the centre, and a bound of |f''| so far away from it."""
        steep = np.abs(slope)
        return _rounded(
            value,
            slope * self.time,
            slope[..., None] * self.spread,
            steep * self.error + 0.5 * bend(self.here) * self.here**2,
            steep * self.rest + 0.5 * bend(self.radius) * self.radius**2,
        )


def widen(g: Enclosure, away: FloatArray) -> Enclosure:
    """Of a function that is g in the middle, and off it by `away` at most elsewhere."""
    return Enclosure(g.centre, g.time, g.spread, g.error, (g.rest + away) * _GROW)


def blur(g: Enclosure, off: Number) -> Enclosure:
    """Of a function that is off g by `off` at most."""
    return Enclosure(g.centre, g.time, g.spread, (g.error + off) * _GROW, (g.rest + off) * _GROW)


def vary(g: Enclosure, off: Number, k: int, count: int) -> Enclosure:
    """Of g + off d_k, where g depends on none of the `count` numbers d."""
    spread = np.zeros((*g.centre.shape, count))
    if count > 0:
        spread[..., k] = off
    return Enclosure(g.centre, g.time, spread, g.error, g.rest)


def constant(value: Number, like: Enclosure) -> Enclosure:
    """A constant, with arrays of the shapes that another enclosure has."""
    none = np.zeros_like(like.centre)
    return Enclosure(none + value, none, np.zeros_like(like.spread), none, none)


def angle_of(y: Enclosure, x: Enclosure) -> Enclosure:
    """The angle of (x, y) from the x axis; nothing is known where that may be the origin.

    Its own branch is that of the centre: continuous over the stretch, also beyond ±pi.
    """
    square = x.centre**2 + y.centre**2
    by_x, by_y = -y.centre / square, x.centre / square
    # The second derivatives of an angle are no greater than one over the squared distance.
    distance = np.sqrt(square) * (1.0 - 2.0**-44)

    def beyond(dx: FloatArray, dy: FloatArray) -> FloatArray:
        return np.asarray(0.5 * (dx**2 + dy**2) * _positive(distance - np.hypot(dx, dy)) ** -2.0)

    X, Y = np.abs(by_x), np.abs(by_y)
    return _rounded(
        np.arctan2(y.centre, x.centre),
        by_x * x.time + by_y * y.time,
        by_x[..., None] * x.spread + by_y[..., None] * y.spread,
        X * x.error + Y * y.error + beyond(x.here, y.here),
        X * x.rest + Y * y.rest + beyond(x.radius, y.radius),
        sizes=np.pi + X * x.radius + Y * y.radius,
    )


def _positive(values: FloatArray) -> FloatArray:
    """The values, nan where they are not positive."""
    return np.where(values > 0.0, values, np.nan)


def _rounded(
    centre: FloatArray,
    time: FloatArray,
    spread: FloatArray,
    error: FloatArray,
    rest: FloatArray,
    *,
    sizes: FloatArray | None = None,
) -> Enclosure:
    """An enclosure with its rounding added: `sizes` is the sum of the terms that were added up."""
    if sizes is None:
        sizes = np.abs(centre) + np.abs(time) + np.abs(spread).sum(axis=-1)
    pad = UNIT * sizes
    return Enclosure(centre, time, spread, (error + pad) * _GROW, (rest + pad) * _GROW)


def compose(powers: FloatArray, at: FloatArray | float, scale: FloatArray | float) -> FloatArray:
    """Coefficients (..., n) of p(at + scale w) in w, of those (..., n) of p; by Horner's rule.

    `at` and `scale` broadcast against the leading axes of `powers`.
    """
    result = np.array(
        np.broadcast_to(powers, np.broadcast_shapes(powers.shape, (*np.shape(at), 1)))
    )
    n = powers.shape[-1]
    for k in range(n - 1):
        for j in range(n - 2, k - 1, -1):
            result[..., j] += at * result[..., j + 1]
    return np.asarray(result * np.asarray(scale)[..., None] ** np.arange(n))


def bernstein(degree: int) -> FloatArray:
    """What makes coefficients of powers of tau on [-1, 1] into Bernstein ones (n, n)."""
    n = degree + 1
    to_unit = np.zeros((n, n))  # tau = 2 w - 1
    for k in range(n):
        for j in range(k + 1):
            to_unit[j, k] = comb(k, j) * 2.0**j * (-1.0) ** (k - j)
    to_bernstein = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            to_bernstein[i, j] = comb(i, j) / comb(degree, j)
    return np.asarray(to_bernstein @ to_unit)
