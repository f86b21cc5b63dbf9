"""The boxes of the course as it really is: flights moved and turned, the level ground meeting them.

A turned flight is as if cut from endless stairs: its treads stand turned, and each lies on the
lane's middle line and is made wider, so that the flight's sides stay where the map has them.
"""

import math

import numpy as np

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.terrain import Box, Course
from drake_quad.world_boxes import face, move_face, placed, standing
from drake_quad.world_profile import Group, aside


def laid_boxes(
    course: Course, groups: list[Group], breaks: list[FloatArray], offsets: dict[str, float]
) -> list[Box]:
    """The boxes of the map, moved; each with its bottom at 0.

    Args:
        course: The map.
        groups: Its flights, with their errors.
        breaks: Of each lane, where its risers really cross the middle line [m].
        offsets: By how much each box's top is higher [m], by its name.
    """
    boxes = [standing(box, box.top + offsets[box.name], 0.0) for box in course.boxes]
    for group in groups:
        _lay_treads(boxes, course, group, breaks[group.lane])
        _join_before(boxes, course, group, breaks[group.lane])
        _join_after(boxes, course, group, breaks[group.lane])
    return sorted(boxes, key=lambda box: box.element)


def _lay_treads(boxes: list[Box], course: Course, group: Group, breaks: FloatArray) -> None:
    """Puts the treads where the breaks have them, turned, all of the lane's strip covered."""
    lane = course.lanes[group.lane]
    own = [k for k, box in enumerate(boxes) if box.element in group.elements]
    for i, k in enumerate(own, start=group.first):
        run = float(breaks[i + 1] - breaks[i]) * math.cos(group.yaw)
        width = _width(float(boxes[k].size[1]), run, group.yaw)
        middle = lane.point(0.5 * (breaks[i] + breaks[i + 1]))
        boxes[k] = placed(boxes[k], middle, (run, width), yaw=lane.yaw + group.yaw)


def _join_before(boxes: list[Box], course: Course, group: Group, breaks: FloatArray) -> None:
    """Makes the ground before the flight meet its first nosing.

    Below a first riser it reaches under the tread. Above one its own edge is the nosing: it ends
    earlier, straight, and an apron that is turned with the flight goes on to the nosing.
    """
    lane, k = course.lanes[group.lane], group.first - 1
    by = float(breaks[group.first] - lane.breaks[group.first])
    reach = aside(lane, k, group.yaw)
    rising = bool(lane.heights[group.first] > lane.heights[k])
    element = group.elements[0] - 1
    move_face(boxes, element, lane.heading, by + reach if rising else by - reach)
    if group.yaw != 0.0 and not rising:
        edge = float(breaks[group.first])
        boxes.append(_apron(boxes, course, group, element, edge, sign=-1.0))


def _join_after(boxes: list[Box], course: Course, group: Group, breaks: FloatArray) -> None:
    """Makes the ground after the flight meet its last tread: level with it, by an apron too."""
    lane, k = course.lanes[group.lane], group.last + 1
    by = float(breaks[k] - lane.breaks[k])
    element = group.elements[-1] + 1
    move_face(boxes, element, -lane.heading, -by - aside(lane, k, group.yaw))
    if group.yaw != 0.0:
        boxes.append(_apron(boxes, course, group, element, float(breaks[k]), sign=1.0))


def _apron(
    boxes: list[Box], course: Course, group: Group, element: int, edge: float, *, sign: float
) -> Box:
    """A level box, turned with the flight, from its end to where the ground is whole again.

    Args:
        boxes: Those of the course, the ground already cut back.
        course: The map.
        group: The flight.
        element: Index of the level element beside it.
        edge: Where the flight's end crosses the middle line [m].
        sign: -1 before the flight, 1 after it.
    """
    lane = course.lanes[group.lane]
    ground = boxes[face(boxes, element, -sign * lane.heading)]
    k = group.first - 1 if sign < 0.0 else group.last + 1
    half = float(lane.half_widths[k])
    # From the cut's far corner to the flight's end, square to that.
    length = 2.0 * half * abs(math.sin(group.yaw))
    middle = lane.point(edge + sign * 0.5 * length / math.cos(group.yaw))
    return Box(
        name=f"{ground.name}_apron_{'before' if sign < 0.0 else 'after'}",
        centre=read_only(np.array([*middle, ground.centre[2]])),
        size=read_only(np.array([length, _width(2.0 * half, length, group.yaw), ground.size[2]])),
        yaw=lane.yaw + group.yaw,
        element=element,
    )


def _width(width: float, length: float, yaw: float) -> float:
    """How wide a turned box, `length` deep, must be to cover a strip of `width` [m]."""
    return width / math.cos(yaw) + length * abs(math.tan(yaw))
