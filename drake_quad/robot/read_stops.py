"""Reads the shapes of a robot's thighs and trunk that come against each other in physics."""

import numpy as np
from pydrake.geometry import Box, Capsule, Cylinder, GeometryId, SceneGraphInspector, Sphere
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_quad.common import FloatArray, read_only
from drake_quad.robot.model import PATH, ThighStops
from drake_quad.robot.read_outline import ROUND, SPECK, half_sizes, outer_boxes, rod

SQUARE = 1e-3  # by which a box's axes may be off those of its body


def read_stops(
    plant: MultibodyPlant, inspector: SceneGraphInspector, trunk: RigidBody, thighs: list[RigidBody]
) -> ThighStops:
    """The shapes that thighs and trunk have for each other; pairs that are filtered have none.

    Meshes and ellipsoids are left out, and so are spheres, caps of capsules, and boxes askew to B
    of the trunk's: no overlap is made up.
    """
    ours = plant.GetCollisionGeometriesForBody(trunk)
    theirs = [plant.GetCollisionGeometriesForBody(thigh) for thigh in thighs]
    meets = [
        [g for g in ours if not all(inspector.CollisionFiltered(g, t) for t in thigh)]
        for thigh in theirs
    ]
    met = [g for g in ours if any(g in some for some in meets)]
    square = [g for g in met if _is_square_box(inspector, g)]
    rods = [
        _ends(inspector, g) for g in met if isinstance(inspector.GetShape(g), Cylinder | Capsule)
    ]
    paths = [
        [path for t in thigh if (path := _path(inspector, t)) is not None] if some else []
        for thigh, some in zip(theirs, meets, strict=True)
    ]
    most = max(len(mine) for mine in paths)
    lines, radii = np.zeros((4, most, PATH, 3)), np.full((4, most), -np.inf)
    for row, mine in enumerate(paths):
        for k, (line, radius) in enumerate(mine):
            lines[row, k], radii[row, k] = line, radius
    return ThighStops(
        boxes=read_only(outer_boxes(inspector, square) if square else np.zeros((0, 2, 3))),
        rods=read_only(np.array([ends for ends, _ in rods]).reshape(-1, 2, 3)),
        rod_radii=read_only(np.array([radius for _, radius in rods])),
        paths=read_only(lines),
        radii=read_only(radii),
    )


def _is_square_box(inspector: SceneGraphInspector, g: GeometryId) -> bool:
    turn = np.abs(inspector.GetPoseInFrame(g).rotation().matrix())
    along = bool(np.abs(turn - np.round(turn)).max() < SQUARE)
    return along and isinstance(inspector.GetShape(g), Box)


def _ends(inspector: SceneGraphInspector, g: GeometryId) -> tuple[FloatArray, float]:
    """The ends (2, 3) of a cylinder's axis, or a capsule's, and its radius [m]."""
    axis, half, radius = rod(inspector.GetShape(g))
    ends = inspector.GetPoseInFrame(g).multiply(np.outer(axis, [-half, half]))
    return np.asarray(ends).T, radius


def _path(inspector: SceneGraphInspector, g: GeometryId) -> tuple[FloatArray, float] | None:
    """Points (PATH, 3) of a way along a shape, and how thick the shape is around it [m].

    Round a box along its edges; along a capsule's axis; to and fro between a cylinder's ends, all
    round it.
    """
    shape = inspector.GetShape(g)
    half = half_sizes(shape)
    if half.max() < SPECK:
        return None
    if isinstance(shape, Box):
        line, radius = ROUND * half, 0.0
    elif isinstance(shape, Cylinder):
        turns = np.repeat(np.linspace(0.0, 2.0 * np.pi, PATH // 2), 2)
        ends = half[2] * np.where((np.arange(PATH) + 1) % 4 < 2, -1.0, 1.0)
        line = np.column_stack([half[0] * np.cos(turns), half[1] * np.sin(turns), ends])
        radius = 0.0
    elif isinstance(shape, Capsule):
        axis, reach, radius = rod(shape)
        line = np.outer([-reach, reach], axis)
    elif isinstance(shape, Sphere):
        line, radius = np.zeros((1, 3)), shape.radius()
    else:
        return None
    line = np.concatenate([line, np.repeat(line[-1:], PATH - len(line), axis=0)])
    return np.asarray(inspector.GetPoseInFrame(g).multiply(line.T)).T, radius
