"""`import drake_quad as dq`: quick, and each name of it does what its docstring says."""

import ast
import re
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path

import pytest
from report_run import draw_only

import drake_quad as dq

PACKAGE = Path(dq.__file__).parent


@pytest.mark.parametrize("name", dq.__all__)
def test_every_name_is_there_and_says_what_it_is(name: str) -> None:
    """Each public name can be had, and all but the version have a docstring."""
    value = getattr(dq, name)
    assert name == "__version__" or value.__doc__
    assert name in dir(dq)


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    """As of any module."""
    with pytest.raises(AttributeError, match="no attribute 'walk'"):
        dq.walk  # noqa: B018


def test_type_checkers_see_the_names_that_there_are() -> None:
    """The imports for type checkers are of the same names from the same modules."""
    tree = ast.parse(Path(dq.__file__).read_text(encoding="utf-8"))
    seen = {
        alias.asname: f"{node.module}"
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("drake_quad.")
        for alias in node.names
    }
    assert seen == {name: f"drake_quad.{home}" for name, home in dq._HOMES.items()}


@pytest.mark.parametrize(
    ("module", "heavy"),
    [
        ("drake_quad", {"pydrake", "numpy", "numba", "matplotlib"}),
        ("drake_quad.cli.main", {"pydrake", "numpy", "numba", "matplotlib", "pyarrow"}),
        ("drake_quad.feasibility.check_request", {"pydrake", "numba", "scipy", "matplotlib"}),
        ("drake_quad.feasibility.work_out", {"matplotlib"}),
    ],
)
def test_an_import_loads_no_more_than_it_needs(module: str, heavy: set[str]) -> None:
    """Drake and numpy come with the first name that needs them, so that `--help` is quick."""
    script = f"import sys, {module}; print(sorted({heavy!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stdout + done.stderr


def test_no_public_name_is_defined_twice() -> None:
    """A reader who has met a class or a function knows it wherever its name stands."""
    defined = Counter(
        node.name
        for path in PACKAGE.rglob("*.py")
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
        and not node.name.startswith("_")
        and path.parent.name != "cli"  # a command is called as what it does: run, check, chart
    )
    assert [name for name, count in defined.items() if count > 1] == []


def test_a_yes_has_a_plan_that_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Robot and stairs in, an answer out, whose scenario is planned, proven, run and read back."""
    stairs = dq.Stairs(rise=0.1, run=0.4, count=2)
    answer = dq.check_stairs("paper_quadruped", stairs, prefer="margin")
    assert answer.feasible and answer.margin and answer.margin > 0.03
    assert answer.nearest() == answer.stairs
    assert "yes" in answer._repr_html_()
    prepared = dq.plan(answer.scenario)
    assert dq.certify(prepared).failure is None
    assert answer.plan is not None and prepared.plan.duration == answer.plan.duration
    chunks = iter(range(100))
    result = dq.simulate(prepared, stop=lambda: next(chunks) >= 1)
    assert result.outcome == "stopped" and "simulated" in result._repr_html_()
    past = dq.load_run(result.save(tmp_path / "run"))
    assert past.summary["outcome"] == "stopped" and len(past.log) == result.table.num_rows
    draw_only(monkeypatch, "margin")
    assert dq.write_report(past, replay=False).is_file()


@cache
def hopeless() -> dq.Feasibility:
    """The answer for steps so steep that knees and shanks would meet them."""
    robot = dq.load_robot("paper_quadruped")
    return dq.check_stairs(robot, dq.Stairs(0.2, 0.12, 2), thorough=False)


@pytest.mark.long
def test_a_no_says_why_and_what_would_work() -> None:
    """With the reason, and the nearest stairs that a quick search finds a gait for."""
    answer = hopeless()
    assert not answer.feasible and answer.reason and answer.plan is None
    nearest = answer.nearest()
    assert (
        nearest is not None and nearest.rise < 0.2 and "no plan was found: " in answer._repr_html_()
    )


def test_a_robot_is_called_as_it_was_asked_for() -> None:
    """A saved scenario names it so, and not the file that it was imported to."""
    assert dq.load_robot("paper_quadruped").source == "paper_quadruped"
    assert hopeless().scenario.robot.model == "paper_quadruped"


def test_a_robot_is_read_from_a_path_as_from_a_string() -> None:
    """A file may be a `Path`; what is read is the same, and its name is a string."""
    file = Path(__file__).resolve().parents[1] / "models" / "paper_quadruped.urdf"
    robot = dq.load_robot(file)
    assert robot.source == str(file)
    assert robot.mass == dq.load_robot(str(file)).mass
    with pytest.raises(dq.InputError, match=r"nowhere\.urdf"):
        dq.load_robot(Path("nowhere.urdf"))


def test_arcs_are_refused_a_certificate_in_a_line() -> None:
    """The paper's own spin swings along arcs, of which nothing is proven."""
    with pytest.raises(dq.InputError, match=r"spin\.swing_path"):
        dq.certify(dq.plan("paper"))


def test_a_study_is_loaded_and_carried_out(tmp_path: Path) -> None:
    """Two short trials here, with their findings and their report."""
    file = tmp_path / "s.yaml"
    file.write_text(
        "scenario: paper\nset: ['mission=[{kind: stand, duration: 1.0}]']\n"
        "vary: [{path: gait.body_height, values: [0.84, 0.86]}]\n"
    )
    assert dq.load_study(file).scenario == "paper"
    found = dq.run_study(file, tmp_path / "out", workers=1)
    assert found["trials"] == 2 and (tmp_path / "out" / "report.html").is_file()


def test_pages_use_names_that_are_there() -> None:
    """Each `dq.name` in a Python block of the README and the documents is public."""
    root = Path(__file__).resolve().parents[1]
    used = []
    for page in (root / "README.md", *sorted((root / "docs").rglob("*.md"))):
        for block in re.findall(
            r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL
        ):
            used += [
                node.attr
                for node in ast.walk(ast.parse(block))
                if isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id == "dq"
            ]
    assert len(used) >= 5 and set(used) <= set(dq.__all__)
