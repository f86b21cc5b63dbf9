"""Laws of the rest-to-rest quintic."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drake_quad.math.curves import quintic, quintic_acceleration, quintic_inverse, quintic_rate

phases = st.floats(0.0, 1.0)


def test_is_equation_one() -> None:
    """It is 6 s^5 - 15 s^4 + 10 s^3, and its derivatives are that polynomial's."""
    polynomial = np.polynomial.Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
    s = np.linspace(0.0, 1.0, 101)
    assert quintic(s) == pytest.approx(polynomial(s))
    assert quintic_rate(s) == pytest.approx(polynomial.deriv()(s), abs=1e-12)
    assert quintic_acceleration(s) == pytest.approx(polynomial.deriv(2)(s), abs=1e-12)


def test_begins_and_ends_at_rest() -> None:
    """From 0 to 1, without velocity or acceleration at either end."""
    for s, value in ((0.0, 0.0), (1.0, 1.0)):
        assert (quintic(s), quintic_rate(s), quintic_acceleration(s)) == (value, 0.0, 0.0)


@given(phases)
def test_is_point_symmetric(s: float) -> None:
    """Run backwards it is the same motion."""
    assert quintic(1.0 - s) == pytest.approx(1.0 - quintic(s), abs=1e-14)


@given(phases)
def test_inverse_undoes_it(fraction: float) -> None:
    """Equation (2): the phase at which a fraction of the way is covered."""
    s = quintic_inverse(fraction)
    assert 0.0 <= s <= 1.0
    assert quintic(s) == pytest.approx(fraction, abs=1e-14)


@given(phases, phases)
def test_inverse_is_increasing(a: float, b: float) -> None:
    """A foot never goes back on its way."""
    low, high = sorted((a, b))
    assert quintic_inverse(low) <= quintic_inverse(high) + 1e-12


@pytest.mark.parametrize("fraction", [-0.01, 1.01, float("nan")])
def test_inverse_refuses_places_that_are_not_on_the_way(fraction: float) -> None:
    """Only fractions in [0, 1] are passed."""
    with pytest.raises(ValueError, match="fraction"):
        quintic_inverse(fraction)
