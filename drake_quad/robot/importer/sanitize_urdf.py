"""Makes a URDF one that Drake's parser takes, whatever is wrong with what is not needed of it."""

import math
import xml.etree.ElementTree as ET
from contextlib import suppress
from pathlib import Path

from drake_quad.errors import InputError
from drake_quad.robot.importer.raw_robot import REPAIRED
from drake_quad.robot.importer.sanitize import (
    DRIVE_NUMBERS,
    Cleaned,
    Drive,
    check_urdf_inertial,
    read_friction,
)
from drake_quad.robot.importer.xml_io import COLON, floats, read_xml


def clean_urdf(c: Cleaned) -> None:
    """Cleans the tree: finds meshes, writes materials out, orders limits, takes drives out.

    Args:
        c: The record to fill; its XML tree is edited in place.

    Raises:
        InputError: If a mass or a drive's number is none.
    """
    _inline_materials(c.root)
    _let_float(c)
    read_friction(c)
    for link in c.root.findall("link"):
        name = link.get("name", "")
        check_urdf_inertial(c, link)
        for kind in ("visual", "collision"):
            for element in list(link.findall(kind)):
                mesh = element.find("geometry/mesh")
                if mesh is None:
                    continue
                found = c.mesh_of(name, kind, mesh.get("filename", ""))
                if found is None:
                    link.remove(element)
                else:
                    mesh.set("filename", str(found))
                    for child in list(mesh):  # such as drake:declare_convex
                        mesh.remove(child)
    for joint in c.root.findall("joint"):
        _read_joint(c, joint)
    for transmission in c.root.findall("transmission"):
        for name in [j.get("name", "") for j in transmission.findall("joint")]:
            drive = c.drives.get(name)
            for actuator in transmission.findall("actuator") if drive else ():
                for tag, otherwise, most in DRIVE_NUMBERS:
                    number = actuator.find(f"drake{COLON}{tag}")
                    if number is not None:
                        text, field = number.get("value"), f"{name}: {tag}"
                        setattr(drive, tag, c.drive_number(text, field, otherwise, most))
        c.root.remove(transmission)
    c.reference.update(_standing_pose(c))


def _read_joint(c: Cleaned, joint: ET.Element) -> None:
    """Takes the drive of one joint, and puts its limits in order."""
    name, limit = joint.get("name", ""), joint.find("limit")
    drive = c.drives.setdefault(name, Drive())
    for child in list(joint):
        if child.tag in ("mimic", "safety_controller", "calibration"):
            joint.remove(child)
    if limit is None:
        return
    effort = floats(limit.get("effort"))
    for key in ("lower", "upper", "effort", "velocity"):  # Drake takes none that is infinite
        if any(math.isinf(value) for value in floats(limit.get(key))):
            del limit.attrib[key]
    drive.effort = effort[0] if effort else math.inf
    ends = (*floats(limit.get("lower")), *floats(limit.get("upper")))
    if len(ends) == 2 and joint.get("type") != "continuous":
        low, high = c.order_limits(name, *ends)
        limit.set("lower", repr(low))
        limit.set("upper", repr(high))


def _inline_materials(root: ET.Element) -> None:
    """Gives every visual its own colour: Drake refuses two materials of one name that differ."""
    colours: dict[str, str] = {}
    for material in root.iter("material"):
        colour = material.find("color")
        if colour is not None and len(floats(colour.get("rgba"))) == 4:
            colours.setdefault(material.get("name", ""), colour.get("rgba", ""))
    for material in root.findall("material"):
        root.remove(material)
    for number, visual in enumerate(root.iter("visual")):
        for material in visual.findall("material"):
            colour = material.find("color")
            own = colour.get("rgba", "") if colour is not None else ""
            rgba = own if len(floats(own)) == 4 else colours.get(material.get("name", ""))
            visual.remove(material)
            if rgba:
                fresh = ET.SubElement(visual, "material", name=f"colour_{number}")
                ET.SubElement(fresh, "color", rgba=rgba)


def _let_float(c: Cleaned) -> None:
    """Takes out what ties the robot to the world; the trunk floats by itself."""
    for joint in list(c.root.findall("joint")):
        parent = joint.find("parent")
        tied = parent is not None and parent.get("link") == "world"
        if tied or joint.get("type") == "floating":
            if joint.get("type") != "floating":
                name = joint.get("name")
                c.note(REPAIRED, f"{name}: tied the robot to the world; now it floats")
            c.root.remove(joint)
    used = {e.get("link") for j in c.root.findall("joint") for e in j}
    for link in list(c.root.findall("link")):
        if link.get("name") == "world" and "world" not in used:
            c.root.remove(link)


def _standing_pose(c: Cleaned) -> dict[str, float]:
    """The joints' angles in the pose that this robot's SRDF calls standing, if there is one."""
    path = _srdf(c)
    if path is None:
        return {}
    c.files.append(path)
    return _pose_in(path, {j.get("name", "") for j in c.root.findall("joint")})


def _srdf(c: Cleaned) -> Path | None:
    """The robot's SRDF, in `../srdf`, as ROS packages have it, or beside the file.

    It is called as the file or the robot is, or it is the only one and is of a robot of that name:
    others in the folder may be other robots'.
    """
    places = [c.beside.parent / "srdf", c.beside]
    for name in (c.files[0].stem, c.root.get("name", "")):
        for path in [place / f"{name}.srdf" for place in places]:
            if path.is_file():
                return path
    for place in places:
        found = list(place.glob("*.srdf"))
        with suppress(InputError, OSError):  # who cannot read it cannot say whose it is
            if len(found) == 1 and read_xml(found[0], "").get("name") == c.root.get("name"):
                return found[0]
    return None


def _pose_in(path: Path, joints: set[str]) -> dict[str, float]:
    """The pose of a SRDF that has most of the joints, `standing` before others."""
    best: dict[str, float] = {}
    states = read_xml(path, str(path)).findall("group_state")
    states.sort(key=lambda s: "stand" not in s.get("name", "").lower())
    for state in states:
        pose = {
            j.get("name", ""): floats(j.get("value"))[0]
            for j in state.findall("joint")
            if j.get("name") in joints and len(floats(j.get("value"))) == 1
        }
        if len(pose) > len(best):
            best = pose
    return best
