"""The package's architecture: packages in one order, each importing only from those before it."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "drake_quad"

# Lowest first. A name is a subpackage of drake_quad, or a module at its top.
ORDER = (
    "common",
    "errors",
    "util",
    "jit",
    "math",
    "robot",
    "terrain",
    "estimation",
    "perception",
    "stability",
    "gait",
    "planning",
    "certificate",
    "infeasibility",
    "control",
    "systems",
    "scenario",
    "gait_design",
    "runs",
    "simulation",
    "feasibility",
    "bus",
    "report",
    "sweep",
    "api",
    "cli",
    "__main__",
)
# The mathematics: it runs where there is no Drake.
ALGORITHMS = {
    "math",
    "gait",
    "stability",
    "planning",
    "control",
    "estimation",
    "certificate",
    "infeasibility",
    "gait_design",
    "perception",
}
# These fill in scenarios, whose YAML and robots are read by Drake.
READ_BY_DRAKE = {
    ("gait_design", name)
    for name in (
        "designed",
        "designer",
        "plan_candidates",
        "quicken",
        "short_course",
        "speed_curve",
        "tempo",
        "tempo_planner",
        "tempo_search",
        "tempo_trials",
    )
}
# What the command line may import beside the public names of `import drake_quad as dq`.
KNOWN_TO_COMMANDS = {"cli", "api", "errors", "util"}
# The one exception: no robot has walked by the bus, so its functions are not promised publicly yet.
UNPROMISED: dict[tuple[str, ...], str] = {("cli", "bus"): "bus"}
# What a package must not know although it is below.
FORBIDDEN = {
    ("report", "systems"),
    ("report", "control"),
    # The controller goes on a robot: it knows no course as it really is, only its map.
    *(
        (package, module)
        for package in ("robot", "planning", "control", "estimation", "stability")
        for module in ("terrain.as_built", "terrain.moved_risers")
    ),
}


def package_of(parts: tuple[str, ...]) -> str:
    """The package of a module by its path within drake_quad, for example ("gait", "swing")."""
    return parts[0] if parts else "__init__"


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
            # `from drake_quad import gait` imports a package, `from x.y import name` the module x.y
            found |= (
                {f"{module}.{alias.name}" for alias in node.names}
                if module == "drake_quad"
                else {module}
            )
    return found


def complaints(source: str, parts: tuple[str, ...], *, is_package: bool = False) -> list[str]:
    """What the architecture has against the imports of the module `parts`."""
    name, package = ".".join(parts), package_of(parts)
    if package not in ORDER:
        return [f"{name}: {package} has no place in the order: give it one in test_layering.py"]
    wrong = []
    for imported in sorted(imports_of(source, parts, is_package=is_package)):
        library, *inner = imported.split(".")
        if library == "pydrake" and package in ALGORITHMS:
            wrong.append(f"{name} imports {imported}: the mathematics knows no Drake")
        elif imported == "pydrake.all":
            wrong.append(f"{name} imports pydrake.all: import what is used")
        if library != "drake_quad" or not inner or inner[0] not in ORDER:
            continue  # what is in no package is a name of drake_quad/__init__.py
        below = ORDER.index(inner[0]) < ORDER.index(package) or inner[0] == package
        known = {(package, inner[0]), (package, ".".join(inner[:2]))}
        if not below or known & FORBIDDEN:
            wrong.append(f"{name} imports {imported}: not below it")
        elif package == "cli" and inner[0] not in KNOWN_TO_COMMANDS | {UNPROMISED.get(parts)}:
            wrong.append(f"{name} imports {imported}: commands call the public API alone")
    return wrong


def modules() -> list[tuple[Path, tuple[str, ...]]]:
    """Every file of the package but its public face, and its path as a module."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found.append((path, parts[:-1] if parts[-1] == "__init__" else parts))
    return [(path, parts) for path, parts in found if parts]


@pytest.mark.parametrize(
    ("path", "parts"), [pytest.param(*m, id=".".join(m[1])) for m in modules()]
)
def test_a_module_imports_only_from_packages_before_its_own(
    path: Path, parts: tuple[str, ...]
) -> None:
    """No module reaches up, nor into what its package must not know."""
    source = path.read_text(encoding="utf-8")
    assert complaints(source, parts, is_package=path.name == "__init__.py") == []


@pytest.mark.parametrize(
    ("parts", "source"),
    [
        (("gait", "swing"), "from drake_quad.planning.task import plan_task"),
        (("gait", "swing"), "import pydrake.math"),
        (("terrain", "lane"), "from drake_quad.scenario.config import Scenario"),
        (("robot", "x"), "from drake_quad.planning.problem import PlanSettings"),
        (("robot", "importer", "x"), "from drake_quad.terrain.lane import Lane"),
        (("planning", "x"), "from drake_quad import scenario"),
        (("planning", "x"), "def f():\n    from drake_quad.scenario.load import load_scenario"),
        (("planning", "x"), "from ..systems import gait_scheduler"),
        (("systems", "x"), "import drake_quad.simulation.diagram"),
        (("report", "x"), "from drake_quad.systems.gait_scheduler import GaitScheduler"),
        (("simulation", "run"), "from pydrake.all import Simulator"),
        (("attic", "x"), "import math"),
        (("jit",), "from drake_quad.robot.legs import Leg"),
        (("util", "yaml_io"), "from drake_quad.jit import jit"),
        (("control", "x"), "from drake_quad.systems.leaf_system import EvalScratch"),
        (("control", "x"), "import pydrake"),
        (("planning", "x"), "from drake_quad.terrain.as_built import World"),
        (("estimation", "x"), "from drake_quad.control.settings import ControlSettings"),
        (("systems", "controller"), "from drake_quad.scenario.load import load_scenario"),
        (("gait_design", "x"), "from drake_quad.simulation.prepare import prepare"),
        (("scenario", "build"), "from drake_quad.simulation.prepare import prepare"),
        (("cli", "runs"), "from drake_quad.runs.reader import load_run"),
        (("cli", "runs"), "from drake_quad.bus.faults import BusFaults"),
        (("cli", "bus"), "from drake_quad.runs.reader import load_run"),
        (("cli", "runs"), "def f():\n    from drake_quad.simulation.run import simulate"),
    ],
)
def test_an_import_upward_is_caught(parts: tuple[str, ...], source: str) -> None:
    """Each way of breaking the architecture gives just one complaint."""
    assert len(complaints(source, parts)) == 1


@pytest.mark.parametrize(
    ("parts", "source"),
    [
        (("gait", "swing"), "import numpy as np\nfrom drake_quad.robot.legs import Leg"),
        (("gait", "swing"), "from .schedule import wave_schedule\nfrom ..errors import InputError"),
        (("gait", "swing"), "import numba\nfrom drake_quad.jit import jit"),
        (("planning", "x"), "from drake_quad.robot.model import RobotModel"),
        (("scenario", "build"), "from drake_quad.planning.problem import PlanSettings"),
        (("cli", "main"), "from drake_quad import __version__"),
        (("cli", "runs"), "import drake_quad as dq\nfrom drake_quad.util.files import user_path"),
        (("cli", "bus"), "from drake_quad.bus.faults import BusFaults"),
        (("control", "x"), "from drake_quad.planning.motion_plan import PlanSample"),
        (("robot", "loader"), "from pydrake.multibody.parsing import Parser"),
        (("systems", "x"), "from drake_quad.control.foot_targets import place_feet"),
        (("simulation", "diagram"), "from drake_quad.systems.controller import MakeController"),
    ],
)
def test_an_import_downward_is_let_pass(parts: tuple[str, ...], source: str) -> None:
    """What the architecture allows gives no complaint."""
    assert complaints(source, parts) == []


def test_no_modules_import_each_other() -> None:
    """There is no circle of modules, not even by way of others, of imports at their top."""
    graph = {}
    for path, parts in modules():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        graph[".".join(("drake_quad", *parts))] = {
            node.module for node in tree.body if isinstance(node, ast.ImportFrom) and node.module
        }
    TopologicalSorter(graph).prepare()


def test_the_order_holds_nothing_that_is_not_there() -> None:
    """Each package of the lists is there: they say what is."""
    assert set(ORDER) == {package_of(parts) for _, parts in modules()}
    assert set(ORDER) > ALGORITHMS


def test_the_mathematics_imports_without_pydrake() -> None:
    """In an interpreter that has no Drake, all of the algorithms can be imported."""
    names = [
        ".".join(("drake_quad", *parts))
        for _, parts in modules()
        if parts[0] in ALGORITHMS and parts not in READ_BY_DRAKE
    ]
    assert "drake_quad.gait.swing" in names and "drake_quad.control.whole_body_qp" in names
    script = f"""
import importlib, sys
sys.path.insert(0, {str(PACKAGE.parent)!r})
class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "pydrake":
            raise ImportError(name + " is blocked")
sys.meta_path.insert(0, Blocker())
for name in {names!r}:
    importlib.import_module(name)
try:
    importlib.import_module("drake_quad.robot.loader")
except ImportError:
    pass
else:
    raise SystemExit("the blocker blocks nothing")
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_runs_and_trials_begin_without_statistics() -> None:
    """scipy.stats takes half a second, which a process that only simulates need not wait."""
    modules = "drake_quad.simulation.run, drake_quad.sweep.executors"
    script = f"import sys, {modules}; raise SystemExit('scipy.stats' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
