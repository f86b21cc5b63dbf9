"""Room for a map that is not exact: the ground under a swing, as high as it may really be."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drake_quad.gait.legs import FloatArray

RAMP = 0.1  # [m] from the foot at the least, over which its own ground rises to the full error
# [m] The least rise of a foot's own ground towards where the nearest riser may be at the nearest:
# that place too then counts as a nosing, which the swing keeps its clearance from.
KEEN = 1e-6
_FLAT = 1e-12


class _Tread(NamedTuple):
    """A level stretch of a profile: where it may begin and end at the widest, and height [m]."""

    from_: float
    to: float
    z: float


def inflate_profile(
    d: FloatArray, z: FloatArray, *, place: float, height: float
) -> tuple[FloatArray, FloatArray]:
    """The ground under a swing with room for errors of the map.

    Every riser may be nearer to the foot, whichever side of it the foot is on, and every tread
    higher. The ground that the foot stands on at lift-off is known there, and so is that at
    touchdown, where the swing ends when the ground is felt: the error grows from there towards
    where the next riser may be. A riser moves at most half the way to a foothold.

    Args:
        d: Horizontal distance from the lift-off, (n,) [m], not decreasing from 0.
        z: Height of the ground, (n,) [m]: level treads, and risers as two points of equal d.
        place: By how much risers may be off [m].
        height: By how much treads may be higher [m].

    Returns:
        (d, z), at least as high everywhere; the very arrays given if there is no error, or no
        riser on the way.
    """
    if place <= 0.0 and height <= 0.0:
        return d, z
    treads = _treads(d, z, max(place, 0.0))
    if len(treads) < 2:
        return d, z
    length, rise = float(d[-1]), max(height, KEEN)
    first, last = treads[0], treads[-1]
    ramp_up = max(treads[1].from_, RAMP)
    ramp_down = max(length - treads[-2].to, RAMP)

    def top(tread: _Tread, at: float) -> float:
        if tread is first:
            return tread.z + rise * min(at / ramp_up, 1.0)
        if tread is last:
            return tread.z + rise * min((length - at) / ramp_down, 1.0)
        return tread.z + rise

    ends = {min(ramp_up, length), max(length - ramp_down, 0.0)}
    for tread in treads:
        ends |= {tread.from_, tread.to}
    points: list[tuple[float, float]] = []
    for a, b in pairwise(sorted(ends)):
        over = [t for t in treads if t.from_ <= a and b <= t.to]
        # Between two ends the highest of straight lines is never above the line between its ends.
        points += [(a, max(top(t, a) for t in over)), (b, max(top(t, b) for t in over))]
    kept = np.array(_corners(points))
    return kept[:, 0], kept[:, 1]


def _treads(d: FloatArray, z: FloatArray, place: float) -> list[_Tread]:
    """The profile's level stretches, neighbours of equal height joined."""
    level: list[tuple[float, float, float]] = []
    for (a, _), (b, z_b) in pairwise(zip(d.tolist(), z.tolist(), strict=True)):
        if b <= a:
            continue
        if level and level[-1][2] == z_b:
            level[-1] = (level[-1][0], b, z_b)
        else:
            level.append((a, b, z_b))
    length = float(d[-1])
    near, far = 0.5 * level[0][1], 0.5 * (level[-1][0] + length)
    final = len(level) - 1
    return [
        _Tread(
            0.0 if k == 0 else max(low - place, near),
            length if k == final else min(high + place, far),
            height,
        )
        for k, (low, high, height) in enumerate(level)
    ]


def _corners(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The polyline without repeated points, and without those on a straight line."""
    kept: list[tuple[float, float]] = []
    for point in points:
        if kept and point == kept[-1]:
            continue
        if len(kept) > 1:
            (ax, ay), (bx, by) = kept[-2], kept[-1]
            if abs((bx - ax) * (point[1] - by) - (by - ay) * (point[0] - bx)) < _FLAT:
                kept.pop()
        kept.append(point)
    return kept
