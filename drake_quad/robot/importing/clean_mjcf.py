"""Makes an MJCF one that Drake's parser takes and reads as MuJoCo would.

Drake's parser misses attributes that a class has from the class above it (axes, limits), takes
meshes as .obj alone, and does not read a joint's own torque limit: so all defaults are written out
where they are used, and the drives are taken from the tree.
"""

import xml.etree.ElementTree as ET
from pathlib import Path

from drake_quad.robot.importing.cleaned import Cleaned
from drake_quad.robot.importing.includes import include_mjcf
from drake_quad.robot.importing.inertials import check_mjcf_inertial
from drake_quad.robot.importing.mesh_files import whole_as_obj
from drake_quad.robot.importing.mjcf_defaults import write_out_defaults
from drake_quad.robot.importing.mjcf_drives import read_drives, read_pose
from drake_quad.robot.importing.records import DROPPED
from drake_quad.robot.importing.sizes import check_mjcf_sizes
from drake_quad.robot.importing.surface_friction import read_friction
from drake_quad.robot.importing.xml_numbers import floats

# What holds bodies, or changes masses, and Drake's parser passes over.
_UNREAD = ("frame", "replicate", "attach", "composite", "flexcomp")
_UNREAD_MASSES = ("settotalmass", "boundmass", "boundinertia")


def clean_mjcf(c: Cleaned) -> None:
    """Cleans the tree: includes and defaults written out, meshes converted, drives taken out.

    Args:
        c: Of which the tree is changed and the rest is filled.

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
            name = mesh.get("name", Path(file).stem)
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
    by_geoms = compiler.get("inertiafromgeom", "auto") == "true"
    for body in c.root.iter("body"):
        for geom in body.findall("geom"):
            used = geom.get("mesh")
            if used is not None and used not in names:
                raise c.refuse(f"{body.get('name', '')}: geom.mesh", used, "there is no such mesh")
            if used not in missing:
                continue
            if by_geoms or body.find("inertial") is None:
                _refuse_if_it_weighs(c, body, geom)
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


def _refuse_if_it_weighs(c: Cleaned, body: ET.Element, geom: ET.Element) -> None:
    """Refuses to drop a geom that its body has mass of."""
    if floats(geom.get("mass", geom.get("density", "1000"))) != [0.0]:
        raise c.refuse(
            f"{body.get('name', '')}: geom.mesh",
            geom.get("mesh"),
            "cannot be read, and the body has mass of it; give the mesh, or the body an inertial",
        )
