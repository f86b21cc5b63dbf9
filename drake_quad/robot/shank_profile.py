"""Shanks as chains of rounded rods, from the rods and boxes that their shapes are."""

from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np

from drake_quad.common import FloatArray, read_only
from drake_quad.robot.model import SHANK_POINTS, ShankProfile

THIN = 0.04  # of its length: radius of a shank where it has no geometry, but for its end
PLACES = np.linspace(0.0, SHANK_POINTS[-1], 32)  # places of a profile, before some are left out
EASED = 0.0002  # [m] that a profile is thicker for fewer places, and at most twice that
ALONG, AROUND = 60, 64  # points along a rod that are looked at, and around it


def box_edges(half: FloatArray) -> FloatArray:
    """The edges of a box of half sizes (3,), by their ends (12, 2, 3) [m]."""
    corners = np.array(list(product((-1.0, 1.0), repeat=3)))
    apart = np.abs(corners[:, None] - corners).sum(axis=-1)
    pairs = np.argwhere(np.triu(apart == 2.0))
    return np.asarray(corners[pairs] * half)


def profile_of_rods(
    rods: Sequence[tuple[FloatArray, float]], length: float, ball: float
) -> FloatArray:
    """How far rods of a shank reach back and ahead of its middle line (2, 32) [m].

    At PLACES, and so far to both sides of each as the next one is.

    Args:
        rods: Points along the middle of each (n, 3) in the shank's frame, and its radius [m]; the
            ends alone of one without a radius.
        length: Length of the shank [m].
        ball: Radius of what the thigh has about the knee [m]; not positive: nothing.
    """
    step, thin = length * PLACES[1], THIN * length
    low, high = length * PLACES - step, length * PLACES + step
    low[0] = -np.inf
    found = np.repeat([[np.inf], [-np.inf]], len(PLACES), axis=1)
    for line, radius in rods:
        along, ahead = -line[:, 2], line[:, 0]
        if radius > 0.0:
            off = np.maximum(np.maximum(low[:, None] - along, along - high[:, None]), 0.0)
            half = np.where(off <= radius, np.sqrt(np.maximum(radius**2 - off**2, 0.0)), -np.inf)
        else:
            ahead, half = _clip(along, ahead, low, high)
        found[0] = np.minimum(found[0], (ahead - half).min(axis=1))
        found[1] = np.maximum(found[1], (ahead + half).max(axis=1))
    bare = np.isinf(found[0])  # by its end there is a foot, at least
    found[:, bare] = np.array([[-thin], [thin]]) * (np.flatnonzero(bare) < len(PLACES) - 1)
    ball = max(ball, 0.0)
    found[:, 0] = min(found[0, 0], -ball), max(found[1, 0], ball)
    middle = 0.5 * (found[0, 0] + found[1, 0])
    above = _reach_above(rods, middle)  # the cap of the first rod is to hold that, too
    found[:, 0] = min(found[0, 0], middle - above), max(found[1, 0], middle + above)
    return found


def _clip(
    along: FloatArray, ahead: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What of a line (2,) is between bounds (n,): its ends (n, 2), and 0, or -inf for nothing."""
    way = along[1] - along[0]
    bounds = np.stack([low, high], axis=1)
    shares = np.clip((bounds - along[0]) / way, 0.0, 1.0) if way else np.tile([0, 1], (len(low), 1))
    there = (high >= along.min()) & (low <= along.max())
    return ahead[0] + shares * (ahead[1] - ahead[0]), np.where(there, 0.0, -np.inf)[:, None]


def _reach_above(rods: Sequence[tuple[FloatArray, float]], ahead: float) -> float:
    """How far rods above a knee are from a point beside it, at most [m]; 0 if none is."""
    around = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    circle = np.stack([np.cos(around), np.sin(around)], axis=1) / np.cos(np.pi / AROUND)
    farthest = 0.0
    for line, radius in rods:
        points = np.stack([-line[:, 2], line[:, 0]], axis=1)[:, None] + radius * circle
        up = points[points[..., 0] < 0.0]
        farthest = max(farthest, np.linalg.norm(up - [0.0, ahead], axis=1).max(initial=0.0))
    return float(farthest)


def join_places(along: FloatArray, back: FloatArray, ahead: FloatArray) -> ShankProfile:
    """The profile of all shanks, without places that rods between others hold as well.

    Args:
        along: Places along the shanks (n,).
        back: Where their shapes begin there, along the shanks' own x (4, n) [m].
        ahead: Where they end there (4, n) [m].
    """
    middle, radius = 0.5 * (back + ahead), 0.5 * (ahead - back)

    def needed(i: int, j: int) -> FloatArray:
        """How thick the rod between two places has to be for each of those between (4, k) [m]."""
        share = (along[i : j + 1] - along[i]) / (along[j] - along[i])
        line = middle[:, i, None] + share * (middle[:, j] - middle[:, i])[:, None]
        return np.asarray(np.abs(middle[:, i : j + 1] - line) + radius[:, i : j + 1])

    def holds(i: int, j: int) -> bool:
        """Whether the rod between two places holds all that is between them, and hardly more."""
        here, thick = radius[:, i : j + 1], np.maximum(radius[:, i], radius[:, j])[:, None]
        return bool(np.all((needed(i, j) <= thick + EASED) & (thick <= here + 2.0 * EASED)))

    kept = [0]
    while kept[-1] < len(along) - 1:
        i = j = kept[-1]
        while j < len(along) - 1 and (j == i or holds(i, j + 1)):
            j += 1
        kept.append(j)
    radii = radius[:, kept]
    for k, (i, j) in enumerate(pairwise(kept)):  # by what the rod between them lacks, and no more
        ends = radius[:, [i, j]]
        lacks = np.maximum(needed(i, j).max(axis=1) - ends.max(axis=1), 0.0)
        radii[:, k : k + 2] = np.maximum(radii[:, k : k + 2], ends + lacks[:, None])
    return ShankProfile(read_only(along[kept]), read_only(middle[:, kept]), read_only(radii))
