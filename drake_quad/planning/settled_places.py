"""Places along a lane that are settled before a walk is divided into strides.

They are the walk's ends, those on treads, and those beside curbs and blocks: such an obstacle has a
place on either side, or one on its middle.
"""

from dataclasses import dataclass, field
from math import inf

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.terrain.lane import Flight, Lane

SHORTEST_BLOCK = 0.4  # of the spacing: on a shorter one no foot steps
LONGEST_BLOCK = 1.5  # of the spacing: a longer one is a step up, and then a step down
NEAREST = 0.2  # of the spacing: a place on account of an obstacle is no nearer to the one before
SHORTEST_LANDING = 0.4  # of a tread: on a shorter one between two flights there is no place


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


@dataclass(frozen=True, eq=False)
class Pins:
    """The places that flights and obstacles settle; level spans between them may be divided.

    Attributes:
        places: Where they are, from the walk's start to its goal [m].
        level: Whether the span after each but the last may be divided.
        begins: Which of them are the first places of flights.
    """

    places: list[float]
    level: list[bool] = field(default_factory=list)
    begins: list[int] = field(default_factory=list)

    def add(self, place: float, *, level: bool) -> None:
        """Appends a place [m]; `level` says whether the span before it may be divided."""
        self.places.append(place)
        self.level.append(level)


def pin_flights(
    lane: Lane,
    obstacles: list[Obstacle],
    start: float,
    goal: float,
    over: tuple[Flight | None, Flight | None],
    *,
    per_tread: int,
    deep: float,
) -> Pins:
    """The places of a walk that are settled: its ends, those on treads, those beside obstacles.

    Args:
        lane: The lane.
        obstacles: Curbs and blocks on it, in walking order; emptied.
        start: Where the body starts, a place [m].
        goal: Where it ends, a place [m].
        over: The flights on which it starts and ends, or None.
        per_tread: How many places every tread has.
        deep: Depth of treads from which a flight is none [m].

    Raises:
        PlanningError: If there is no room to step between start, flights and goal.
    """
    begun, ended = over
    pins = Pins([start])
    end = start  # of the flight before
    for flight in lane.close_flights(deep):
        treads = lane.treads(flight)
        first, last = treads[0], treads[-1]
        if last[1] < start or first[0] > goal:
            continue
        end = snap_to_obstacles(
            obstacles, until=first[0], goal=goal, end=end, pins=pins.places, level=pins.level
        )
        before = first[0] - 0.5 * (first[1] - first[0]) / per_tread
        if flight == begun:
            pass  # it starts on a tread of this one
        elif before >= pins.places[-1] - 1e-6:
            pins.add(before, level=True)
        elif len(pins.places) == 1:
            raise PlanningError(
                f"the walk starts {first[0] - start:.2f} m before a flight; "
                f"{first[0] - before:.2f} m are needed",
                start=start,
                flight=float(first[0]),
            )
        elif first[0] - end < SHORTEST_LANDING * (first[1] - first[0]):
            pins.places.pop()  # from tread to tread
            pins.level.pop()
        else:
            pins.places[-1] = 0.5 * (end + first[0])  # one place serves both flights
        if flight != begun:
            pins.begins.append(len(pins.places))
        for a, b, _ in treads:
            for k in range(1, 2 * per_tread, 2):
                place = ((2 * per_tread - k) * a + k * b) / (2 * per_tread)
                if (flight == begun and place <= start + 1e-9) or (
                    flight == ended and place >= goal - 1e-9
                ):
                    continue
                pins.add(place, level=False)
        if flight == ended:
            break
        end = last[1]
        pins.add(end + 0.5 * (end - last[0]) / per_tread, level=False)
    if ended is None:
        snap_to_obstacles(
            obstacles, until=goal, goal=goal, end=end, pins=pins.places, level=pins.level
        )
    if goal < pins.places[-1] - 1e-6:
        raise PlanningError(
            f"the walk ends {goal - start:.2f} m on, too near behind a flight or before its start",
            goal=goal,
        )
    if ended is None or goal > pins.places[-1] + 1e-9:
        pins.add(goal, level=ended is None)
    return pins
