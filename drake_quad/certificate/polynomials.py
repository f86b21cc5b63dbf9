"""Polynomials on stretches of time: as coefficients of powers, last axis, lowest first."""

from math import comb

import numpy as np

from drake_quad.gait.legs import FloatArray


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
