"""Feet that stand higher or lower than the map has the ground, as they would stand on the map."""

import numpy as np

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.terrain import Course

NEGLIGIBLE = 0.005  # [m]: what feet sink in, and maps are off by


def on_map(course: Course, feet: FloatArray, foot_radius: float) -> FloatArray:
    """The feet (4, 3) in W, all as much higher or lower as puts them on the map's ground [m].

    By the median of the feet, for one may stand beyond an edge that is not where the map has it. A
    plan from there is the map's, and the controller adds by how much the ground was found higher or
    lower, as it does all along. A plan from the feet's own heights would step to the map's.

    Args:
        course: The map.
        feet: The feet's sphere centres where they stand (4, 3) in W [m].
        foot_radius: [m].
    """
    error = feet[:, 2] - foot_radius - course.height(feet[:, 0], feet[:, 1])
    known = error[np.isfinite(error)]
    higher = float(np.median(known)) if len(known) else 0.0
    if abs(higher) < NEGLIGIBLE:
        return feet
    return read_only(feet - [0.0, 0.0, higher])
