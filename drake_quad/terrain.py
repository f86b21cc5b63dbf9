"""The course: floor, stairs, landings, turns and the like, all from one list of elements.

From that list come the collision boxes, the height of the ground anywhere, the nosings, and the
lanes (straight stretches between turns) on which gaits are planned: so what the planner believes
and what the plant collides with cannot differ.

W is the world frame: the course begins at its origin and heads along +x, z up.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.errors import InputError
from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.terrain_box import Box, first_overlap, make_box
from drake_quad.terrain_check import check_elements
from drake_quad.terrain_elements import Element
from drake_quad.terrain_faces import move_face
from drake_quad.terrain_flight import Flight
from drake_quad.terrain_lane import EDGE, Lane
from drake_quad.terrain_layout import Layout

__all__ = ["Box", "Course", "Element", "Flight", "Lane", "build_course"]

FOUNDATION = 0.2  # [m] of solid below the lowest level
BACK = 150.0  # [deg]; a turn by more leads back along the way that led to it


@dataclass(frozen=True)
class Course:
    """A course, ready to plan on and to build.

    Attributes:
        lanes: The straight stretches, in walking order.
        turns: The turn at the end of each lane but the last [rad], left positive.
        boxes: The solids. On the map, boxes of different elements never overlap; only on a
            landing with an oblique turn do boxes of one element overlap, their tops level, and on
            stairs with an overhang or open risers, one over the other.
    """

    lanes: tuple[Lane, ...]
    turns: tuple[float, ...]
    boxes: tuple[Box, ...]

    @cached_property
    def _tops(self) -> tuple[FloatArray, ...]:
        """Of all boxes' tops: axes (n, 2, 2) in rows, middles, half sizes, heights, gradients."""
        return (
            read_only(np.array([box.axes for box in self.boxes])),
            read_only(np.array([box.middle for box in self.boxes])),
            read_only(np.array([0.5 * box.extent for box in self.boxes])),
            read_only(np.array([box.top for box in self.boxes])),
            read_only(np.array([box.gradient for box in self.boxes])),
        )

    def height(self, x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Height of the ground in W [m] at `x`, `y` [m] (broadcast); nan off the course."""
        axes, centres, halves, tops, gradients = self._tops
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        p_W = np.stack(np.broadcast_arrays(x, y), axis=-1)
        p_box = np.einsum("nij,...nj->...ni", axes, p_W[..., None, :] - centres)
        inside = np.all(np.abs(p_box) <= halves + EDGE, axis=-1)
        z = np.where(inside, tops + gradients * p_box[..., 0], -np.inf).max(axis=-1)
        return np.where(np.isfinite(z), z, np.nan)

    def nosings(self) -> FloatArray:
        """The nosings (m, 2, 3) in W [m]: of each its right and its left end."""
        ends = []
        for lane in self.lanes:
            for (s, z), yaw in zip(lane.nosings(), lane.nosing_yaws(), strict=True):
                half = float(lane.half_widths[lane.interval(s)])
                aside = half * math.tan(yaw)
                p_W = lane.point([s + aside, s - aside], [-half, half])
                ends.append(np.column_stack([p_W, [z, z]]))
        return np.array(ends, dtype=np.float64).reshape(-1, 2, 3)

    def bounds(self) -> FloatArray:
        """The corners (2, 3) of the course's bounding box in W [m], lowest and highest."""
        xy = np.concatenate([box.corners() for box in self.boxes])
        bottom = min(float(box.centre[2] - 0.5 * box.size[2]) for box in self.boxes)
        top = max(box.top + 0.5 * abs(box.gradient) * box.extent[0] for box in self.boxes)
        return np.array([[*xy.min(axis=0), bottom], [*xy.max(axis=0), top]])


def foundation(lanes: Sequence[Lane]) -> float:
    """How deep the solids of a course go: below its lowest ground [m]."""
    falls = [np.minimum(lane.gradients, 0.0) * np.diff(lane.breaks) for lane in lanes]
    lowest = [np.min(lane.heights + fall) for lane, fall in zip(lanes, falls, strict=True)]
    return float(min(lowest)) - FOUNDATION


def build_course(
    elements: Sequence[Element],
    *,
    start_height: float = 0.0,
    foot_radius: float = 0.035,
    turning_space: float = 1.5,
    source: str = "course",
) -> Course:
    """Checks the elements and lays them out, one after the other.

    A landing of length L with a turn has its pivot at its middle: the lane ends there, and the
    next lane begins there with the new heading; the landing reaches L/2 along either.

    Args:
        elements: The course in walking order; first and last a floor or a landing.
        start_height: Height of the first element in W [m].
        foot_radius: Of the robot [m], for the shortest tread that can bear it.
        turning_space: Shortest landing on which the robot can turn [m].
        source: What an error names as the holder of the elements, for example the file.

    Raises:
        InputError: A field that no course can have, or a course that runs into itself.
    """
    check_elements(elements, source=source, foot_radius=foot_radius, turning_space=turning_space)
    layout = Layout(start_height)
    for index, element in enumerate(elements):
        layout.add(index, element)
    layout.finish()
    bottom = foundation(layout.lanes)
    boxes = [make_box(slab, bottom) for slab in layout.slabs]
    _undercut(boxes, elements, layout.lanes)
    clash = first_overlap(boxes)
    if clash is not None:
        old, new = clash
        raise InputError(
            source=source,
            field=f"course[{new.element}]",
            value=elements[new.element].kind,
            remedy=f"runs into course[{old.element}]: "
            + _way_out(elements, old.element, new.element),
        )
    return Course(lanes=tuple(layout.lanes), turns=tuple(layout.turns), boxes=tuple(boxes))


def _way_out(elements: Sequence[Element], old: int, new: int) -> str:
    """What may keep two elements of a course apart."""
    for k, element in enumerate(elements[old : new + 1], start=old):
        turn = element.turn_deg or 0.0
        if abs(turn) > BACK:
            return (
                f"course[{k}] turns by {turn:g} degrees, back onto the way that led to it; put two "
                f"landings in its place, one after the other, each of turn_deg: "
                f"{math.copysign(90.0, turn):g}"
            )
    return "make it narrower, turn the other way, or make the landing between longer"


def _undercut(boxes: list[Box], elements: Sequence[Element], lanes: Sequence[Lane]) -> None:
    """Moves the ground back from under the first noses of stairs that go down from it."""
    owners = [k for k, element in enumerate(elements) if element.kind == "stairs"]
    for lane in lanes:
        for flight in lane.flights:
            before = owners.pop(0) - 1
            if flight.undercut:
                move_face(boxes, before, lane.heading, -flight.undercut)
