"""The direction of the ground under a place."""

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.terrain import Course
from drake_quad.terrain_lane import EDGE


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
