"""Reads the outlines of shanks, thighs and trunk from a plant's collision shapes."""

from collections.abc import Sequence
from itertools import pairwise, product

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

from drake_quad.common import FloatArray, read_only
from drake_quad.robot.model import SHANK_POINTS, ShankProfile

SPECK = 0.005  # [m] across: geometries no larger are let be
THIN = 0.04  # of its length: radius of a shank where it has no geometry, but for its end


def read_sides(
    plant: MultibodyPlant,
    inspector: SceneGraphInspector,
    links: tuple[RigidBody, RigidBody],
    foot: str,
    lengths: tuple[float, float],
) -> FloatArray:
    """How far a shank's geometries reach back and ahead of its middle line (2, 8) [m].

    The middle line is the shank's own -z axis, from the knee to the foot; looked at from the side
    at SHANK_POINTS. Each geometry but `foot` is taken for a rod: a line through its middle, with a
    radius. The knee is as thick as what the thigh has about it, too.

    Args:
        plant: The robot.
        inspector: Inspector of the robot's geometry.
        links: The leg's thigh and shank.
        foot: Name of the foot's geometry.
        lengths: Lengths of thigh and shank [m].
    """
    (thigh, shank), length = links, lengths[1]
    thin = THIN * length
    found = np.repeat([[np.inf], [-np.inf]], len(SHANK_POINTS), axis=1)
    for g in plant.GetCollisionGeometriesForBody(shank):
        if inspector.GetName(g) == foot:
            continue
        line, radius = _rod_line(inspector, g)
        along, ahead = -line[:, 2] / length, line[:, 0]
        for k, at in enumerate(SHANK_POINTS):
            near = np.abs(along - at) * length <= radius + 0.05 * length
            if np.any(near):
                found[0, k] = min(found[0, k], float(np.min(ahead[near])) - radius)
                found[1, k] = max(found[1, k], float(np.max(ahead[near])) + radius)
    bare = np.isinf(found[0])  # by its end there is a foot, at least
    found[:, bare] = np.array([[-thin], [thin]]) * (np.flatnonzero(bare) < len(SHANK_POINTS) - 1)
    ball = _about_knee(plant, inspector, thigh, lengths[0])
    found[:, 0] = min(found[0, 0], -ball), max(found[1, 0], ball)
    return found


PLACES = np.linspace(0.0, SHANK_POINTS[-1], 32)  # places of a profile, before some are left out
EASED = 0.0002  # [m] that a profile is thicker for fewer places, and at most twice that
ALONG, AROUND = 60, 64  # points along a rod that are looked at, and around it


def read_profile(
    plant: MultibodyPlant,
    inspector: SceneGraphInspector,
    links: tuple[RigidBody, RigidBody],
    foot: str,
    lengths: tuple[float, float],
) -> FloatArray:
    """How far a shank's geometries reach back and ahead of its middle line (2, 32) [m].

    At PLACES, and so far to both sides of each as the next one is. Boxes are taken by their edges,
    all else as rods that hold it, which are round where they are.

    Args:
        plant: The robot.
        inspector: Inspector of the robot's geometry.
        links: The leg's thigh and shank.
        foot: Name of the foot's geometry.
        lengths: Lengths of thigh and shank [m].
    """
    thigh, shank = links
    rods: list[tuple[FloatArray, float]] = []
    for g in plant.GetCollisionGeometriesForBody(shank):
        if inspector.GetName(g) == foot:
            continue
        shape = inspector.GetShape(g)
        if isinstance(shape, Box):  # a rod would not hold its corners
            X = inspector.GetPoseInFrame(g)
            edges = box_edges(half_sizes(shape))
            rods += [(np.asarray(X.multiply(edge.T)).T, 0.0) for edge in edges]
        else:
            rods.append(_rod_line(inspector, g, ALONG))
    return profile_of_rods(rods, lengths[1], _about_knee(plant, inspector, thigh, lengths[0]))


def box_edges(half: FloatArray) -> FloatArray:
    """The edges of a box of half sizes (3,), by their ends (12, 2, 3) [m]."""
    corners = np.array(list(product((-1.0, 1.0), repeat=3)))
    apart = np.abs(corners[:, None] - corners).sum(axis=-1)
    pairs = np.argwhere(np.triu(apart == 2.0))
    return np.asarray(corners[pairs] * half)


def profile_of_rods(
    rods: Sequence[tuple[FloatArray, float]], length: float, ball: float
) -> FloatArray:
    """How far rods of a shank reach back and ahead of its middle line, see `read_profile`.

    Args:
        rods: Points along the middle of each (n, 3) in the shank's frame, and its radius [m]; the
            ends alone of one without a radius.
        length: Length of the shank [m].
        ball: Radius of what the thigh has about the knee [m]; not positive: nothing.
    """
    step, thin = length * PLACES[1], THIN * length
    low, high = length * PLACES - step, length * PLACES + step
    low[0] = -np.inf
    found = np.repeat([[np.inf], [-np.inf]], len(PLACES), axis=1)
    for line, radius in rods:
        along, ahead = -line[:, 2], line[:, 0]
        if radius > 0.0:
            off = np.maximum(np.maximum(low[:, None] - along, along - high[:, None]), 0.0)
            half = np.where(off <= radius, np.sqrt(np.maximum(radius**2 - off**2, 0.0)), -np.inf)
        else:
            ahead, half = _clip(along, ahead, low, high)
        found[0] = np.minimum(found[0], (ahead - half).min(axis=1))
        found[1] = np.maximum(found[1], (ahead + half).max(axis=1))
    bare = np.isinf(found[0])  # by its end there is a foot, at least
    found[:, bare] = np.array([[-thin], [thin]]) * (np.flatnonzero(bare) < len(PLACES) - 1)
    ball = max(ball, 0.0)
    found[:, 0] = min(found[0, 0], -ball), max(found[1, 0], ball)
    middle = 0.5 * (found[0, 0] + found[1, 0])
    above = _reach_above(rods, middle)  # the cap of the first rod is to hold that, too
    found[:, 0] = min(found[0, 0], middle - above), max(found[1, 0], middle + above)
    return found


def _clip(
    along: FloatArray, ahead: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What of a line (2,) is between bounds (n,): its ends (n, 2), and 0, or -inf for nothing."""
    way = along[1] - along[0]
    bounds = np.stack([low, high], axis=1)
    shares = np.clip((bounds - along[0]) / way, 0.0, 1.0) if way else np.tile([0, 1], (len(low), 1))
    there = (high >= along.min()) & (low <= along.max())
    return ahead[0] + shares * (ahead[1] - ahead[0]), np.where(there, 0.0, -np.inf)[:, None]


def _reach_above(rods: Sequence[tuple[FloatArray, float]], ahead: float) -> float:
    """How far rods above a knee are from a point beside it, at most [m]; 0 if none is."""
    around = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    circle = np.stack([np.cos(around), np.sin(around)], axis=1) / np.cos(np.pi / AROUND)
    farthest = 0.0
    for line, radius in rods:
        points = np.stack([-line[:, 2], line[:, 0]], axis=1)[:, None] + radius * circle
        up = points[points[..., 0] < 0.0]
        farthest = max(farthest, np.linalg.norm(up - [0.0, ahead], axis=1).max(initial=0.0))
    return float(farthest)


def join_places(along: FloatArray, back: FloatArray, ahead: FloatArray) -> ShankProfile:
    """The profile of all shanks, without places that rods between others hold as well.

    Args:
        along: Places along the shanks (n,).
        back: Where their shapes begin there, along the shanks' own x (4, n) [m].
        ahead: Where they end there (4, n) [m].
    """
    middle, radius = 0.5 * (back + ahead), 0.5 * (ahead - back)

    def needed(i: int, j: int) -> FloatArray:
        """How thick the rod between two places has to be for each of those between (4, k) [m]."""
        share = (along[i : j + 1] - along[i]) / (along[j] - along[i])
        line = middle[:, i, None] + share * (middle[:, j] - middle[:, i])[:, None]
        return np.asarray(np.abs(middle[:, i : j + 1] - line) + radius[:, i : j + 1])

    def holds(i: int, j: int) -> bool:
        """Whether the rod between two places holds all that is between them, and hardly more."""
        here, thick = radius[:, i : j + 1], np.maximum(radius[:, i], radius[:, j])[:, None]
        return bool(np.all((needed(i, j) <= thick + EASED) & (thick <= here + 2.0 * EASED)))

    kept = [0]
    while kept[-1] < len(along) - 1:
        i = j = kept[-1]
        while j < len(along) - 1 and (j == i or holds(i, j + 1)):
            j += 1
        kept.append(j)
    radii = radius[:, kept]
    for k, (i, j) in enumerate(pairwise(kept)):  # by what the rod between them lacks, and no more
        ends = radius[:, [i, j]]
        lacks = np.maximum(needed(i, j).max(axis=1) - ends.max(axis=1), 0.0)
        radii[:, k : k + 2] = np.maximum(radii[:, k : k + 2], ends + lacks[:, None])
    return ShankProfile(read_only(along[kept]), read_only(middle[:, kept]), read_only(radii))


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
