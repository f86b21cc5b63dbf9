"""Masses and inertias that a file gives its links: those that no body has, refused or noted.

Drake's parsers put a stand-in in the place of many of them (of 1 kg, or a ball of water), and warn.
"""

import math
import xml.etree.ElementTree as ET

from pydrake.multibody.tree import RotationalInertia

from drake_quad.robot.importing.cleaned import Cleaned
from drake_quad.robot.importing.records import DOUBTFUL, REPAIRED
from drake_quad.robot.importing.xml_numbers import floats

LIGHT = 1e-3  # [kg], [kg m²]: a link below both is a frame with a name, whatever it is given
HEAVY = 0.05  # [kg]: what is lighter may well be told as a point
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
    mass = _above_zero(c, name, inertial.findtext("mass"))
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
    told, inertia = inertial.find("mass"), inertial.find("inertia")
    text = told.get("value") if told is not None else None
    mass = floats(text) or ([] if (text or "").strip() else [0.0])
    if len(mass) != 1:
        return  # Drake's parser says what is wrong
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
        _above_zero(c, name, inertial.get("mass"))
        for key, count in (("diaginertia", 3), ("fullinertia", 6)):
            values = floats(inertial.get(key))
            if len(values) == count and not RotationalInertia(*values).CouldBePhysicallyValid():
                raise c.refuse(f"{name}: inertial.{key}", inertial.get(key), _RIGHT)


_RIGHT = "no body has this: principal moments are not negative, none above the other two's sum"


def _above_zero(c: Cleaned, name: str, text: str | None) -> float:
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
