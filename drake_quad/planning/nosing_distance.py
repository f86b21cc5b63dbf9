"""Signed distance of lines between points from nosings, compiled.

The distance of points alone does not see a nosing between two of them.
"""

from math import sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray

FAR = 1.0  # [m]: lines that are farther from any nosing are as good as there


@compiled
def from_nosing(
    s0: float, z0: float, s1: float, z1: float, edge: float, low: float, high: float, far: float
) -> float:
    """Signed distance of a line from the nosing between two treads [m].

    Negative where the line goes through what is below the nosing, though neither of its ends does.

    Args:
        s0: Where the line begins, along the stairs [m].
        z0: How high [m].
        s1: Where it ends [m].
        z1: How high [m].
        edge: Where the nosing is [m].
        low: Height of the tread before it [m].
        high: Of the tread after it [m].
        far: A distance beyond which any is as good [m]: that is told of lines farther off.
    """
    top = max(low, high)
    if low == high or min(s0, s1) - edge > far or edge - max(s0, s1) > far:
        return far
    ds, dz = s1 - s0, z1 - z0
    square = ds * ds + dz * dz
    t = ((edge - s0) * ds + (top - z0) * dz) / square if square > 0.0 else 0.0
    t = min(max(t, 0.0), 1.0)
    away_s, away_z = s0 + t * ds - edge, z0 + t * dz - top
    distance = sqrt(away_s * away_s + away_z * away_z)
    if (s0 - edge) * (s1 - edge) < 0.0 and z0 + (edge - s0) / ds * dz < top:
        distance = -distance
    return min(distance, far)


@compiled
def nosing_distance(
    s: FloatArray, z: FloatArray, ends: FloatArray, heights: FloatArray
) -> FloatArray:
    """The least of every line's from all nosings of a profile (N, M - 1) [m].

    Args:
        s: Where the M points are that each of N rows of lines joins, along the profile (N, M) [m].
        z: How high (N, M) [m].
        ends: Where the profile's level stretches begin and end (n + 1,) [m].
        heights: Of the stretches (n,) [m].
    """
    found = np.full((s.shape[0], s.shape[1] - 1), FAR)
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            for k in range(len(heights) - 1):
                here = from_nosing(
                    s[i, j], z[i, j], s[i, j + 1], z[i, j + 1], ends[k + 1], heights[k],
                    heights[k + 1], FAR,
                )  # fmt: skip
                found[i, j] = min(found[i, j], here)
    return found
