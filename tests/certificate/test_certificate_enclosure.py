"""Enclosures: whatever is computed of functions of time is true at every time."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.certificate.enclosure import Enclosure, angle_of, bernstein, blur, compose, vary
from drake_quad.common import FloatArray

SAMPLES = np.linspace(-1.0, 1.0, 401)
COEFFICIENT = st.floats(-1.0, 1.0)
CUBIC = st.lists(COEFFICIENT, min_size=4, max_size=4)
HALF = st.sampled_from([1e-4, 0.01, 0.1, 0.5])
KNOWN = 2  # how many numbers are not known
OFF = st.lists(st.sampled_from([0.0, 1e-4, 0.01, 0.1]), min_size=KNOWN, max_size=KNOWN)
CORNERS = np.array([[x, y] for x in (-1.0, 0.3, 1.0) for y in (-1.0, 0.0, 1.0)])


def enclosed(
    cubic: FloatArray, half: float, *, at: float = 0.0, off: list[float] | None = None
) -> tuple[Enclosure, FloatArray]:
    """A cubic in t on [-half, half], and what is not known of it, as an enclosure.

    Returns:
        The enclosure, and its values at SAMPLES of the stretch (401,), or with `off`, for CORNERS
        of what is not known, (9, 401).
    """
    powers = np.asarray(cubic) * half ** np.arange(4)
    powers[0] += at
    size = np.abs(powers)
    tiny = np.array([[1e-15 * (1.0 + size.sum())]])
    middle = np.array([[powers[0]]]), np.array([[powers[1]]])
    known = Enclosure(*middle, np.zeros((1, 1, 0)), tiny, size[2:].sum() + tiny)
    values = powers @ SAMPLES ** np.arange(4)[:, None]
    if off is None:
        return known, values
    both = vary(known, off[0], 0, KNOWN) + vary(0.0 * known, off[1], 1, KNOWN)
    return both, values + (CORNERS @ off)[:, None]


def holds(found: Enclosure, values: FloatArray) -> None:
    """The values lie in the enclosure; those in the middle in what it says of the middle."""
    assert np.all(values >= found.lower[0, 0]) and np.all(values <= found.upper[0, 0])
    middle = values[..., len(SAMPLES) // 2]
    rounding = 1e-13 * (1.0 + np.abs(middle).max())
    assert np.all(middle >= found.lower_here[0, 0] - rounding)
    assert np.all(middle <= found.upper_here[0, 0] + rounding)


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
@given(cubic=CUBIC, half=HALF, off=OFF)
@settings(max_examples=60, deadline=None)
def test_a_function_is_where_its_enclosure_says(
    case: int, cubic: list[float], half: float, off: list[float]
) -> None:
    """Of a cubic's sine, root and so on: at every sample, whatever is not known of it."""
    function, exact, at = FUNCTIONS[case]
    g, values = enclosed(np.array(cubic), half, at=at)
    holds(function(g), exact(values))
    g, values = enclosed(np.array(cubic), half, at=at, off=off)
    holds(function(g), exact(values))


@given(one=CUBIC, other=CUBIC, half=HALF, off=OFF, also=OFF)
@settings(max_examples=60, deadline=None)
def test_sums_products_and_angles_are_where_they_say(
    one: list[float], other: list[float], half: float, off: list[float], also: list[float]
) -> None:
    """Of two cubics at once, of which the same numbers are not known."""
    a, u = enclosed(np.array(one), half, off=off)
    b, v = enclosed(np.array(other), half, at=4.5, off=also)
    holds(a + b, u + v)
    holds(b - a, v - u)
    holds(a * b, u * v)
    with np.errstate(invalid="ignore"):  # its caller's business
        holds(angle_of(a, b), np.arctan2(u, v))
    both = Enclosure(**{k: np.concatenate([x, vars(b)[k]], axis=1) for k, x in fields_of(a)})
    holds(both.sum(axis=1), u + v)


def fields_of(g: Enclosure) -> list[tuple[str, FloatArray]]:
    """An enclosure's arrays by name."""
    return [(name, vars(g)[name]) for name in ("centre", "time", "spread", "error", "rest")]


def test_what_is_not_known_of_one_thing_cancels() -> None:
    """A number less itself is 0 whatever it is; the terms' own numbers of a sum do not cancel."""
    g, _ = enclosed(np.array([0.4, 0.0, 0.0, 0.0]), 0.1, off=[0.1, 0.2])
    assert (g - g).upper[0, 0] < 1e-12
    assert (blur(g, 0.1) - g).upper[0, 0] == pytest.approx(0.1)
    pair = Enclosure(**{k: np.concatenate([x, -x if k == "spread" else x], axis=1)
                        for k, x in fields_of(g)})  # fmt: skip
    assert pair.sum(axis=1).radius[0, 0] < 1e-12
    assert pair.sum(axis=1, own=1).radius[0, 0] == pytest.approx(0.4)
    assert pair.sum(axis=1, own=2).radius[0, 0] == pytest.approx(0.6)


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
