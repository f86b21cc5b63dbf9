"""Compiled kernels are the Python that is read: same results, to the bit each time."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drake_quad.common import FloatArray
from drake_quad.control.base_tracking import smooth_step
from drake_quad.jit import jit

SMALL = st.floats(-1e3, 1e3)


@jit
def dot(a: FloatArray, b: FloatArray) -> float:
    """A sum whose order matters to the last bit."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@jit
def ratio(a: float, b: float) -> float:
    """A quotient."""
    return a / b


@given(st.lists(st.tuples(SMALL, SMALL), min_size=1, max_size=50))
def test_sums_are_added_up_in_their_order(pairs: list[tuple[float, float]]) -> None:
    """No fast-math: a compiled sum is the interpreter's own, to the bit."""
    a, b = np.array(pairs).T.copy()
    total = 0.0
    for x, y in zip(a.tolist(), b.tolist(), strict=True):
        total += x * y
    assert dot(a, b) == total


def test_no_numbers_are_seen() -> None:
    """A nan stays one, and is not assumed away."""
    assert np.isnan(dot(np.array([1.0, np.nan]), np.ones(2)))


@pytest.mark.parametrize(("a", "expected"), [(1.0, np.inf), (-1.0, -np.inf)])
def test_division_by_zero_is_numpys(a: float, expected: float) -> None:
    """A kernel in the loop gives an infinity, and raises nothing."""
    assert ratio(a, 0.0) == expected
    assert np.isnan(ratio(0.0, 0.0))


def test_name_and_docstring_are_kept() -> None:
    """What is compiled can still be read about."""
    assert dot.__name__ == "dot"
    assert dot.__doc__ == "A sum whose order matters to the last bit."


@given(st.floats(-2.0, 3.0))
def test_kernels_of_the_package_agree_with_plain_python(x: float) -> None:
    """One that exists in both forms."""
    assert smooth_step(x) == smooth_step.py_func(x)  # type: ignore[attr-defined]
