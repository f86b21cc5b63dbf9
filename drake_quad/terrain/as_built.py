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
from drake_quad.terrain.boxes import Box, Slab, face, make_box, move_face
from drake_quad.terrain.course import Course, foundation
from drake_quad.terrain.lane import Flight, Lane, flight_parts
from drake_quad.terrain.moved_risers import (
    RiserGroup,
    aside,
    drawn_tilts,
    find_groups,
    moved_breaks,
    moved_heights,
    refuse_slopes,
)


def laid_boxes(
    course: Course,
    lanes: tuple[Lane, ...],
    groups: list[RiserGroup],
    offsets: dict[int, float],
    bottom: float,
    tilts: dict[int, FloatArray],
) -> list[Box]:
    """The boxes of the course as it really is, in walking order.

    Args:
        course: The course as mapped.
        lanes: Lanes of the course with the errors, along their middle lines.
        groups: The flights, with their errors.
        offsets: Height that each element that is no flight is raised by [m], by its index.
        bottom: Height of the bottom of all that stands on the foundation [m].
        tilts: By how much each tread of a flight rises along its lane [m/m], by the flight's
            element.
    """
    boxes = [
        _raised(box, offsets[box.element], bottom) for box in course.boxes if box.element in offsets
    ]
    for group in groups:
        _join_before(boxes, course.lanes[group.lane], lanes[group.lane], group, bottom)
        _join_after(boxes, course.lanes[group.lane], lanes[group.lane], group, bottom)
        for flight, element in zip(group.flights, group.elements, strict=True):
            lane = lanes[group.lane]
            slabs = _flight_slabs(lane, lane.flights[flight], element, tilts[element])
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


def _flight_slabs(lane: Lane, flight: Flight, element: int, tilts: FloatArray) -> list[Slab]:
    """A flight's solids where the lane's breaks have them, all of its strip covered.

    Args:
        lane: The lane with the errors.
        flight: The flight.
        element: Index of its element of the course.
        tilts: By how much each of its treads rises along the lane, about its middle (n,) [m/m].
    """
    part = slice(flight.first, flight.last + 2)
    heights = lane.heights[flight.first - 1 : flight.last + 1]
    width = 2.0 * float(lane.half_widths[flight.first])
    slabs = []
    # Along the middle line a turned flight is longer than square to its nosings.
    along = flight._replace(overhang=flight.overhang / math.cos(flight.yaw))
    for name, start, end, top, thickness in flight_parts(along, lane.breaks[part], heights):
        size = (end - start) * math.cos(flight.yaw)
        kind, _, number = name.partition("_")
        gradient = 0.0
        if kind in ("tread", "nose") and tilts[int(number) - 1] != 0.0:
            k = flight.first + int(number) - 1
            middle = 0.5 * float(lane.breaks[k] + lane.breaks[k + 1])
            gradient = float(tilts[int(number) - 1])
            top += gradient * (0.5 * (start + end) - middle) * math.cos(flight.yaw)
        slabs.append(
            Slab(
                f"stairs_{element}_{name}",
                lane.point(0.5 * (start + end)),
                (size, _width(width, size, flight.yaw)),
                lane.yaw + flight.yaw,
                top,
                element,
                thickness,
                gradient,
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
        tilt: Each tread but a flight's last falls so much towards its nosing, about its middle
            [m/m], as worn ones do.
        random: Whether rise and run (for all flights), position and yaw (for each flight) and tilt
            (for each tread) are drawn evenly between minus and plus the value, or taken as they
            are.
    """

    rise: float = 0.0
    run: float = 0.0
    position: float = 0.0
    yaw: float = 0.0
    tread: float = 0.0
    tilt: float = 0.0
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
    tilts = drawn_tilts(
        lanes, groups, errors.tilt, generator if errors.random and errors.tilt else None, source
    )
    boxes = laid_boxes(course, lanes, groups, offsets, foundation(lanes), tilts)
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
