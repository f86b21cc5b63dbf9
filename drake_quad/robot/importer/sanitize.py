"""What the three sanitizers share: notes, drives, includes, impossible sizes and inertias.

Drake's parsers put a stand-in in the place of many of them (of 1 kg, or a ball of water), and warn.
"""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydrake.multibody.tree import RotationalInertia

from drake_quad.errors import InputError
from drake_quad.robot.importer.meshes import hull_as_obj
from drake_quad.robot.importer.raw_robot import DOUBTFUL, DROPPED, REPAIRED, Note
from drake_quad.robot.importer.sources import resolve
from drake_quad.robot.importer.spelling import check_spelling
from drake_quad.robot.importer.stated_friction import (
    Shapes,
    has_friction_of_others,
    joint_friction,
    shapes_with_friction,
)
from drake_quad.robot.importer.xml_io import check_depth, floats, read_xml

# Of Drake's tags for a drive: what is taken if there is none, and the most that any drive has.
DRIVE_NUMBERS = (("rotor_inertia", 0.0, 1e3), ("gear_ratio", 1.0, 1e4))  # [kg m²], none


@dataclass
class Drive:
    """A joint's drive as a file gives it: torque limit [Nm], rotor inertia [kg m²], gear ratio."""

    effort: float = math.inf
    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0


@dataclass
class Cleaned:
    """A file that Drake's parser takes, and what had to be taken out of it.

    Attributes:
        root: The tree, changed in place by those who clean.
        beside: Folder of the original, from which its relative paths go.
        scratch: Folder for converted meshes.
        source: Name of the file, for errors.
        drives: Drives by joint; in SDF by model and joint, `model::joint`.
        reference: Angles of a standing pose by joint [rad], where the file has one.
        notes: What was changed or assumed.
        files: Every other file that was read.
        shapeless: Links of which a collision mesh is missing.
        included: Every file that was included, as often as it was.
        massless: Links that have no mass whatever Drake reads, `model::link`.
        frictional: The collision shapes that state a friction of Drake's kind: see
            `shapes_with_friction`.
        joint_friction: Coulomb friction of the joints by name, where the file has it [Nm].
    """

    root: ET.Element
    beside: Path
    scratch: Path
    source: str
    drives: dict[str, Drive] = field(default_factory=dict)
    reference: dict[str, float] = field(default_factory=dict)
    notes: list[Note] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    shapeless: set[str] = field(default_factory=set)
    included: list[Path] = field(default_factory=list)
    massless: set[str] = field(default_factory=set)
    frictional: Shapes = field(default_factory=set)
    joint_friction: dict[str, float] = field(default_factory=dict)

    def refuse(self, field: str, value: Any, remedy: str) -> InputError:
        """The error that names the file, a field of it, its value and what would be right."""
        return InputError(source=self.source, field=field, value=value, remedy=remedy)

    def strictly(self, text: str | None, field: str) -> list[float]:
        """The numbers in an attribute that Drake is not to see; none for none.

        Raises:
            InputError: If anything in it is no number.
        """
        found = floats(text)
        if not found and (text or "").strip():
            raise self.refuse(field, text, "must be a number")
        return found

    def note(self, kind: str, text: str) -> None:
        """Notes something once."""
        note = Note(kind, text)
        if note not in self.notes:
            self.notes.append(note)

    def locate_mesh(self, uri: str, what: str) -> Path | None:
        """The mesh's file; None, with a note, if it is not there."""
        found = resolve(uri, beside=self.beside)
        if found is None:
            self.note(DROPPED, f"{what}: mesh {Path(uri).name} is not there")
        elif found not in self.files:
            self.files.append(found)
        return found

    def mesh_of(self, link: str, kind: str, uri: str) -> Path | None:
        """The file of a link's mesh, or None with a note.

        Args:
            link: Name of the link.
            kind: `visual`, or `collision`: of that the convex hull, as a file that Drake takes.
            uri: Name of the mesh in the robot's file.
        """
        what = f"{kind} of link {link}"
        found = self.locate_mesh(uri, what)
        if kind == "visual":
            return found
        hull = hull_as_obj(found, self.scratch) if found else None
        if found and hull is None:
            self.note(DROPPED, f"{what}: mesh {found.name} cannot be read")
        if hull is None:
            self.shapeless.add(link)
        return hull

    def order_limits(self, joint: str, lower: float, upper: float) -> tuple[float, float]:
        """The limits in order, with a note if they were not."""
        if lower <= upper:
            return lower, upper
        self.note(REPAIRED, f"{joint}: limits {lower:g} and {upper:g} were reversed; swapped")
        return upper, lower

    def drive_number(self, text: str | None, field: str, otherwise: float, most: float) -> float:
        """A rotor's inertia or a gear's ratio; `otherwise` if the file gives none.

        Raises:
            InputError: If it is no number, or one that no drive has; a ratio of 0 is none.
        """
        found = (self.strictly(text, field) or [otherwise])[0]
        least = 0.0 if otherwise == 0.0 else 1.0 / most
        if not least <= found <= most:
            raise self.refuse(field, text, f"must be a number from {least:g} to {most:g}")
        return found


MOST_INCLUDED = 200  # by one robot: its file, twice in a file that is twice in another ..., grows
Chain = tuple[Path, ...]  # the robot's file, one that it includes, one that this includes, ...


def open_included(
    c: Cleaned, uri: str, chain: Chain, tags: tuple[str, ...], *, inside: str = ""
) -> ET.Element:
    """The root of an included file, which is added to `c.files`.

    Args:
        c: Record of the including file; relative paths start at `beside`.
        uri: Name of the included file, as the including file has it.
        chain: Files that led to the including file, each including the next.
        tags: Tags that the included file may begin with.
        inside: Tag of the element that takes what the included one holds, if another does.

    Raises:
        InputError: If it is not there, is no robot's, includes itself, or has misspelt names.
    """
    source = file_name(c, chain)

    def refuse(remedy: str) -> InputError:
        return InputError(source=source, field="include", value=uri, remedy=remedy)

    found = resolve(uri, beside=c.beside) if uri.strip() else None
    if found is None:
        what = "names no file" if not uri.strip() else "there is no such file"
        raise refuse(f"{what}; give that of a file to include, absolute or beside the robot's")
    if found in chain:
        way = ", ".join(path.name for path in chain[chain.index(found) + 1 :])
        raise refuse(f"{found.name} includes itself" + (f" by way of {way}" if way else ""))
    if len(c.included) >= MOST_INCLUDED:
        raise refuse(f"more than {MOST_INCLUDED} files are included")
    c.included.append(found)
    if found not in c.files:
        c.files.append(found)
    root = read_xml(found, str(found))
    if root.tag not in tags:
        begins = " or ".join(f"<{tag}>" for tag in tags)
        raise refuse(f"{found.name} begins with <{root.tag}>; one to include, with {begins}")
    check_spelling(root, str(found), inside=inside)
    return root


def file_name(c: Cleaned, chain: Chain) -> str:
    """How errors name the file at the chain's end: the robot's own as the person gave it."""
    return c.source if len(chain) == 1 else str(chain[-1])


def include_mjcf(c: Cleaned) -> None:
    """Puts included files where they are included, as MuJoCo does: each of them once.

    Raises:
        InputError: If one is not there, is no MJCF, or is included twice.
    """
    _include(c, c.root, (c.files[0],))
    check_depth(c.root, c.source)


def _include(c: Cleaned, root: ET.Element, chain: Chain) -> None:
    """Puts included files into the tree of one."""
    for element in list(root.iter()):
        for child in element.findall("include"):
            uri = child.get("file", "")
            found = resolve(uri, beside=c.beside)
            if found in c.included and found not in chain:
                raise InputError(
                    source=file_name(c, chain),
                    field="include",
                    value=uri,
                    remedy="is included twice; MuJoCo takes each file once",
                )
            tags = ("mujoco", "mujocoinclude")
            other = open_included(c, uri, chain, tags, inside=element.tag)
            _include(c, other, (*chain, c.included[-1]))
            place = list(element).index(child)
            element[place : place + 1] = list(other)


LIGHT = 1e-3  # [kg], [kg m²]: a link below both is a frame with a name, whatever it is given
HEAVY = 0.05  # [kg]: what is lighter may well be given as a point
_MOMENTS, _PRODUCTS = ("ixx", "iyy", "izz"), ("ixy", "ixz", "iyz")


def check_sdf_inertial(c: Cleaned, link: ET.Element, scoped: str) -> None:
    """Looks at a link of an SDF; one without an inertial is put into `c.massless`.

    Raises:
        InputError: If mass or inertia is given by half, or the mass is not above zero.
    """
    name, inertial = link.get("name", ""), link.find("inertial")
    if inertial is None:
        c.massless.add(scoped)
        return
    if inertial.get("auto", "").strip().lower() in ("true", "1"):
        raise c.refuse(f"{name}: inertial.auto", inertial.get("auto"), "give mass and inertia")
    mass = _mass_above_zero(c, name, inertial.findtext("mass"))
    texts = {key: inertial.findtext(f"inertia/{key}") for key in _MOMENTS + _PRODUCTS}
    missing = [key for key in _MOMENTS if not (texts[key] or "").strip()]
    if missing:
        raise c.refuse(
            f"{name}: inertia", inertial.findtext("inertia"), f"give {', '.join(missing)} [kg m²]"
        )
    values = [c.strictly(texts[k], f"{name}: {k}") or [0.0] for k in _MOMENTS + _PRODUCTS]
    _note_impossible(c, name, mass, [value[0] for value in values])


def check_urdf_inertial(c: Cleaned, link: ET.Element) -> None:
    """Looks at a link of a URDF; one of mass 0 is left no inertia, which Drake would weigh by 1 kg.

    Raises:
        InputError: If the mass is negative.
    """
    name, inertial = link.get("name", ""), link.find("inertial")
    if inertial is None:
        return
    element, inertia = inertial.find("mass"), inertial.find("inertia")
    text = element.get("value") if element is not None else None
    mass = floats(text) or ([] if (text or "").strip() else [0.0])
    if len(mass) != 1:
        return  # Drake's parser reports what is wrong
    if mass[0] < 0.0:
        raise c.refuse(f"{name}: mass", text, "must not be negative [kg]")
    given = {} if inertia is None else inertia.attrib
    values = [(floats(given.get(key)) or [0.0])[0] for key in _MOMENTS + _PRODUCTS]
    if mass[0] >= HEAVY and not any(values[:3]):
        text = f"link {name}: its mass of {mass[0]:.3g} kg has no inertia, as if it were a point"
        c.note(DOUBTFUL, f"{text}; give ixx, iyy and izz [kg m²]")
    elif mass[0] > 0.0:
        _note_impossible(c, name, mass[0], values)
    elif any(values):
        link.remove(inertial)
        c.note(REPAIRED, f"link {name}: an inertia without mass; it has neither")


def check_mjcf_inertial(c: Cleaned, body: ET.Element) -> None:
    """Looks at a body of an MJCF.

    Raises:
        InputError: If it has two, its mass is not above zero, or no body has its inertia.
    """
    name, found = body.get("name", ""), body.findall("inertial")
    if len(found) > 1:
        raise c.refuse(f"{name}: inertial", len(found), "give one")
    for inertial in found:
        _mass_above_zero(c, name, inertial.get("mass"))
        for key, count in (("diaginertia", 3), ("fullinertia", 6)):
            values = floats(inertial.get(key))
            if len(values) == count and not RotationalInertia(*values).CouldBePhysicallyValid():
                raise c.refuse(f"{name}: inertial.{key}", inertial.get(key), _RIGHT)


_RIGHT = "no body has this: principal moments are not negative, none above the other two's sum"


def _mass_above_zero(c: Cleaned, name: str, text: str | None) -> float:
    """A mass; one that is none is refused."""
    values = c.strictly(text, f"{name}: mass")
    if len(values) != 1 or not 0.0 < values[0] < math.inf:
        raise c.refuse(f"{name}: mass", text, "must be a number above zero [kg]")
    return values[0]


def _note_impossible(c: Cleaned, name: str, mass: float, values: list[float]) -> None:
    """Notes moments and products of inertia that no body has."""
    if mass < LIGHT and max(map(abs, values)) < LIGHT:
        return
    if all(map(math.isfinite, values)) and not RotationalInertia(*values).CouldBePhysicallyValid():
        text = f"link {name}: no body has its inertia; that of a ball of water of its mass"
        c.note(REPAIRED, text)


# Of a shape in SDF: the elements that hold its sizes, and how many each holds.
_SDF = {
    "sphere": {"radius": 1},
    "box": {"size": 3},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "ellipsoid": {"radii": 3},
}
# Of a shape in MJCF: how many sizes it has, and how many with `fromto`.
_MJCF = {
    "sphere": (1, 1),
    "box": (3, 1),
    "cylinder": (2, 1),
    "capsule": (2, 1),
    "ellipsoid": (3, 1),
}


def check_sdf_sizes(c: Cleaned, link: ET.Element) -> None:
    """Looks at the shapes of a link.

    Raises:
        InputError: If a size is missing, or not above zero.
    """
    name = link.get("name", "")
    for kind in ("visual", "collision"):
        for shape in (s for g in link.findall(f"{kind}/geometry") for s in g):
            for tag, count in _SDF.get(shape.tag, {}).items():
                text = shape.findtext(tag)
                _sizes_above_zero(c, f"{name}: {kind} {shape.tag}.{tag}", text, count)


def check_mjcf_sizes(c: Cleaned, body: ET.Element) -> None:
    """Looks at the geoms of a body, defaults written out.

    Raises:
        InputError: If a size is missing, or not above zero.
    """
    for geom in body.findall("geom"):
        kind = geom.get("type", "mesh" if geom.get("mesh") else "sphere")
        if kind in _MJCF and not geom.get("mesh"):  # a shape that is fitted to a mesh has none
            count = _MJCF[kind]["fromto" in geom.attrib]
            _sizes_above_zero(c, f"{body.get('name', '')}: {kind}.size", geom.get("size"), count)


def _sizes_above_zero(c: Cleaned, field: str, text: str | None, count: int) -> None:
    """Refuses fewer sizes than a shape has, and any that is none."""
    values = floats(text)[:count]
    if len(values) < count or min(values) <= 0.0:
        what = "must be a number" if count == 1 else f"must be {count} numbers"
        raise c.refuse(field, text, f"{what} above zero [m]")


def read_friction(c: Cleaned) -> None:
    """Remembers which links and joints state their friction, and notes what is not used."""
    c.frictional |= shapes_with_friction(c.root)
    c.joint_friction |= joint_friction(c.root, c.refuse)
    mjcf = c.root.tag == "mujoco"
    of_mujoco = mjcf and any(e.get("friction") for e in c.root.iter("geom"))
    if of_mujoco or (not mjcf and has_friction_of_others(c.root)):
        whose = "MuJoCo's" if mjcf else "ODE's"
        text = f"friction of {whose} kind is not used: that of contacts is simulation.friction"
        c.note(DROPPED, text)
