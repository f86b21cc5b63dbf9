"""How thick a robot is where it may touch stairs, read from its collision geometry."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import GeometryId, SceneGraph
from pydrake.multibody.plant import MultibodyPlant

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.robot.load_robot import AddRobot
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.shank_outline import SHANK_POINTS, half_sizes

__all__ = ["SHANK_POINTS", "Shape", "read_shape"]


@dataclass(frozen=True, eq=False)
class Shape:
    """A robot's outline.

    Attributes:
        trunk_lower: Least x, y, z of the trunk in B (3,) [m].
        trunk_upper: Greatest ones (3,) [m].
        shank_offsets: How far ahead (the shank's own x) of each leg's line from knee to foot the
            middle of its shank is at SHANK_POINTS, feet left out (4, 7) [m].
        shank_radii: How far it reaches from there to either side (4, 7) [m].
    """

    trunk_lower: FloatArray
    trunk_upper: FloatArray
    shank_offsets: FloatArray
    shank_radii: FloatArray


def read_shape(robot: RobotModel) -> Shape:
    """Reads the outline of a robot's collision geometry; of its hips where the trunk has none."""
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddRobot(plant, robot.url)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    trunk = plant.GetBodyByName(robot.trunk)
    boxes = [_corners(inspector, g) for g in plant.GetCollisionGeometriesForBody(trunk)]
    corners = np.concatenate(boxes or [robot.geometry.p_BH])
    return Shape(
        trunk_lower=read_only(corners.min(axis=0)),
        trunk_upper=read_only(corners.max(axis=0)),
        shank_offsets=robot.shank_offsets,
        shank_radii=robot.shank_radii,
    )


def _corners(inspector: object, g: GeometryId) -> FloatArray:
    """The corners of a geometry's box in its body's frame, (8, 3) [m]."""
    half = half_sizes(inspector.GetShape(g))  # type: ignore[attr-defined]
    X = inspector.GetPoseInFrame(g)  # type: ignore[attr-defined]
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return np.array([X.multiply(half * s) for s in signs])
