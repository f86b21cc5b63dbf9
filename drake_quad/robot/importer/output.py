"""Writes the normal form: a URDF and meshes for the eye.

A mesh comes apart by colour, and is made coarser where it has more triangles than a picture of a
robot needs: reports hold them all. Without `trimesh` only meshes that Drake shows as they are stay.
"""

import hashlib
import xml.etree.ElementTree as ET
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Mesh, Sphere
from pydrake.math import RigidTransform, RollPitchYaw

from drake_quad.common import FloatArray
from drake_quad.robot.importer.meshes import Faces, coarsen, have_trimesh, load_parts, write_surface
from drake_quad.robot.importer.normal_form import NormalLeg, NormalLink, NormalRobot
from drake_quad.robot.importer.raw_robot import ASSUMED, DROPPED, GeometryInstance, Note

FOLDER = "meshes"
MOST_FACES = 6000  # of one mesh file
SHOWN = frozenset({".obj", ".gltf"})  # formats that Drake shows
COLOURED = frozenset({".dae", ".gltf", ".glb"})  # whose own colours go before the robot's file's
Colour = tuple[float, ...]
PLAIN: Colour = (0.6, 0.6, 0.62, 1.0)  # of a link that the file gives no picture


class MeshFile(NamedTuple):
    """A mesh as the URDF is to name it: a path, and its scale along x, y, z."""

    path: str
    scale: tuple[float, float, float]


class _Part(NamedTuple):
    """One colour of a mesh: the file that it is in, and the colour if the mesh has one."""

    file: str
    colour: Colour | None


def write_visuals(
    robot: NormalRobot, folder: Path, collision: dict[str, list[GeometryInstance]]
) -> tuple[dict[str, list[GeometryInstance]], list[Note]]:
    """Writes the meshes into `folder`; returns the shapes by link, and what was dropped.

    Args:
        robot: The robot with the visual shapes.
        folder: Where the URDF is to be.
        collision: Collision shapes by link: a link without any other picture shows these.
    """
    done: dict[Path, list[_Part]] = {}
    made: dict[str, list[GeometryInstance]] = {}
    notes: list[Note] = []
    for link in (robot.trunk, *(link for leg in robot.legs for link in leg.links)):
        pieces = made.setdefault(link.name, [])
        for piece in link.visual:
            if not isinstance(piece.shape, (Mesh, Convex)):
                pieces.append(piece)
                continue
            path = Path(piece.shape.source().path())
            if path not in done:
                done[path] = _convert(path, folder)
                if not done[path]:
                    hint = "" if have_trimesh() else "; pip install pycollada trimesh reads it"
                    notes.append(Note(DROPPED, f"visual mesh {path.name} cannot be shown{hint}"))
            scale = tuple(float(x) for x in piece.shape.scale3())
            for part in done[path]:
                mesh = MeshFile(part.file, (scale[0], scale[1], scale[2]))
                own, given = part.colour, piece.colour
                colour = own or given if path.suffix.lower() in COLOURED else given or own
                pieces.append(replace(piece, shape=mesh, colour=colour))
    shanks = {leg.links[2].name: leg.foot.radius for leg in robot.legs}
    bare = []
    for name, pieces in made.items():
        sizes = [p.shape.radius() if isinstance(p.shape, Sphere) else np.inf for p in pieces]
        if max(sizes, default=0.0) <= 2.0 * shanks.get(name, 0.0) and collision.get(name):
            bare.append(name)
            made[name] = [replace(piece, colour=PLAIN) for piece in collision[name]]
    if bare:
        notes.append(Note(ASSUMED, f"shown by their collision shapes: {', '.join(bare)}"))
    return made, notes


def _convert(path: Path, folder: Path) -> list[_Part]:
    """A mesh's parts by colour, each in a file of its own; none if it cannot be read."""
    loaded = load_parts(path)
    if not loaded:
        return [_Part(str(path), None)] if path.suffix.lower() in SHOWN else []
    parts: dict[Colour | None, list[tuple[FloatArray, Faces]]] = {}
    for part in loaded:
        surface = (np.asarray(part.vertices, dtype=float), np.asarray(part.faces))
        parts.setdefault(_colour(part), []).append(surface)
    total = sum(len(faces) for surfaces in parts.values() for _, faces in surfaces)
    (folder / FOLDER).mkdir(exist_ok=True)
    stem = f"{path.stem}_{hashlib.sha256(str(path).encode()).hexdigest()[:6]}"
    found = []
    for number, (colour, surfaces) in enumerate(parts.items()):
        points, faces = _joined(surfaces)
        share = MOST_FACES * max(len(faces) / total, 0.05)
        points, faces = coarsen(points, faces, most=int(share))
        if len(faces):
            name = f"{stem}_{number}.obj"
            write_surface(folder / FOLDER / name, points, faces)
            found.append(_Part(f"{FOLDER}/{name}", colour))
    return found


def _joined(surfaces: list[tuple[FloatArray, Faces]]) -> tuple[FloatArray, Faces]:
    """Several surfaces as one."""
    starts = np.cumsum([0, *(len(points) for points, _ in surfaces)])
    faces = [f + start for (_, f), start in zip(surfaces, starts, strict=False)]
    return np.concatenate([points for points, _ in surfaces]), np.concatenate(faces)


def _colour(geometry: Any) -> Colour | None:
    """The one colour of a surface, of a texture its mean; None if the file gives none."""
    visual = geometry.visual
    material = getattr(visual, "material", None)
    if material is None:
        if not getattr(visual, "defined", False):
            return None
        rgba = np.asarray(visual.main_color, dtype=float)
    else:
        image = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
        if image is not None:
            pixels = np.asarray(image.convert("RGB").resize((32, 32)), dtype=float)
            rgba = np.array([*pixels.reshape(-1, 3).mean(axis=0), 255.0])
        else:
            rgba = np.asarray(material.main_color, dtype=float)
    # Half a shade is no other colour. Opaque: exporters often write 0 for opacity.
    return (*(round(float(c) / 255.0, 2) for c in rgba[:3]), 1.0)


def make_urdf(
    robot: NormalRobot,
    collision: dict[str, list[GeometryInstance]],
    visual: dict[str, list[GeometryInstance]],
    *,
    comment: str,
    inside_trunk: Collection[str] = (),
) -> str:
    """The text of the URDF.

    Args:
        robot: What to write.
        collision: Shapes by link, in the link's frame.
        visual: Visual shapes; meshes as files relative to the URDF.
        comment: Text at the head of the file.
        inside_trunk: Legs (`FL`, ...) whose thighs lie within the trunk's shape where the robot
            stands: contacts of these with the trunk mean nothing, and are left out.
    """
    root = ET.Element("robot", {"name": robot.name, "xmlns:drake": "https://drake.mit.edu/"})
    root.append(ET.Comment(f" {comment} "))
    for link in (robot.trunk, *(link for leg in robot.legs for link in leg.links)):
        _add_link(root, link, collision.get(link.name, []), visual.get(link.name, []))
    for leg in robot.legs:
        _add_joints(root, robot, leg)
    for leg in robot.legs:
        # Neighbours overlap at their joint.
        near = [robot.trunk.name, leg.links[0].name]
        if leg.short in inside_trunk:
            near.append(leg.links[1].name)
        _add_filter(root, f"{leg.short}_near_trunk", near)
        _add_filter(root, f"{leg.short}_leg", [link.name for link in leg.links])
    # Hips turn in place, side by side; the boxes of their meshes have corners that the hips lack.
    _add_filter(root, "hips", [leg.links[0].name for leg in robot.legs])
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add_link(
    root: ET.Element,
    link: NormalLink,
    collision: list[GeometryInstance],
    visual: list[GeometryInstance],
) -> None:
    """A link with its mass and shapes."""
    element = ET.SubElement(root, "link", name=link.name)
    inertial = ET.SubElement(element, "inertial")
    I = link.rigid.central_inertia()  # noqa: E741
    ET.SubElement(inertial, "origin", xyz=_told(link.rigid.centre()), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(float(link.rigid.mass)))
    places = {
        "ixx": (0, 0),
        "iyy": (1, 1),
        "izz": (2, 2),
        "ixy": (0, 1),
        "ixz": (0, 2),
        "iyz": (1, 2),
    }
    ET.SubElement(inertial, "inertia", {k: repr(float(I[at])) for k, at in places.items()})
    used: set[str] = set()
    for kind, pieces in (("visual", visual), ("collision", collision)):
        for piece in pieces:
            name, number = piece.name, 1
            while f"{kind} {name}" in used:
                number += 1
                name = f"{piece.name}_{number}"
            used.add(f"{kind} {name}")
            _add_shape(ET.SubElement(element, kind, name=name), piece, f"{link.name}_{name}")
            if kind == "collision" and piece.friction is not None:
                _add_friction(element[-1], *piece.friction)


def _add_shape(element: ET.Element, piece: GeometryInstance, material: str) -> None:
    """One geometry."""
    element.append(_origin(piece.X))
    shape, geometry = piece.shape, ET.SubElement(element, "geometry")
    if isinstance(shape, Sphere):
        ET.SubElement(geometry, "sphere", radius=repr(shape.radius()))
    elif isinstance(shape, (Cylinder, Capsule)):
        tag = "cylinder" if isinstance(shape, Cylinder) else "capsule"
        ET.SubElement(geometry, tag, radius=repr(shape.radius()), length=repr(shape.length()))
    elif isinstance(shape, Box):
        ET.SubElement(geometry, "box", size=_told(np.array(shape.size())))
    elif isinstance(shape, Ellipsoid):
        sizes = {k: repr(getattr(shape, k)()) for k in "abc"}
        ET.SubElement(geometry, "drake:ellipsoid", sizes)
    elif isinstance(shape, MeshFile):
        ET.SubElement(geometry, "mesh", filename=shape.path, scale=_told(shape.scale))
    else:
        raise TypeError(type(shape).__name__)
    if piece.colour is not None:
        ET.SubElement(
            ET.SubElement(element, "material", name=material),
            "color",
            rgba=" ".join(f"{c:.4g}" for c in piece.colour),
        )


def _add_friction(element: ET.Element, static: float, dynamic: float) -> None:
    """The friction of a collision shape, in Drake's tags."""
    properties = ET.SubElement(element, "drake:proximity_properties")
    ET.SubElement(properties, "drake:mu_static", value=repr(static))
    ET.SubElement(properties, "drake:mu_dynamic", value=repr(dynamic))


def _add_joints(root: ET.Element, robot: NormalRobot, leg: NormalLeg) -> None:
    """The three joints of a leg, each with its drive."""
    names = [robot.trunk.name, *(link.name for link in leg.links)]
    hip = leg.frames.origin[0] - robot.centre
    origins = [np.round(hip, 12), leg.links[0].end, leg.links[1].end]
    for k, hinge in enumerate(leg.raw.hinges):
        joint = ET.SubElement(root, "joint", name=hinge.name, type="revolute")
        ET.SubElement(joint, "origin", xyz=_told(origins[k]), rpy="0 0 0")
        ET.SubElement(joint, "parent", link=names[k])
        ET.SubElement(joint, "child", link=names[k + 1])
        ET.SubElement(joint, "axis", xyz=_told(np.round(leg.frames.axis[k], 12)))
        limits = {"lower": leg.limits.lower[k], "upper": leg.limits.upper[k]}
        limits |= {"effort": leg.limits.effort[k], "velocity": leg.limits.speed[k]}
        ET.SubElement(joint, "limit", {key: repr(float(v)) for key, v in limits.items()})
        ET.SubElement(joint, "dynamics", damping=repr(hinge.damping),
                      friction=repr(hinge.friction))  # fmt: skip
        drive = ET.SubElement(root, "transmission", name=f"{hinge.name}_drive")
        ET.SubElement(drive, "type").text = "transmission_interface/SimpleTransmission"
        ET.SubElement(
            ET.SubElement(drive, "joint", name=hinge.name), "hardwareInterface"
        ).text = "EffortJointInterface"
        actuator = ET.SubElement(drive, "actuator", name=hinge.name)
        ET.SubElement(actuator, "drake:rotor_inertia", value=repr(hinge.rotor_inertia))
        ET.SubElement(actuator, "drake:gear_ratio", value=repr(hinge.gear_ratio))


def _add_filter(root: ET.Element, name: str, links: list[str]) -> None:
    """Links that never collide with one another."""
    group = ET.SubElement(root, "drake:collision_filter_group", name=name)
    for link in links:
        ET.SubElement(group, "drake:member", link=link)
    ET.SubElement(group, "drake:ignored_collision_filter_group", name=name)


def _origin(X: RigidTransform) -> ET.Element:
    """A pose."""
    rpy = RollPitchYaw(X.rotation()).vector()
    return ET.Element("origin", xyz=_told(X.translation()), rpy=_told(np.array(rpy)))


def _told(v: Any) -> str:
    """Numbers as text, to the last bit."""
    return " ".join(repr(float(x) + 0.0) for x in v)
