"""What counts as a number where people give one, and how a least length is told."""

from math import floor, isfinite
from numbers import Integral, Real


def is_finite_real(value: object) -> bool:
    """Whether it is a finite number; True and False are none."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return False
    try:
        return isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False


def is_integer(value: object) -> bool:
    """Whether it is a whole number; True and False are none."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def whole_millimetres(length: float) -> int:
    """A length [m] in millimetres, rounded down: what is kept at least is never told as more."""
    return floor(round(1e3 * length, 6))  # a rounding error takes no millimetre off
