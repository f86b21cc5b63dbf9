"""How thick a robot is where it may touch stairs, read from its collision geometry."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Box, Capsule, Cylinder, Ellipsoid, GeometryId, SceneGraph
from pydrake.geometry import Shape as DrakeShape
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.robot.load_robot import AddRobot
from drake_quad.robot.robot_model import RobotModel

SHANK_POINTS = 0.14 * np.arange(7)  # from the knee on, to the foot: 1
THIN = 0.04  # of its length: radius of a shank without geometry


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
    sides = np.stack(
        [
            _sides(plant, inspector, plant.GetJointByName(name).child_body(), robot, float(length))
            for name, length in zip(robot.joint_names[2::3], robot.geometry.shank, strict=True)
        ]
    )
    return Shape(
        trunk_lower=read_only(corners.min(axis=0)),
        trunk_upper=read_only(corners.max(axis=0)),
        shank_offsets=read_only(0.5 * (sides[:, 1] + sides[:, 0])),
        shank_radii=read_only(0.5 * (sides[:, 1] - sides[:, 0])),
    )


def shank_middles(
    shape: Shape, knees: FloatArray, feet: FloatArray, across: FloatArray
) -> FloatArray:
    """The middles of all shanks' outlines at SHANK_POINTS (..., 4, 7, 3) [m].

    Args:
        shape: The robot's outline.
        knees: (..., 4, 3) [m].
        feet: (..., 4, 3) [m], in the same frame.
        across: Unit vectors of the knees' axes, to the left (..., 4, 3).
    """
    along = feet - knees
    ahead = np.cross(along, across)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    middle = knees[..., None, :] + SHANK_POINTS[:, None] * along[..., None, :]
    return middle + shape.shank_offsets[..., None] * ahead[..., None, :]


def _half_sizes(shape: DrakeShape) -> FloatArray:
    """Half the size of a shape's own box (3,) [m]; 0 of a mesh, which says nothing of itself."""
    if isinstance(shape, Box):
        return 0.5 * np.asarray(shape.size())
    if isinstance(shape, Cylinder):
        return np.array([shape.radius(), shape.radius(), 0.5 * shape.length()])
    if isinstance(shape, Capsule):
        return np.array([shape.radius()] * 2 + [0.5 * shape.length() + shape.radius()])
    if isinstance(shape, Ellipsoid):
        return np.array([shape.a(), shape.b(), shape.c()])
    radius = getattr(shape, "radius", None)
    return np.full(3, float(radius()) if radius else 0.0)


def _corners(inspector: object, g: GeometryId) -> FloatArray:
    """The corners of a geometry's box in its body's frame, (8, 3) [m]."""
    half = _half_sizes(inspector.GetShape(g))  # type: ignore[attr-defined]
    X = inspector.GetPoseInFrame(g)  # type: ignore[attr-defined]
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return np.array([X.multiply(half * s) for s in signs])


def _sides(
    plant: MultibodyPlant, inspector: object, shank: RigidBody, robot: RobotModel, length: float
) -> FloatArray:
    """How far a shank's geometries reach back and ahead of its middle line (2, 7) [m].

    The middle line is the shank's own -z axis, from the knee to the foot; looked at from the side
    at SHANK_POINTS. Each geometry is taken for a rod: a line through its middle, with a radius.
    """
    thin = THIN * float(robot.geometry.shank.min())
    found = np.repeat([[-thin], [thin]], len(SHANK_POINTS), axis=1)
    for g in plant.GetCollisionGeometriesForBody(shank):
        if inspector.GetName(g) in robot.foot_geometry:  # type: ignore[attr-defined]
            continue
        axis, half, radius = _rod(inspector.GetShape(g))  # type: ignore[attr-defined]
        X = inspector.GetPoseInFrame(g)  # type: ignore[attr-defined]
        line = np.array([X.multiply(axis * at) for at in np.linspace(-half, half, 15)])
        along, ahead = -line[:, 2] / length, line[:, 0]
        for k, at in enumerate(SHANK_POINTS):
            near = np.abs(along - at) * length <= radius + 0.05 * length
            if np.any(near):
                found[0, k] = min(found[0, k], float(np.min(ahead[near])) - radius)
                found[1, k] = max(found[1, k], float(np.max(ahead[near])) + radius)
    return found


def _rod(shape: DrakeShape) -> tuple[FloatArray, float, float]:
    """A shape as a rod: its axis (3,), half its length and its radius [m]."""
    half = _half_sizes(shape)
    if isinstance(shape, Cylinder | Capsule):
        return np.array([0.0, 0.0, 1.0]), float(0.5 * shape.length()), float(shape.radius())
    k = int(np.argmax(half))
    radius = float(np.max(np.delete(half, k)))
    return np.eye(3)[k], max(float(half[k]) - radius, 0.0), radius
