"""Numbers of a URDF that have to be there whole: one or three, with the signs that they can have.

Drake's parser reads the beginning of a text as a number and passes over the rest: `2,75` is 2 to
it, and `38 kg` is 38. What it refuses it tells in terms of its own functions.
"""

import xml.etree.ElementTree as ET

from drake_quad.errors import InputError
from drake_quad.robot.importer.xml_io import COLON, floats

ANY, NOT_NEGATIVE, POSITIVE = "", "must not be negative", "must be more than 0"
# How many numbers, and what they must be, by tag and attribute.
_WANTED = {
    **dict.fromkeys((("limit", "lower"), ("limit", "upper")), (1, ANY)),
    **dict.fromkeys((("limit", "effort"), ("limit", "velocity")), (1, NOT_NEGATIVE)),
    **dict.fromkeys((("dynamics", "damping"), ("dynamics", "friction")), (1, NOT_NEGATIVE)),
    ("mass", "value"): (1, NOT_NEGATIVE),
    **{("inertia", axes): (1, ANY) for axes in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")},
    **{(shape, "radius"): (1, POSITIVE) for shape in ("sphere", "cylinder", "capsule")},
    **{(shape, "length"): (1, POSITIVE) for shape in ("cylinder", "capsule")},
    ("box", "size"): (3, POSITIVE),
    **dict.fromkeys((("origin", "xyz"), ("origin", "rpy"), ("axis", "xyz")), (3, ANY)),
    (f"drake{COLON}gear_ratio", "value"): (1, POSITIVE),
    (f"drake{COLON}rotor_inertia", "value"): (1, NOT_NEGATIVE),
}
_NOT_READ = ("visual", "gazebo", "plugin", "ros2_control")  # nothing of the physics is in these
_OF_MOVING = ("axis", "limit", "dynamics")  # which mean nothing in a fixed joint
_PLURAL = {1: "one number", 3: "three numbers"}


def check_urdf(root: ET.Element, source: str) -> None:
    """Refuses macros that nobody has expanded, and numbers that are none or cannot be.

    Raises:
        InputError: Naming the link or joint, the element, its attribute and the text.
    """
    ahead = [(root, "", False)]
    while ahead:
        element, holder, fixed = ahead.pop()
        if element.tag in _NOT_READ:
            continue
        _check_expanded(element, source)
        if element.tag in ("link", "joint"):
            holder, fixed = element.get("name", ""), element.get("type") == "fixed"
        ahead += [(child, holder, fixed) for child in reversed(element)]
        if fixed and element.tag in _OF_MOVING:
            continue
        for key, text in element.attrib.items():
            wanted = _WANTED.get((element.tag, key))
            if wanted is not None and text.strip():
                _check(text, *wanted, source=source, field=_field(holder, element.tag, key))


def _field(named: str, tag: str, key: str) -> str:
    return f"{named}: " * bool(named) + f"{tag.replace(COLON, ':')}.{key}"


def _check(text: str, count: int, sign: str, *, source: str, field: str) -> None:
    """Refuses a text that is not so many numbers of that sign.

    Raises:
        InputError: It is not.
    """
    numbers = floats(text)
    if len(numbers) != count:
        remedy = f"must be {_PLURAL[count]}, with decimal points, no commas and no units"
    elif any(x < 0.0 or (sign == POSITIVE and x == 0.0) for x in numbers if sign):
        remedy = sign
    else:
        return
    raise InputError(source=source, field=field, value=text, remedy=remedy)


def _check_expanded(element: ET.Element, source: str) -> None:
    """Refuses xacro, which is no URDF before it is expanded.

    Raises:
        InputError: The element is of xacro, or an attribute of it holds a macro.
    """
    values = [text for text in element.attrib.values() if "${" in text or "$(" in text]
    if element.tag.startswith(f"xacro{COLON}") or values:
        raise InputError(
            source=source,
            field=element.tag.replace(COLON, ":"),
            value=next(iter(values), element.get("name", "")),
            remedy="is xacro; expand it first: xacro robot.xacro > robot.urdf",
        )
