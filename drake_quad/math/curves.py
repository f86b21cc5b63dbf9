"""Smooth curves: the rest-to-rest quintic (equations (1) to (3)) and uniform cubic B-splines.

The functions of the quintic take a phase s in [0, 1], a number or an array.
"""

from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from drake_quad.common import FloatArray, read_only
from drake_quad.jit import jit

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


# The same three for kernels, which take a number.
quintic_kernel, quintic_rate_kernel = jit(quintic), jit(quintic_rate)
quintic_acceleration_kernel = jit(quintic_acceleration)


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


# Rows: position, velocity, acceleration; columns: powers of u; then control points.
_BASIS = np.array(
    [[1.0, 4.0, 1.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]]
) / 6.0  # fmt: skip

WHOLE = 1e-9  # [knots] by which a duration may be off a whole number of them: rounding


def weights(u: FloatArray, knot: float) -> FloatArray:
    """Weights of the four control points at local time `u` (N,) in [0, 1].

    Returns:
        (N, 3, 4): for the value, its first and its second time derivative, at knot spacing
        `knot` [s].
    """
    one, zero = np.ones_like(u), np.zeros_like(u)
    powers = np.stack(
        [
            np.stack([one, u, u**2, u**3], axis=-1),
            np.stack([zero, one, 2 * u, 3 * u**2], axis=-1) / knot,
            np.stack([zero, zero, 2 * one, 6 * u], axis=-1) / knot**2,
        ],
        axis=-2,
    )
    return np.asarray(powers @ _BASIS)


def knot_spacing(duration: float, most: float) -> float:
    """The spacing of knots of which a whole number makes the duration, at most `most` [s].

    A path is at rest at its end if its last three control points are one, and its end is a knot.
    """
    spans = duration / most
    whole = max(round(spans), 1)
    if abs(spans - whole) <= WHOLE:
        return most
    return float(duration / np.ceil(spans))


def knot_count(duration: float, knot: float) -> int:
    """How many control points a spline over `duration` [s] has."""
    return int(np.ceil(duration / knot - WHOLE)) + 3


def greville(duration: float, knot: float) -> FloatArray:
    """The times at which each control point weighs most, clipped to the path, (n,) [s]."""
    times = (np.arange(knot_count(duration, knot)) - 1) * knot
    return np.asarray(np.clip(times, 0.0, duration))


def join_weights(duration: float, knot: float, joined: float) -> FloatArray:
    """Weights (n,) from 1 to 0 by which an offset at a path's start fades over its control points.

    An offset with these weights keeps the path at rest at both ends and continuous to the
    acceleration.

    Args:
        duration: Duration of the path [s].
        knot: Knot spacing [s].
        joined: Time from which on the weights are 0 [s].
    """
    # The first three control points are the start, at rest, and the last three the end.
    late = (greville(duration, knot) - knot) / max(joined - 4.0 * knot, knot)
    left = 1.0 - quintic(np.clip(late, 0.0, 1.0))
    left[-3:] = 0.0
    return np.asarray(left)


@dataclass(frozen=True, eq=False)
class BodySpline:
    """x, y, z, pitch, yaw of the body in W over time, at rest at both ends.

    Attributes:
        knot: Knot spacing [s].
        control: (n, 5) control points [m, m, m, rad, rad].
    """

    knot: float
    control: FloatArray
    _segments: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "control", read_only(self.control))
        object.__setattr__(self, "_segments", len(self.control) - 3)

    def sample(self, t: float) -> FloatArray:
        """Returns (3, 5): value, velocity, acceleration at `t` [s]; at rest outside the path."""
        r = t / self.knot
        i = min(max(int(r), 0), self._segments - 1)
        u = min(max(r - i, 0.0), 1.0)
        h = 1.0 / self.knot
        w = np.array([[1.0, u, u * u, u**3], [0.0, h, 2 * u * h, 3 * u * u * h],
                      [0.0, 0.0, 2 * h * h, 6 * u * h * h]]) @ _BASIS  # fmt: skip
        return np.asarray(w @ self.control[i : i + 4])

    def samples(self, times: FloatArray) -> FloatArray:
        """Returns `sample` at many times (N,), (N, 3, 5)."""
        r = np.asarray(times, dtype=float) / self.knot
        i = np.clip(r.astype(int), 0, self._segments - 1)
        w = weights(np.clip(r - i, 0.0, 1.0), self.knot)
        return np.asarray(w @ self.control[i[:, None] + np.arange(4)])


@jit
def sample_body(control: FloatArray, knot: float, t: float) -> FloatArray:
    """A `BodySpline` at time `t` [s]: (3, 5) value, velocity, acceleration; at rest outside.

    Args:
        control: Control points (n, 5).
        knot: Knot spacing [s].
        t: Gait time [s].
    """
    r, h = t / knot, 1.0 / knot
    i = min(max(int(r), 0), len(control) - 4)
    u = min(max(r - i, 0.0), 1.0)
    motion = np.empty((3, 5))
    for j in range(5):
        p0, p1, p2, p3 = control[i, j], control[i + 1, j], control[i + 2, j], control[i + 3, j]
        # By powers of u: the uniform cubic B-spline's basis.
        a, b = (p0 + 4.0 * p1 + p2) / 6.0, (p2 - p0) / 2.0
        c, d = (p0 - 2.0 * p1 + p2) / 2.0, (p3 - p0 + 3.0 * (p1 - p2)) / 6.0
        motion[0, j] = a + u * (b + u * (c + u * d))
        motion[1, j] = h * (b + u * (2.0 * c + 3.0 * d * u))
        motion[2, j] = h * h * (2.0 * c + 6.0 * d * u)
    return motion


def most_beside(values: FloatArray, beside: int) -> FloatArray:
    """The greatest of each value and so many to either side of it, (N,)."""
    # Numpy's, for to import scipy.ndimage takes each command a quarter of a second.
    padded = np.pad(values, beside, constant_values=-np.inf)
    return np.asarray(sliding_window_view(padded, 2 * beside + 1).max(axis=-1))
