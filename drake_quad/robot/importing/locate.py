"""Finds a robot's file, and the files that it names."""

import os
import re
from dataclasses import dataclass
from pathlib import Path

from drake_quad.errors import InputError
from drake_quad.given_files import is_given
from drake_quad.robot.importing.catalogue import PACKAGES, find_by_name, is_name, root_of
from drake_quad.robot.importing.xml_text import read_text
from drake_quad.user_path import user_path

_FOLDER = re.compile(r"(?:meshdir|assetdir)\s*=\s*(['\"])(.+?)\1")
_NAMED = re.compile(r"(?:filename|file)\s*=\s*(['\"])(.+?)\1|<uri>\s*([^<\s]+)")
_INCLUDED = re.compile(
    r"<include\b(?:[^>]*?\sfile\s*=\s*[\"']([^\"']+)|.*?<uri>\s*([^<\s]+))", re.DOTALL
)


@dataclass(frozen=True)
class Found:
    """A robot's file.

    Attributes:
        path: Where it is.
        model: What the person gave.
        name: A short name for it.
    """

    path: Path
    model: str
    name: str


def find_robot(model: str) -> Found:
    """The file that `model` means: a `package://` URL, a path, `NAME` or `PACKAGE:NAME`.

    Raises:
        InputError: If there is none.
    """

    def refuse(remedy: str) -> InputError:
        return InputError(source=model, field="robot.model", value=model, remedy=remedy)

    if not model:
        raise refuse("cannot be read as a robot: no file is given")
    if "://" not in model:
        path = user_path(model)
        if is_given(path):
            return Found(path.resolve(), model, path.name.split(".")[0] or "robot")
        if is_name(model):  # before directories: that of a robot's run is often named after it
            return Found(find_by_name(model), model, model.rpartition(":")[2])
        if path.is_dir():
            raise refuse("cannot be read as a robot: it is a directory; give the file in it")
        raise refuse("cannot be read as a robot: no such file")
    if not model.startswith(("package://", "file://")):
        raise refuse("cannot be read as a robot: give package://..., a path or a robot's name")
    found = resolve(model, beside=Path())
    if found is None:
        raise refuse("cannot be read as a robot: no such package, or no such file in it")
    return Found(found, model, found.name.split(".")[0] or "robot")


def resolve(uri: str, *, beside: Path) -> Path | None:
    """The file that `uri` in a robot's file means, or None if it is not there.

    A package is looked for among those that are known, then upwards from the robot's file (a
    folder of that name, or one that holds such a folder), then in ROS_PACKAGE_PATH.

    Args:
        uri: `package://`, `model://`, `file://` or a path.
        beside: Folder of the robot's file.
    """
    scheme, separator, rest = uri.strip().partition("://")
    if not separator:
        return _file(beside / uri)
    if scheme == "file":
        return _file(Path("/" + rest.lstrip("/")))
    package, _, inner = rest.partition("/")
    places = [root_of(p) for p in PACKAGES if p.scheme == package]
    if package == "underactuated":  # its package.xml is a floor above its models
        places = [p.parent for p in places if p]
    for folder in (beside.resolve(), *beside.resolve().parents) if str(beside) != "." else ():
        places += [folder if folder.name == package else None, folder / package]
    places += [Path(p) / package for p in os.environ.get("ROS_PACKAGE_PATH", "").split(":") if p]
    for place in places:
        found = _file(place / inner) if place else None
        if found:
            return found
    return None


def files_named_in(path: Path) -> list[Path]:
    """The meshes and other files that a robot's file names, as far as they are there, and SRDFs.

    Files that it includes, or that those include, count with all that they name.
    """
    texts, pending, bases = [], [path], {path.parent: None}
    found: set[Path | None] = {path}
    while pending:
        file = pending.pop()
        bases[file.parent] = None
        try:
            texts.append(read_text(file))
        except (OSError, LookupError, UnicodeError):
            continue  # whoever reads it as a robot says so
        # SDF resolves beside the file that includes, MJCF beside the first one.
        uris = [uri for pair in _INCLUDED.findall(texts[-1]) for uri in pair if uri]
        new = {resolve(uri, beside=base) for uri in uris for base in (file.parent, path.parent)}
        pending += [p for p in new - found if p is not None]
        found |= new
    text = "\n".join(texts)
    folders = ["", *(folder for _, folder in _FOLDER.findall(text))]
    found |= {
        resolve(uri if "://" in uri or not folder else f"{folder}/{uri}", beside=base)
        for uri in {uri for _, *pair in _NAMED.findall(text) for uri in pair if uri}
        for folder in folders
        for base in bases
    }
    for place in (path.parent, path.parent.parent / "srdf"):
        found |= set(place.glob("*.srdf"))
    return sorted(p for p in found - {path} if p is not None)


def _file(path: Path) -> Path | None:
    """The path if a file is there."""
    try:
        return path.resolve() if is_given(path) else None
    except OSError:
        return None
