"""Turning a course from its first flight on, and room for a robot that does not turn with it."""

from dataclasses import dataclass, replace

import numpy as np

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.terrain import Box, Course, Lane
from drake_quad.terrain_box import rotation
from drake_quad.world_boxes import extent, face, grown, move_face, world_error

LEVEL_MIN = 0.3  # [m] of level ground that must be left between flights


@dataclass(eq=False)
class Group:
    """Flights of one lane with no level ground between: intervals `first` to `last`."""

    lane: int
    first: int
    last: int
    elements: list[int]
    shifts: FloatArray  # of each riser and of the last tread's end, along the lane [m]


def turned(
    lanes: list[Lane], boxes: list[Box], first: Group, yaw: float, source: str
) -> tuple[list[Lane], list[Box], float]:
    """Everything from the first flight on, turned; and how far from the pivot it reaches [m].

    The floor before the flight ends earlier, so that none of it lies past the turned nosing; an
    apron, level with it and turned with the flight, joins the two.
    """
    lane = lanes[first.lane]
    pivot, R = lane.point(lane.breaks[first.first]), rotation(yaw)
    element = first.elements[0]
    k = face(boxes, element - 1, lane.heading)
    width = extent(boxes[k], np.array([-lane.heading[1], lane.heading[0]]))
    cut = 0.5 * width * abs(float(np.tan(yaw)))
    left = extent(boxes[k], lane.heading) - cut
    if left < LEVEL_MIN:
        remedy = f"leaves {left:.2f} m of level ground before the first flight"
        raise world_error(source, "yaw_error_deg", float(np.degrees(yaw)), remedy)
    far = max(float(np.max(np.linalg.norm(b.corners() - pivot, axis=1))) for b in boxes)
    new = [
        box
        if box.element < element
        else replace(
            box,
            centre=read_only(np.array([*(pivot + R @ (box.centre[:2] - pivot)), box.centre[2]])),
            yaw=box.yaw + yaw,
        )
        for box in boxes
    ]
    move_face(new, element - 1, lane.heading, -cut)
    # In the turned frame the cut floor's far corner is this far behind the nosing.
    length = cut * float(np.cos(yaw)) + 0.5 * width * abs(float(np.sin(yaw)))
    old = boxes[k]
    apron = Box(
        name=f"{old.name}_apron",
        centre=read_only(np.array([*(pivot - 0.5 * length * (R @ lane.heading)), old.centre[2]])),
        size=read_only(np.array([length, width, old.size[2]])),
        yaw=lane.yaw + yaw,
        element=element - 1,
    )
    new.insert(k + 1, apron)
    moved = [
        lane
        if i < first.lane
        else replace(lane, p_WL=read_only(pivot + R @ (lane.p_WL - pivot)), yaw=lane.yaw + yaw)
        for i, lane in enumerate(lanes)
    ]
    return moved, new, far


def with_room(
    course: Course, lanes: list[Lane], boxes: list[Box], first: Group, by: float
) -> list[Box]:
    """The boxes, those of the end and of landings to turn on made larger where nothing is."""
    boxes = list(boxes)
    turn_elements = sorted(
        {
            box.element
            for box in boxes
            for lane in lanes[:-1]
            if "_tread_" not in box.name
            and np.allclose(box.centre[:2], lane.point(lane.length), atol=1e-6)
        }
    )
    for index, element in enumerate(turn_elements):
        if element < first.elements[0]:
            continue
        back, on = -lanes[index].heading, lanes[index + 1].heading
        k = next(i for i, box in enumerate(boxes) if box.element == element)
        for way in (*boxes[k].axes, *-boxes[k].axes):
            if way @ back < 0.5 and way @ on < 0.5:
                boxes[k] = grown(boxes[k], way, by)
    last = boxes[-1].element
    if last not in turn_elements and last > first.elements[0]:
        ahead = lanes[-1].heading
        left = np.array([-ahead[1], ahead[0]])
        for way in (ahead, left, -left):
            boxes[-1] = grown(boxes[-1], way, by)
    return boxes
