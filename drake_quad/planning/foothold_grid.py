"""Where along a lane feet may step: on treads, and on level ground in strides alike.

In a gait of n places a cycle (`foothold_pattern`) every foot steps n places on, so the level walk
is in phase with the flight when the first foot reaches it, whatever the distance.

A walk may begin and end on a flight, over one of its places: so a robot that does not know a flight
to its end can stop on it, look, and go on from the same footprints.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import gcd

import numpy as np

from drake_quad.common import FloatArray, IntArray, read_only
from drake_quad.errors import PlanningError
from drake_quad.planning.settled_places import (
    Pins,
    find_foothold_obstacles,
    flight_at,
    flight_places,
    nearest_place,
    pin_flights,
)
from drake_quad.terrain.lane import Flight, Lane


@dataclass(frozen=True, eq=False)
class FootholdGrid:
    """Places along a lane.

    Attributes:
        s: (nN + 1 + behind + ahead,) places along the lane [m]; the body starts over `s[behind]`
            and ends over `s[behind + nN]`.
        z: Heights of the ground there [m].
        behind: How many places lie behind the start (the gait's rear feet begin there).
        cycles: N: cycles of the wave gait from start to end, n places each.
        on_tread: Which places are on a tread of a flight, or on a block.
        line: Where treads have several places, the grid with one a tread: its line is the flights'
            own.
        starts_on_flight: Whether the body starts over a tread with more of its flight ahead.
        ends_on_flight: Whether it ends over one.
    """

    s: FloatArray
    z: FloatArray
    behind: int
    cycles: int
    on_tread: tuple[bool, ...]
    line: "FootholdGrid | None" = None
    starts_on_flight: bool = False
    ends_on_flight: bool = False

    @property
    def knots(self) -> tuple[FloatArray, FloatArray]:
        """Places [m] and heights [m] that the slope line goes through: one a tread."""
        return (self.s, self.z) if self.line is None else (self.line.s, self.line.z)

    def height(self, s: FloatArray) -> FloatArray:
        """The slope line through the treads' middles, at `s` [m]; flat beyond the ends."""
        return np.asarray(np.interp(s, *self.knots))


FARTHER = 3  # places laid beyond an end on a flight, for the slope under the body there


def make_foothold_grid(
    lane: Lane,
    *,
    start: float,
    goal: float,
    spacing: float,
    behind: int = 1,
    ahead: int = 1,
    per_cycle: int = 2,
    per_tread: int = 1,
    deep: float = np.inf,
) -> FootholdGrid:
    """Lays the lattice for a walk of the body from `start` to `goal` along `lane`.

    Args:
        lane: The lane.
        start: Where the body's centre starts, along the lane [m].
        goal: Where it is to end [m]. On a flight, both are the nearest of its places.
        spacing: The longest distance between neighbours on level ground [m].
        behind: How many places to lay behind the start.
        ahead: How many to lay beyond the goal.
        per_cycle: n: how many places a cycle advances.
        per_tread: q: how many places every tread has, evenly spaced.
        deep: Depth of treads from which a flight is none, but floors with curbs between [m].

    Raises:
        PlanningError: If there is no room to step between start, flights and goal.
    """
    begun, ended = flight_at(lane, start, deep), flight_at(lane, goal, deep)
    start, goal = (nearest_place(lane, x, per_tread=per_tread, deep=deep) for x in (start, goal))
    obstacles = find_foothold_obstacles(lane, spacing, deep)
    pins = pin_flights(lane, obstacles, start, goal, (begun, ended), per_tread=per_tread, deep=deep)
    s = _divide_spans(pins, spacing=spacing, per_cycle=per_cycle, per_tread=per_tread)
    first_gap, last_gap = (s[1] - s[0], s[-1] - s[-2]) if len(s) > 1 else (spacing, spacing)
    hind = [s[0] - first_gap * (behind - k) for k in range(behind)]
    fore = [s[-1] + last_gap * (k + 1) for k in range(ahead)]
    if begun is not None:
        hind = _places_behind(lane, begun, start, behind, per_tread=per_tread, spacing=spacing)
    if ended is not None:
        fore = _places_beyond(lane, ended, goal, ahead, per_tread=per_tread, spacing=spacing)
    places = np.array(hind + s + fore)
    z = lane.height(places)
    if np.any(np.isnan(z)):
        bad = places[np.isnan(z)]
        raise PlanningError(
            f"a foot would have to stand at {bad[0]:.2f} m along the lane, beyond the ground",
            places=bad.tolist(),
        )
    steps = {i for f in lane.close_flights(deep) for i in range(f.first, f.last + 1)}
    line = None
    if per_tread > 1:
        line = make_foothold_grid(lane, start=start, goal=goal, spacing=per_tread * spacing,
                            behind=0, ahead=0, per_cycle=1, deep=deep)  # fmt: skip
    return FootholdGrid(
        s=read_only(places),
        z=read_only(z),
        behind=len(hind),
        cycles=(len(s) - 1) // per_cycle,
        on_tread=tuple(
            lane.kinds[i] == "block" or i in steps for i in lane.interval(places).tolist()
        ),
        line=line,
        starts_on_flight=begun is not None,
        ends_on_flight=ended is not None,
    )


def _divide_spans(pins: Pins, *, spacing: float, per_cycle: int, per_tread: int) -> list[float]:
    """The places from start to goal [m]: level spans are divided, so that cycles come out whole.

    Args:
        pins: The places that are settled.
        spacing: The longest distance between neighbours on level ground [m].
        per_cycle: How many places a cycle advances.
        per_tread: How many places every tread has.

    Raises:
        PlanningError: If there is no level ground on which the stride could be adapted.
    """
    gaps = np.diff(pins.places)
    counts = np.array([max(int(np.ceil(g / spacing - 1e-6)), 0) if lv else 1
                       for g, lv in zip(gaps, pins.level, strict=True)])  # fmt: skip
    alike = gcd(per_cycle, per_tread)
    before = 0
    for pin in pins.begins:  # each foot on the same place of every tread as on endless stairs
        while counts[:pin].sum() % alike and _add_place(gaps, counts, pins.level, before, pin):
            pass
        before = pin
    while counts.sum() % per_cycle:  # whole cycles: a stride more behind the last flight
        if not (
            _add_place(gaps, counts, pins.level, before, len(gaps))
            or _add_place(gaps, counts, pins.level, 0, len(gaps))
        ):
            raise PlanningError(
                "no level ground on which to adapt the stride", goal=pins.places[-1]
            )
    s = [pins.places[0]]
    for a, gap, count in zip(pins.places[:-1], gaps, counts, strict=True):
        s += [a + gap * (k + 1) / count for k in range(count)]
    return s


def _add_place(
    gaps: FloatArray, counts: IntArray, level: Sequence[bool], begin: int, end: int
) -> bool:
    """Gives the widest level span of some one place more; whether there is one.

    Args:
        gaps: Lengths of the spans [m].
        counts: Into how many strides each is divided; one of them grows.
        level: Whether each may be divided.
        begin: The first of those that are looked at.
        end: One after the last.
    """
    widths = [gaps[k] / counts[k] if level[k] and counts[k] else 0.0 for k in range(begin, end)]
    if max(widths, default=0.0) <= 0.0:
        return False
    counts[begin + int(np.argmax(widths))] += 1
    return True


def _places_behind(
    lane: Lane, flight: Flight, start: float, count: int, *, per_tread: int, spacing: float
) -> list[float]:
    """The places before `start` on a flight, and on the ground before that, in walking order [m].

    They are `count`, which feet may need, and FARTHER besides where there is ground.
    """
    treads = lane.treads(flight)
    places = flight_places(lane, flight, per_tread)
    found = [float(x) for x in places[places < start - 1e-9][::-1]]
    found.append(float(treads[0, 0] - 0.5 * (treads[0, 1] - treads[0, 0]) / per_tread))
    while len(found) < count + FARTHER:
        found.append(found[-1] - spacing)
    found = found[: count + FARTHER]
    return [x for k, x in enumerate(found) if k < count or x >= -lane.run_in][::-1]


def _places_beyond(
    lane: Lane, flight: Flight, goal: float, count: int, *, per_tread: int, spacing: float
) -> list[float]:
    """The same beyond `goal`: on the flight, and on the ground behind it [m]."""
    treads = lane.treads(flight)
    places = flight_places(lane, flight, per_tread)
    found = [float(x) for x in places[places > goal + 1e-9]]
    found.append(float(treads[-1, 1] + 0.5 * (treads[-1, 1] - treads[-1, 0]) / per_tread))
    while len(found) < count + FARTHER:
        found.append(found[-1] + spacing)
    end = lane.length + lane.run_out
    return [x for k, x in enumerate(found[: count + FARTHER]) if k < count or x <= end]
