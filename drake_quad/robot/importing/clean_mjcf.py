"""Makes an MJCF one that Drake's parser takes and reads as MuJoCo would.

Drake's parser misses attributes that a class has from the class above it (axes, limits), takes
meshes as .obj alone, and does not read a joint's own torque limit: so all defaults are written out
where they are used, and the drives are taken from the tree.
"""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

from drake_quad.robot.importing.cleaned import Cleaned, Drive
from drake_quad.robot.importing.mesh_files import whole_as_obj
from drake_quad.robot.importing.records import DROPPED
from drake_quad.robot.importing.xml_text import floats, read_xml

Defaults = dict[str, dict[str, dict[str, str]]]  # class -> tag -> attributes
_ACTUATORS = ("motor", "position", "velocity", "general", "intvelocity", "damper")
_INHERITING = ("joint", "geom", *_ACTUATORS)


def clean_mjcf(c: Cleaned, source: str) -> None:
    """Cleans the tree: includes and defaults written out, meshes converted, drives taken out.

    Args:
        c: Of which the tree is changed and the rest is filled.
        source: For errors.
    """
    _include(c, c.root, source)
    c.root.attrib.setdefault("model", "robot")  # Drake wants a name
    compiler: dict[str, str] = {}
    for element in c.root.findall("compiler"):
        compiler.update(element.attrib)
    defaults: Defaults = {"": {}}
    for element in list(c.root.findall("default")):
        _gather(element, "", defaults)
        c.root.remove(element)
    for body in c.root.findall("worldbody"):
        _write_out(body, "", defaults)
        for light in [e for e in body.iter() if e.tag in ("body", "worldbody")]:
            for child in [e for e in light if e.tag in ("light", "camera", "site")]:
                light.remove(child)
    for place in c.root.findall("actuator"):
        for actuator in place:
            for key, value in _inherited(actuator, "", defaults).items():
                actuator.attrib.setdefault(key, value)
    _convert_meshes(c, compiler)
    _read_drives(c, degrees=compiler.get("angle", "degree") == "degree")
    for tag in ("actuator", "sensor", "keyframe", "contact", "visual", "equality", "tendon"):
        for element in list(c.root.findall(tag)):
            c.root.remove(element)


def _include(c: Cleaned, element: ET.Element, source: str) -> None:
    """Puts included files where they are included."""
    for child in list(element):
        if child.tag != "include":
            _include(c, child, source)
            continue
        path = c.locate_mesh(child.get("file", ""), "included file")
        place = list(element).index(child)
        element.remove(child)
        if path is not None:
            other = read_xml(path, source)
            _include(c, other, source)
            for offset, part in enumerate(other):
                element.insert(place + offset, part)


def _gather(element: ET.Element, parent: str, defaults: Defaults) -> None:
    """The defaults of a class with all that it has from those above it."""
    name = element.get("class", "") if element.get("class") != "main" else ""
    own = {tag: dict(attributes) for tag, attributes in defaults[parent].items()}
    for child in element:
        if child.tag != "default":
            own.setdefault(child.tag, {}).update(child.attrib)
    defaults[name] = own
    for child in element.findall("default"):
        _gather(child, name, defaults)


def _inherited(element: ET.Element, inside: str, defaults: Defaults) -> dict[str, str]:
    """The attributes that an element has from its class."""
    name = element.attrib.pop("class", inside)
    return defaults.get(name, defaults[""]).get(element.tag, {})


def _write_out(body: ET.Element, inside: str, defaults: Defaults) -> None:
    """Writes out the defaults in a body and all below it."""
    inside = body.attrib.pop("childclass", inside)
    for child in body:
        if child.tag == "body":
            _write_out(child, inside, defaults)
        elif child.tag in _INHERITING:
            for key, value in _inherited(child, inside, defaults).items():
                child.attrib.setdefault(key, value)
        else:
            child.attrib.pop("class", None)


def _convert_meshes(c: Cleaned, compiler: dict[str, str]) -> None:
    """Makes every mesh an .obj, and drops geoms whose mesh cannot be had."""
    folder = compiler.get("meshdir", compiler.get("assetdir", ""))
    for element in c.root.findall("compiler"):
        for key in ("meshdir", "assetdir", "texturedir"):
            element.attrib.pop(key, None)
    missing = set()
    for asset in c.root.findall("asset"):
        for mesh in list(asset.findall("mesh")):
            file = mesh.get("file", "")
            name = mesh.get("name", Path(file).stem)
            if not file:
                continue
            found = c.locate_mesh(str(Path(folder) / file), f"mesh {name}")
            made = whole_as_obj(found, c.scratch) if found else None
            if found and made is None:
                c.note(DROPPED, f"mesh {found.name} cannot be read")
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
    for body in c.root.iter("body"):
        for geom in [g for g in body.findall("geom") if g.get("mesh") in missing]:
            body.remove(geom)
            if (geom.get("contype"), geom.get("conaffinity")) != ("0", "0"):
                c.shapeless.add(body.get("name", ""))


def _read_drives(c: Cleaned, *, degrees: bool) -> None:
    """Takes torque limits and armature of the joints, and the pose of the first keyframe."""
    joints = [j for j in c.root.iter("joint") if j.get("name")]
    for joint in joints:
        name = joint.get("name", "")
        drive = c.drives.setdefault(name, Drive())
        drive.rotor_inertia = (floats(joint.attrib.pop("armature", None)) or [0.0])[0]
        limit = floats(joint.attrib.pop("actuatorfrcrange", None))
        ends = floats(joint.get("range"))
        if len(ends) == 2:
            low, high = c.order_limits(name, *ends)
            joint.set("range", f"{low!r} {high!r}")
            if low == high == 0.0:
                del joint.attrib["range"]
        drive.effort = max(map(abs, limit)) if limit else math.inf
    for place in c.root.findall("actuator"):
        for actuator in place:
            drive = c.drives.get(actuator.get("joint", ""), Drive())
            gear = (floats(actuator.get("gear")) or [1.0])[0]
            limits = [floats(actuator.get("forcerange"))]
            if actuator.tag == "motor":
                limits.append(floats(actuator.get("ctrlrange")))
            for limit in limits:
                if len(limit) == 2 and limit != [0.0, 0.0]:
                    drive.effort = min(drive.effort, abs(gear) * max(map(abs, limit)))
    for key in c.root.findall("keyframe/key")[:1]:
        angles = floats(key.get("qpos"))
        order = [
            j.get("name", "") for body in c.root.findall("worldbody") for j in body.iter("joint")
        ]
        if len(angles) == 7 + len(order):
            c.reference.update(zip(order, angles[7:], strict=True))
