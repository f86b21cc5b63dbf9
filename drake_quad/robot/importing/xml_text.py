"""A robot's file as an XML tree, whatever it does with namespaces and encodings."""

import codecs
import re
import xml.etree.ElementTree as ET
from pathlib import Path

from drake_quad.errors import InputError
from drake_quad.given_files import MOST_TEXT, read_given
from drake_quad.robot.importing.xml_numbers import COLON, check_numbers

MOST_NESTED = 200  # levels of elements: robots have some thirty, Python's stack a thousand
# A prefix that nobody declares is an error to an XML parser and none to those who write URDF.
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
    check_numbers(root, source)
    return root


def read_text(path: Path) -> str:
    """A file's text by its byte order mark, by the encoding that it declares, or as UTF-8.

    Raises:
        OSError: If it cannot be read.
        LookupError: If nobody knows the encoding that it declares.
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
