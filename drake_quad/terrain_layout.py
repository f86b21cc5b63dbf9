"""Laying a course out: where each element goes, as intervals of a lane and as slabs of ground."""

import math

import numpy as np

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.terrain_box import Slab, rotation
from drake_quad.terrain_elements import DEFAULT_WIDTH, Element
from drake_quad.terrain_flight import Flight, flight_parts
from drake_quad.terrain_lane import EDGE, Lane


class Layout:
    """Where the next element goes: the lane being laid, its origin, heading and height."""

    def __init__(self, height: float) -> None:
        self.lanes: list[Lane] = []
        self.turns: list[float] = []
        self.slabs: list[Slab] = []
        self.z = height
        self._begin_lane(origin=np.zeros(2), yaw=0.0, run_in=0.0)

    def add(self, index: int, element: Element) -> None:
        """Lays one checked element."""
        if element.turn:
            self._add_turn(index, element)
        elif element.kind == "stairs":
            self._add_flight(index, element)
        elif element.kind == "curb":
            self.z += element.climb
        else:
            self._add_stretch(index, element)

    def finish(self) -> None:
        """Ends the last lane where the course ends."""
        self._end_lane(run_out=0.0)

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
