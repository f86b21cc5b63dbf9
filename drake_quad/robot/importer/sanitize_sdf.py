"""Makes an SDF one that Drake's parser takes, and with it those that it includes."""

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

from drake_quad.robot.importer.raw_robot import REPAIRED
from drake_quad.robot.importer.sanitize import (
    DRIVE_NUMBERS,
    Chain,
    Cleaned,
    Drive,
    check_sdf_inertial,
    check_sdf_sizes,
    file_name,
    open_included,
    read_friction,
)
from drake_quad.robot.importer.xml_io import COLON, floats, write_xml


def clean_sdf(c: Cleaned) -> None:
    """Cleans the tree: meshes found, limits in order, drives taken out, nothing tied to the world.

    Args:
        c: The record to fill; its XML tree is edited in place.

    Raises:
        InputError: If something in it is no robot's, such as a link of mass 0.
    """
    _clean_file(c, (c.files[0],), scope=(), name="")


def included_file(scratch: Path, number: int) -> Path:
    """Where the clean one of the file is that was included as the one of a number, from 1."""
    return scratch / f"included_{number}.sdf"


def _clean_file(c: Cleaned, chain: Chain, *, scope: tuple[str, ...], name: str) -> None:
    """Cleans one file, the models of which are within the model `scope`, the first called `name`.

    A model's scope is its own name after those of the models that hold it, as Drake has it.
    """
    version = c.root.get("version", "")
    if not re.fullmatch(r"1\.\d+", version):
        raise c.refuse("sdf.version", version, "must be that of the format, such as 1.9")
    read_friction(c)
    for place in (c.root, *c.root.findall("world")):
        _clean_includes(c, place, chain, scope)
    for place in (c.root, *c.root.findall("world")):
        for model in place.findall("model"):
            _clean_model(c, model, chain, (*scope, name or model.get("name", "")))


def _clean_includes(c: Cleaned, place: ET.Element, chain: Chain, scope: tuple[str, ...]) -> None:
    """Cleans the files that a model or world includes, and names the clean ones instead."""
    for include in place.findall("include"):
        uri = include.find("uri")
        root = open_included(c, (uri.text if uri is not None else "") or "", chain, ("sdf",))
        file = included_file(c.scratch, len(c.included))
        longer = (*chain, c.included[-1])
        inner = replace(c, root=root, beside=longer[-1].parent, source=file_name(c, longer))
        merged = include.get("merge", "").strip().lower() in ("true", "1")
        model = root.find("model")
        own = model.get("name", "") if model is not None else ""
        name = (include.findtext("name") or "").strip() or own
        if merged and scope:
            _clean_file(inner, longer, scope=scope[:-1], name=scope[-1])
        else:
            _clean_file(inner, longer, scope=scope, name=name)
        write_xml(root, file)
        uri.text = f"file://{file}"  # type: ignore[union-attr]


def _clean_model(c: Cleaned, model: ET.Element, chain: Chain, scope: tuple[str, ...]) -> None:
    """Cleans a model and those in it."""
    _clean_includes(c, model, chain, scope)
    for inner in model.findall("model"):
        _clean_model(c, inner, chain, (*scope, inner.get("name", "")))
    for static in model.findall("static"):
        model.remove(static)
    for link in model.findall("link"):
        check_sdf_inertial(c, link, "::".join([*scope, link.get("name", "")]))
        check_sdf_sizes(c, link)
        _find_meshes(c, link)
    for joint in model.findall("joint"):
        name = joint.get("name", "")
        if (joint.findtext("parent") or "").strip() == "world":
            c.note(REPAIRED, f"{name}: tied the robot to the world; now it floats")
            model.remove(joint)
            continue
        drive = c.drives.setdefault("::".join([*scope, name]), Drive())
        for axis in joint.findall("axis"):
            _read_axis(c, name, axis, drive)


def _find_meshes(c: Cleaned, link: ET.Element) -> None:
    """Names a link's meshes by where they are; takes out those that are not there."""
    name = link.get("name", "")
    for kind in ("visual", "collision"):
        for element in link.findall(kind):
            uri = element.find("geometry/mesh/uri")
            if uri is None:
                continue
            found = c.mesh_of(name, kind, (uri.text or "").strip())
            if found is None:
                link.remove(element)
            else:
                uri.text = f"file://{found}"


def _read_axis(c: Cleaned, name: str, axis: ET.Element, drive: Drive) -> None:
    """Reads an axis's drive, and puts its limits in order."""
    for tag, otherwise, most in DRIVE_NUMBERS:
        text = axis.findtext(f"drake{COLON}{tag}")
        if text is not None:
            setattr(drive, tag, c.drive_number(text, f"{name}: {tag}", otherwise, most))
    limit = axis.find("limit")
    if limit is None:
        return
    effort = c.strictly(limit.findtext("effort"), f"{name}: effort")
    drive.effort = effort[0] if effort and effort[0] >= 0.0 else math.inf
    for element in limit.findall("effort"):
        limit.remove(element)
    low, high = limit.find("lower"), limit.find("upper")
    ends = (*floats(limit.findtext("lower")), *floats(limit.findtext("upper")))
    if low is not None and high is not None and len(ends) == 2:
        first, last = c.order_limits(name, *ends)
        low.text, high.text = repr(first), repr(last)
