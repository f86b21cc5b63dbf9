"""Where risers and treads of a map's flights really are: errors applied along the lanes.

All lengths are along the lanes' middle lines.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane

RISE_MIN = 0.002  # [m] what is less is no riser
RUN_MIN = 0.10  # [m]
LEVEL_MIN = 0.3  # [m] of level ground that must be left between flights


@dataclass(eq=False)
class RiserGroup:
    """Flights of one lane with no level ground between: intervals `first` to `last`.

    Attributes:
        lane: Index of the lane.
        first: Index of its first interval on the lane.
        last: Index of its last interval on the lane.
        flights: Indices of its flights on the lane.
        elements: Indices of their elements of the course.
        position: Shift along the lane [m].
        yaw: Turn about its middle [rad], left positive.
    """

    lane: int
    first: int
    last: int
    flights: list[int]
    elements: list[int]
    position: float = 0.0
    yaw: float = 0.0


def find_groups(course: Course) -> list[RiserGroup]:
    """The flights in walking order, those that meet put together."""
    elements = list(dict.fromkeys(box.element for box in course.boxes if "_tread_" in box.name))
    groups: list[RiserGroup] = []
    for index, lane in enumerate(course.outward):
        for k, flight in enumerate(lane.flights):
            element = elements.pop(0)
            before = groups[-1] if groups else None
            if before and (before.lane, before.last + 1) == (index, flight.first):
                before.last = flight.last
                before.flights.append(k)
                before.elements.append(element)
            else:
                groups.append(RiserGroup(index, flight.first, flight.last, [k], [element]))
    return groups


def aside(lane: Lane, interval: int, yaw: float) -> float:
    """How far a line turned by `yaw` is ahead where it crosses the interval's side [m]."""
    return float(lane.half_widths[interval]) * abs(float(np.tan(yaw)))


def moved_breaks(
    lane: Lane, index: int, groups: list[RiserGroup], run: float, source: str
) -> FloatArray:
    """The breaks of lane `index` with its risers where they cross the middle line [m].

    Raises:
        InputError: A tread too short, or too little level ground beside a flight.
    """
    breaks, straight = np.array(lane.breaks), np.array(lane.breaks)
    own = [group for group in groups if group.lane == index]
    for group in own:
        part = slice(group.first, group.last + 2)
        old = lane.breaks[part]
        middle = 0.5 * (old[0] + old[-1])
        n = group.last + 1 - group.first
        new = old - middle + run * (np.arange(n + 1) - 0.5 * n)
        if np.min(np.diff(new)) < RUN_MIN:
            remedy = f"leaves a tread less than {RUN_MIN} m deep"
            raise map_error(source, "run_error", float(np.min(np.diff(new))), remedy)
        straight[part] = middle + group.position + new
        breaks[part] = middle + group.position + new / np.cos(group.yaw)
    for group in own:
        for k in (group.first - 1, group.last + 1):
            turned = [aside(lane, k, g.yaw) for g in own if k in (g.first - 1, g.last + 1)]
            least = min(LEVEL_MIN, float(lane.breaks[k + 1] - lane.breaks[k]))
            _check_left("position_error", straight[k + 1] - straight[k], least, source)
            left = breaks[k + 1] - breaks[k] - sum(turned)
            _check_left("yaw_error_deg", left, max(least, 2.0 * max(turned)), source)
    return breaks


def _check_left(field: str, left: float, least: float, source: str) -> None:
    """Raises if less level ground is left straight than the least, on which aprons lie."""
    if left < least:
        remedy = f"leaves {max(left, 0.0):.2f} m of level ground beside a flight"
        raise map_error(source, field, left, f"{remedy}: at least {least:.2f} m")


def moved_heights(
    course: Course,
    groups: list[RiserGroup],
    rise: float,
    tread: float,
    generator: np.random.Generator,
    source: str,
) -> tuple[list[FloatArray], dict[int, float]]:
    """The lanes' heights; and by how much other elements than flights are higher, by index [m].

    Raises:
        InputError: A step without rise.
    """
    elements = iter(element for group in groups for element in group.elements)
    offset = 0.0
    heights: list[FloatArray] = []
    after: dict[int, float] = {-1: 0.0}
    for lane in course.lanes:
        new = np.array(lane.heights)
        done = 0
        for flight in lane.flights:
            new[done : flight.first] += offset
            sign = 1.0 if flight.going == "up" else -1.0
            n = flight.last + 1 - flight.first
            own = offset + sign * rise * np.arange(1, n + 1)
            own += tread * generator.uniform(-1.0, 1.0, size=n)
            new[flight.first : flight.last + 1] += own
            least = float(np.min(sign * np.diff(new[flight.first - 1 : flight.last + 1])))
            if least < RISE_MIN + flight.thickness:
                field = "rise_error" if tread == 0.0 else "tread_error"
                remedy = f"leaves a step with a rise of {least:.3f} m"
                raise map_error(source, field, least, remedy)
            offset, done = float(own[-1]), flight.last + 1
            after[next(elements)] = offset
        new[done:] += offset
        heights.append(new)
    others = {box.element for box in course.boxes} - set(after)
    return heights, {k: after[max(e for e in after if e < k)] for k in others}


def refuse_slopes(course: Course, groups: list[RiserGroup], source: str) -> None:
    """Raises where a flight has a slope right beside it: no level ground that can give way."""
    for group in groups:
        kinds = course.lanes[group.lane].kinds
        for k in (group.first - 1, group.last + 1):
            if kinds[k] == "slope":
                element = group.elements[0] if k < group.first else group.elements[-1]
                raise InputError(
                    source=source,
                    field=f"course[{element}].kind",
                    value="stairs",
                    remedy="with errors of the world it needs level ground between it and a slope",
                )


def map_error(source: str, field: str, value: float, remedy: str) -> InputError:
    """The error at a field of the world, with the figure that it leads to."""
    return InputError(source=source, field=f"world.{field}", value=round(value, 4), remedy=remedy)


def drawn_tilts(
    lanes: Sequence[Lane],
    groups: list[RiserGroup],
    tilt: float,
    generator: np.random.Generator | None,
    source: str,
) -> dict[int, FloatArray]:
    """By how much each tread of each flight's element rises along its lane (n,) [m/m].

    Args:
        lanes: The lanes with the other errors.
        groups: Their flights.
        tilt: How much each tread falls towards its nosing [m/m].
        generator: Draws how much of it, evenly between minus and plus; all of it if None.
        source: What an error names.

    Raises:
        InputError: A step without rise.
    """
    tilts = {}
    for group in groups:
        lane = lanes[group.lane]
        for k, element in zip(group.flights, group.elements, strict=True):
            flight = lane.flights[k]
            n = flight.last + 1 - flight.first
            fall = np.full(n, tilt)
            if generator is not None:
                fall *= generator.uniform(-1.0, 1.0, size=n)
            fall[-1] = 0.0  # it is part of the level ground after it
            runs = np.diff(lane.breaks[flight.first : flight.last + 2])
            heights = lane.heights[flight.first - 1 : flight.last + 1]
            sides = np.concatenate([[0.0], 0.5 * fall * runs])  # of what is before it and of each
            least = float(np.min(np.abs(np.diff(heights)) - sides[:-1] - sides[1:]))
            if least < RISE_MIN + flight.thickness:
                remedy = f"leaves a step with a rise of {least:.3f} m"
                raise map_error(source, "tread_tilt", least, remedy)
            tilts[element] = fall if flight.going == "up" else -fall
    return tilts
