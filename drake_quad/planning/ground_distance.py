"""Signed distance of many points from a profile of level stretches, compiled."""

from math import inf, sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray


@compiled
def ground_distance(
    s: FloatArray, z: FloatArray, ends: FloatArray, heights: FloatArray
) -> FloatArray:
    """Signed distance of points from the ground (N,) [m], negative inside it.

    Args:
        s: Where the points are along the profile (N,) [m].
        z: How high (N,) [m].
        ends: Where the stretches begin and end (n + 1,) [m], the outermost infinitely far away.
        heights: Of the stretches (n,) [m].
    """
    found = np.empty(len(s))
    for i in range(len(s)):
        best = inf
        for k in range(len(heights)):
            beside = max(ends[k] - s[i], s[i] - ends[k + 1])
            if beside > 0.0 and beside >= best:
                continue
            above = z[i] - heights[k]
            if beside <= 0.0:
                here = above if above > 0.0 else max(beside, above)
            else:
                here = beside if above <= 0.0 else sqrt(beside * beside + above * above)
            best = min(best, here)
        found[i] = best
    return found
