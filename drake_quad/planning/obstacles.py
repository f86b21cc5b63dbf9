"""Where feet step on account of curbs and blocks: on both sides of them, or on their middle."""

from dataclasses import dataclass
from math import inf

from drake_quad.terrain import Lane

SHORTEST_BLOCK = 0.4  # of the spacing: on a shorter one no foot steps
LONGEST_BLOCK = 1.5  # of the spacing: a longer one is a step up, and then a step down
NEAREST = 0.2  # of the spacing: a place on account of an obstacle is no nearer to the one before


@dataclass(frozen=True)
class Obstacle:
    """A curb or a block on the way.

    Attributes:
        start: Where it begins along the lane [m].
        end: Where it ends: a curb where it begins [m].
        places: Where it asks for a foot [m].
        room: Least distance of those from the place before, and from the goal [m].
    """

    start: float
    end: float
    places: tuple[float, ...]
    room: float


def find_obstacles(lane: Lane, spacing: float, deep: float = inf) -> list[Obstacle]:
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


def pin_obstacles(
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
            if pins[-1] + obstacle.room < place < goal - obstacle.room:
                pins.append(place)
                level.append(not over)
                over = True
    return end
