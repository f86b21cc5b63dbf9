"""Sizes of the primitive shapes in a file: Drake's parsers read some that are none as 0 or 1 m."""

import xml.etree.ElementTree as ET

from drake_quad.robot.importing.cleaned import Cleaned
from drake_quad.robot.importing.xml_numbers import floats

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
                _above_zero(c, f"{name}: {kind} {shape.tag}.{tag}", text, count)


def check_mjcf_sizes(c: Cleaned, body: ET.Element) -> None:
    """Looks at the geoms of a body, defaults written out.

    Raises:
        InputError: If a size is missing, or not above zero.
    """
    for geom in body.findall("geom"):
        kind = geom.get("type", "mesh" if geom.get("mesh") else "sphere")
        if kind in _MJCF and not geom.get("mesh"):  # a shape that is fitted to a mesh has none
            count = _MJCF[kind]["fromto" in geom.attrib]
            _above_zero(c, f"{body.get('name', '')}: {kind}.size", geom.get("size"), count)


def _above_zero(c: Cleaned, field: str, text: str | None, count: int) -> None:
    """Refuses fewer sizes than a shape has, and any that is none."""
    values = floats(text)[:count]
    if len(values) < count or min(values) <= 0.0:
        what = "must be a number" if count == 1 else f"must be {count} numbers"
        raise c.refuse(field, text, f"{what} above zero [m]")
