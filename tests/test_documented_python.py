"""The Python of the documentation site runs as it stands: that of pages and of notebooks."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from replay_rig import short_run

import drake_quad as dq
from drake_quad.scenario.load import load_scenario

DOCS = Path(__file__).resolve().parents[1] / "docs"
FOLDERS = ("start", "guides", "concepts", "reference")
PAGES = sorted(
    [
        *DOCS.glob("*.md"),
        *(page for folder in FOLDERS for page in (DOCS / folder).glob("*.md")),
        DOCS.parent / "README.md",
    ]
)
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
SLOW_NOTEBOOKS = {"first_climb", "own_robot"}  # a climb is simulated, several gaits are designed
LONG_NOTEBOOKS = {"margins_and_certificates"}  # ten plans are made
SLOW_PAGES = {"README"}  # a climb is simulated


def python_blocks(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(
            page, id=page.stem, marks=[pytest.mark.slow] if page.stem in SLOW_PAGES else []
        )
        for page in PAGES
        if python_blocks(page)
    ],
)
def test_a_page_s_python_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All blocks of a page, one after the other, where there is a run in runs/case_study."""
    monkeypatch.chdir(tmp_path)
    short_run(tmp_path / "runs" / "case_study")
    names: dict[str, object] = {"__name__": page.stem}
    for block in python_blocks(page):
        exec(compile(block, str(page), "exec"), names)
    assert "dq" in names


def test_the_pages_with_python_are_found() -> None:
    """The search is not empty by mistake."""
    with_python = {page.stem for page in PAGES if python_blocks(page)}
    assert with_python >= {
        "README",
        "scenario",
        "own_controller",
        "own_stairs",
        "first_climb",
        "api",
    }


def code_of(notebook: Path) -> str:
    """The code cells of a notebook as one program."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")


@pytest.mark.parametrize(
    "notebook",
    [
        pytest.param(
            path,
            id=path.stem,
            marks=[pytest.mark.slow]
            if path.stem in SLOW_NOTEBOOKS
            else [pytest.mark.long]
            if path.stem in LONG_NOTEBOOKS
            else [],
        )
        for path in NOTEBOOKS
    ],
)
def test_a_notebook_runs(notebook: Path, tmp_path: Path) -> None:
    """All of its cells, in a process of its own, with nothing but what the cells import."""
    done = subprocess.run(
        [sys.executable, "-c", code_of(notebook)],
        cwd=tmp_path, env={**os.environ, "MPLBACKEND": "agg"}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_is_stripped_and_uses_the_public_face_alone(notebook: Path) -> None:
    """No output is committed, and nothing of drake_quad is imported but drake_quad itself."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    for cell in cells:
        assert cell["cell_type"] == "markdown" or (
            not cell["outputs"] and cell["execution_count"] is None
        )
    imported = re.findall(r"^(?:import|from) (\S+)", code_of(notebook), re.M)
    assert set(imported) <= {"drake_quad", "numpy", "matplotlib.pyplot", "pathlib", "tempfile"}


def test_the_scenario_of_own_stairs_can_be_read(tmp_path: Path) -> None:
    """The blocks of YAML on the page are one scenario, with a course of seven elements."""
    page = (DOCS / "guides" / "own_stairs.md").read_text(encoding="utf-8")
    text = "".join(re.findall(r"```yaml\n(.*?)```", page, re.DOTALL))
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    scenario = load_scenario(tmp_path / "mine.yaml")
    assert scenario.design == "auto" and len(scenario.course) == 7 and scenario.world.random


def test_the_reference_has_each_public_name_once() -> None:
    """The page of the Python API lists what `import drake_quad as dq` gives, and nothing else."""
    listed = re.findall(
        r"^::: drake_quad\.(\w+)$",
        (DOCS / "reference" / "api.md").read_text(encoding="utf-8"),
        re.M,
    )
    assert sorted(listed) == sorted(set(dq.__all__) - {"__version__"})
