"""Makes an MJCF one that Drake's parser accepts, with defaults written out and drives read.

Drake's parser misses attributes that a class has from the class above it (axes, limits), takes
meshes as .obj alone, and does not read a joint's own torque limit: so all defaults are written out
where they are used, and the drives are taken from the tree.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from drake_quad.robot.importer.meshes import whole_as_obj
from drake_quad.robot.importer.raw_robot import DROPPED
from drake_quad.robot.importer.sanitize import (
    DRIVE_NUMBERS,
    Cleaned,
    Drive,
    check_mjcf_inertial,
    check_mjcf_sizes,
    include_mjcf,
    read_friction,
)
from drake_quad.robot.importer.xml_io import check_depth, floats

Defaults = dict[str, dict[str, dict[str, str]]]  # class -> tag, see `_kind` -> attributes
ACTUATORS = ("motor", "position", "velocity", "general", "intvelocity", "damper")
_INHERITING = ("joint", "geom", *ACTUATORS)


def write_out_defaults(c: Cleaned) -> None:
    """Gives every joint, geom, mesh and actuator the attributes that it has from its class.

    Raises:
        InputError: If there is no such class.
    """
    defaults: Defaults = {"": {}}
    for element in c.root.findall("default"):
        _gather(element, "", defaults)
        c.root.remove(element)
    for body in c.root.findall("worldbody"):
        _write_out(c, body, "", defaults)
    for place in c.root.findall("asset"):
        for mesh in place.findall("mesh"):
            _inherit(c, mesh, "", defaults)
    for place in c.root.findall("actuator"):
        for actuator in place:
            _inherit(c, actuator, "", defaults)


def _gather(element: ET.Element, parent: str, defaults: Defaults) -> None:
    """The defaults of a class with all that it has from those above it."""
    name = element.get("class", "") if element.get("class") != "main" else ""
    own = {tag: dict(attributes) for tag, attributes in defaults[parent].items()}
    for child in element:
        if child.tag != "default":
            own.setdefault(_kind(child), {}).update(child.attrib)
    defaults[name] = own
    for child in element.findall("default"):
        _gather(child, name, defaults)


def _kind(element: ET.Element) -> str:
    """What an element has its defaults as: in MuJoCo all actuators of a class share theirs."""
    return "actuator" if element.tag in ACTUATORS else element.tag


def _known(c: Cleaned, name: str, field: str, defaults: Defaults) -> str:
    """A class, `main` named as in Defaults."""
    name = "" if name == "main" else name
    if name not in defaults:
        known = ", ".join(sorted(filter(None, defaults))) or "main alone"
        raise c.refuse(field, name, f"there is no such default class; there are {known}")
    return name


def _inherit(c: Cleaned, element: ET.Element, inside: str, defaults: Defaults) -> None:
    """Gives an element the attributes that it has from its class, or from that of its body."""
    field = f"{element.get('name') or element.get('joint') or element.tag}: class"
    name = _known(c, element.attrib.pop("class", inside), field, defaults)
    for key, value in defaults[name].get(_kind(element), {}).items():
        element.attrib.setdefault(key, value)


def _write_out(c: Cleaned, body: ET.Element, inside: str, defaults: Defaults) -> None:
    """Writes out the defaults in a body and all below it."""
    field = f"{body.get('name', '')}: childclass"
    inside = _known(c, body.attrib.pop("childclass", inside), field, defaults)
    for child in body:
        if child.tag == "body":
            _write_out(c, child, inside, defaults)
        elif child.tag in _INHERITING:
            _inherit(c, child, inside, defaults)
        else:
            child.attrib.pop("class", None)


_POSITIONS = {"free": 7, "ball": 4}  # of a joint in a keyframe; of all others one


def read_drives(c: Cleaned) -> None:
    """Takes torque limits and armature of the joints, which Drake is not to see.

    Raises:
        InputError: If one is no number, or a motor's joint is not there.
    """
    _read_joints(c)
    for place in c.root.findall("actuator"):
        for actuator in place:
            name = actuator.get("joint")
            if name is None:
                continue
            if name not in c.drives:
                raise c.refuse(f"{actuator.tag}.joint", name, "there is no such joint")
            drive = c.drives[name]
            gear = (c.strictly(actuator.get("gear"), f"{name}: gear") or [1.0])[0]
            limits = [c.strictly(actuator.get("forcerange"), f"{name}: forcerange")]
            if actuator.tag == "motor":
                limits.append(c.strictly(actuator.get("ctrlrange"), f"{name}: ctrlrange"))
            for limit in limits:
                if len(limit) == 2 and limit != [0.0, 0.0]:
                    drive.effort = min(drive.effort, abs(gear) * max(map(abs, limit)))


def _read_joints(c: Cleaned) -> None:
    """Takes what the joints themselves say, and puts their limits in order."""
    _, otherwise, most = DRIVE_NUMBERS[0]
    for joint in c.root.iter("joint"):
        name = joint.get("name", "")
        if not name:
            continue
        drive = c.drives.setdefault(name, Drive())
        armature = joint.attrib.pop("armature", None)
        drive.rotor_inertia = c.drive_number(armature, f"{name}: armature", otherwise, most)
        text = joint.attrib.pop("actuatorfrcrange", None)
        limit = c.strictly(text, f"{name}: actuatorfrcrange")
        ends = floats(joint.get("range"))
        if len(ends) == 2:
            low, high = c.order_limits(name, *ends)
            joint.set("range", f"{low!r} {high!r}")
            if low == high == 0.0:
                del joint.attrib["range"]
        drive.effort = max(map(abs, limit)) if limit else math.inf


def read_pose(c: Cleaned) -> None:
    """Takes the joints' angles in the first keyframe; Drake is to see none of it."""
    starts, count = {}, 0
    for body in c.root.findall("worldbody"):
        for joint in body.iter():
            if joint.tag in ("joint", "freejoint"):
                kind = "free" if joint.tag == "freejoint" else joint.get("type", "hinge")
                if kind not in _POSITIONS:
                    starts[joint.get("name", "")] = count
                count += _POSITIONS.get(kind, 1)
    for key in c.root.findall("keyframe/key")[:1]:
        positions = c.strictly(key.get("qpos"), "keyframe: qpos")
        if positions and len(positions) != count:
            text = f"keyframe: {len(positions)} positions where the joints have {count}"
            c.note(DROPPED, text)
        elif positions:
            c.reference.update({name: positions[start] for name, start in starts.items() if name})


# What holds bodies, or changes masses, and Drake's parser passes over.
_UNREAD = ("frame", "replicate", "attach", "composite", "flexcomp")
_UNREAD_MASSES = ("settotalmass", "boundmass", "boundinertia")


def clean_mjcf(c: Cleaned) -> None:
    """Cleans the tree: includes and defaults written out, meshes converted, drives taken out.

    Args:
        c: The record to fill; its XML tree is edited in place.

    Raises:
        InputError: If something in it is no robot's, or nothing that Drake reads.
    """
    include_mjcf(c)
    if not c.root.get("model"):
        c.root.set("model", "robot")  # Drake wants a name
    compiler: dict[str, str] = {}
    for element in c.root.findall("compiler"):
        compiler.update(element.attrib)
    _refuse_unread(c, compiler)
    write_out_defaults(c)
    _refuse_other_inertia(c, compiler)
    _split_bodies(c)
    read_friction(c)
    for body in (b for place in c.root.findall("worldbody") for b in place.iter()):
        if body.tag not in ("body", "worldbody"):
            continue
        for child in [e for e in body if e.tag in ("light", "camera", "site")]:
            body.remove(child)
        if body.tag == "body":
            check_mjcf_inertial(c, body)
            check_mjcf_sizes(c, body)
    _convert_meshes(c, compiler)
    read_drives(c)
    read_pose(c)
    for tag in ("actuator", "sensor", "keyframe", "contact", "visual", "equality", "tendon"):
        for element in list(c.root.findall(tag)):
            c.root.remove(element)


def _refuse_unread(c: Cleaned, compiler: dict[str, str]) -> None:
    """Refuses what would change the robot if Drake's parser read it."""
    for place in c.root.findall("worldbody"):
        for element in place.iter():
            if element.tag in _UNREAD:
                remedy = "is not read: write what it makes into the file as bodies"
                name = element.get("name") or element.get("prefix") or ""
                raise c.refuse(f"<{element.tag}>", name, remedy)
    angle = compiler.get("angle", "degree")
    if angle not in ("degree", "radian"):
        raise c.refuse("compiler.angle", angle, "must be degree or radian")
    for key in _UNREAD_MASSES:
        if any(value > 0.0 for value in c.strictly(compiler.get(key), f"compiler.{key}")):
            remedy = "is not read: write the masses that it makes into the file"
            raise c.refuse(f"compiler.{key}", compiler[key], remedy)


_POSE = ("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler")


def _split_bodies(c: Cleaned) -> None:
    """Gives each joint a body of its own; Drake's parser puts all but the last at the parent's.

    As in MuJoCo the first is the outermost, and all are told in the body's frame.

    Raises:
        InputError: If there are so many that the tree gets too deep.
    """
    names = {body.get("name", "") for body in c.root.iter("body")}
    for parent in list(c.root.iter()):
        for body in parent.findall("body"):
            holder = parent
            for joint in body.findall("joint")[:-1]:
                name = f"{body.get('name', 'body')}_{joint.get('name', 'joint')}"
                while name in names:
                    name += "_"
                names.add(name)
                pose = {key: body.attrib.pop(key) for key in _POSE if key in body.attrib}
                outer = ET.Element("body", {"name": name, **pose})
                holder[list(holder).index(body)] = outer
                body.remove(joint)
                outer.extend([joint, body])
                holder = outer
    check_depth(c.root, c.source)


_INERTIA_GROUPS = [0.0, 5.0]  # of the geoms that have mass, where the compiler says nothing


def _refuse_other_inertia(c: Cleaned, compiler: dict[str, str]) -> None:
    """Refuses geoms of which Drake's parser would make another inertia, defaults written out."""
    groups = c.strictly(compiler.get("inertiagrouprange"), "compiler.inertiagrouprange")
    low, high = groups if len(groups) == 2 else _INERTIA_GROUPS
    shells = {_mesh_name(m) for m in c.root.findall("asset/mesh") if m.get("inertia") == "shell"}
    for body, geom in _weighing(c, compiler):
        name, remedy = body.get("name", ""), "is not read: write what it makes into an inertial"
        group = c.strictly(geom.get("group"), f"{name}: geom.group") or [0.0]
        if not low <= group[0] <= high:
            field, value = f"{name}: geom.group outside compiler.inertiagrouprange", group[0]
            raise c.refuse(field, f"{value:g}", remedy)
        if geom.get("shellinertia", "").strip() == "true":
            raise c.refuse(f"{name}: geom.shellinertia", "true", remedy)
        if geom.get("mesh") in shells and geom.get("type", "mesh") == "mesh":
            raise c.refuse(f"{name}: inertia of mesh {geom.get('mesh')}", "shell", remedy)


def _weighing(c: Cleaned, compiler: dict[str, str]) -> Iterator[tuple[ET.Element, ET.Element]]:
    """The geoms that a body has mass of, each after its body."""
    by_geoms = compiler.get("inertiafromgeom", "auto") == "true"
    for body in c.root.iter("body"):
        if by_geoms or body.find("inertial") is None:
            for geom in body.findall("geom"):
                if floats(geom.get("mass", geom.get("density", "1000"))) != [0.0]:
                    yield body, geom


def _mesh_name(mesh: ET.Element) -> str:
    """By which name geoms call a mesh."""
    return mesh.get("name", Path(mesh.get("file", "")).stem)


def _convert_meshes(c: Cleaned, compiler: dict[str, str]) -> None:
    """Makes every mesh an .obj, and drops geoms whose mesh cannot be had."""
    folder = compiler.get("meshdir", compiler.get("assetdir", ""))
    for element in c.root.findall("compiler"):
        for key in ("meshdir", "assetdir", "texturedir"):
            element.attrib.pop(key, None)
    names, missing = set(), set()
    for asset in c.root.findall("asset"):
        for mesh in list(asset.findall("mesh")):
            file = mesh.get("file", "")
            name = _mesh_name(mesh)
            names.add(name)
            made = _as_obj(c, str(Path(folder) / file) if file else "", name)
            if made is None:
                missing.add(name)
                asset.remove(mesh)
            else:
                mesh.set("name", name)
                mesh.set("file", str(made))
        for element in [e for e in asset if e.tag in ("texture", "hfield")]:
            asset.remove(element)
        for material in asset.findall("material"):
            material.attrib.pop("texture", None)
    weighing = [geom for _, geom in _weighing(c, compiler)]
    for body in c.root.iter("body"):
        for geom in body.findall("geom"):
            used = geom.get("mesh")
            if used is not None and used not in names:
                raise c.refuse(f"{body.get('name', '')}: geom.mesh", used, "there is no such mesh")
            if used not in missing:
                continue
            if any(geom is other for other in weighing):
                remedy = (
                    "cannot be read, and the body has mass of it; give the mesh, or the body an"
                )
                raise c.refuse(f"{body.get('name', '')}: geom.mesh", used, f"{remedy} inertial")
            body.remove(geom)
            if (geom.get("contype"), geom.get("conaffinity")) != ("0", "0"):
                c.shapeless.add(body.get("name", ""))


def _as_obj(c: Cleaned, file: str, name: str) -> Path | None:
    """A mesh as a file that Drake takes, or None with a note."""
    if not file:
        c.note(DROPPED, f"mesh {name} is in no file of its own")
        return None
    found = c.locate_mesh(file, f"mesh {name}")
    made = whole_as_obj(found, c.scratch) if found else None
    if found and made is None:
        c.note(DROPPED, f"mesh {found.name} cannot be read")
    return made
