"""A robot's file as an XML tree, whatever it does with namespaces; numbers in it checked."""

import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

from drake_quad.errors import InputError

# A prefix that nobody declares is an error to an XML parser and none to those who write URDF.
_PREFIXED = re.compile(r"(</?|\s)([A-Za-z_][\w.-]*):([A-Za-z_][\w.-]*)(?=[\s=/>])")
_COLON = "__colon__"
_NUMERIC = frozenset(
    [
        "xyz",
        "rpy",
        "value",
        "ixx",
        "iyy",
        "izz",
        "ixy",
        "ixz",
        "iyz",
        "mass",
        "diaginertia",
        "fullinertia",
        "pos",
        "quat",
        "euler",
        "axisangle",
        "range",
        "size",
        "axis",
        "ref",
        "lower",
        "upper",
        "effort",
        "velocity",
        "radius",
        "length",
        "scale",
        "damping",
        "friction",
        "armature",
        "ctrlrange",
        "forcerange",
        "fromto",
    ]
)
_MAY_BE_INFINITE = frozenset({"lower", "upper", "effort", "velocity", "range", "ctrlrange"})


def read_xml(path: Path, source: str) -> ET.Element:
    """The root element of a file.

    Raises:
        InputError: If there is none, it is no XML, or a number in it is none.
    """

    def refuse(remedy: str) -> InputError:
        return InputError(source=source, field="robot.model", value=source, remedy=remedy)

    if path.is_dir():
        raise refuse("cannot be read as a robot: it is a directory; give the robot's file in it")
    try:
        text = path.read_bytes().decode("utf-8-sig", errors="replace")
    except OSError as error:
        raise refuse(f"cannot be read as a robot: {error.strerror or error}") from None
    if not text.strip():
        raise refuse("cannot be read as a robot: the file is empty")
    text = re.sub(r"\sxmlns\s*=\s*(\"[^\"]*\"|'[^']*')", "", text)
    text = _PREFIXED.sub(rf"\1\2{_COLON}\3", text)
    text = re.sub(r"^\s*<\?xml[^>]*\?>", "", text)  # its encoding is no longer true
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, ValueError) as error:
        raise refuse(f"cannot be read as a robot: it is no XML ({error})") from None
    _check_numbers(root, source)
    return root


def write_xml(root: ET.Element, path: Path) -> None:
    """Writes the tree, its prefixes as they were."""
    text = ET.tostring(root, encoding="unicode").replace(_COLON, ":")
    if "drake:" in text and "xmlns:drake" not in text:
        text = re.sub(rf"<{root.tag}\b", f'<{root.tag} xmlns:drake="drake"', text, count=1)
    path.write_text(text, encoding="utf-8")


def floats(text: str | None) -> list[float]:
    """The numbers in an attribute; none for none."""
    try:
        return [float(word) for word in (text or "").replace(",", " ").split()]
    except ValueError:
        return []


def _check_numbers(root: ET.Element, source: str) -> None:
    """Refuses nan anywhere, and infinity where there cannot be any."""
    named = ""
    for element in root.iter():
        named = element.get("name") or named
        places = [(key, text) for key, text in element.attrib.items() if key in _NUMERIC]
        if len(element) == 0 and element.text:  # SDF has its numbers between tags
            places.append(("", element.text))
        for key, text in places:
            for number in floats(text):
                bad = math.isnan(number) or (math.isinf(number) and key not in _MAY_BE_INFINITE)
                if bad and (key or math.isnan(number)):
                    field = f"{named}: {element.tag}" + (f".{key}" if key else "")
                    raise InputError(
                        source=source, field=field, value=text, remedy="must be a number"
                    )
