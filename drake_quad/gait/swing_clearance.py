"""The swing's apex: how high and when, so that it clears nosings and an uncertain map.

A profile is the terrain along the straight line under a swing: (d, z), each (n,) [m], with d the
horizontal distance from the start, not decreasing, and a vertical riser as two points of equal d.
A nosing is a convex corner of it. The foot is a sphere; its path is that of its centre.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import FloatArray
from drake_quad.math.curves import quintic, quintic_inverse
from drake_quad.terrain.lane import without_collinear

Profile = tuple[ArrayLike, ArrayLike]

_SAMPLES = 193
_TOLERANCE = 1e-5  # [m], of the sampled distances
_WORTHWHILE = 5e-3  # [m]; for less height than this the apex stays over the paper's riser
_EARLIEST = 0.15  # apex phase; nearer to an end the foot would have to jump
_OTHER_PHASES = tuple(k / 10 for k in range(2, 9))
_CALM_PHASES = tuple(k / 40 for k in range(8, 33))


@dataclass(frozen=True)
class Apex:
    """Where a swing peaks: its phase in (0, 1), its height [m], and what clearance lacks [m]."""

    phase: float
    z: float
    shortfall: float = 0.0


def nosings(profile: Profile, length: float) -> FloatArray:
    """Returns (k, 2), the convex corners (d, z) strictly between the ends of a swing."""
    points = np.column_stack([np.asarray(side, dtype=np.float64) for side in profile])
    points = points[np.insert(np.any(np.diff(points, axis=0) != 0.0, axis=1), 0, True)]
    step = np.diff(points, axis=0)
    turn = step[:-1, 0] * step[1:, 1] - step[:-1, 1] * step[1:, 0]
    corners: FloatArray = points[1:-1][turn < -1e-15]
    inside: FloatArray = corners[(corners[:, 0] > 0.0) & (corners[:, 0] < length)]
    return inside


def riser_for_swing(profile: Profile, length: float) -> tuple[float, float] | None:
    """Returns the paper's (d_s, h_s): the riser over which the swing is to peak.

    The last one when climbing and the first when descending, so that the leg is high on the side
    of the upper tread; where the swing ends as high as it starts, the highest nosing, and of
    equals the one nearest to the middle. None on ground without nosings.
    """
    corners = nosings(profile, length)
    if not len(corners):
        return None
    z = _ground(profile, np.array([0.0, length]))
    if z[1] > z[0]:
        d_s, h_s = corners[-1]
    elif z[1] < z[0]:
        d_s, h_s = corners[0]
    else:
        d_s, h_s = min(corners, key=lambda corner: (-corner[1], abs(corner[0] - length / 2)))
    return float(d_s), float(h_s)


def find_apex(
    *,
    length: float,
    z_ends: tuple[float, float],
    profile: Profile,
    clearance: float,
    foot_radius: float,
    lift: float,
    calm: bool = False,
) -> Apex:
    """Returns the apex of `swing.plan_swing`, whose arguments these are.

    Args:
        length: Horizontal length of the swing [m].
        z_ends: Heights of the foot's centre at lift-off and touchdown [m].
        profile: The terrain under the swing.
        clearance: Least distance from nosings, least height over treads passed [m].
        foot_radius: Least height over the ends' own ground [m].
        lift: Least height of the apex over the higher end [m].
        calm: Whether the foot is to go up and down no faster than it has to, instead of no higher.

    Raises:
        ValueError: The profile does not cover the swing.
    """
    d, z = (np.asarray(side, dtype=np.float64) for side in profile)
    return _find_apex(
        length, z_ends, (d.tobytes(), z.tobytes()), clearance, foot_radius, lift, calm
    )  # fmt: skip


# Plans of the same footprints are made again and again, with other times: the arcs are the same.
@lru_cache(maxsize=4096)
def _find_apex(
    length: float,
    z_ends: tuple[float, float],
    packed: tuple[bytes, bytes],
    clearance: float,
    foot_radius: float,
    lift: float,
    calm: bool,
) -> Apex:
    """See `find_apex`; the profile is given by its bytes."""
    d, z = (np.frombuffer(side) for side in packed)
    profile = d, z
    if not (d[0] <= 1e-9 and d[-1] >= length - 1e-9 and np.all(np.diff(d) >= 0.0)):
        raise ValueError(f"the profile must run from 0 to at least the swing's {length:.6g} m")
    lowest = max(z_ends) + lift
    if np.ptp(z) == 0.0:
        return Apex(0.5, lowest)
    riser = riser_for_swing(profile, length)
    if riser is None and np.ptp(_ground(profile, np.linspace(0.0, length, 9))) == 0.0:
        return Apex(0.5, lowest)
    phase = 0.5 if riser is None else quintic_inverse(riser[0] / length)
    paper = np.array([np.clip(phase, _EARLIEST, 1.0 - _EARLIEST)])
    course = _Obstacles(length, z_ends, profile, clearance, foot_radius)
    if not calm and course.slack(paper, np.array([lowest]))[0] >= -_TOLERANCE:
        return Apex(float(paper[0]), lowest)
    phases = np.concatenate([paper, _CALM_PHASES if calm else _OTHER_PHASES])
    # An arc that peaks higher above both ends than half its length is not a step any more.
    highest = lowest + length / 2.0
    low, high = np.full(len(phases), lowest), np.full(len(phases), highest)
    slack = course.slack(phases, high)
    if slack.max() < -_TOLERANCE:
        best = int(np.argmax(slack))
        return Apex(float(phases[best]), highest, -float(slack[best]))
    while np.max(high - low) > _TOLERANCE:
        middle = (low + high) / 2.0
        clears = course.slack(phases, middle) >= -_TOLERANCE
        low, high = np.where(clears, low, middle), np.where(clears, middle, high)
    high = np.where(slack >= -_TOLERANCE, high, np.inf)
    if calm:
        steepest = np.maximum((high - z_ends[0]) / phases, (high - z_ends[1]) / (1.0 - phases))
        best = int(np.argmin(steepest))
        return Apex(float(phases[best]), float(high[best]))
    best = 0 if high[0] <= high.min() + _WORTHWHILE else int(np.argmin(high))
    return Apex(float(phases[best]), float(high[best]))


@dataclass(frozen=True, eq=False)
class _Obstacles:
    """What a swing has to stay clear of, sampled for evaluation; arguments as of `find_apex`."""

    length: float
    z_ends: tuple[float, float]
    profile: Profile
    clearance: float
    foot_radius: float

    @cached_property
    def corners(self) -> FloatArray:
        """(k, 2) nosings."""
        return nosings(self.profile, self.length)

    @cached_property
    def times(self) -> FloatArray:
        """Sampled phases (n,), then the phases (k,) at which the foot is over each nosing."""
        over = [quintic_inverse(d / self.length) for d in self.corners[:, 0]]
        return np.concatenate([np.linspace(0.0, 1.0, _SAMPLES), over])

    @cached_property
    def distance(self) -> FloatArray:
        """(n,) horizontal distance from the start at the sampled phases [m]."""
        return self.length * quintic(self.times[:_SAMPLES])

    @cached_property
    def least_height(self) -> FloatArray:
        """(n,) lowest admissible height of the centre at the sampled phases [m]."""
        ground: FloatArray = _ground(self.profile, self.distance)
        # A foot may stand a little into the ground as measured: it need not jump out of it.
        own = np.minimum(self.foot_radius, np.array(self.z_ends) - ground[[0, -1]])
        if not len(self.corners):
            return np.asarray(ground + own.min())
        first, last = self.corners[[0, -1], 0]
        before, after = self.distance <= first, self.distance >= last
        least = np.where(before, own[0], np.where(after, own[1], self.clearance))
        return np.asarray(ground + least)

    @cached_property
    def least_distance(self) -> FloatArray:
        """(k,) distance to keep from each nosing [m].

        A foothold that is itself close to a nosing is not the swing's to move: from one beside
        or above the nosing the foot keeps the distance it has there, and past a riser that it
        stands too close to, half of what the foothold leaves beyond the foot's own radius.
        """
        keep = np.full(len(self.corners), self.clearance)
        for d, z in zip((0.0, self.length), self.z_ends, strict=True):
            beside = np.abs(self.corners[:, 0] - d)
            above = z - self.corners[:, 1]
            gap = np.where(above >= 0.0, np.hypot(beside, above), (beside + self.foot_radius) / 2)
            keep = np.minimum(keep, gap)
        return keep

    def slack(self, phases: FloatArray, apexes: FloatArray) -> FloatArray:
        """Returns (c,): how much each of c arcs exceeds what it has to keep, at its worst [m].

        It never falls as an apex rises: every point of the arc rises with it.
        """
        z = self._heights(phases, apexes)
        path, over = z[:, :_SAMPLES], z[:, _SAMPLES:]
        worst: FloatArray = (path - self.least_height).min(axis=1)
        if not len(self.corners):
            return worst
        dx = self.distance[:, None] - self.corners[:, 0]
        dz = path[:, :, None] - self.corners[:, 1]
        nearest = np.sqrt(_least(dx * dx + dz * dz))
        above = over - self.corners[:, 1]
        signed = np.where(above > 0.0, nearest, above)
        return np.asarray(np.minimum(worst, (signed - self.least_distance).min(axis=1)))

    def _heights(self, phases: FloatArray, apexes: FloatArray) -> FloatArray:
        """Returns (c, n + k), equation (3) at `times`."""
        phase, apex = phases[:, None], apexes[:, None]
        rising = quintic(np.minimum(self.times / phase, 1.0))
        falling = quintic(np.maximum((self.times - phase) / (1.0 - phase), 0.0))
        start, end = self.z_ends
        heights: FloatArray = start + (apex - start) * rising + (end - apex) * falling
        return heights


def _least(values: FloatArray) -> FloatArray:
    """Returns (c, k), the least of smooth values (c, n, k) along n, between samples too."""
    at = np.clip(np.argmin(values, axis=1), 1, values.shape[1] - 2)[:, None, :]
    before, here, after = (
        np.take_along_axis(values, at + shift, axis=1)[:, 0, :] for shift in (-1, 0, 1)
    )
    bend = np.maximum(before - 2.0 * here + after, 1e-300)
    vertex = here - (before - after) ** 2 / (8.0 * bend)
    at_end = here > np.minimum(before, after)
    return np.where(at_end, np.minimum(before, after), np.maximum(vertex, 0.0))


def _ground(profile: Profile, d: FloatArray) -> FloatArray:
    """Returns the terrain's height [m] at distances d; at a riser that of the tread behind it."""
    x, z = (np.asarray(side, dtype=np.float64) for side in profile)
    return np.interp(d, x, z)


RAMP = 0.1  # [m] from the foot at the least, over which its own ground rises to the full error
# [m] The least rise of a foot's own ground towards where the nearest riser may be at the nearest:
# that place too then counts as a nosing, which the swing keeps its clearance from.
KEEN = 1e-6
_FLAT = 1e-12  # [m²]


class _Tread(NamedTuple):
    """A level stretch of a profile: where it may begin and end at the widest, and height [m]."""

    from_: float
    to: float
    z: float


def inflate_profile(
    d: FloatArray, z: FloatArray, *, place: float, height: float
) -> tuple[FloatArray, FloatArray]:
    """The ground under a swing, as high as it may be by the map's error.

    Every riser may be nearer to the foot, whichever side of it the foot is on, and every tread
    higher. The ground that the foot stands on at lift-off is known there, and so is that at
    touchdown, where the swing ends when the ground is felt: the error grows from there towards
    where the next riser may be. A riser moves at most half the way to a foothold.

    Args:
        d: Horizontal distance from the lift-off, (n,) [m], not decreasing from 0.
        z: Height of the ground, (n,) [m]: level treads, and risers as two points of equal d.
        place: Greatest error of a riser's place [m].
        height: Greatest error of a tread's height [m].

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
    kept = np.array(without_collinear(points, flat=_FLAT))
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
