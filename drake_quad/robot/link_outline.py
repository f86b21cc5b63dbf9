"""Outlines of shanks, thighs and trunk: rounded chains and boxes, as planners see them."""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.robot.model import RobotModel

# ------------------------------------------------------------------------------------------------
# Where along a shank its outline is given, and how much each place counts.
# ------------------------------------------------------------------------------------------------


# From the knee on, to the foot: 1. The last is where a thick shank ends above a thin foot: over a
# nosing, and leaning, it is what comes down on it first.
SHANK_POINTS = np.append(0.14 * np.arange(7), 0.93)
# By which a distance at them is multiplied where it is weighed against the room wanted: the end
# is always near to what its foot is on, and a third of that will do.
CLEARANCE_WEIGHTS = np.append(np.ones(7), 3.0)


# ------------------------------------------------------------------------------------------------
# How thick a robot is where it may touch stairs.
# ------------------------------------------------------------------------------------------------


__all__ = ["SHANK_POINTS", "LinkOutline", "link_outline_of"]


@dataclass(frozen=True, eq=False)
class LinkOutline:
    """A robot's outline.

    Attributes:
        trunk_lower: Least x, y, z of the trunk in B (3,) [m].
        trunk_upper: Greatest ones (3,) [m].
        trunk_parts: Least and greatest ones of each of its parts (K, 2, 3) [m].
        shank_offsets: How far ahead (the shank's own x) of each leg's line from knee to foot the
            middle of its shank is at SHANK_POINTS, feet left out (4, 8) [m].
        shank_radii: How far it reaches from there to either side (4, 8) [m].
    """

    trunk_lower: FloatArray
    trunk_upper: FloatArray
    trunk_parts: FloatArray
    shank_offsets: FloatArray
    shank_radii: FloatArray


def link_outline_of(robot: RobotModel) -> LinkOutline:
    """The outline of a robot's collision geometry; of its hips where the trunk has none."""
    return LinkOutline(
        trunk_lower=robot.trunk_box[0],
        trunk_upper=robot.trunk_box[1],
        trunk_parts=robot.trunk_boxes,
        shank_offsets=robot.shank_offsets,
        shank_radii=robot.shank_radii,
    )
