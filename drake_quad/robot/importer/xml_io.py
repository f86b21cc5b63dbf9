"""Reads and writes XML, with strict numbers."""

import codecs
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

from drake_quad.errors import InputError
from drake_quad.util.files import MOST_TEXT, read_given

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


def check_xml_numbers(root: ET.Element, source: str) -> None:
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


MOST_NESTED = 200  # levels of elements: robots have some thirty, Python's stack a thousand
# An undeclared prefix is an error to an XML parser, and common in URDF.
_PREFIXED = re.compile(r"(</?|\s)([A-Za-z_][\w.-]*):([A-Za-z_][\w.-]*)(?=[\s=/>])")
_DECLARED = re.compile(rb"\s*<\?xml[^>]*?\sencoding\s*=\s*[\"']([\w.:-]+)[\"']")


def read_xml(path: Path, source: str) -> ET.Element:
    """The root element of a file.

    Raises:
        InputError: If there is none, it is no XML, or a number in it is none.
    """

    def refuse(remedy: str) -> InputError:
        remedy = f"cannot be read as a robot: {remedy}"
        return InputError(source=source, field="robot.model", value=source, remedy=remedy)

    if path.is_dir():
        raise refuse("it is a directory; give the robot's file in it")
    try:
        text = read_text(path)
    except OSError as error:
        raise refuse(error.strerror or str(error)) from None
    except (LookupError, UnicodeError) as error:
        raise refuse(f"it is not in the encoding that it declares ({error})") from None
    if not text.strip():
        raise refuse("the file is empty")
    text = re.sub(r"\sxmlns\s*=\s*(\"[^\"]*\"|'[^']*')", "", text)
    text = _PREFIXED.sub(rf"\1\2{COLON}\3", text)
    text = re.sub(r"^\s*<\?xml[^>]*\?>", "", text)  # its encoding is no longer true
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, ValueError) as error:
        raise refuse(f"it is no XML ({error})") from None
    check_depth(root, source)
    check_xml_numbers(root, source)
    return root


def read_text(path: Path) -> str:
    """A file's text by its byte order mark, by the encoding that it declares, or as UTF-8.

    Raises:
        OSError: If it cannot be read.
        LookupError: If the encoding that it declares is unknown.
        UnicodeError: If it is not in that encoding.
    """
    data = read_given(path, most=MOST_TEXT)
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16")
    declared = _DECLARED.match(data)
    encoding = declared[1].decode("ascii").lower() if declared else "utf-8"
    if encoding in ("utf-8", "utf8", "us-ascii", "ascii"):
        # Comments are often in another: no reason to refuse a robot.
        return data.decode("utf-8-sig", errors="replace")
    return data.decode(encoding)


def check_depth(root: ET.Element, source: str) -> None:
    """Refuses a tree whose elements are nested deeper than any robot's.

    Raises:
        InputError: If they are.
    """
    level, depth = [root], 0
    while level:
        depth += 1
        if depth > MOST_NESTED:
            raise InputError(
                source=source,
                field=f"<{level[0].tag.replace(COLON, ':')}>",
                value=depth,
                remedy=f"elements are nested too deep: at most {MOST_NESTED} levels",
            )
        level = [child for element in level for child in element]


def write_xml(root: ET.Element, path: Path) -> None:
    """Writes the tree, its prefixes as they were."""
    text = ET.tostring(root, encoding="unicode").replace(COLON, ":")
    if "drake:" in text and "xmlns:drake" not in text:
        text = re.sub(rf"<{root.tag}\b", f'<{root.tag} xmlns:drake="drake"', text, count=1)
    path.write_text(text, encoding="utf-8")
