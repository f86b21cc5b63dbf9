"""The course as it really is: unlike the map that the controller plans on.

From the map's Course comes another one with flights of other rises and runs, elsewhere, turned.
The ground under the robot's start stays as it is; floors and landings stay where the map has them,
level, and joined to what is before and after them. The lanes are the map's, straight, with the
risers where they really cross the middle line.
"""

from dataclasses import dataclass, replace

import numpy as np

from drake_quad.gait.legs import read_only
from drake_quad.terrain import Course, foundation
from drake_quad.world_boxes import laid_boxes
from drake_quad.world_profile import (
    Group,
    find_groups,
    moved_breaks,
    moved_heights,
    refuse_slopes,
)

YAW_MIN = 1e-6  # [rad] what is less is no turn: no slivers of ground a micron long


@dataclass(frozen=True, kw_only=True)
class WorldErrors:
    """How the real course differs from the map.

    Attributes:
        rise: Added to every rise [m].
        run: Added to every run [m]; the flight's middle stays where it is.
        position: By which each flight is farther along its lane [m]. The level ground before it
            is so much longer, the ground after it so much shorter.
        yaw: By which each flight is turned about its own middle [rad], left positive.
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


def build_world(
    course: Course,
    errors: WorldErrors,
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
        generator: What is random comes from here, always the same numbers in the same order.
        source: What an error names as the holder of the fields, the file.

    Raises:
        InputError: A step without rise, a tread too short for a foot, no level ground left, or a
            slope right beside stairs.
    """
    groups = find_groups(course)
    if errors == replace(WorldErrors(), random=errors.random) or not groups:
        return course
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
    groups: list[Group], errors: WorldErrors, generator: np.random.Generator
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
