"""The numbers in a robot's file: read strictly, and those that no robot has refused."""

import math
import re
import xml.etree.ElementTree as ET

from drake_quad.errors import InputError

COLON = "__colon__"  # stands in a tree for the colon of a prefix
GREATEST = 1e15  # in SI units: nothing of a robot is greater, and squares of it do not overflow
_NUMBER = re.compile(
    r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(inf|infinity|nan)", re.ASCII | re.IGNORECASE
)
# fmt: off
_MAY_BE_INFINITE = frozenset({
    "lower", "upper", "effort", "velocity",
    "range", "ctrlrange", "forcerange", "actuatorfrcrange",
})
_NUMERIC = _MAY_BE_INFINITE | frozenset({
    "xyz", "rpy", "pos", "pose", "quat", "euler", "axisangle", "xyaxes", "zaxis", "axis", "ref",
    "fromto", "qpos", "value", "mass", "density", "settotalmass", "diaginertia", "fullinertia",
    "ixx", "iyy", "izz", "ixy", "ixz", "iyz", "size", "radius", "length", "radii", "scale", "rgba",
    "damping", "friction", "armature", "gear", "rotor_inertia", "gear_ratio",
})
# Tags whose text is a name: a link may be called nan.
_NAMING = frozenset({
    "parent", "child", "name", "uri", "link", "joint", "frame", "plugin",
    "author", "email", "description",
})
# fmt: on


def floats(text: str | None) -> list[float]:
    """The numbers in an attribute; none for none, or if anything in it is no number.

    What Python alone takes for a number (1_000, digits of other scripts) is none.
    """
    words = (text or "").replace(",", " ").split()
    return [float(w) for w in words] if all(_NUMBER.fullmatch(w) for w in words) else []


def check_numbers(root: ET.Element, source: str) -> None:
    """Refuses nan anywhere, and what is too great where it cannot be.

    Raises:
        InputError: Naming the element, its attribute and the text.
    """
    ahead = [(root, "")]
    while ahead:
        element, holder = ahead.pop()
        named = element.get("name") or element.get("joint") or holder
        ahead += [(child, named) for child in reversed(element)]
        tag = element.tag.rpartition(COLON)[2]
        places = [(key, text) for key, text in element.attrib.items() if key in _NUMERIC]
        if len(element) == 0 and element.text and tag not in _NAMING:
            places.append(("", element.text))  # SDF has its numbers between tags
        for key, text in places:
            for number in floats(text):
                kind = key or tag
                limited = kind in _NUMERIC - _MAY_BE_INFINITE
                if math.isnan(number) or (limited and abs(number) > GREATEST):
                    place = (f"{named}: " if named else "") + element.tag.replace(COLON, ":")
                    raise InputError(
                        source=source,
                        field=place + (f".{key}" if key else ""),
                        value=text,
                        remedy=f"must be a number, and none beyond {GREATEST:g}",
                    )
