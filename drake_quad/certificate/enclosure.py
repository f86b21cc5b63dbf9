"""Rigorous mean-value enclosures of smooth functions, and Bernstein bounds of polynomials.

An `Enclosure` says of a function g on stretches [m - h, m + h] of time, for every stretch at once:

    |g(m) - centre| <= error            (what rounding may have done)
    |g(t) - centre| <= radius           for all t of the stretch
    |g'(t) - rate| <= rate_radius       for all t of the stretch

Arithmetic keeps all three true: a product's rate is enclosed by the product rule, and its radius
is the lesser of what the factors' radii give and of error + h (|rate| + rate_radius), the mean
value theorem. The latter makes an enclosure's excess fall with the square of h (Moore, Kearfott,
Cloud: Introduction to Interval Analysis, 2009, chapter 6; midpoint-radius form: Rump, 1999). Every
operation adds what its own rounding can do, `UNIT` times its terms.
"""

from dataclasses import dataclass
from math import comb

import numpy as np

from drake_quad.common import FloatArray

UNIT = 2.0**-50  # eight rounding errors of a double: libm's sine and its like are good to one
_GROW = 1.0 + 2.0**-44  # covers the rounding of the radii's own arithmetic

Number = float | FloatArray


@dataclass(frozen=True, eq=False)
class Enclosure:
    """Functions of time on stretches of it; all arrays broadcast against `half`.

    Attributes:
        centre: Approximation of g in the middle of each stretch.
        error: Bound of its error.
        radius: How far g may be from `centre` in the stretch; inf or nan where nothing is known.
        rate: About g' there [1/s].
        rate_radius: How far g' may be from `rate` in the stretch.
        half: Half the length of each stretch [s].
    """

    centre: FloatArray
    error: FloatArray
    radius: FloatArray
    rate: FloatArray
    rate_radius: FloatArray
    half: FloatArray

    __array_ufunc__ = None  # so that `array * enclosure` asks us, not numpy, element by element

    @property
    def lower(self) -> FloatArray:
        """Below g everywhere in the stretch."""
        return np.asarray(self.centre - self.radius * _GROW - UNIT * np.abs(self.centre))

    @property
    def upper(self) -> FloatArray:
        """Above g everywhere in the stretch."""
        return np.asarray(self.centre + self.radius * _GROW + UNIT * np.abs(self.centre))

    def __neg__(self) -> "Enclosure":
        return Enclosure(
            -self.centre, self.error, self.radius, -self.rate, self.rate_radius, self.half
        )

    def __add__(self, other: "Enclosure | Number") -> "Enclosure":
        if not isinstance(other, Enclosure):
            centre = self.centre + other
            pad = UNIT * np.abs(centre)
            return Enclosure(
                centre, self.error + pad, self.radius + pad, self.rate, self.rate_radius, self.half
            )
        return _meet(
            self.centre + other.centre,
            self.error + other.error,
            self.radius + other.radius,
            self.rate + other.rate,
            self.rate_radius + other.rate_radius,
            self.half,
        )

    __radd__ = __add__

    def __sub__(self, other: "Enclosure | Number") -> "Enclosure":
        return self + (-other)

    def __rsub__(self, other: Number) -> "Enclosure":
        return (-self) + other

    def __mul__(self, other: "Enclosure | Number") -> "Enclosure":
        if not isinstance(other, Enclosure):
            size = np.abs(other)
            centre, rate = self.centre * other, self.rate * other
            pad = UNIT * np.abs(centre)
            return Enclosure(
                centre,
                self.error * size + pad,
                self.radius * size + pad,
                rate,
                self.rate_radius * size + UNIT * np.abs(rate),
                self.half,
            )
        a, b = self, other
        A, B = np.abs(a.centre), np.abs(b.centre)
        speed_a, speed_b = np.abs(a.rate) + a.rate_radius, np.abs(b.rate) + b.rate_radius
        return _meet(
            a.centre * b.centre,
            A * b.error + a.error * B + a.error * b.error,
            A * b.radius + a.radius * B + a.radius * b.radius,
            a.centre * b.rate + b.centre * a.rate,
            A * b.rate_radius + a.radius * speed_b + B * a.rate_radius + b.radius * speed_a,
            a.half,
            terms=A * np.abs(b.rate) + B * np.abs(a.rate),
        )

    __rmul__ = __mul__

    @staticmethod
    def of_rate(g: "Enclosure") -> "Enclosure":
        """The rate g' as a number that is known to its radius alone, its own rate unknown."""
        unknown = np.full_like(g.rate, np.inf)
        return Enclosure(
            g.rate, g.rate_radius, g.rate_radius, np.zeros_like(g.rate), unknown, g.half
        )

    def sum(self, axis: int) -> "Enclosure":
        """The sum along an axis, which is kept with length 1; `half` has to be 1 long there."""

        def total(values: FloatArray) -> FloatArray:
            return np.asarray(np.sum(values, axis=axis, keepdims=True))

        return _meet(
            total(self.centre),
            total(self.error),
            total(self.radius),
            total(self.rate),
            total(self.rate_radius),
            self.half,
            sizes=total(np.abs(self.centre)),
            terms=total(np.abs(self.rate)),
        )

    def sin(self) -> "Enclosure":
        """The sine."""
        s, c = np.sin(self.centre), np.cos(self.centre)
        return self._through(s, c, 1.0, np.minimum(np.abs(s) + self.radius, 1.0))

    def cos(self) -> "Enclosure":
        """The cosine."""
        s, c = np.sin(self.centre), np.cos(self.centre)
        return self._through(c, -s, 1.0, np.minimum(np.abs(c) + self.radius, 1.0))

    def sqrt(self) -> "Enclosure":
        """The square root; nothing is known of it where the argument may be 0 or less."""
        low = _positive(self.centre - self.radius)
        root = np.sqrt(np.maximum(self.centre, 0.0))
        return self._through(root, 0.5 / root, 0.5 / np.sqrt(low), 0.25 * low**-1.5)

    def reciprocal(self) -> "Enclosure":
        """1/g; nothing is known of it where g may be 0."""
        low = _positive(np.abs(self.centre) - self.radius)
        inverse = 1.0 / self.centre
        return self._through(inverse, -(inverse**2), low**-2, 2.0 * low**-3)

    def arccos(self) -> "Enclosure":
        """The arc cosine; nothing is known of it where the argument may leave (-1, 1)."""
        high = np.abs(self.centre) + self.radius
        inside = _positive((1.0 - high) * (1.0 + high))
        here = np.maximum((1.0 - self.centre) * (1.0 + self.centre), 0.0)
        angle = np.arccos(np.clip(self.centre, -1.0, 1.0))
        return self._through(angle, -1.0 / np.sqrt(here), inside**-0.5, high * inside**-1.5)

    def _through(
        self, value: FloatArray, slope: FloatArray, steepest: Number, bend: Number
    ) -> "Enclosure":
        """f(g): f and f' at the centre, and bounds of |f'| and |f''| over the stretch's values."""
        speed = np.abs(self.rate) + self.rate_radius
        return _meet(
            value,
            steepest * self.error,
            steepest * self.radius,
            slope * self.rate,
            np.abs(slope) * self.rate_radius + bend * self.radius * speed,
            self.half,
        )


def widen(g: Enclosure, away: FloatArray, rate: FloatArray) -> Enclosure:
    """Of a function that is g in the middle, and off it by `away`, its rate by `rate`, at most."""
    return Enclosure(
        g.centre, g.error, (g.radius + away) * _GROW, g.rate, (g.rate_radius + rate) * _GROW, g.half
    )


def angle_of(y: Enclosure, x: Enclosure) -> Enclosure:
    """The angle of (x, y) from the x axis; nothing is known where that may be the origin.

    Its own branch is that of the centre: continuous over the stretch, also beyond ±pi.
    """
    distance = np.hypot(x.centre, y.centre)

    def turned(dx: FloatArray, dy: FloatArray) -> FloatArray:
        sine = np.hypot(dx, dy) / distance
        known = sine < 1.0
        return np.where(known, np.arcsin(np.where(known, sine, 0.0)), np.inf)

    with np.errstate(invalid="ignore"):  # 0 times what is unknown of the rates' own rates
        rate = x * Enclosure.of_rate(y) - y * Enclosure.of_rate(x)
        rate = rate * (x * x + y * y).reciprocal()
    return _meet(
        np.arctan2(y.centre, x.centre),
        turned(x.error, y.error),
        turned(x.radius, y.radius),
        rate.centre,
        rate.radius,
        x.half,
    )


def _positive(values: FloatArray) -> FloatArray:
    """The values, nan where they are not positive."""
    return np.where(values > 0.0, values, np.nan)


def _meet(
    centre: FloatArray,
    error: FloatArray,
    radius: FloatArray,
    rate: FloatArray,
    rate_radius: FloatArray,
    half: FloatArray,
    *,
    sizes: FloatArray | None = None,
    terms: FloatArray | None = None,
) -> Enclosure:
    """An enclosure with its rounding added, and its radius the lesser of the two that hold."""
    pad = UNIT * (np.abs(centre) if sizes is None else sizes)
    rate_radius = (rate_radius + UNIT * (np.abs(rate) if terms is None else terms)) * _GROW
    error = (error + pad) * _GROW
    by_mean_value = error + half * (np.abs(rate) + rate_radius)
    return Enclosure(
        centre, error, np.fmin(radius + pad, by_mean_value) * _GROW, rate, rate_radius, half
    )


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
