"""Moving the boxes of a course: faces, footprints, tops."""

from dataclasses import replace

import numpy as np

from drake_quad.errors import InputError
from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.terrain import Box

ALIGNED = 1e-9


def move_face(boxes: list[Box], element: int, way: FloatArray, by: float) -> None:
    """Moves the face of the element that looks `way` (2,) by `by` [m].

    The square of a landing with an oblique turn touches that face with a corner: it must not
    stick out where the face goes back.
    """
    k = face(boxes, element, way)
    boxes[k] = grown(boxes[k], way, by)
    square = next(i for i, box in enumerate(boxes) if box.element == element)
    if by < 0.0 and square != k:
        sides = np.concatenate([boxes[square].axes, -boxes[square].axes])
        side = sides[int(np.argmax(sides @ way))]
        boxes[square] = grown(boxes[square], side, by / float(side @ way))


def face(boxes: list[Box], element: int, way: FloatArray) -> int:
    """Index of the box whose face, of those of the element that look `way`, is the farthest."""
    found = [
        (float(way @ box.centre[:2]) + 0.5 * extent(box, way), k)
        for k, box in enumerate(boxes)
        if box.element == element and np.max(np.abs(box.axes @ way)) > 1.0 - ALIGNED
    ]
    return max(found)[1]


def extent(box: Box, way: FloatArray) -> float:
    """Size of the box along its own axis that is nearest to `way` [m]."""
    return float(box.size[int(np.argmax(np.abs(box.axes @ way)))])


def grown(box: Box, way: FloatArray, by: float) -> Box:
    """The box with its face that looks `way` moved by `by` [m]."""
    size = np.array(box.size[:2])
    size[int(np.argmax(np.abs(box.axes @ way)))] += by
    return placed(box, box.centre[:2] + 0.5 * by * way, (float(size[0]), float(size[1])))


def placed(
    box: Box, centre: FloatArray, size: tuple[float, float], *, yaw: float | None = None
) -> Box:
    """The box with another footprint, and another yaw [rad] if given."""
    return replace(
        box,
        centre=read_only(np.array([*centre, box.centre[2]])),
        size=read_only(np.array([*size, box.size[2]])),
        yaw=box.yaw if yaw is None else yaw,
    )


def standing(box: Box, top: float, bottom: float) -> Box:
    """The box with another top and bottom [m]."""
    return replace(
        box,
        centre=read_only(np.array([*box.centre[:2], 0.5 * (top + bottom)])),
        size=read_only(np.array([*box.size[:2], top - bottom])),
    )


def world_error(source: str, field: str, value: float, remedy: str) -> InputError:
    """The error at a field of the world, with the figure that it leads to."""
    return InputError(source=source, field=f"world.{field}", value=round(value, 4), remedy=remedy)
