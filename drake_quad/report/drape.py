"""The support polygon laid on the course like a carpet: seen from above, it is the polygon."""

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.gait.support import support_polygon
from drake_quad.terrain import Box, Course

LIFT = 0.006  # [m] above the ground: level with it, the two would flicker
EDGE_WIDTH = 0.02  # [m] of what two feet give: a line, which would not be seen


def drape(course: Course, feet: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The convex hull of feet, cut along the course's boxes and put on top of each.

    Args:
        course: In W.
        feet: (n, 2) horizontal places of the bearing feet in W [m]. One foot gives nothing.

    Returns:
        (vertices (k, 3) in W [m], triangles (m, 3) of their indices).
    """
    hull = np.array(support_polygon(feet))
    if len(hull) == 2:
        hull = _widen(hull)
    vertices: list[FloatArray] = []
    triangles: list[list[int]] = []
    count = 0
    for box in course.boxes if len(hull) > 2 else ():
        piece = clip(hull, box)
        if len(piece) < 3:
            continue
        z = box.top + box.gradient * ((piece - box.middle) @ box.axes[0])
        vertices.append(np.column_stack([piece, z + LIFT]))
        triangles += [[count, count + i, count + i + 1] for i in range(1, len(piece) - 1)]
        count += len(piece)
    if not vertices:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.float64)
    return np.concatenate(vertices), np.array(triangles, dtype=np.float64)


def clip(polygon: FloatArray, box: Box) -> FloatArray:
    """The part of a convex polygon (n, 2) within a box's footprint (Sutherland and Hodgman)."""
    for axis, half in zip(box.axes, 0.5 * box.extent, strict=True):
        for normal in (axis, -axis):
            if not len(polygon):
                return polygon
            inside = half - (polygon - box.middle) @ normal  # [m] positive within
            polygon = _cut(polygon, inside)
    return polygon


def _cut(polygon: FloatArray, inside: FloatArray) -> FloatArray:
    """The part of a polygon (n, 2) on the side where `inside` (n,), linear over it, is positive."""
    kept = []
    for a, b, da, db in zip(
        polygon, np.roll(polygon, -1, axis=0), inside, np.roll(inside, -1), strict=True
    ):
        if da >= 0.0:
            kept.append(a)
        if (da > 0.0) != (db > 0.0) and da != db:
            kept.append(a + da / (da - db) * (b - a))
    return np.array(kept).reshape(-1, 2)


def _widen(ends: FloatArray) -> FloatArray:
    """A strip about the line between two points (2, 2)."""
    along = ends[1] - ends[0]
    across = np.array([-along[1], along[0]]) * (0.5 * EDGE_WIDTH / np.linalg.norm(along))
    return np.array([ends[0] - across, ends[1] - across, ends[1] + across, ends[0] + across])
