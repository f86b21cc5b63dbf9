"""Finds the foot of a leg: its radius, where it is, and which shape of the file it stands for."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Mesh, Sphere

from drake_quad.common import FloatArray
from drake_quad.robot.importer.meshes import read_points
from drake_quad.robot.importer.raw_robot import (
    ASSUMED,
    REPAIRED,
    GeometryInstance,
    Note,
    RigidGroup,
)

SMALLEST, LARGEST = 0.015, 0.030  # [m] radius of a foot without a shape in the file
SHARE = 0.07  # of the shank's length, between these


@dataclass(frozen=True)
class Foot:
    """A foot.

    Attributes:
        centre: (3,) in T [m].
        radius: Radius of the foot [m].
        piece: The shape that it replaces, or None.
        note: How it was found, if not by its own sphere.
    """

    centre: FloatArray
    radius: float
    piece: GeometryInstance | None
    note: Note | None


def find_foot(shank: RigidGroup, knee: FloatArray, *, radius: float | None = None) -> Foot:
    """The foot of a leg.

    It is the collision sphere farthest from the knee. Without any it is put at the end: into the
    tip of the farthest collision shape, or on the farthest link that is fixed to the shank.

    Args:
        shank: The last moving link and all that is fixed to it.
        knee: A point of the knee's axis, (3,) in T [m].
        radius: Radius of the foot from the robot's overrides, if any [m].
    """
    tips = [(_tip(piece, knee), piece) for piece in shank.collision]
    spheres = [
        (float(np.linalg.norm(p.X.translation() - knee)), p)
        for p in shank.collision
        if isinstance(p.shape, Sphere)
    ]
    if spheres:
        _, piece = max(spheres, key=lambda s: s[0])
        own = float(piece.shape.radius())
        return Foot(np.array(piece.X.translation()), radius or own, piece, None)
    leaves = [(float(np.linalg.norm(p - knee)), name) for name, p in shank.leaves.items()]
    leaf = max(leaves, default=(0.0, ""))
    tip, piece = max(tips, key=lambda t: float(np.linalg.norm(t[0] - knee)), default=(knee, None))  # type: ignore[assignment]
    far = float(np.linalg.norm(tip - knee))
    length = max(far, leaf[0])
    size = radius or float(np.clip(SHARE * length, SMALLEST, LARGEST))
    if piece is not None and far >= 0.9 * leaf[0]:
        centre = tip + (knee - tip) * size / far
        text = f"foot of {shank.name}: a sphere of {1e3 * size:.0f} mm in the tip of {piece.name}"
        return Foot(centre, size, piece, Note(REPAIRED, text))
    text = f"foot of {shank.name}: a sphere of {1e3 * size:.0f} mm at {leaf[1] or 'its end'}"
    return Foot(shank.leaves.get(leaf[1], tip), size, None, Note(ASSUMED, text))


def points_of(piece: GeometryInstance) -> FloatArray:
    """Points whose hull is a shape or holds it, (n, 3) in the frame of its pose [m]."""
    s = piece.shape
    if isinstance(s, (Mesh, Convex)):
        points = read_points(s.source().path())
        local = np.zeros((1, 3)) if points is None else points * np.array(s.scale3())
    else:
        half = _half_size(s)
        corners = np.array(np.meshgrid(*3 * [[-1.0, 1.0]])).reshape(3, -1).T
        local = corners * half
    return np.asarray((piece.X @ local.T).T)


def _half_size(shape: object) -> FloatArray:
    """Half the size of a primitive's box, (3,) [m]."""
    if isinstance(shape, Box):
        return np.asarray(0.5 * np.array(shape.size()))
    if isinstance(shape, Sphere):
        return np.full(3, shape.radius())
    if isinstance(shape, Cylinder):
        return np.array([shape.radius(), shape.radius(), 0.5 * shape.length()])
    if isinstance(shape, Capsule):
        r = shape.radius()
        return np.array([r, r, 0.5 * shape.length() + r])
    if isinstance(shape, Ellipsoid):
        return np.array([shape.a(), shape.b(), shape.c()])
    return np.zeros(3)


def _tip(piece: GeometryInstance, knee: FloatArray) -> FloatArray:
    """The middle of that end of a shape that is farthest from the knee, (3,)."""
    points = points_of(piece)
    far = np.linalg.norm(points - knee, axis=1)
    end = points[far >= far.max() - 0.1 * (far.max() - far.min()) - 1e-9]
    middle = 0.5 * (end.min(axis=0) + end.max(axis=0))
    direction = middle - knee
    return np.asarray(knee + direction / max(np.linalg.norm(direction), 1e-9) * far.max())
