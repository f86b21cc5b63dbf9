"""Laying a course out: where each element goes, as intervals of a lane and as slabs of ground."""

import math
from typing import NamedTuple

import numpy as np

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.terrain_box import rotation
from drake_quad.terrain_elements import DEFAULT_WIDTH, Element
from drake_quad.terrain_lane import EDGE, Flight, Lane


class Slab(NamedTuple):
    """The top of a box: all of it but how deep it goes."""

    name: str
    centre: FloatArray  # (2,) in W [m]
    size: tuple[float, float]  # [m]
    yaw: float
    top: float  # [m]
    element: int


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
        else:
            size = (element.length or 0.0, element.width or DEFAULT_WIDTH)
            middle = self._stretch(*size, element.kind)
            self._slab(index, element.kind, self._place(middle), size)

    def finish(self) -> None:
        """Ends the last lane where the course ends."""
        self._end_lane(run_out=0.0)

    def _begin_lane(self, *, origin: FloatArray, yaw: float, run_in: float) -> None:
        self._origin, self._yaw, self._run_in = origin, yaw, run_in
        self._breaks = [0.0]
        self._intervals: list[tuple[float, float, str]] = []  # height, half width, kind
        self._flights: list[Flight] = []

    def _end_lane(self, *, run_out: float) -> None:
        heights, half_widths, kinds = zip(*self._intervals, strict=True)
        self.lanes.append(
            Lane(
                p_WL=read_only(self._origin),
                yaw=self._yaw,
                breaks=read_only(np.array(self._breaks)),
                heights=read_only(np.array(heights)),
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

    def _stretch(self, length: float, width: float, kind: str) -> float:
        """Lengthens the lane by an interval at the present height; returns its middle's s."""
        start = self._breaks[-1]
        self._breaks.append(start + length)
        self._intervals.append((self.z, 0.5 * width, kind))
        return start + 0.5 * length

    def _slab(
        self,
        index: int,
        name: str,
        centre: FloatArray,
        size: tuple[float, float],
        *,
        yaw: float | None = None,
    ) -> None:
        """Notes a slab at the present height, named after its kind, element and place in it."""
        kind, _, part = name.partition("_")
        label = f"{kind}_{index}_{part}".rstrip("_")
        self.slabs.append(
            Slab(label, centre, size, self._yaw if yaw is None else yaw, self.z, index)
        )

    def _add_flight(self, index: int, element: Element) -> None:
        """A riser, then its tread, for each step."""
        width, first = element.width or DEFAULT_WIDTH, len(self._intervals)
        start = self.z
        for k, (height, run) in enumerate(element.profile, start=1):
            self.z = start + height
            middle = self._stretch(run, width, "tread")
            self._slab(index, f"stairs_tread_{k}", self._place(middle), (run, width))
        self._flights.append(Flight(first, len(self._intervals) - 1, str(element.going)))

    def _add_turn(self, index: int, element: Element) -> None:
        """A landing to turn on: the largest square about the pivot that crosses neither edge.

        The edges are those where the landing meets its neighbours, L/2 from the pivot. For a turn
        by a right angle the square is the whole landing; for an oblique one it lies turned
        half-way, smaller, and a stretch along either lane joins it to the neighbours.
        """
        length = element.length or 0.0
        width = element.width or length
        oblique = math.remainder(element.turn, 0.5 * math.pi)
        tilt = 0.5 * oblique
        side = length / (math.cos(tilt) + math.sin(abs(tilt)))
        self._stretch(0.5 * length, width, "landing")
        pivot, yaw_out = self._place(self._breaks[-1]), self._yaw + element.turn
        self._slab(index, "landing", pivot, (side, side), yaw=self._yaw + tilt)
        if abs(oblique) > EDGE:
            for way, yaw, sign in (("in", self._yaw, -1.0), ("out", yaw_out, 1.0)):
                centre = pivot + sign * 0.25 * length * rotation(yaw)[:, 0]
                self._slab(index, f"landing_{way}", centre, (0.5 * length, width), yaw=yaw)
        self._end_lane(run_out=0.5 * side)
        self.turns.append(element.turn)
        self._begin_lane(origin=pivot, yaw=yaw_out, run_in=0.5 * side)
        self._stretch(0.5 * length, width, "landing")
