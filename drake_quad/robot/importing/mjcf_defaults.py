"""Writes the defaults of an MJCF out where they are used."""

import xml.etree.ElementTree as ET

from drake_quad.robot.importing.cleaned import Cleaned

Defaults = dict[str, dict[str, dict[str, str]]]  # class -> tag -> attributes
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
            own.setdefault(child.tag, {}).update(child.attrib)
    defaults[name] = own
    for child in element.findall("default"):
        _gather(child, name, defaults)


def _known(c: Cleaned, name: str, field: str, defaults: Defaults) -> str:
    """A class, `main` told as Defaults has it."""
    name = "" if name == "main" else name
    if name not in defaults:
        known = ", ".join(sorted(filter(None, defaults))) or "main alone"
        raise c.refuse(field, name, f"there is no such default class; there are {known}")
    return name


def _inherit(c: Cleaned, element: ET.Element, inside: str, defaults: Defaults) -> None:
    """Gives an element the attributes that it has from its class, or from that of its body."""
    field = f"{element.get('name') or element.get('joint') or element.tag}: class"
    name = _known(c, element.attrib.pop("class", inside), field, defaults)
    for key, value in defaults[name].get(element.tag, {}).items():
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
