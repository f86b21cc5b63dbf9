"""Enclosures: whatever is computed of functions of time is true at every time."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.certificate.enclosure import Enclosure, angle_of, bernstein, compose
from drake_quad.common import FloatArray

SAMPLES = np.linspace(-1.0, 1.0, 401)
COEFFICIENT = st.floats(-1.0, 1.0)
CUBIC = st.lists(COEFFICIENT, min_size=4, max_size=4)
HALF = st.sampled_from([1e-4, 0.01, 0.1, 0.5])


def enclosed(cubic: FloatArray, half: float, *, at: float = 0.0) -> tuple[Enclosure, FloatArray]:
    """A cubic in t on [-half, half] as an enclosure, and its values at SAMPLES of it."""
    powers = np.asarray(cubic) * half ** np.arange(4)
    powers[0] += at
    size = np.abs(powers)
    rates = np.array([powers[1], size[2] * 2 + size[3] * 3]) / half
    tiny = 1e-15 * (1.0 + size.sum())
    columns = (powers[0], tiny, size[1:].sum() + tiny, rates[0], rates[1] + tiny / half, half)
    values = powers @ SAMPLES ** np.arange(4)[:, None]
    return Enclosure(*(np.array([[c]]) for c in columns)), values


def holds(found: Enclosure, values: FloatArray) -> None:
    """The values lie in the enclosure, and their chords' slopes in that of the rate."""
    assert np.all(values >= found.lower[0, 0]) and np.all(values <= found.upper[0, 0])
    half = found.half[0, 0]
    slopes = np.diff(values) / (np.diff(SAMPLES) * half)
    rounding = 1e-13 * (1.0 + np.abs(values).max()) / (half * 5e-3)
    off = np.abs(slopes - found.rate[0, 0])
    assert np.all(off <= found.rate_radius[0, 0] + rounding)


FUNCTIONS: list[tuple[Callable[[Enclosure], Enclosure], Callable[[FloatArray], FloatArray], float]]
FUNCTIONS = [
    (lambda g: g.sin(), np.sin, 0.3),
    (lambda g: g.cos(), np.cos, 0.3),
    (lambda g: g.sqrt(), np.sqrt, 4.5),
    (lambda g: g.reciprocal(), lambda v: 1.0 / v, -5.0),
    (lambda g: (g * 0.2).arccos(), lambda v: np.arccos(0.2 * v), 0.2),
    (lambda g: 2.0 - g * g, lambda v: 2.0 - v * v, 0.0),
]


@pytest.mark.parametrize("case", range(len(FUNCTIONS)))
@given(cubic=CUBIC, half=HALF)
@settings(max_examples=40, deadline=None)
def test_a_function_is_where_its_enclosure_says(case: int, cubic: list[float], half: float) -> None:
    """Of a cubic's sine, root and so on: values and rates, at every sample."""
    function, exact, at = FUNCTIONS[case]
    g, values = enclosed(np.array(cubic), half, at=at)
    holds(function(g), exact(values))


@given(one=CUBIC, other=CUBIC, half=HALF)
@settings(max_examples=60, deadline=None)
def test_sums_products_and_angles_are_where_they_say(
    one: list[float], other: list[float], half: float
) -> None:
    """Of two cubics at once."""
    (a, u), (b, v) = enclosed(np.array(one), half), enclosed(np.array(other), half, at=4.5)
    holds(a + b, u + v)
    holds(b - a, v - u)
    holds(a * b, u * v)
    with np.errstate(invalid="ignore"):  # its caller's business
        holds(angle_of(a, b), np.arctan2(u, v))
    stacked = {k: np.hstack([getattr(a, k), getattr(b, k)]) for k in vars(a) if k != "half"}
    both = Enclosure(**stacked, half=a.half)
    holds(both.sum(axis=1), u + v)


def test_excess_falls_with_the_square_of_the_stretch() -> None:
    """Ten times shorter, a hundred times nearer to the range itself."""
    excess = []
    for half in (0.1, 0.01):
        g, values = enclosed(np.array([0.2, 0.7, -0.5, 0.3]), half)
        found = g.sin() * g.cos()
        excess.append(values_range(np.sin(values) * np.cos(values), found))
    assert excess[1] < 0.015 * excess[0]


def values_range(values: FloatArray, found: Enclosure) -> float:
    """By how much an enclosure is wider than the values."""
    return float(found.upper[0, 0] - values.max() + values.min() - found.lower[0, 0])


def test_where_nothing_is_known_nothing_is_said() -> None:
    """A root of what may be negative, a quotient by what may be 0: bounds that prove nothing."""
    g, _ = enclosed(np.array([0.0, 1.0, 0.0, 0.0]), 0.5)
    with np.errstate(all="ignore"):
        for found in (g.sqrt(), g.reciprocal(), (g * 3.0).arccos(), angle_of(g, g)):
            assert not found.lower[0, 0] > -1e6


@given(powers=st.lists(COEFFICIENT, min_size=6, max_size=6), at=st.floats(0.0, 1.0))
@settings(max_examples=60, deadline=None)
def test_bernstein_coefficients_hold_a_polynomial(powers: list[float], at: float) -> None:
    """Its least and its greatest are outside of no value; and moving the origin changes none."""
    p = np.array(powers)
    values = np.polynomial.polynomial.polyval(SAMPLES, p)
    found = bernstein(5) @ p
    assert found.min() <= values.min() + 1e-12 and found.max() >= values.max() - 1e-12
    moved = compose(p, at, 0.5)
    again = np.polynomial.polynomial.polyval(SAMPLES, moved)
    assert np.allclose(again, np.polynomial.polynomial.polyval(at + 0.5 * SAMPLES, p), atol=1e-12)
