"""Files that a robot's file includes: found, read, and none of them within itself."""

import xml.etree.ElementTree as ET
from pathlib import Path

from drake_quad.errors import InputError
from drake_quad.robot.importing.cleaned import Cleaned
from drake_quad.robot.importing.locate import resolve
from drake_quad.robot.importing.misspelt import check_spelling
from drake_quad.robot.importing.xml_text import check_depth, read_xml

MOST_INCLUDED = 200  # by one robot: its file, twice in a file that is twice in another ..., grows
Chain = tuple[Path, ...]  # the robot's file, one that it includes, one that this includes, ...


def open_included(
    c: Cleaned, uri: str, chain: Chain, tags: tuple[str, ...], *, inside: str = ""
) -> ET.Element:
    """The root of an included file, which is added to `c.files`.

    Args:
        c: Of the file that includes; `beside` is where its paths go from.
        uri: As the file names it.
        chain: By what way the file that includes was reached.
        tags: With which the included one may begin.
        inside: Tag of the element that takes what the included one holds, if another does.

    Raises:
        InputError: If it is not there, is no robot's, includes itself, or has misspelt names.
    """
    source = told(c, chain)

    def refuse(remedy: str) -> InputError:
        return InputError(source=source, field="include", value=uri, remedy=remedy)

    found = resolve(uri, beside=c.beside) if uri.strip() else None
    if found is None:
        what = "names no file" if not uri.strip() else "there is no such file"
        raise refuse(f"{what}; give that of a file to include, absolute or beside the robot's")
    if found in chain:
        way = ", ".join(path.name for path in chain[chain.index(found) + 1 :])
        raise refuse(f"{found.name} includes itself" + (f" by way of {way}" if way else ""))
    if len(c.included) >= MOST_INCLUDED:
        raise refuse(f"more than {MOST_INCLUDED} files are included")
    c.included.append(found)
    if found not in c.files:
        c.files.append(found)
    root = read_xml(found, str(found))
    if root.tag not in tags:
        begins = " or ".join(f"<{tag}>" for tag in tags)
        raise refuse(f"{found.name} begins with <{root.tag}>; one to include, with {begins}")
    check_spelling(root, str(found), inside=inside)
    return root


def told(c: Cleaned, chain: Chain) -> str:
    """How errors name the file at the chain's end: the robot's own as the person gave it."""
    return c.source if len(chain) == 1 else str(chain[-1])


def include_mjcf(c: Cleaned) -> None:
    """Puts included files where they are included, as MuJoCo does: each of them once.

    Raises:
        InputError: If one is not there, is no MJCF, or is included twice.
    """
    _include(c, c.root, (c.files[0],))
    check_depth(c.root, c.source)


def _include(c: Cleaned, root: ET.Element, chain: Chain) -> None:
    """Puts included files into the tree of one."""
    for element in list(root.iter()):
        for child in element.findall("include"):
            uri = child.get("file", "")
            found = resolve(uri, beside=c.beside)
            if found in c.included and found not in chain:
                raise InputError(
                    source=told(c, chain),
                    field="include",
                    value=uri,
                    remedy="is included twice; MuJoCo takes each file once",
                )
            tags = ("mujoco", "mujocoinclude")
            other = open_included(c, uri, chain, tags, inside=element.tag)
            _include(c, other, (*chain, c.included[-1]))
            place = list(element).index(child)
            element[place : place + 1] = list(other)
