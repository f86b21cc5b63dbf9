"""A straight stretch of a course as a step profile, and the flights on it."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import FloatArray, read_only
from drake_quad.math.rotations import rotation


class Flight(NamedTuple):
    """The steps of one flight: intervals `first` to `last` (inclusive) of its lane.

    Attributes:
        first: Index of its first interval.
        last: Index of its last interval.
        going: `up` or `down`.
        yaw: Angle of its nosings against the lane's [rad]; 0 but in the course as built.
        overhang: Distance that each tread reaches beyond the riser under it [m].
        thickness: Thickness of what reaches out, and of treads over open risers [m].
        open: Whether there is nothing between the treads.
    """

    first: int
    last: int
    going: str
    yaw: float = 0.0
    overhang: float = 0.0
    thickness: float = 0.0
    open: bool = False

    @property
    def undercut(self) -> float:
        """By how much the ground before it stands back under its edge, the first nosing [m]."""
        return self.overhang if self.going == "down" and not self.open else 0.0


class Part(NamedTuple):
    """A piece of a flight, across all of it: from `start` to `end` along the lane [m]."""

    name: str
    start: float
    end: float
    top: float  # [m]
    thickness: float | None = None  # [m]; None: down to the foundation


def flight_parts(flight: Flight, breaks: FloatArray, heights: FloatArray) -> list[Part]:
    """The solids of a flight. From above they are its treads, whatever is under them.

    The breaks are where the nosings are; with an overhang the risers stand back from them under
    the upper tread. Just one part for each tread has `tread` in its name.

    Args:
        flight: What it is like.
        breaks: (n + 1,) ends of its treads along the lane [m].
        heights: (n + 1,) of what is before it, then of its treads, in W [m].
    """
    ends, tops = breaks.tolist(), heights.tolist()
    n = len(ends) - 1
    if flight.open:
        return _open_parts(flight, ends, tops)
    up = flight.going == "up"
    back = flight.overhang if up else -flight.overhang  # from a nosing to its riser
    risers = [end + back for end in ends[:-1]] + [ends[-1]]
    parts = [Part(f"tread_{k + 1}", risers[k], risers[k + 1], tops[k + 1]) for k in range(n)]
    if back == 0.0:
        return parts
    for k in range(n):
        a, b = sorted((ends[k], risers[k]))
        own = k + 1 if up else k  # of the tread after it going up, before it going down
        parts.append(Part(f"nose_{own}", a, b, tops[own], flight.thickness))
    if up:
        parts.append(Part("foot", ends[0], risers[0], tops[0]))
    return parts


def _open_parts(flight: Flight, ends: list[float], tops: list[float]) -> list[Part]:
    """Boards over the ground that is at the flight's lower end; one level with it lies on it."""
    n, over, up = len(ends) - 1, flight.overhang, flight.going == "up"
    parts = []
    for k in range(n):
        a, b = ends[k], ends[k + 1]
        a, b = (a, min(b + over, ends[-1])) if up else (max(a - over, ends[0]), b)
        parts.append(Part(f"tread_{k + 1}", a, b, tops[k + 1], flight.thickness))
    return [*parts, Part("ground", ends[0], ends[-1], tops[0] if up else tops[-1])]


EDGE = 1e-9  # [m] a point this near to an edge counts as on it


@dataclass(frozen=True)
class _PlainLane:
    """A lane's breaks, heights and gradients, and its intervals' spans along s, in plain floats."""

    breaks: list[float]
    heights: list[float]
    gradients: list[float]
    spans: tuple[tuple[float, float], ...]

    def height(self, interval: int, s: float) -> float:
        """As `Lane._height_in`."""
        return self.heights[interval] + self.gradients[interval] * (s - self.breaks[interval])

    def interval(self, s: float) -> int:
        """As `Lane.interval`."""
        last = len(self.heights) - 1
        behind = min(max(bisect_right(self.breaks, s - EDGE) - 1, 0), last)
        ahead = min(max(bisect_right(self.breaks, s + EDGE) - 1, 0), last)
        return ahead if self.height(ahead, s) >= self.height(behind, s) else behind


@dataclass(frozen=True)
class Lane:
    """A straight stretch of the course, with its own frame L: s along it, lateral to the left.

    Interval i of the profile is [breaks[i], breaks[i + 1]]; it begins at height heights[i] and
    rises by gradients[i], which is 0 but on a slope. The lane proper is s in [0, length]; where it
    meets a turn, the landing goes on past its end (`run_out`) or lies behind its origin
    (`run_in`), level, so that feet find ground there.

    Attributes:
        p_WL: Origin of the lane in W, (2,) [m].
        yaw: Heading of the lane about W's z [rad].
        breaks: (n + 1,) ends of the intervals along s [m], increasing from 0.
        heights: (n,) height of each interval in W, where it begins [m].
        gradients: (n,) rise of each interval along s [m/m].
        half_widths: (n,) half the width of each interval [m].
        kinds: What each interval is: `floor`, `landing`, `tread`, `block` or `slope`.
        flights: The flights of stairs on it, in walking order.
        run_in: Level ground behind the origin [m].
        run_out: Level ground past the end [m].
    """

    p_WL: FloatArray
    yaw: float
    breaks: FloatArray
    heights: FloatArray
    gradients: FloatArray
    half_widths: FloatArray
    kinds: tuple[str, ...]
    flights: tuple[Flight, ...] = ()
    run_in: float = 0.0
    run_out: float = 0.0

    @property
    def length(self) -> float:
        """From the origin to the next turn's pivot, or to the end of the course [m]."""
        return float(self.breaks[-1])

    @property
    def half_width(self) -> float:
        """Half the width of the narrowest part [m]."""
        return float(self.half_widths.min())

    @cached_property
    def heading(self) -> FloatArray:
        """(2,) the unit vector along s in W."""
        return rotation(self.yaw)[:, 0]

    def point(self, s: ArrayLike, lateral: ArrayLike = 0.0) -> FloatArray:
        """The place (..., 2) in W of the lane coordinates `s`, `lateral` [m]."""
        x, y = np.broadcast_arrays(np.asarray(s, dtype=float), np.asarray(lateral, dtype=float))
        c, n = self.heading
        return np.asarray(self.p_WL + np.stack([c * x - n * y, n * x + c * y], axis=-1))

    def coordinates(self, p_W: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """The lane coordinates (s, lateral) of the places (..., 2) in W: inverse of `point`."""
        d = np.asarray(p_W, dtype=float)[..., :2] - self.p_WL
        c, n = self.heading
        return c * d[..., 0] + n * d[..., 1], c * d[..., 1] - n * d[..., 0]

    def interval(self, s: ArrayLike) -> np.ndarray[tuple[int, ...], np.dtype[np.intp]]:
        """Index of the interval that bears a foot at `s`: of two at a riser, the higher."""
        s = np.asarray(s, dtype=float)
        if s.ndim == 0:
            return np.array(self._plain.interval(float(s)))
        last = len(self.heights) - 1
        behind, ahead = (
            np.minimum(np.maximum(self.breaks.searchsorted(s + e, side="right") - 1, 0), last)
            for e in (-EDGE, EDGE)
        )
        return np.where(self._height_in(ahead, s) >= self._height_in(behind, s), ahead, behind)

    def _height_in(self, interval: np.ndarray, s: FloatArray) -> FloatArray:
        """Height in W at `s` of the ground that an interval has, extended beyond its ends [m]."""
        rise = self.gradients[interval] * (s - self.breaks[interval])
        return np.asarray(self.heights[interval] + rise)

    @cached_property
    def _plain(self) -> "_PlainLane":
        """The same numbers for one place at a time, where numpy's calls cost more than the work."""
        breaks = self.breaks.tolist()
        spans = tuple(zip([-np.inf, *breaks[1:-1]], [*breaks[1:-1], np.inf], strict=True))
        return _PlainLane(breaks, self.heights.tolist(), self.gradients.tolist(), spans)

    def gradient(self, s: ArrayLike) -> FloatArray:
        """Rise of the ground along s at `s` [m/m], in its shape."""
        return np.asarray(self.gradients[self.interval(s)])

    def height(self, s: ArrayLike) -> FloatArray:
        """Height of the ground in W at `s` [m], in its shape; nan where there is none."""
        s = np.asarray(s, dtype=float)
        inside = (s >= -self.run_in - EDGE) & (s <= self.length + self.run_out + EDGE)
        return np.where(inside, self._height_in(self.interval(s), s), np.nan)

    def profile(self, s0: float, s1: float) -> tuple[FloatArray, FloatArray]:
        """The ground from `s0` to `s1` as a polyline, walked in either direction.

        Returns:
            (d, z): d (n,) distance from `s0` [m], 0 to |s1 - s0|, z (n,) height in W [m]. A riser
            is two points of the same d; both ends are there, and no point between collinear ones.
        """
        lo, hi = min(s0, s1), max(s0, s1)
        points: list[tuple[float, float]] = [(lo, float(self.height(lo)))]
        for k, (a, b) in enumerate(self._plain.spans):
            if a < hi and b > lo:
                points += [(x, self._plain.height(k, x)) for x in (max(lo, a), min(hi, b))]
        points.append((hi, float(self.height(hi))))
        s, z_at = np.array(without_collinear(points)).T
        return (s - lo, z_at) if s1 >= s0 else ((hi - s)[::-1], z_at[::-1])

    def nosings(self) -> FloatArray:
        """The nosings as (m, 2) rows (s, z) [m] in walking order: the upper edge of each riser."""
        at, lower, upper = self._risers()
        return np.stack([self.breaks[at], np.maximum(lower, upper)], axis=-1)

    def close_flights(self, deep: float = np.inf) -> tuple[Flight, ...]:
        """The flights with a tread that is less than `deep` [m]: their steps follow each other.

        Deeper treads are like floors, with a curb between one and the next.
        """
        runs = np.diff(self.breaks)
        return tuple(f for f in self.flights if runs[f.first : f.last + 1].min() < deep)

    def single_risers(self, deep: float = np.inf) -> FloatArray:
        """Where the risers are that belong to no close flight, as of blocks and curbs (m,) [m]."""
        at = self._risers()[0]
        own = [(at >= f.first) & (at <= f.last) for f in self.close_flights(deep)]
        return np.asarray(self.breaks[at[~np.any(own, axis=0)] if own else at])

    def nosing_yaws(self) -> FloatArray:
        """By how much each nosing, as of `nosings`, is turned against the lane (m,) [rad]."""
        yaws = np.zeros(len(self.breaks))
        for flight in self.flights:
            yaws[flight.first : flight.last + 1] = flight.yaw
        return np.asarray(yaws[self._risers()[0]])

    @cached_property
    def end_heights(self) -> FloatArray:
        """Height in W of each interval where it ends (n,) [m]."""
        return read_only(self._height_in(np.arange(len(self.heights)), self.breaks[1:]))

    @cached_property
    def edges(self) -> FloatArray:
        """Where along s the ground steps up or down, or a slope begins or ends (m,) [m]."""
        steps = np.abs(self.heights[1:] - self.end_heights[:-1]) > EDGE
        return read_only(self.breaks[1:-1][steps | (np.diff(self.gradients) != 0.0)])

    def risers(self) -> tuple[FloatArray, FloatArray]:
        """Where the risers are along s, and how much higher the ground is beyond (m,), (m,) [m]."""
        at, before, after = self._risers()
        return self.breaks[at], after - before

    def _risers(self) -> tuple[np.ndarray, FloatArray, FloatArray]:
        """Indices (m,) of the breaks that are risers, and heights before and after each [m]."""
        before, after = self.end_heights[:-1], self.heights[1:]
        at = np.flatnonzero(np.abs(after - before) > EDGE)
        return at + 1, before[at], after[at]

    def treads(self, flight: Flight) -> FloatArray:
        """The treads of a flight as (n, 3) rows (s at start, s at end, z) [m]."""
        own = slice(flight.first, flight.last + 1)
        return np.stack([self.breaks[:-1][own], self.breaks[1:][own], self.heights[own]], axis=-1)


def reverse_lane(lane: Lane) -> Lane:
    """The lane walked the other way: from where it ends, back to its origin.

    Every flight has a riser before each of its treads. So the last tread of a flight, level with
    what follows it, is before the reversed one; as that one's last tread serves a piece of the
    ground before the flight, as deep as the flight's first tread, or half of that ground.
    """
    lengths = np.diff(lane.breaks)
    columns = (lengths, lane.end_heights, 0.0 - lane.gradients, lane.half_widths)
    numbers = (column[::-1].tolist() for column in columns)
    pieces = [list(piece) for piece in zip(*numbers, lane.kinds[::-1], strict=True)]
    count = len(pieces)
    flights: list[Flight] = []
    for cut, flight in enumerate(reversed(lane.flights)):
        level, last = (count - 1 - k + cut for k in (flight.last, flight.first))
        if pieces[level - 1][-1] != "tread":
            pieces[level][-1] = pieces[level - 1][-1]
        length, height, gradient, half_width, kind = pieces[last + 1]
        deep = min(pieces[last][0], 0.5 * length)
        tread = [deep, height, gradient, half_width, "tread" if gradient == 0.0 else kind]
        rest = [length - deep, height + gradient * deep, gradient, half_width, kind]
        pieces[last + 1 : last + 2] = [tread, rest]
        going = "down" if flight.going == "up" else "up"
        flights.append(flight._replace(first=level + 1, last=last + 1, going=going))
    deep_of, heights, gradients, half_widths, kinds = zip(*pieces, strict=True)
    return Lane(
        p_WL=read_only(lane.point(lane.length)),
        yaw=lane.yaw + math.pi,
        breaks=read_only(np.concatenate([[0.0], np.cumsum(deep_of)])),
        heights=read_only(np.array(heights)),
        gradients=read_only(np.array(gradients)),
        half_widths=read_only(np.array(half_widths)),
        kinds=kinds,
        flights=tuple(flights),
        run_in=lane.run_out,
        run_out=lane.run_in,
    )


def without_collinear(
    points: Sequence[tuple[float, float]], *, flat: float = 0.0
) -> list[tuple[float, float]]:
    """The polyline without the points inside a straight stretch; both its ends stay.

    Args:
        points: Points of the polyline.
        flat: Twice the area [m²] of a triangle of three points up to which they are in a line.
    """
    kept: list[tuple[float, float]] = []
    for point in points:
        if len(kept) > 1 and abs(_turn(kept[-2], kept[-1], point)) <= flat:
            kept[-1] = point
        else:
            kept.append(point)
    return kept


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Twice the area of a triangle: 0 where the points are in a line, or two of them equal."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
