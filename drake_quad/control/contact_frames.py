"""Which way the ground under a foot faces, by the map; and the axes in which its force is told.

Contact sensors say whether a foot bears, not which way it is pushed, so the map alone tells the
ground's tilt. On level ground the axes are W's own.
"""

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.jit import jit
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import EDGE

COLUMNS = 10  # of a box: its two axes (2, 2), its middle (2), half its extent (2), top, gradient


def ground_table(course: Course | None) -> FloatArray:
    """The tops of a course's boxes (n, COLUMNS), writable; none if all of them are level."""
    boxes = [] if course is None else list(course.boxes)
    if not any(box.gradient for box in boxes):
        return np.zeros((0, COLUMNS))
    return np.array(
        [
            [*box.axes.ravel(), *box.middle, *(0.5 * box.extent), box.top, box.gradient]
            for box in boxes
        ]
    )


@jit
def normal_at(ground: FloatArray, x: float, y: float) -> tuple[float, float, float]:
    """The unit normal in W of the ground at a place [m]; upright off the course.

    The same as `terrain.course.ground_normals`, for one place.

    Args:
        ground: See `ground_table`.
        x: In W [m].
        y: In W [m].
    """
    highest, gx, gy = -np.inf, 0.0, 0.0
    for k in range(len(ground)):
        box = ground[k]
        dx, dy = x - box[4], y - box[5]
        along, across = box[0] * dx + box[1] * dy, box[2] * dx + box[3] * dy
        if abs(along) > box[6] + EDGE or abs(across) > box[7] + EDGE:
            continue
        z = box[8] + box[9] * along
        if z > highest:
            highest, gx, gy = z, box[9] * box[0], box[9] * box[1]
    if gx == 0.0 and gy == 0.0:
        return 0.0, 0.0, 1.0
    length = np.sqrt(gx * gx + gy * gy + 1.0)
    return -gx / length, -gy / length, 1.0 / length


@jit
def contact_axes(normals: FloatArray) -> FloatArray:
    """The axes (4, 3, 3) in W, in columns, of the force on each foot: two along the ground, normal.

    The first points straight down the slope; on level ground they are W's x, y and z,
    and that is where the last one's z is 1.

    Args:
        normals: Of the ground under the feet (4, 3).
    """
    axes = np.zeros((4, 3, 3))
    for k in range(4):
        nx, ny, nz = normals[k, 0], normals[k, 1], normals[k, 2]
        if nz == 1.0:
            axes[k, 0, 0] = axes[k, 1, 1] = axes[k, 2, 2] = 1.0
            continue
        tilt = np.sqrt(nx * nx + ny * ny)
        dx, dy = nx / tilt, ny / tilt
        axes[k, 0, 0], axes[k, 1, 0], axes[k, 2, 0] = dx * nz, dy * nz, -tilt
        axes[k, 0, 1], axes[k, 1, 1] = -dy, dx
        axes[k, 0, 2], axes[k, 1, 2], axes[k, 2, 2] = nx, ny, nz
    return axes
