"""Lays a course's elements out as lanes, turns and boxes, with the normals of its ground.

From that list come the collision boxes, the height of the ground anywhere, the nosings, and the
lanes (straight stretches between turns) on which gaits are planned: so what the planner believes
and what the plant collides with cannot differ.

W is the world frame, z up: the course begins at its origin and heads along +x, unless told.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import FloatArray, read_only
from drake_quad.errors import InputError
from drake_quad.jit import jit
from drake_quad.math.rotations import rotation
from drake_quad.terrain.boxes import Box, Slab, first_overlap, make_box, move_face
from drake_quad.terrain.element_checks import check_elements
from drake_quad.terrain.elements import DEFAULT_WIDTH, TURNING_SPACE, Element
from drake_quad.terrain.lane import EDGE, Flight, Lane, flight_parts, reverse_lane
from drake_quad.util.display import one_line


class Layout:
    """Where the next element goes: the lane being laid, its origin, heading and height."""

    def __init__(self, height: float, origin: FloatArray, yaw: float) -> None:
        self.lanes: list[Lane] = []
        self.turns: list[float] = []
        self.slabs: list[Slab] = []
        self.z = height
        self.turn_back = 0.0
        self._begin_lane(origin=origin, yaw=yaw, run_in=0.0)

    def add(self, index: int, element: Element) -> None:
        """Lays one checked element."""
        if element.kind == "return":
            self.turn_back = element.turn
        elif element.turn:
            self._add_turn(index, element)
        elif element.kind == "stairs":
            self._add_flight(index, element)
        elif element.kind == "curb":
            self.z += element.climb
        else:
            self._add_stretch(index, element)

    def finish(self) -> None:
        """Ends the last lane where the course ends, or in the middle of what it turns back on."""
        half = 0.5 * (self._breaks[-1] - self._breaks[-2]) if self.turn_back else 0.0
        self._breaks[-1] -= half
        self._end_lane(run_out=half)

    def _begin_lane(self, *, origin: FloatArray, yaw: float, run_in: float) -> None:
        self._origin, self._yaw, self._run_in = origin, yaw, run_in
        self._breaks = [0.0]
        # height, gradient, half width, kind
        self._intervals: list[tuple[float, float, float, str]] = []
        self._flights: list[Flight] = []

    def _end_lane(self, *, run_out: float) -> None:
        heights, gradients, half_widths, kinds = zip(*self._intervals, strict=True)
        self.lanes.append(
            Lane(
                p_WL=read_only(self._origin),
                yaw=self._yaw,
                breaks=read_only(np.array(self._breaks)),
                heights=read_only(np.array(heights)),
                gradients=read_only(np.array(gradients)),
                half_widths=read_only(np.array(half_widths)),
                kinds=tuple(kinds),
                flights=tuple(self._flights),
                run_in=self._run_in,
                run_out=run_out,
            )
        )

    def _place(self, s: float) -> FloatArray:
        """The point (2,) in W at `s` along the lane being laid."""
        return np.asarray(self._origin + s * rotation(self._yaw)[:, 0])

    def _stretch(self, length: float, width: float, kind: str, gradient: float = 0.0) -> float:
        """Lengthens the lane by an interval from the present height on; returns its middle's s."""
        start = self._breaks[-1]
        self._breaks.append(start + length)
        self._intervals.append((self.z, gradient, 0.5 * width, kind))
        return start + 0.5 * length

    def _slab(
        self,
        label: str,
        centre: FloatArray,
        size: tuple[float, float],
        index: int,
        *,
        yaw: float | None = None,
        gradient: float = 0.0,
    ) -> None:
        """Notes a slab that begins at the present height."""
        top = self.z + 0.5 * gradient * size[0]
        yaw = self._yaw if yaw is None else yaw
        self.slabs.append(Slab(label, centre, size, yaw, top, index, gradient=gradient))

    def _add_stretch(self, index: int, element: Element) -> None:
        """A floor, a landing, a block or a slope, straight on."""
        kind, length, width = element.kind, element.length or 0.0, element.width or DEFAULT_WIDTH
        gradient = element.climb / length if kind == "slope" else 0.0
        below = self.z
        self.z += element.climb if kind == "block" else 0.0
        middle = self._stretch(length, width, kind, gradient)
        self._slab(f"{kind}_{index}", self._place(middle), (length, width), index,
                   gradient=gradient)  # fmt: skip
        self.z = below + (element.climb if kind == "slope" else 0.0)

    def _add_flight(self, index: int, element: Element) -> None:
        """A riser, then its tread, for each step."""
        width, first = element.width or DEFAULT_WIDTH, len(self._intervals)
        start = self.z
        for height, run in element.profile:
            self.z = start + height
            self._stretch(run, width, "tread")
        last = len(self._intervals) - 1
        flight = Flight(first, last, str(element.going), 0.0, *element.style)
        self._flights.append(flight)
        heights = [start, *(z for z, *_ in self._intervals[first:])]
        for part in flight_parts(flight, np.array(self._breaks[first:]), np.array(heights)):
            self.slabs.append(
                Slab(
                    f"stairs_{index}_{part.name}",
                    self._place(0.5 * (part.start + part.end)),
                    (part.end - part.start, width),
                    self._yaw,
                    part.top,
                    index,
                    part.thickness,
                )
            )

    def _add_turn(self, index: int, element: Element) -> None:
        """A landing to turn on: the largest square about the pivot that crosses neither edge.

        The edges are those where the landing meets its neighbours, L/2 from the pivot. For a turn
        by a right angle the square is the whole landing; for an oblique one it lies turned
        half-way, smaller, and a stretch along either lane joins it to the neighbours.
        """
        length, width = element.length or 0.0, element.turning_width
        oblique = math.remainder(element.turn, 0.5 * math.pi)
        tilt = 0.5 * oblique
        side = length / (math.cos(tilt) + math.sin(abs(tilt)))
        self._stretch(0.5 * length, width, "landing")
        pivot, yaw_out = self._place(self._breaks[-1]), self._yaw + element.turn
        name = f"landing_{index}"
        self._slab(name, pivot, (side, side), index, yaw=self._yaw + tilt)
        if abs(oblique) > EDGE:
            for way, yaw, sign in (("in", self._yaw, -1.0), ("out", yaw_out, 1.0)):
                centre = pivot + sign * 0.25 * length * rotation(yaw)[:, 0]
                self._slab(f"{name}_{way}", centre, (0.5 * length, width), index, yaw=yaw)
        self._end_lane(run_out=0.5 * side)
        self.turns.append(element.turn)
        self._begin_lane(origin=pivot, yaw=yaw_out, run_in=0.5 * side)
        self._stretch(0.5 * length, width, "landing")


__all__ = ["Box", "Course", "Element", "Flight", "Lane", "build_course"]

FOUNDATION = 0.2  # [m] of solid below the lowest level
BACK = 150.0  # [deg]; a turn by more leads back along the way that led to it


@dataclass(frozen=True, eq=False)
class Course:
    """A course, ready to plan on and to build.

    Attributes:
        lanes: The straight stretches, in walking order.
        turns: The turn at the end of each lane but the last [rad], left positive.
        boxes: The solids. On the map, boxes of different elements never overlap; only on a
            landing with an oblique turn do boxes of one element overlap, their tops level, and on
            stairs with an overhang or open risers, one over the other.
        returning: How many lanes, the last ones, lead back over the ground of those before.
    """

    lanes: tuple[Lane, ...]
    turns: tuple[float, ...]
    boxes: tuple[Box, ...]
    returning: int = 0

    def __repr__(self) -> str:
        lanes = "1 lane" if len(self.lanes) == 1 else f"{len(self.lanes)} lanes"
        flights = sum(len(lane.flights) for lane in self.lanes)
        return one_line(self, lanes, f"{flights} flights", f"{len(self.boxes)} boxes")

    @property
    def outward(self) -> tuple[Lane, ...]:
        """The lanes without those that lead back."""
        return self.lanes[: len(self.lanes) - self.returning]

    def without_way_back(self) -> "Course":
        """The same ground, walked to where the course turns back."""
        lanes = self.outward
        return Course(lanes, self.turns[: len(lanes) - 1], self.boxes)

    def with_way_back(self, turn: float) -> "Course":
        """The same ground, walked back to where the course began.

        Args:
            turn: The turn at the end, by which the robot turns back [rad], left positive.
        """
        back = tuple(reverse_lane(lane) for lane in reversed(self.lanes))
        turns = (*self.turns, turn, *(-angle for angle in reversed(self.turns)))
        return Course((*self.lanes, *back), turns, self.boxes, len(back))

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
        for lane in self.outward:
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
    origin: tuple[float, float] = (0.0, 0.0),
    yaw: float = 0.0,
    foot_radius: float = 0.035,
    turning_space: float = TURNING_SPACE,
    source: str = "course",
) -> Course:
    """Checks the elements and lays them out, one after the other.

    A landing of length L with a turn has its pivot at its middle: the lane ends there, and the
    next lane begins there with the new heading; the landing reaches L/2 along either. A course
    that ends with `return` turns in the middle of what is before, and has its lanes once more, the
    other way round.

    Args:
        elements: The course in walking order; first and last a floor or a landing.
        start_height: Height of the first element in W [m].
        origin: Where the course begins in W [m].
        yaw: Heading of its first lane about W's z [rad].
        foot_radius: Radius of the robot's feet [m], for the shortest tread that can bear one.
        turning_space: Shortest landing on which the robot can turn [m].
        source: What an error names as the holder of the elements, for example the file.

    Raises:
        InputError: A field that no course can have, or a course that runs into itself.
    """
    check_elements(elements, source=source, foot_radius=foot_radius, turning_space=turning_space)
    layout = Layout(start_height, np.array(origin, dtype=float), yaw)
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
    course = Course(lanes=tuple(layout.lanes), turns=tuple(layout.turns), boxes=tuple(boxes))
    return course.with_way_back(layout.turn_back) if layout.turn_back else course


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


def ground_normals(course: Course, places: FloatArray) -> FloatArray:
    """Unit normals (..., 3) in W of the ground at `places` (..., 2) [m]; upright off the course.

    A nosing is the edge of a level tread: what a foot's sphere feels there, it does not say.
    """
    flat = places.reshape(-1, 2)
    normals, highest = np.tile([0.0, 0.0, 1.0], (len(flat), 1)), np.full(len(flat), -np.inf)
    for box in course.boxes:
        p = (flat - box.middle) @ box.axes.T
        z = box.top + box.gradient * p[:, 0]
        here = np.all(np.abs(p) <= 0.5 * box.extent + EDGE, axis=-1) & (z > highest)
        slope = np.array([*(-box.gradient * box.axes[0]), 1.0])
        highest = np.where(here, z, highest)
        normals[here] = slope / np.linalg.norm(slope)
    return normals.reshape(*places.shape[:-1], 3)


def box_tops(course: Course) -> FloatArray:
    """The tops of a course's boxes as kernels take them, one a row (n, 10).

    Columns: the two axes in W (4), the middle (2) [m], half the extent (2) [m], the height in the
    middle [m] and the gradient along the first axis.
    """
    rows = [
        [*b.axes.ravel(), *b.middle, *(0.5 * b.extent), b.top, b.gradient] for b in course.boxes
    ]
    return np.array(rows).reshape(-1, 10)


@jit
def top_at(tops: FloatArray, x: float, y: float) -> tuple[float, float, float]:
    """Height [m] and gradient along x and y of the highest of `box_tops` at a place in W [m].

    The height is nan where there is none, and the gradient zero.
    """
    height, gx, gy = np.nan, 0.0, 0.0
    for k in range(len(tops)):
        box = tops[k]
        dx, dy = x - box[4], y - box[5]
        along, across = box[0] * dx + box[1] * dy, box[2] * dx + box[3] * dy
        if abs(along) > box[6] + EDGE or abs(across) > box[7] + EDGE:
            continue
        z = box[8] + box[9] * along
        if not height >= z:
            height, gx, gy = z, box[9] * box[0], box[9] * box[1]
    return height, gx, gy
