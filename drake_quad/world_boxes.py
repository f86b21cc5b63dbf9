"""The boxes of the course as it really is: flights moved and turned, the level ground to meet them.

A turned flight is as if cut from endless stairs: its treads stand turned, and each lies on the
lane's middle line and is made wider, so that the flight's sides stay where the map has them.
"""

import math
from dataclasses import replace

import numpy as np

from drake_quad.gait.legs import read_only
from drake_quad.terrain import Box, Course, Flight, Lane
from drake_quad.terrain_box import Slab, make_box
from drake_quad.terrain_faces import face, move_face
from drake_quad.terrain_flight import flight_parts
from drake_quad.world_profile import Group, aside


def laid_boxes(
    course: Course,
    lanes: tuple[Lane, ...],
    groups: list[Group],
    offsets: dict[int, float],
    bottom: float,
) -> list[Box]:
    """The boxes of the course as it really is, in walking order.

    Args:
        course: The map.
        lanes: Its lanes with the errors, along their middle lines.
        groups: The flights, with their errors.
        offsets: By how much the elements that are no flights are higher [m], by their index.
        bottom: Of all that stands on the foundation [m].
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


def _join_before(boxes: list[Box], old: Lane, lane: Lane, group: Group, bottom: float) -> None:
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


def _join_after(boxes: list[Box], old: Lane, lane: Lane, group: Group, bottom: float) -> None:
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
    group: Group,
    element: int,
    edge: float,
    bottom: float,
    *,
    sign: float,
) -> Box:
    """A level box, turned with the flight, from its end to where the ground is whole again.

    Args:
        boxes: Those of the course, the ground already cut back.
        lane: The lane with the errors.
        group: The flight.
        element: Index of the level element beside it.
        edge: Where the flight's end crosses the middle line [m].
        bottom: Of the foundation [m].
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
