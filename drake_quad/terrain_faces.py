"""Moving the faces of a course's boxes: where level ground ends."""

from dataclasses import replace

import numpy as np

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.terrain_box import Box

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
