"""The course's solids: boxes and slabs, their overlaps and faces."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drake_quad.common import BoolArray, FloatArray, read_only
from drake_quad.math.rotations import rotation

OVERLAP = 1e-6  # [m] boxes that share less than this merely touch

_CORNERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


@dataclass(frozen=True)
class Box:
    """A solid box of the course, its top level but for that of a slope.

    Attributes:
        name: Kind and index of the element, then the tread, for example `stairs_1_tread_3`.
        centre: (3,) in W [m].
        size: (3,) along its own x, y, z [m].
        yaw: Angle of its x axis about W's z [rad].
        element: Index of the element of the course that it belongs to.
        pitch: Turn about its own y axis, before the yaw [rad]; negative where the ground rises
            along its x axis.
    """

    name: str
    centre: FloatArray
    size: FloatArray
    yaw: float
    element: int
    pitch: float = 0.0

    @property
    def top(self) -> float:
        """Height of its top's middle in W [m]."""
        return float(self.centre[2] + 0.5 * self.size[2] * math.cos(self.pitch))

    @property
    def gradient(self) -> float:
        """By how much its top rises along its x axis [m/m]."""
        return -math.tan(self.pitch)

    @property
    def axes(self) -> FloatArray:
        """Its horizontal unit axes (2, 2) in W, in rows; seen from above where it is tilted."""
        return rotation(self.yaw).T

    @property
    def middle(self) -> FloatArray:
        """(2,) the middle of its top in W, from above [m]."""
        lean = 0.5 * self.size[2] * math.sin(self.pitch)
        return np.asarray(self.centre[:2] + lean * self.axes[0])

    @property
    def extent(self) -> FloatArray:
        """(2,) the size of its top from above, along its axes [m]."""
        return np.asarray(self.size[:2] * [math.cos(self.pitch), 1.0])

    def corners(self) -> FloatArray:
        """The corners of its top from above (4, 2) in W [m], counter-clockwise."""
        return np.asarray(self.middle + (0.5 * self.extent * _CORNERS) @ self.axes)


class Slab(NamedTuple):
    """The top of a box, and the box's thickness unless it reaches the foundation."""

    name: str
    centre: FloatArray  # (2,) in W [m]
    size: tuple[float, float]  # [m]
    yaw: float  # [rad]
    top: float  # of its middle [m]
    element: int
    thickness: float | None = None  # [m]; None: down to the foundation
    gradient: float = 0.0  # along its own x axis [m/m]


def make_box(slab: Slab, bottom: float) -> Box:
    """The solid under a slab, down to `bottom` [m] if it doesn't say how thick it is.

    Under a slope's highest end it reaches the bottom; so under its lowest it reaches deeper.
    """
    pitch = -math.atan(slab.gradient)
    down = math.cos(pitch)
    highest = slab.top + 0.5 * abs(slab.gradient) * slab.size[0]
    depth = (highest - bottom) * down if slab.thickness is None else slab.thickness
    ahead = rotation(slab.yaw)[:, 0]
    middle = slab.centre - 0.5 * depth * math.sin(pitch) * ahead
    return Box(
        name=slab.name,
        centre=read_only(np.array([*middle, slab.top - 0.5 * depth * down])),
        size=read_only(np.array([slab.size[0] / down, slab.size[1], depth])),
        yaw=slab.yaw,
        element=slab.element,
        pitch=pitch if slab.gradient else 0.0,
    )


def first_overlap(boxes: Sequence[Box]) -> tuple[Box, Box] | None:
    """The first two boxes of different elements that share ground, in walking order.

    Two rectangles are apart if and only if they are apart along an axis of one of them.
    """
    corners = np.array([box.corners() for box in boxes])
    owners = np.array([box.element for box in boxes])
    for box in boxes:
        apart = owners >= box.element  # only what was there before
        for axis in box.axes:
            apart = apart | _apart(corners, box.corners(), axis)
        for k in np.flatnonzero(~apart).tolist():
            if not any(_apart(corners[k : k + 1], box.corners(), a)[0] for a in boxes[k].axes):
                return boxes[k], box
    return None


def _apart(many: FloatArray, one: FloatArray, axis: FloatArray) -> BoolArray:
    """For footprints `many` (n, 4, 2): whether each lies beside `one` (4, 2) along `axis`."""
    a, b = many @ axis, one @ axis
    gap = np.maximum(a.min(axis=-1) - b.max(), b.min() - a.max(axis=-1))
    return np.asarray(gap > -OVERLAP)


ALIGNED = 1e-9


def move_face(boxes: list[Box], element: int, way: FloatArray, by: float) -> None:
    """Moves the face of the element that looks `way` (2,) by `by` [m]; its boxes are level.

    The square of a landing with an oblique turn touches that face with a corner: it must not
    stick out where the face goes back.
    """
    k = face(boxes, element, way)
    boxes[k] = grown(boxes[k], way, by)
    square = next(i for i, box in enumerate(boxes) if box.element == element)
    if by < 0.0 and _is_square(boxes[square], way):
        sides = np.concatenate([boxes[square].axes, -boxes[square].axes])
        side = sides[int(np.argmax(sides @ way))]
        boxes[square] = grown(boxes[square], side, by / float(side @ way))


def face(boxes: list[Box], element: int, way: FloatArray) -> int:
    """Index of the box whose face, of those of the element that look `way`, is the farthest."""
    found = [
        (float(way @ box.centre[:2]) + 0.5 * extent(box, way), k)
        for k, box in enumerate(boxes)
        if box.element == element and not _is_square(box, way)
    ]
    return max(found)[1]


def extent(box: Box, way: FloatArray) -> float:
    """Size of the box along its own axis that is nearest to `way` [m]."""
    return float(box.size[int(np.argmax(np.abs(box.axes @ way)))])


def grown(box: Box, way: FloatArray, by: float) -> Box:
    """The box with its face that looks `way` moved by `by` [m]."""
    size = np.array(box.size)
    size[int(np.argmax(np.abs(box.axes @ way)))] += by
    centre = np.array(box.centre)
    centre[:2] += 0.5 * by * way
    return replace(box, centre=read_only(centre), size=read_only(size))


def _is_square(box: Box, way: FloatArray) -> bool:
    """Whether no face of the box looks `way`: it lies askew."""
    return bool(np.max(np.abs(box.axes @ way)) < 1.0 - ALIGNED)
