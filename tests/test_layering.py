"""The house's floors: a file imports only from floors below its own, or from its own package."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "drake_quad"

# A room is a subpackage, or the modules of the package itself whose names begin alike:
# scenario.py and scenario_check.py are both in room `scenario`.
FLOORS = {
    "errors": -1,
    "given": -1,  # given_files.py
    "plain": -1,  # plain_json.py
    "processes": -1,
    "whole": -1,  # whole_files.py
    "user": -1,  # user_path.py
    "yaml": -1,  # yaml_text.py
    "version": -1,  # drake_quad/__init__.py
    "cache": -1,  # cache_directory.py
    "kernel": -1,  # kernel_cache.py
    "compiled": -1,
    "gait": 0,
    "terrain": 0,
    "world": 0,
    "robot": 1,
    "planning": 1,
    "estimation": 1,
    "control": 1,
    "stability": 1,
    "systems": 2,
    "certificate": 2,
    "design": 2,
    "controller": 3,
    "scenario": 3,
    "precompile": 3,
    "preparation": 3,
    "designer": 3,
    "diagram": 3,
    "viewers": 3,
    "run": 4,
    "summary": 4,
    "check": 4,  # check_stairs.py
    "chart": 4,
    "plan": 4,  # plan_report.py
    "inspect": 4,
    "simulation": 4,
    "report": 4,
    "sweep": 5,
    "cli": 6,
    "main": 6,  # drake_quad/__main__.py
}

# Beyond the floors: who may import whom on one floor, and who may not although it is below.
# No two rooms of a floor may import each other, not even by way of others (a test says so).
NEIGHBOURS = {
    ("planning", "robot"),
    ("planning", "stability"),
    ("control", "planning"),
    ("control", "robot"),
    ("stability", "robot"),
    ("terrain", "gait"),
    ("world", "gait"),
    ("world", "terrain"),
    ("preparation", "designer"),
    ("preparation", "scenario"),
    ("designer", "scenario"),
    ("diagram", "controller"),
    ("diagram", "preparation"),
    ("diagram", "scenario"),
    ("viewers", "diagram"),
    ("simulation", "run"),
    ("simulation", "summary"),
    ("plan", "run"),
    ("chart", "check"),
    ("check", "inspect"),
    ("report", "inspect"),
    ("main", "cli"),
    ("compiled", "kernel"),
    ("kernel", "cache"),
    ("processes", "errors"),
    ("whole", "errors"),
    ("yaml", "errors"),
}
FORBIDDEN = {
    ("report", "systems"),
    ("report", "control"),
    # The controller goes on a robot: it knows no scenario and no simulated world.
    *((room, "world") for room in ("robot", "planning", "control", "estimation", "stability")),
    # Floor 0 runs where numpy alone is.
    *((room, "compiled") for room in ("gait", "terrain", "world")),
    *((room, "yaml") for room in ("gait", "terrain", "world")),
}

FLOOR_ZERO_LIBRARIES = {"numpy", "drake_quad"}
MORE_LIBRARIES = {
    "cache": {"platformdirs"},
    "compiled": {"numba"},
    "given": {"pyarrow"},
    "kernel": {"numba"},
    "yaml": {"yaml", "pydrake"},
}


def room_of(parts: tuple[str, ...]) -> str:
    """The room of a module by its path within drake_quad, for example ("gait", "legs")."""
    if not parts:
        return "version"
    return parts[0] if parts[0] in FLOORS else parts[0].strip("_").split("_")[0]


def imports_of(source: str, parts: tuple[str, ...], *, is_package: bool = False) -> set[str]:
    """Every module that the source of the module `parts` imports, by its full name."""
    package = ("drake_quad", *(parts if is_package else parts[:-1]))
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
            # `from drake_quad import gait` imports a room, `from x.y import name` the module x.y
            found |= (
                {f"{module}.{alias.name}" for alias in node.names}
                if module == "drake_quad"
                else {module}
            )
    return found


def complaints(source: str, parts: tuple[str, ...], *, is_package: bool = False) -> list[str]:
    """What the floors have against the imports of the module `parts`."""
    room = room_of(parts)
    if room not in FLOORS:
        return [f"{'.'.join(parts)}: on no floor: give {room} one in test_layering.py"]
    wrong = []
    for name in sorted(imports_of(source, parts, is_package=is_package)):
        library, *inner = name.split(".")
        if library != "drake_quad":
            allowed = FLOOR_ZERO_LIBRARIES | MORE_LIBRARIES.get(room, set())
            standard = library in sys.stdlib_module_names or library in allowed
            if FLOORS[room] <= 0 and not standard:
                wrong.append(f"{'.'.join(parts)} imports {name}: floor 0 is numpy only")
            if name == "pydrake.all":
                wrong.append(f"{'.'.join(parts)} imports pydrake.all: import what is used")
            continue
        other = room_of(tuple(inner))
        # a name that is no room is one that drake_quad/__init__.py defines, such as __version__
        floor = FLOORS.get(other, -1)
        below = floor < FLOORS[room] or other == room or (room, other) in NEIGHBOURS
        if not below or (room, other) in FORBIDDEN:
            wrong.append(f"{'.'.join(parts)} imports {name}: not below it")
    return wrong


def modules() -> list[tuple[Path, tuple[str, ...]]]:
    """Every file of the package, and its path as a module."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found.append((path, parts[:-1] if parts[-1] == "__init__" else parts))
    return found


@pytest.mark.parametrize(
    ("path", "parts"), [pytest.param(*m, id=".".join(m[1]) or "drake_quad") for m in modules()]
)
def test_a_file_imports_only_from_floors_below(path: Path, parts: tuple[str, ...]) -> None:
    """No file reaches up, nor across, nor into what its room must not know."""
    source = path.read_text(encoding="utf-8")
    assert complaints(source, parts, is_package=path.name == "__init__.py") == []


@pytest.mark.parametrize(
    ("parts", "source"),
    [
        (("gait", "swing"), "from drake_quad.terrain import Course"),
        (("gait", "swing"), "import pydrake.math"),
        (("terrain",), "from scipy.spatial import ConvexHull"),
        (("terrain_lane",), "from drake_quad.scenario_config import Scenario"),
        (("robot", "x"), "from drake_quad.planning.settings import PlanSettings"),
        (("planning", "x"), "from drake_quad import scenario"),
        (("planning", "x"), "def f():\n    from drake_quad.scenario import Scenario"),
        (("planning", "x"), "from ..systems import gait_scheduler"),
        (("systems", "x"), "import drake_quad.diagram"),
        (("report", "x"), "from drake_quad.systems.gait_scheduler import GaitScheduler"),
        (("report", "x"), "from drake_quad.simulation import run"),
        (("simulation",), "from pydrake.all import Simulator"),
        (("attic",), "import math"),
        (("compiled",), "from drake_quad.gait.legs import Leg"),
        (("compiled",), "import scipy"),
        (("yaml_text",), "import scipy"),
        (("terrain",), "from drake_quad.yaml_text import parse_yaml"),
        (("gait", "swing"), "from drake_quad.compiled import compiled"),
        (("gait", "swing"), "import numba"),
        (("planning", "x"), "from drake_quad.control.settings import ControlSettings"),
        (("planning", "x"), "from drake_quad.world import World"),
        (("control", "x"), "from drake_quad.estimation.filter import step"),
        (("control", "x"), "from drake_quad.systems.scratch import EvalScratch"),
        (("estimation", "x"), "from drake_quad.planning.settings import PlanSettings"),
        (("estimation", "x"), "from drake_quad.control.settings import ControlSettings"),
        (("world_turn",), "from drake_quad.scenario_config import Scenario"),
        (("systems", "x"), "from drake_quad.controller import MakeController"),
        (("controller",), "from drake_quad.scenario import load_scenario"),
        (("controller",), "from drake_quad.diagram import MakeDiagram"),
        (("scenario_build",), "from drake_quad.preparation import prepare"),
    ],
)
def test_an_import_upward_is_caught(parts: tuple[str, ...], source: str) -> None:
    """Each way of breaking the floors gives just one complaint."""
    assert len(complaints(source, parts)) == 1


@pytest.mark.parametrize(
    ("parts", "source"),
    [
        (("gait", "swing"), "import numpy as np\nfrom drake_quad.gait.legs import Leg"),
        (("gait", "swing"), "from .legs import Leg\nfrom ..errors import InputError"),
        (("terrain_lane",), "from drake_quad.terrain_box import rotation"),
        (("planning", "x"), "from drake_quad.robot.robot_model import RobotModel"),
        (("scenario_build",), "from drake_quad.planning.settings import PlanSettings"),
        (("cli",), "from drake_quad import __version__, simulation"),
        (("compiled",), "import numba\nfrom typing import cast"),
        (("control", "x"), "from drake_quad.planning.motion_plan import PlanSample"),
        (("control", "x"), "from drake_quad.compiled import compiled"),
        (("robot", "x"), "from drake_quad.yaml_text import parse_yaml"),
        (("systems", "x"), "from drake_quad.control.tracking import place_feet"),
        (("diagram_wires",), "from drake_quad.controller import MakeController"),
    ],
)
def test_an_import_downward_is_let_pass(parts: tuple[str, ...], source: str) -> None:
    """What the house allows gives no complaint."""
    assert complaints(source, parts) == []


def test_neighbours_of_one_floor_go_one_way_only() -> None:
    """The tables allow no circle: who may import a neighbour is nowhere to be found from there."""
    TopologicalSorter(
        {room: {other for one, other in NEIGHBOURS if one == room} for room in FLOORS}
    ).prepare()
    assert all(FLOORS[one] == FLOORS[other] for one, other in NEIGHBOURS)


def test_tables_hold_nothing_that_nobody_needs() -> None:
    """Each room of the tables is there, and each neighbour is imported: they say what is."""
    rooms = {room_of(parts) for _, parts in modules()}
    assert set(FLOORS) == rooms
    imported = {
        (room_of(parts), room_of(tuple(name.split(".")[1:])))
        for path, parts in modules()
        for name in imports_of(
            path.read_text(encoding="utf-8"), parts, is_package=path.name == "__init__.py"
        )
        if name.startswith("drake_quad.")
    }
    assert imported >= NEIGHBOURS


def test_floor_zero_imports_without_pydrake() -> None:
    """In an interpreter where nothing but numpy can be imported, all of floor 0 can."""
    names = [
        ".".join(("drake_quad", *parts))
        for _, parts in modules()
        if FLOORS.get(room_of(parts), 9) <= 0 and room_of(parts) not in MORE_LIBRARIES
    ]
    assert "drake_quad.gait.legs" in names and "drake_quad.terrain" in names
    script = f"""
import importlib, sys
sys.path.insert(0, {str(PACKAGE.parent)!r})
class Blocker:
    def find_spec(self, name, path=None, target=None):
        blocked = ("pydrake", "scipy", "yaml", "matplotlib", "piqp", "daqp", "numba")
        if name.split(".")[0] in blocked:
            raise ImportError(name + " is blocked")
sys.meta_path.insert(0, Blocker())
for name in {names!r}:
    importlib.import_module(name)
try:
    importlib.import_module("drake_quad.scenario_config")
except ImportError:
    pass
else:
    raise SystemExit("the blocker blocks nothing")
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_runs_and_trials_begin_without_statistics() -> None:
    """scipy.stats takes half a second, which a process that only simulates need not wait."""
    modules = "drake_quad.simulation, drake_quad.sweep.process"
    script = f"import sys, {modules}; raise SystemExit('scipy.stats' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
