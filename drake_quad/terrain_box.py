"""The boxes of a course: their footprints, and whether two of them share ground."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.gait.legs import BoolArray, FloatArray

OVERLAP = 1e-6  # [m] boxes that share less than this merely touch

_CORNERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


@dataclass(frozen=True)
class Box:
    """A solid box of the course, its top level.

    Attributes:
        name: For example `stairs_1_tread_3`: kind and index of the element, then the tread.
        centre: (3,) in W [m].
        size: (3,) along its own x, y, z [m].
        yaw: Of its x axis about W's z [rad].
        element: Index of the element of the course that it belongs to.
    """

    name: str
    centre: FloatArray
    size: FloatArray
    yaw: float
    element: int

    @property
    def top(self) -> float:
        """Height of its top in W [m]."""
        return float(self.centre[2] + 0.5 * self.size[2])

    @property
    def axes(self) -> FloatArray:
        """Its horizontal unit axes (2, 2) in W, in rows."""
        return rotation(self.yaw).T

    def corners(self) -> FloatArray:
        """The footprint's corners (4, 2) in W [m], counter-clockwise."""
        return np.asarray(self.centre[:2] + (0.5 * self.size[:2] * _CORNERS) @ self.axes)


def rotation(yaw: float) -> FloatArray:
    """The rotation (2, 2) about z by `yaw`; exact at multiples of a right angle.

    So boxes after right-angle turns abut without slivers of rounding between them.
    """
    c, s = (round(v) if abs(v - round(v)) < 1e-15 else v for v in (math.cos(yaw), math.sin(yaw)))
    return np.array([[c, -s], [s, c]], dtype=np.float64)


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
