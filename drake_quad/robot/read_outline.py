"""Reads the outlines of shanks, thighs and trunk from a plant's collision shapes."""

from collections.abc import Sequence

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    GeometryId,
    SceneGraphInspector,
    Shape as DrakeShape,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_quad.common import FloatArray
from drake_quad.robot.model import SHANK_POINTS
from drake_quad.robot.shank_profile import ALONG, THIN, box_edges, profile_of_rods

SPECK = 0.005  # [m] across: geometries no larger are let be


def read_shank(
    plant: MultibodyPlant,
    inspector: SceneGraphInspector,
    links: tuple[RigidBody, RigidBody],
    foot: str,
    lengths: tuple[float, float],
) -> tuple[FloatArray, FloatArray]:
    """How far a shank's geometries reach back and ahead of its middle line.

    The middle line is the shank's own -z axis, from the knee to the foot; looked at from the side.
    The knee is as thick as what the thigh has about it, too.

    Args:
        plant: The robot.
        inspector: Inspector of the robot's geometry.
        links: The leg's thigh and shank.
        foot: Name of the foot's geometry, which does not count.
        lengths: Lengths of thigh and shank [m].

    Returns:
        sides: At SHANK_POINTS (2, 8) [m], with each geometry taken for a rod: a line through its
            middle, with a radius.
        profile: At PLACES, and so far to both sides of each as the next one is (2, 32) [m]. Boxes
            are taken by their edges, all else as rods that hold it, which are round where they are.
    """
    thigh, shank = links
    lines, rods = [], []
    for g in plant.GetCollisionGeometriesForBody(shank):
        if inspector.GetName(g) == foot:
            continue
        lines.append(_rod_line(inspector, g))
        shape = inspector.GetShape(g)
        if isinstance(shape, Box):  # a rod would not hold its corners
            X = inspector.GetPoseInFrame(g)
            edges = box_edges(half_sizes(shape))
            rods += [(np.asarray(X.multiply(edge.T)).T, 0.0) for edge in edges]
        else:
            rods.append(_rod_line(inspector, g, ALONG))
    ball = _about_knee(plant, inspector, thigh, lengths[0])
    return _sides(lines, lengths[1], ball), profile_of_rods(rods, lengths[1], ball)


def _sides(rods: Sequence[tuple[FloatArray, float]], length: float, ball: float) -> FloatArray:
    """The sides (2, 8) of rods, each about a line (15, 3), see `read_shank` [m].

    Args:
        rods: Lines and radii [m].
        length: Length of the shank [m].
        ball: Radius of what the thigh has about the knee [m].
    """
    thin = THIN * length
    found = np.repeat([[np.inf], [-np.inf]], len(SHANK_POINTS), axis=1)
    for line, radius in rods:
        along, ahead = -line[:, 2] / length, line[:, 0]
        for k, at in enumerate(SHANK_POINTS):
            near = np.abs(along - at) * length <= radius + 0.05 * length
            if np.any(near):
                found[0, k] = min(found[0, k], float(np.min(ahead[near])) - radius)
                found[1, k] = max(found[1, k], float(np.max(ahead[near])) + radius)
    bare = np.isinf(found[0])  # by its end there is a foot, at least
    found[:, bare] = np.array([[-thin], [thin]]) * (np.flatnonzero(bare) < len(SHANK_POINTS) - 1)
    found[:, 0] = min(found[0, 0], -ball), max(found[1, 0], ball)
    return found


def _about_knee(
    plant: MultibodyPlant, inspector: SceneGraphInspector, thigh: RigidBody, length: float
) -> float:
    """Radius of the largest ball about the knee that a geometry of the thigh holds [m]."""
    knee, ball = np.array([0.0, 0.0, -length]), -np.inf
    for g in plant.GetCollisionGeometriesForBody(thigh):
        line, radius = _rod_line(inspector, g)
        ball = max(ball, radius - float(np.min(np.linalg.norm(line - knee, axis=1))))
    return ball


def _rod_line(
    inspector: SceneGraphInspector, g: GeometryId, count: int = 15
) -> tuple[FloatArray, float]:
    """Points (count, 3) along a geometry's middle in its body's frame, and its radius [m]."""
    axis, half, radius = rod(inspector.GetShape(g))
    X = inspector.GetPoseInFrame(g)
    return np.array([X.multiply(axis * at) for at in np.linspace(-half, half, count)]), radius


def half_sizes(shape: DrakeShape) -> FloatArray:
    """Half the size of a shape's own box (3,) [m]; 0 of a mesh, whose size is not known here."""
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


def bounding_box(inspector: SceneGraphInspector, geometries: list[GeometryId]) -> FloatArray:
    """Least and greatest coordinates of geometries in their body's frame (2, 3) [m]."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    corners = [
        inspector.GetPoseInFrame(g).multiply(s * half_sizes(inspector.GetShape(g)))
        for g in geometries
        for s in signs
    ]
    return np.stack([np.min(corners, axis=0), np.max(corners, axis=0)])


def outer_boxes(inspector: SceneGraphInspector, geometries: list[GeometryId]) -> FloatArray:
    """The boxes of geometries, each its own, in their body's frame (K, 2, 3) [m].

    Without those that another holds, and specks, of which files are full; there is one at least.
    """
    boxes = [bounding_box(inspector, [g]) for g in geometries]
    boxes.sort(key=lambda box: -float(np.prod(box[1] - box[0])))
    found: list[FloatArray] = []
    for box in boxes:
        held = any(np.all(box[0] >= other[0]) and np.all(box[1] <= other[1]) for other in found)
        if not found or not (held or np.max(box[1] - box[0]) < SPECK):
            found.append(box)
    return np.array(found)


def rod(shape: DrakeShape) -> tuple[FloatArray, float, float]:
    """A shape as a rod: its axis (3,), half its length and its radius [m]."""
    half = half_sizes(shape)
    if isinstance(shape, Cylinder | Capsule):
        return np.array([0.0, 0.0, 1.0]), float(0.5 * shape.length()), float(shape.radius())
    k = int(np.argmax(half))
    radius = float(np.max(np.delete(half, k)))
    return np.eye(3)[k], max(float(half[k]) - radius, 0.0), radius


# A way along a box's edges, by corners: round one side, round the other.
ROUND = np.array(
    [[1, 1, 1], [1, 1, -1], [-1, 1, -1], [-1, 1, 1], [1, 1, 1],
     [1, -1, 1], [1, -1, -1], [-1, -1, -1], [-1, -1, 1], [1, -1, 1]]
)  # fmt: skip


def read_thighs(
    plant: MultibodyPlant, inspector: SceneGraphInspector, thighs: list[RigidBody]
) -> tuple[FloatArray, FloatArray]:
    """Lines along the shapes of all thighs, and how thick what is around them is.

    Returns:
        points: Points that lines join, for K shapes each, in the thighs' frames (4, K, 10, 3) [m];
            where a thigh has fewer shapes, or a shape fewer points, some are repeated.
        radii: Radii around the lines (4, K) [m].
    """
    points: list[list[FloatArray]] = []
    radii: list[list[float]] = []
    for thigh in thighs:
        mine, thick = [np.zeros((len(ROUND), 3))], [0.0]  # the hip, if there is nothing else
        for g in plant.GetCollisionGeometriesForBody(thigh):
            shape = inspector.GetShape(g)
            half = half_sizes(shape)
            if half.max() < SPECK:
                continue
            if isinstance(shape, Box):
                line, radius = ROUND * half, 0.0
            else:
                axis, reach, radius = rod(shape)
                line = np.outer(np.linspace(-reach, reach, len(ROUND)), axis)
            X = inspector.GetPoseInFrame(g)
            mine.append(np.asarray(X.multiply(line.T)).T)
            thick.append(radius)
        points.append(mine)
        radii.append(thick)
    most = max(len(mine) for mine in points)
    for mine, thick in zip(points, radii, strict=True):
        mine += [mine[-1]] * (most - len(mine))
        thick += [thick[-1]] * (most - len(thick))
    return np.array(points), np.array(radii)
