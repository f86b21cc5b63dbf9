"""The course as it really is: a map's errors applied to risers, flights and boxes.

All lengths are along the lanes' middle lines; boxes are turned and widened.

A turned flight is as if cut from endless stairs: its treads stand turned, and each lies on the
lane's middle line and is made wider, so that the flight's sides stay where the map has them.

From the map's Course comes another one with flights of other rises and runs, elsewhere, turned.
The ground under the robot's start stays as it is; floors and landings stay where the map has them,
level, and joined to what is before and after them. The lanes are the map's, straight, with the
risers where they really cross the middle line.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from drake_quad.common import FloatArray, read_only
from drake_quad.errors import InputError
from drake_quad.terrain.boxes import Box, Slab, face, make_box, move_face
from drake_quad.terrain.course import Course, foundation
from drake_quad.terrain.lane import Flight, Lane, flight_parts

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


def laid_boxes(
    course: Course,
    lanes: tuple[Lane, ...],
    groups: list[RiserGroup],
    offsets: dict[int, float],
    bottom: float,
) -> list[Box]:
    """The boxes of the course as it really is, in walking order.

    Args:
        course: The course as mapped.
        lanes: Lanes of the course with the errors, along their middle lines.
        groups: The flights, with their errors.
        offsets: Height that each element that is no flight is raised by [m], by its index.
        bottom: Height of the bottom of all that stands on the foundation [m].
    """
    boxes = [
        _raised(box, offsets[box.element], bottom) for box in course.boxes if box.element in offsets
    ]
    for group in groups:
        _join_before(boxes, course.lanes[group.lane], lanes[group.lane], group, bottom)
        _join_after(boxes, course.lanes[group.lane], lanes[group.lane], group, bottom)
        for flight, element in zip(group.flights, group.elements, strict=True):
            lane = lanes[group.lane]
            slabs = _flight_slabs(lane, lane.flights[flight], element)
            boxes += [make_box(slab, bottom) for slab in slabs]
    return sorted(boxes, key=lambda box: box.element)


def _raised(box: Box, by: float, bottom: float) -> Box:
    """The box, higher by `by` [m], and down to `bottom`; a slope, as deep as before."""
    top = box.top + by
    depth = float(box.size[2]) if box.gradient else top - bottom
    middle = top - 0.5 * depth * math.cos(box.pitch)
    return replace(
        box,
        centre=read_only(np.array([*box.centre[:2], middle])),
        size=read_only(np.array([*box.size[:2], depth])),
    )


def _flight_slabs(lane: Lane, flight: Flight, element: int) -> list[Slab]:
    """A flight's solids where the lane's breaks have them, all of its strip covered."""
    part = slice(flight.first, flight.last + 2)
    heights = lane.heights[flight.first - 1 : flight.last + 1]
    width = 2.0 * float(lane.half_widths[flight.first])
    slabs = []
    # Along the middle line a turned flight is longer than square to its nosings.
    along = flight._replace(overhang=flight.overhang / math.cos(flight.yaw))
    for name, start, end, top, thickness in flight_parts(along, lane.breaks[part], heights):
        size = (end - start) * math.cos(flight.yaw)
        slabs.append(
            Slab(
                f"stairs_{element}_{name}",
                lane.point(0.5 * (start + end)),
                (size, _width(width, size, flight.yaw)),
                lane.yaw + flight.yaw,
                top,
                element,
                thickness,
            )
        )
    return slabs


def _join_before(boxes: list[Box], old: Lane, lane: Lane, group: RiserGroup, bottom: float) -> None:
    """Makes the ground before a flight meet its first nosing.

    Below a first riser it reaches under the tread. Above one its own edge is the nosing: it ends
    earlier, straight, and an apron that is turned with the flight goes on to the nosing.
    """
    k = group.first - 1
    flight = lane.flights[group.flights[0]]
    edge = float(lane.breaks[group.first]) - flight.undercut / math.cos(group.yaw)
    by = edge - float(old.breaks[group.first] - flight.undercut)
    reach = aside(lane, k, group.yaw)
    rising = bool(lane.heights[group.first] > lane.heights[k])
    element = max(box.element for box in boxes if box.element < group.elements[0])
    move_face(boxes, element, lane.heading, by + reach if rising else by - reach)
    if group.yaw != 0.0 and not rising:
        boxes.append(_apron(boxes, lane, group, element, edge, bottom, sign=-1.0))


def _join_after(boxes: list[Box], old: Lane, lane: Lane, group: RiserGroup, bottom: float) -> None:
    """Makes the ground after a flight meet its last tread: level with it, by an apron too."""
    k = group.last + 1
    edge = float(lane.breaks[k])
    element = min(box.element for box in boxes if box.element > group.elements[-1])
    reach = aside(lane, k, group.yaw)
    move_face(boxes, element, -lane.heading, float(old.breaks[k]) - edge - reach)
    if group.yaw != 0.0:
        boxes.append(_apron(boxes, lane, group, element, edge, bottom, sign=1.0))


def _apron(
    boxes: list[Box],
    lane: Lane,
    group: RiserGroup,
    element: int,
    edge: float,
    bottom: float,
    *,
    sign: float,
) -> Box:
    """A level box, turned with the flight, from its end to where the ground is whole again.

    Args:
        boxes: Boxes of the course, the ground already cut back.
        lane: The lane with the errors.
        group: The flight.
        element: Index of the level element beside it.
        edge: Where the flight's end crosses the middle line [m].
        bottom: Height of the foundation's bottom [m].
        sign: -1 before the flight, 1 after it.
    """
    ground = boxes[face(boxes, element, -sign * lane.heading)]
    k = group.first - 1 if sign < 0.0 else group.last + 1
    width = 2.0 * float(lane.half_widths[k])
    # From the cut's far corner to the flight's end, square to that.
    length = width * abs(math.sin(group.yaw))
    slab = Slab(
        f"{ground.name}_apron_{'before' if sign < 0.0 else 'after'}",
        lane.point(edge + sign * 0.5 * length / math.cos(group.yaw)),
        (length, _width(width, length, group.yaw)),
        lane.yaw + group.yaw,
        ground.top,
        element,
    )
    return make_box(slab, bottom)


def _width(width: float, length: float, yaw: float) -> float:
    """How wide a turned box, `length` deep, must be to cover a strip of `width` [m]."""
    return width / math.cos(yaw) + length * abs(math.tan(yaw))


YAW_MIN = 1e-6  # [rad] what is less is no turn: no slivers of ground a micron long


@dataclass(frozen=True, kw_only=True)
class MapErrors:
    """How the real course differs from the map.

    Attributes:
        rise: Error added to every rise [m].
        run: Error added to every run [m]; the flight's middle stays where it is.
        position: Shift of each flight along its lane [m]. The level ground before it
            is so much longer, the ground after it so much shorter.
        yaw: Turn of each flight about its own middle [rad], left positive.
        tread: Each tread is higher or lower by up to this [m], drawn evenly; what follows a flight
            is level with its last tread.
        random: Whether rise and run (for all flights), position and yaw (for each flight) are
            drawn evenly between minus and plus the value, or taken as they are.
    """

    rise: float = 0.0
    run: float = 0.0
    position: float = 0.0
    yaw: float = 0.0
    tread: float = 0.0
    random: bool = False


def build_as_built(
    course: Course,
    errors: MapErrors,
    *,
    generator: np.random.Generator,
    source: str = "scenario",
) -> Course:
    """Returns the real course; `course` itself if there are no errors, or no stairs.

    Where the map has ground there is some, if perhaps of another height. Flights with no level
    ground between them move and turn as one.

    Boxes of the real course may overlap: where a flight is turned, its ends reach over ground that
    is lower, or lie on ground that is level with them. The highest counts, and level tops make no
    edge: a foot on both is borne by both, at the same height and along the same normal.

    Args:
        course: The map.
        errors: How the course differs from it.
        generator: Source of all random numbers, which are drawn in a fixed order.
        source: What an error names as the holder of the fields, the file.

    Raises:
        InputError: A step without rise, a tread too short for a foot, no level ground left, or a
            slope right beside stairs.
    """
    groups = find_groups(course)
    if errors == replace(MapErrors(), random=errors.random) or not groups:
        return course
    if course.returning:
        turn = course.turns[len(course.outward) - 1]
        outward = course.without_way_back()
        built = build_as_built(outward, errors, generator=generator, source=source)
        return built.with_way_back(turn)
    refuse_slopes(course, groups, source)
    rise, run = _draw(groups, errors, generator)
    breaks = [moved_breaks(lane, i, groups, run, source) for i, lane in enumerate(course.lanes)]
    heights, offsets = moved_heights(course, groups, rise, errors.tread, generator, source)
    yaws = {(group.lane, k): group.yaw for group in groups for k in group.flights}
    lanes = tuple(
        replace(
            lane,
            breaks=read_only(b),
            heights=read_only(h),
            flights=tuple(f._replace(yaw=yaws[i, k]) for k, f in enumerate(lane.flights)),
        )
        for i, (lane, b, h) in enumerate(zip(course.lanes, breaks, heights, strict=True))
    )
    boxes = laid_boxes(course, lanes, groups, offsets, foundation(lanes))
    return Course(lanes=lanes, turns=course.turns, boxes=tuple(boxes))


def _draw(
    groups: list[RiserGroup], errors: MapErrors, generator: np.random.Generator
) -> tuple[float, float]:
    """What is added to every rise and to every run [m]; sets the groups' place and yaw."""
    n = len(groups)
    draws = generator.uniform(-1.0, 1.0, size=2 + 2 * n)
    signs = draws if errors.random else np.ones_like(draws)
    for group, place, turn in zip(groups, signs[2 : 2 + n], signs[2 + n :], strict=True):
        group.position = float(place) * errors.position
        yaw = float(turn) * errors.yaw
        group.yaw = yaw if abs(yaw) > YAW_MIN else 0.0
    return float(signs[0]) * errors.rise, float(signs[1]) * errors.run
