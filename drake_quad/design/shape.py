"""How thick a robot is where it may touch stairs, read from its collision geometry."""

from dataclasses import dataclass

from drake_quad.gait.legs import FloatArray
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.shank_outline import SHANK_POINTS

__all__ = ["SHANK_POINTS", "Shape", "read_shape"]


@dataclass(frozen=True, eq=False)
class Shape:
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


def read_shape(robot: RobotModel) -> Shape:
    """The outline of a robot's collision geometry; of its hips where the trunk has none."""
    return Shape(
        trunk_lower=robot.trunk_box[0],
        trunk_upper=robot.trunk_box[1],
        trunk_parts=robot.trunk_boxes,
        shank_offsets=robot.shank_offsets,
        shank_radii=robot.shank_radii,
    )
