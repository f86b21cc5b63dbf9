"""The course as it really is: unlike the map that the controller plans on.

From the map's Course comes another one with other rises, runs, places and heading. The ground
under the robot's start stays as it is; landings stay level, and joined to what is before and after
them. The lanes are the map's, moved: beside a turned flight they are right on the flight and past
it, not on the floor before.
"""

from dataclasses import dataclass, replace

import numpy as np

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.terrain import FOUNDATION, Box, Course, Lane
from drake_quad.world_boxes import move_face, placed, standing, world_error
from drake_quad.world_turn import LEVEL_MIN, Group, turned, with_room

RISE_MIN = 0.002  # [m] what is less is no riser
RUN_MIN = 0.10  # [m]


@dataclass(frozen=True, kw_only=True)
class WorldErrors:
    """How the real course differs from the map.

    Attributes:
        rise: Added to every rise [m].
        run: Added to every run [m]; the flight's middle stays where it is.
        position: By which each flight is farther along its lane [m]. The level ground before it
            is so much longer, the ground after it so much shorter.
        yaw: By which everything from the first flight on is turned about the middle of that
            flight's first nosing [rad], left positive.
        tread: Each tread is higher or lower by up to this [m], drawn evenly; what follows a flight
            is level with its last tread.
        random: Whether rise, run, yaw, and position (for each flight) are drawn evenly between
            minus and plus the value, or taken as they are.
    """

    rise: float = 0.0
    run: float = 0.0
    position: float = 0.0
    yaw: float = 0.0
    tread: float = 0.0
    random: bool = False


def build_world(
    course: Course,
    errors: WorldErrors,
    *,
    generator: np.random.Generator,
    source: str = "scenario",
) -> Course:
    """Returns the real course; `course` itself if there are no errors, or no stairs.

    So that a robot that keeps to the map still has ground under it, the last element reaches
    farther ahead and aside, and landings to turn on reach farther on the sides that no flight
    meets, by as much as the errors move them.

    Args:
        course: The map.
        errors: How the course differs from it.
        generator: What is random comes from here, always the same numbers in the same order.
        source: What an error names as the holder of the fields, the file.

    Raises:
        InputError: A step without rise, a tread too short for a foot, or no level ground left.
    """
    groups = _find_groups(course)
    if errors == replace(WorldErrors(), random=errors.random) or not groups:
        return course
    draws = generator.uniform(-1.0, 1.0, size=3 + len(groups))
    signs = draws if errors.random else np.ones_like(draws)
    rise, run, yaw = signs[:3] * (errors.rise, errors.run, errors.yaw)
    for group, sign in zip(groups, signs[3:], strict=True):
        n = group.last + 1 - group.first
        group.shifts = sign * errors.position + run * (np.arange(n + 1) - 0.5 * n)
    breaks = [_moved_breaks(lane, i, groups, source) for i, lane in enumerate(course.lanes)]
    heights, offsets = _moved_heights(course, rise, errors.tread, generator, source)
    boxes = _moved_boxes(course, groups, breaks, offsets)
    lanes = [
        replace(lane, breaks=read_only(b), heights=read_only(h))
        for lane, b, h in zip(course.lanes, breaks, heights, strict=True)
    ]
    moved = max(float(np.max(np.abs(group.shifts))) for group in groups)
    if yaw != 0.0:
        lanes, boxes, far = turned(lanes, boxes, groups[0], float(yaw), source)
        moved += far * abs(float(np.sin(yaw)))
    boxes = with_room(course, lanes, boxes, groups[0], moved)
    bottom = min(box.top for box in boxes) - FOUNDATION
    return Course(
        lanes=tuple(lanes),
        turns=course.turns,
        boxes=tuple(standing(box, box.top, bottom) for box in boxes),
    )


def _find_groups(course: Course) -> list[Group]:
    """The flights in walking order, those that meet put together."""
    elements = list(dict.fromkeys(box.element for box in course.boxes if "_tread_" in box.name))
    groups: list[Group] = []
    for index, lane in enumerate(course.lanes):
        for flight in lane.flights:
            element = elements.pop(0)
            before = groups[-1] if groups else None
            if before and (before.lane, before.last + 1) == (index, flight.first):
                before.last = flight.last
                before.elements.append(element)
            else:
                group = Group(index, flight.first, flight.last, [element], np.zeros(0))
                groups.append(group)
    return groups


def _moved_breaks(lane: Lane, index: int, groups: list[Group], source: str) -> FloatArray:
    """The lane's breaks, its risers shifted."""
    breaks = np.array(lane.breaks)
    for group in groups:
        if group.lane == index:
            breaks[group.first : group.last + 2] += group.shifts
    for kind, length in zip(lane.kinds, np.diff(breaks), strict=True):
        if kind == "tread" and length < RUN_MIN:
            raise world_error(
                source, "run_error", length, f"leaves a tread less than {RUN_MIN} m deep"
            )
    for group in groups:
        if group.lane != index:
            continue
        for k in (group.first - 1, group.last + 1):
            left, before = breaks[k + 1] - breaks[k], lane.breaks[k + 1] - lane.breaks[k]
            if left < min(LEVEL_MIN, before):
                remedy = f"leaves {left:.2f} m of level ground beside a flight"
                raise world_error(
                    source, "position_error", left, f"{remedy}: at least {LEVEL_MIN} m"
                )
    return breaks


def _moved_heights(
    course: Course, rise: float, tread: float, generator: np.random.Generator, source: str
) -> tuple[list[FloatArray], dict[str, float]]:
    """The lanes' heights, and by how much each box's top is higher, by its name [m]."""
    offset, heights, offsets = 0.0, [], {}
    names = [box.name for box in course.boxes if "_tread_" in box.name]
    after: dict[int, float] = {}
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
            below = np.concatenate([[new[flight.first - 1]], new[flight.first : flight.last + 1]])
            if np.min(sign * np.diff(below)) < RISE_MIN:
                least = float(np.min(sign * np.diff(below)))
                field = "rise_error" if tread == 0.0 else "tread_error"
                raise world_error(
                    source, field, least, f"leaves a step with a rise of {least:.3f} m"
                )
            for value in own:
                offsets[names.pop(0)] = float(value)
            offset, done = float(own[-1]), flight.last + 1
            element = next(b.element for b in course.boxes if b.name == _last(offsets))
            after[element] = offset
        new[done:] += offset
        heights.append(new)
    for box in course.boxes:
        if box.name not in offsets:
            before = [element for element in after if element < box.element]
            offsets[box.name] = after[max(before)] if before else 0.0
    return heights, offsets


def _last(names: dict[str, float]) -> str:
    return next(reversed(names))


def _moved_boxes(
    course: Course, groups: list[Group], breaks: list[FloatArray], offsets: dict[str, float]
) -> list[Box]:
    """The boxes, shifted along their lanes and raised."""
    boxes = [standing(box, box.top + offsets[box.name], 0.0) for box in course.boxes]
    for group in groups:
        lane = course.lanes[group.lane]
        b = breaks[group.lane]
        own = [k for k, box in enumerate(boxes) if box.element in group.elements]
        for i, k in enumerate(own, start=group.first):
            middle = lane.point(0.5 * (b[i] + b[i + 1]))
            run = float(b[i + 1] - b[i])
            size = boxes[k].size
            boxes[k] = placed(boxes[k], middle, (run, float(size[1])))
        ahead = lane.heading
        move_face(boxes, group.elements[0] - 1, ahead, float(group.shifts[0]))
        move_face(boxes, group.elements[-1] + 1, -ahead, -float(group.shifts[-1]))
    return boxes
