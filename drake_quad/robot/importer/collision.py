"""Collision shapes of the normal form: primitives as they are, meshes as what holds them.

Drake's point contact is quick and steady with primitives. So a mesh on trunk or hip becomes its
box, one on thigh or shank a capsule along the link. The foot is a sphere, and nothing of the
shank reaches beyond it.
"""

from pathlib import Path

import numpy as np
from pydrake.geometry import Box, Capsule, Convex, Mesh, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_quad.common import FloatArray
from drake_quad.robot.importer.feet import points_of
from drake_quad.robot.importer.normal_form import NormalLeg, NormalLink, NormalRobot
from drake_quad.robot.importer.parse import quiet
from drake_quad.robot.importer.raw_robot import ASSUMED, REPAIRED, GeometryInstance, Note

THINNEST = 0.005  # [m] radius of a capsule that stands for a mesh
THICK = 0.08  # radius of a capsule that stands for nothing known, of its link's length
DEEP = 0.5  # height of a trunk's box that stands for nothing known, of the hips' distance across
STANDING_PITCH = 0.9  # [rad] of the hip from straight down, within which robots stand and walk
STANDING_SWAY = 0.15  # [rad] of abduction, likewise
FOOT_PART = 1 / 3  # of the shank, at its end: a shape within is the foot's own, whatever its form
BARE = 0.9  # of a shank, beyond which the foot's sphere stands for it
TOLD_FROM = 0.003  # [m] by which a shape may reach out of its capsule without a word
WITHIN = 90.0  # percent of a mesh's vertices that its capsule's radius holds


def trunk_shapes(link: NormalLink) -> tuple[list[GeometryInstance], list[Note]]:
    """Of a trunk or hip: primitives kept, meshes as boxes along the link's axes.

    A trunk whose meshes are all missing is a box from hip to hip.
    """
    shapes, notes = [], []
    for piece in link.collision:
        if _is_mesh(piece):
            shapes.append(_box(piece, link))
            notes.append(Note(REPAIRED, f"{link.name}: collision mesh {piece.name} as its box"))
        else:
            shapes.append(piece)
    return shapes, notes


def between_hips(trunk: NormalLink) -> tuple[list[GeometryInstance], list[Note]]:
    """What stands for a trunk whose collision meshes are all missing: a box from hip to hip."""
    x, y = 2.0 * np.abs(trunk.end[:2])
    box = GeometryInstance(f"{trunk.name}_box", trunk.name, Box(x, y, DEEP * y), RigidTransform())
    text = f"{trunk.name}: no collision shape is left; a box from hip to hip"
    return [box], [Note(ASSUMED, text)]


def thigh_shapes(link: NormalLink) -> tuple[list[GeometryInstance], list[Note]]:
    """Of a thigh: primitives kept, meshes together as two capsules, for thighs taper."""
    meshes = [p for p in link.collision if _is_mesh(p)]
    shapes = [p for p in link.collision if not _is_mesh(p)]
    if not shapes and not meshes and link.shapeless:
        return _stand_in(link, np.inf)
    if not meshes:
        return shapes, []
    upper, lower = _tapered(meshes, link)
    text = (
        f"{link.name}: collision meshes as capsules of radius {1e3 * upper.shape.radius():.0f}, "
        f"in its lower half {1e3 * lower.shape.radius():.0f} mm along the link"
    )
    return [*shapes, upper, lower], [Note(REPAIRED, text)]


def shank_shapes(leg: NormalLeg) -> tuple[list[GeometryInstance], list[Note]]:
    """Of a shank without its foot: likewise, and what would touch before the foot as a capsule."""
    link, radius = leg.links[2], leg.foot.radius
    own = [p for p in link.collision if not _is_foot(p, leg)]
    own = [p for p in own if not _within_foot(p, link.end, radius)]
    odd = [
        p
        for p in own
        if _is_mesh(p)
        or _reaches_beyond(p, link.end, radius)
        or (_id(leg) == p.link + p.name and not _ends_round(p, radius))
    ]
    shapes = [p for p in own if all(p is not other for other in odd)]
    if not own and link.shapeless:
        return _stand_in(link, 0.8 * radius)
    if not odd:
        return shapes, []
    capsule = _capsule(odd, link, link.end, 0.8 * radius)
    what = ", ".join(p.name for p in odd)
    return [*shapes, capsule], [_told(link, capsule, what, _beyond(odd, link.end, capsule))]


def foot_shape(leg: NormalLeg) -> GeometryInstance:
    """The foot's sphere, in the shank's frame, with the friction of what it stands for."""
    X, sphere = RigidTransform(leg.links[2].end), Sphere(leg.foot.radius)
    friction = leg.foot.piece.friction if leg.foot.piece else None
    return GeometryInstance(f"{leg.short}_foot", leg.links[2].name, sphere, X, friction=friction)


def _id(leg: NormalLeg) -> str:
    """Of the shape that the foot stands for."""
    piece = leg.foot.piece
    return piece.link + piece.name if piece else ""


def _is_foot(piece: GeometryInstance, leg: NormalLeg) -> bool:
    """Whether the foot stands for all of a shape, and not for the tip of a shank alone."""
    if piece.link + piece.name != _id(leg):
        return False
    begins = -float(points_of(piece)[:, 2].max()) / float(np.linalg.norm(leg.links[2].end))
    return isinstance(piece.shape, Sphere) or begins >= 1.0 - FOOT_PART


def _ends_round(piece: GeometryInstance, radius: float) -> bool:
    """Whether the ball in a shape's tip touches the ground first, however the shank is inclined."""
    return isinstance(piece.shape, Capsule) and bool(piece.shape.radius() <= radius)


def _is_mesh(piece: GeometryInstance) -> bool:
    """Whether a shape is no primitive."""
    return isinstance(piece.shape, (Mesh, Convex))


def _within_foot(piece: GeometryInstance, foot: FloatArray, radius: float) -> bool:
    """Whether a shape lies in the foot's sphere: another part of the foot."""
    return bool(np.all(np.linalg.norm(points_of(piece) - foot, axis=1) <= 1.75 * radius + 1e-6))


def _reaches_beyond(piece: GeometryInstance, foot: FloatArray, radius: float) -> bool:
    """Whether a shape would touch level ground before the foot does, the shank upright."""
    return bool(points_of(piece)[:, 2].min() < foot[2] - 0.999 * radius)


def _box(piece: GeometryInstance, link: NormalLink) -> GeometryInstance:
    """The box along the link's axes that holds a shape."""
    points = points_of(piece)
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 1e-3)
    return GeometryInstance(piece.name, link.name, Box(*size), RigidTransform(0.5 * (low + high)))


def _capsule(
    pieces: list[GeometryInstance], link: NormalLink, end: FloatArray, most: float
) -> GeometryInstance:
    """A capsule from the link's joint to its end, as thick as most of the shapes are."""
    points = np.concatenate([points_of(p) for p in pieces])
    length = float(np.linalg.norm(end))
    along = end / length
    s = np.clip(points @ along, 0.0, length)
    distance = np.linalg.norm(points - s[:, None] * along, axis=1)
    radius = float(np.clip(np.percentile(distance, WITHIN), THINNEST, most))
    X = RigidTransform(0.5 * end)  # links hang along -z: so does the capsule
    return GeometryInstance(f"{link.name}_capsule", link.name, Capsule(radius, length), X)


def _tapered(
    pieces: list[GeometryInstance], link: NormalLink
) -> tuple[GeometryInstance, GeometryInstance]:
    """Capsules for the halves of a link, each as thick as most of the shapes are there.

    The lower one ends where the shapes do: a knee is not to be thicker than it is.
    """
    points = np.concatenate([points_of(p) for p in pieces])
    length = float(np.linalg.norm(link.end))
    along = link.end / length
    s = points @ along
    aside = np.linalg.norm(points - s[:, None] * along, axis=1)
    below = s > 0.5 * length
    radii = [
        float(max(np.percentile(aside[half], WITHIN), THINNEST)) if np.any(half) else THINNEST
        for half in (~below, below)
    ]
    beyond = float(np.clip(s.max() - length, 0.0, radii[1]))  # the knee, of the shapes
    last = max(length - (radii[1] - beyond), 0.55 * length)
    found = []
    for name, radius, (start, end) in zip(
        ("upper", "lower"), radii, ((0.0, 0.5 * length), (0.5 * length, last)), strict=True
    ):
        X = RigidTransform(0.5 * (start + end) * along)  # links hang along -z: so does the capsule
        shape = Capsule(radius, end - start)
        found.append(GeometryInstance(f"{link.name}_{name}_capsule", link.name, shape, X))
    return found[0], found[1]


def _stand_in(link: NormalLink, most: float) -> tuple[list[GeometryInstance], list[Note]]:
    """A capsule for a thigh or shank whose collision meshes are all missing."""
    length = float(np.linalg.norm(link.end))
    shape = Capsule(min(THICK * length, most), length)
    piece = GeometryInstance(
        f"{link.name}_capsule", link.name, shape, RigidTransform(0.5 * link.end)
    )
    text = f"{link.name}: no collision shape is left; a capsule of {1e3 * shape.radius():.0f} mm"
    return [piece], [Note(ASSUMED, text)]


def _beyond(pieces: list[GeometryInstance], end: FloatArray, capsule: GeometryInstance) -> float:
    """How far shapes reach out of the capsule that stands for them [m], but next to the foot."""
    points = np.concatenate([points_of(p) for p in pieces])
    length = float(np.linalg.norm(end))
    s = points @ end / length
    points, s = points[s < BARE * length], np.clip(s[s < BARE * length], 0.0, length)
    aside = np.linalg.norm(points - s[:, None] * end / length, axis=1)
    return float(np.max(aside, initial=0.0)) - float(capsule.shape.radius())


def _told(link: NormalLink, capsule: GeometryInstance, what: str, beyond: float) -> Note:
    """What a capsule stands for, and what of that it is too thin for."""
    size = f"{1e3 * capsule.shape.radius():.0f} mm"
    text = f"{link.name}: {what} as a capsule of radius {size} along the link"
    if beyond >= TOLD_FROM:
        text += f", {1e3 * beyond:.0f} mm thinner than it is where it is thickest"
    return Note(REPAIRED, text)


def thighs_inside_trunk(urdf: Path, robot: NormalRobot) -> list[str]:
    """Legs whose thigh is in contact with the trunk's shape already where the robot stands.

    Trunks of files are often boxes around meshes, into which a thigh's root reaches. Standing is
    any hip pitch up to `STANDING_PITCH` from straight down and abduction up to `STANDING_SWAY`.

    Args:
        urdf: The robot's normal form, without a filter between thighs and trunk.
        robot: Robot whose shapes they are.

    Returns:
        The legs' short names, in order.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    with quiet():  # Drake warns of joints' friction, which it does not simulate
        Parser(plant).AddModels(str(urdf))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    of_plant = plant.GetMyMutableContextFromRoot(context)
    of_scene = scene_graph.GetMyContextFromRoot(context)
    shapes_of = {
        link: {int(g.get_value()) for g in plant.GetCollisionGeometriesForBody(body)}
        for link, body in (
            (name, plant.GetBodyByName(name))
            for name in (robot.trunk.name, *(leg.links[1].name for leg in robot.legs))
        )
    }
    trunk = shapes_of[robot.trunk.name]
    inside: dict[str, None] = {}
    for sway in (-STANDING_SWAY, 0.0, STANDING_SWAY):
        for pitch in np.linspace(-STANDING_PITCH, STANDING_PITCH, 13):
            for leg in robot.legs:
                for hinge, angle in zip(leg.raw.hinges[:2], (sway, pitch), strict=True):
                    plant.GetJointByName(hinge.name).set_angle(of_plant, float(angle))
            found = scene_graph.get_query_output_port().Eval(of_scene)
            for pair in found.ComputePointPairPenetration():
                ids = {int(pair.id_A.get_value()), int(pair.id_B.get_value())}
                if ids & trunk:
                    inside |= dict.fromkeys(
                        leg.short for leg in robot.legs if ids & shapes_of[leg.links[1].name]
                    )
    return [leg.short for leg in robot.legs if leg.short in inside]
