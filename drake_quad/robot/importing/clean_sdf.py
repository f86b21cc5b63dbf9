"""Makes an SDF one that Drake's parser takes."""

import math

from drake_quad.robot.importing.cleaned import Cleaned, Drive
from drake_quad.robot.importing.records import REPAIRED
from drake_quad.robot.importing.xml_text import _COLON, floats


def clean_sdf(c: Cleaned) -> None:
    """Cleans the tree: meshes found, limits in order, drives taken out, nothing tied to the world.

    Args:
        c: Of which the tree is changed and the rest is filled.
    """
    for link in c.root.iter("link"):
        name = link.get("name", "")
        for kind in ("visual", "collision"):
            for element in list(link.findall(kind)):
                uri = element.find("geometry/mesh/uri")
                if uri is None:
                    continue
                uri_text = (uri.text or "").strip()
                if kind == "collision":
                    found = c.collision_mesh(uri_text, name)
                else:
                    found = c.locate_mesh(uri_text, f"visual of link {name}")
                if found is None:
                    link.remove(element)
                else:
                    uri.text = f"file://{found}"
    for model in c.root.iter("model"):
        for static in model.findall("static"):
            model.remove(static)
        for joint in list(model.findall("joint")):
            name = joint.get("name", "")
            if (joint.findtext("parent") or "").strip() == "world":
                c.note(REPAIRED, f"{name}: tied the robot to the world; now it floats")
                model.remove(joint)
                continue
            drive = c.drives.setdefault(name, Drive())
            for axis in joint.findall("axis"):
                _read_axis(c, name, axis, drive)


def _read_axis(c: Cleaned, name: str, axis: object, drive: Drive) -> None:
    """Takes what an axis says of its drive, and puts its limits in order."""
    limit = axis.find("limit")  # type: ignore[attr-defined]
    for tag, key in (("rotor_inertia", "rotor_inertia"), ("gear_ratio", "gear_ratio")):
        found = floats(axis.findtext(f"drake{_COLON}{tag}"))  # type: ignore[attr-defined]
        if found:
            setattr(drive, key, found[0])
    if limit is None:
        return
    effort = floats(limit.findtext("effort"))
    drive.effort = effort[0] if effort and effort[0] >= 0.0 else math.inf
    for element in limit.findall("effort"):
        limit.remove(element)
    low, high = limit.find("lower"), limit.find("upper")
    ends = (*floats(limit.findtext("lower")), *floats(limit.findtext("upper")))
    if low is not None and high is not None and len(ends) == 2:
        first, last = c.order_limits(name, *ends)
        low.text, high.text = repr(first), repr(last)
