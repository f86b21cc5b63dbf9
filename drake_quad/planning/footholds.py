"""Where along a lane feet may step: the places, obstacles, and the wave gait's pattern on them.

Curbs and blocks have a place on either side, or one on their middle. In the wave gait of n treads a
cycle every foot steps n places on, so the level walk is in phase with the flight when the first
foot reaches it, whatever the distance.

On stairs a foot can only stand on treads. The paper describes cycles of one and of two treads
(section II-A); this is the general pattern of n places a cycle with rear feet k places behind. A
tread is one place, or more where treads are deep against the legs.

A walk may begin and end on a flight, over one of its places: so a robot that does not know a flight
to its end can stop on it, look, and go on from the same footprints.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import gcd, inf

import numpy as np

from drake_quad.common import FloatArray, IntArray, read_only
from drake_quad.errors import PlanningError
from drake_quad.robot.legs import DIAGONALS, LEGS, Leg
from drake_quad.terrain.lane import Flight, Lane

SHORTEST_BLOCK = 0.4  # of the spacing: on a shorter one no foot steps
LONGEST_BLOCK = 1.5  # of the spacing: a longer one is a step up, and then a step down
NEAREST = 0.2  # of the spacing: a place on account of an obstacle is no nearer to the one before


@dataclass(frozen=True)
class Obstacle:
    """A curb or a block on the way.

    Attributes:
        start: Where it begins along the lane [m].
        end: Where it ends: a curb where it begins [m].
        places: Where a foot is to stand on its account [m].
        gap: Least distance of these places from the place before, and from the goal [m].
    """

    start: float
    end: float
    places: tuple[float, ...]
    gap: float


def find_foothold_obstacles(lane: Lane, spacing: float, deep: float = inf) -> list[Obstacle]:
    """The curbs and blocks of a lane: single risers, two that are near each other as one.

    Args:
        lane: The lane.
        spacing: The longest distance between neighbouring places on level ground [m].
        deep: Depth of treads from which the risers of a flight are curbs, too [m].
    """
    found, risers = [], lane.single_risers(deep).tolist()
    while risers:
        a = b = risers.pop(0)
        if risers and risers[0] - a < LONGEST_BLOCK * spacing:
            b = risers.pop(0)
        middle, half = 0.5 * (a + b), 0.5 * spacing
        on = b - a >= SHORTEST_BLOCK * spacing
        places = (middle,) if on else (middle - half, middle + half)
        found.append(Obstacle(a, b, places, NEAREST * spacing))
    return found


def snap_to_obstacles(
    obstacles: list[Obstacle],
    *,
    until: float,
    goal: float,
    end: float,
    pins: list[float],
    level: list[bool],
) -> float:
    """Adds the places of the obstacles that begin before `until`, and forgets those.

    A place that has no room is left out: footholds keep clear of risers in any case.

    Args:
        obstacles: Those ahead, in walking order.
        until: Where to stop along the lane [m].
        goal: Where the walk ends [m].
        end: Where the last flight or obstacle before ends [m].
        pins: Places that are settled so far [m].
        level: Whether the span before each but the first may be divided.

    Returns:
        Where the last flight or obstacle so far ends [m].
    """
    while obstacles and obstacles[0].start < until:
        obstacle = obstacles.pop(0)
        if obstacle.end <= pins[0]:
            continue
        end = max(end, obstacle.end)
        over = False  # a span over an obstacle stays one, as wide as it is
        for place in obstacle.places:
            if pins[-1] + obstacle.gap < place < goal - obstacle.gap:
                pins.append(place)
                level.append(not over)
                over = True
    return end


SHORTEST_LANDING = 0.4  # of a tread: on a shorter one between two flights there is no place


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


def flight_places(lane: Lane, flight: Flight, per_tread: int = 1) -> FloatArray:
    """The places on a flight, in walking order (n per_tread,) [m].

    Args:
        lane: The lane.
        flight: One of its flights.
        per_tread: How many places every tread has, evenly spaced.
    """
    shares = (2.0 * np.arange(per_tread) + 1.0) / (2.0 * per_tread)
    treads = lane.treads(flight)
    return np.asarray(treads[:, :1] + np.diff(treads[:, :2]) * shares).reshape(-1)


def flight_at(lane: Lane, s: float, deep: float = inf) -> Flight | None:
    """The flight on which a foot at `s` [m] stands with more risers ahead; None for level ground.

    Its last tread is level with what follows, and counts as that.

    Args:
        lane: The lane.
        s: Where along it [m].
        deep: Depth of treads from which a flight is none [m].
    """
    k = int(lane.interval(s))
    for flight in lane.close_flights(deep):
        if flight.first <= k < flight.last:
            return flight
    return None


def nearest_place(lane: Lane, s: float, *, per_tread: int = 1, deep: float = inf) -> float:
    """The place that is nearest to `s` [m] if that is on a flight, else `s` itself [m]."""
    flight = flight_at(lane, s, deep)
    if flight is None:
        return s
    places = flight_places(lane, flight, per_tread)
    return float(places[np.argmin(np.abs(places - s))])


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
    pins: list[float] = [start]
    end = start  # of the flight before
    level: list[bool] = []  # whether the span after pin k is level
    begins: list[int] = []  # the pins that are flights' first places
    obstacles = find_foothold_obstacles(lane, spacing, deep)
    flights = lane.close_flights(deep)
    for flight in flights:
        treads = lane.treads(flight)
        first, last = treads[0], treads[-1]
        if last[1] < start or first[0] > goal:
            continue
        end = snap_to_obstacles(
            obstacles, until=first[0], goal=goal, end=end, pins=pins, level=level
        )
        before = first[0] - 0.5 * (first[1] - first[0]) / per_tread
        if flight == begun:
            pass  # it starts on a tread of this one
        elif before >= pins[-1] - 1e-6:
            pins.append(before)
            level.append(True)
        elif len(pins) == 1:
            raise PlanningError(
                f"the walk starts {first[0] - start:.2f} m before a flight; "
                f"{first[0] - before:.2f} m are needed",
                start=start,
                flight=float(first[0]),
            )
        elif first[0] - end < SHORTEST_LANDING * (first[1] - first[0]):
            pins.pop()  # from tread to tread
            level.pop()
        else:
            pins[-1] = 0.5 * (end + first[0])  # one place serves both flights
        if flight != begun:
            begins.append(len(pins))
        for a, b, _ in treads:
            for k in range(1, 2 * per_tread, 2):
                place = ((2 * per_tread - k) * a + k * b) / (2 * per_tread)
                if (flight == begun and place <= start + 1e-9) or (
                    flight == ended and place >= goal - 1e-9
                ):
                    continue
                pins.append(place)
                level.append(False)
        if flight == ended:
            break
        end = last[1]
        pins.append(end + 0.5 * (end - last[0]) / per_tread)
        level.append(False)
    if ended is None:
        snap_to_obstacles(obstacles, until=goal, goal=goal, end=end, pins=pins, level=level)
    if goal < pins[-1] - 1e-6:
        raise PlanningError(
            f"the walk ends {goal - start:.2f} m on, too near behind a flight or before its start",
            goal=goal,
        )
    if ended is None or goal > pins[-1] + 1e-9:
        pins.append(goal)
        level.append(ended is None)

    gaps = np.diff(pins)
    counts = np.array([max(int(np.ceil(g / spacing - 1e-6)), 0) if lv else 1
                       for g, lv in zip(gaps, level, strict=True)])  # fmt: skip
    alike = gcd(per_cycle, per_tread)
    before = 0
    for pin in begins:  # each foot on the same place of every tread as on stairs without end
        while counts[:pin].sum() % alike and _add_place(gaps, counts, level, before, pin):
            pass
        before = pin
    while counts.sum() % per_cycle:  # whole cycles: a stride more behind the last flight
        if not (
            _add_place(gaps, counts, level, before, len(gaps))
            or _add_place(gaps, counts, level, 0, len(gaps))
        ):
            raise PlanningError("no level ground on which to adapt the stride", goal=goal)
    s = [start]
    for a, gap, count in zip(pins[:-1], gaps, counts, strict=True):
        s += [a + gap * (k + 1) / count for k in range(count)]
    if len(s) == 1:
        s_all, first_gap, last_gap = s, spacing, spacing
    else:
        s_all, first_gap, last_gap = s, s[1] - s[0], s[-1] - s[-2]
    hind = [s_all[0] - first_gap * (behind - k) for k in range(behind)]
    fore = [s_all[-1] + last_gap * (k + 1) for k in range(ahead)]
    if begun is not None:
        hind = _places_behind(lane, begun, start, behind, per_tread=per_tread, spacing=spacing)
        behind = len(hind)
    if ended is not None:
        fore = _places_beyond(lane, ended, goal, ahead, per_tread=per_tread, spacing=spacing)
    places = np.array(hind + s_all + fore)
    z = lane.height(places)
    if np.any(np.isnan(z)):
        bad = places[np.isnan(z)]
        raise PlanningError(
            f"a foot would have to stand at {bad[0]:.2f} m along the lane, beyond the ground",
            places=bad.tolist(),
        )
    steps = {i for f in flights for i in range(f.first, f.last + 1)}
    kinds = [lane.kinds[i] == "block" or i in steps for i in lane.interval(places).tolist()]
    line = None
    if per_tread > 1:
        line = make_foothold_grid(lane, start=start, goal=goal, spacing=per_tread * spacing,
                            behind=0, ahead=0, per_cycle=1, deep=deep)  # fmt: skip
    return FootholdGrid(
        s=read_only(places),
        z=read_only(z),
        behind=behind,
        cycles=(len(s) - 1) // per_cycle,
        on_tread=tuple(kinds),
        line=line,
        starts_on_flight=begun is not None,
        ends_on_flight=ended is not None,
    )


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


# The fraction of the cycle at which each leg lifts off: of the wave gait, in the order 1-4-2-3, and
# of the trot.
LIFT_OFF = {Leg(1): 0.0, Leg(4): 0.25, Leg(2): 0.5, Leg(3): 0.75}
TROT_LIFT_OFF = {leg: 0.5 * k for k, pair in enumerate(DIAGONALS) for leg in pair}
WAVE, TROT = "wave", "trot"
GAITS = (WAVE, TROT)


@dataclass(frozen=True)
class FootholdPattern:
    """Footprints of a wave gait, or of a trot.

    Attributes:
        treads: n: how many places every foot, and the body, advance in a cycle: treads, if a tread
            is one place.
        lag: k: how many places the right rear foot stands behind the left front foot as a cycle
            begins.
        per_tread: q: how many places every tread has, one behind the other.
        gait: One of GAITS.
    """

    treads: int = 2
    lag: int = 1
    per_tread: int = 1
    gait: str = WAVE

    @property
    def lift_off(self) -> dict[Leg, float]:
        """The fraction of the cycle at which each leg lifts off."""
        return TROT_LIFT_OFF if self.gait == TROT else LIFT_OFF

    def first(self, leg: Leg) -> int:
        """The place of a leg as a cycle begins, from the body's: it then steps `treads` on."""
        return self._first(leg) + self._middle

    def _first(self, leg: Leg) -> int:
        """The place of a leg as a cycle begins, from the left front foot's."""
        late = self.treads // 2 if self.lift_off[leg] >= 0.5 else 0
        return late - (self.lag if leg in (Leg(3), Leg(4)) else 0)

    @cached_property
    def _middle(self) -> int:
        """How many places behind the left front foot's the body's is: the nearest to the middle."""
        strokes = [self._first(leg) + self.treads * (0.5 - self.lift_off[leg]) for leg in LEGS]
        return -round(sum(strokes) / len(LEGS))

    def centre(self, leg: Leg, duty_factor: float) -> float:
        """Where the middle of a leg's stroke is, from the body's place [places]."""
        return self.first(leg) + self.treads * (0.5 * duty_factor - self.lift_off[leg])

    @cached_property
    def stance(self) -> float:
        """Distance of the middles of the front legs' strokes from the rear legs' [places]."""
        c = {leg: self.centre(leg, 1.0) for leg in LEGS}
        return 0.5 * (c[Leg(1)] + c[Leg(2)] - c[Leg(3)] - c[Leg(4)])

    def ahead(self, duty_factor: float) -> float:
        """How far the middle of all strokes is ahead of the body's place [places]."""
        return sum(self.centre(leg, duty_factor) for leg in LEGS) / len(LEGS)

    @property
    def shares_places(self) -> bool:
        """Whether a rear foot ever lands on the place where the front foot of its side stands."""
        return self.lag in (self.treads // 2, self.treads - self.treads // 2)

    @property
    def behind(self) -> int:
        """How many places behind the body's the rearmost foot stands as a cycle begins."""
        return max(0, *(-self.first(leg) for leg in LEGS))

    @property
    def beyond(self) -> int:
        """How many places ahead of the body's the foremost foot stands as a cycle begins."""
        return max(1, *(self.first(leg) for leg in LEGS))
