"""The rest-to-rest quintic that every smooth motion here is made of (equations (1) to (3)).

All functions take a phase s in [0, 1], a number or an array.
"""

from typing import TypeVar

from drake_quad.common import FloatArray

Phase = TypeVar("Phase", float, FloatArray)


def quintic(s: Phase) -> Phase:
    """Returns 10 s^3 - 15 s^4 + 6 s^5: from 0 to 1, at rest and unaccelerated at both ends."""
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


def quintic_rate(s: Phase) -> Phase:
    """Returns the first derivative of `quintic`, 30 s^2 (1 - s)^2."""
    return 30.0 * (s * (1.0 - s)) * (s * (1.0 - s))


def quintic_acceleration(s: Phase) -> Phase:
    """Returns the second derivative of `quintic`, 60 s (1 - s) (1 - 2 s)."""
    return 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)


def quintic_inverse(fraction: float) -> float:
    """Returns the s in [0, 1] at which `quintic(s)` is `fraction`: equation (2).

    Raises:
        ValueError: `fraction` is not in [0, 1].
    """
    if not 0.0 <= fraction <= 1.0:
        raise ValueError(f"fraction = {fraction}: a swing passes fractions in [0, 1] only")
    if fraction > 0.5:  # quintic(1 - s) = 1 - quintic(s), and below 1/2 nothing cancels
        return 1.0 - quintic_inverse(1.0 - fraction)
    s: float = (fraction / 10.0) ** (1.0 / 3.0)
    if s == 0.0:
        return 0.0
    for _ in range(20):  # Newton; quadratic from this start, which is off by a fifth at most
        step = (quintic(s) - fraction) / quintic_rate(s)
        s -= step
        if abs(step) <= 1e-16 * s:
            break
    return s
