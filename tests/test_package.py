"""What the package says of itself is the same everywhere."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_every_file_tells_the_same_version() -> None:
    """Version and licence of pyproject.toml are those of CITATION.cff and the changelog."""
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    newest = re.search(r"^## \[(\d.*?)\]", (ROOT / "CHANGELOG.md").read_text(), re.M)
    assert citation["version"] == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    assert newest is not None and newest.group(1) == PROJECT["version"]


def test_the_readme_begins_with_both_commands() -> None:
    """The first two blocks of code are the commands that CI carries out, on whichever python3."""
    text = (ROOT / "README.md").read_text()
    found = re.findall(r"<!-- (\w+) command -->\n```sh\n(.*?)\n```", text, re.S)
    assert [name for name, _ in found] == ["run", "test"]
    assert [block for _, block in found] == re.findall(r"```sh\n(.*?)\n```", text, re.S)[:2]
    assert all(block.startswith("python3 -m venv .venv && ") for _, block in found)


def test_no_upper_bound_keeps_a_newer_python_or_drake_out() -> None:
    """Whoever installs it next year gets next year's Drake."""
    assert "<" not in PROJECT["requires-python"]
    assert not [name for name in PROJECT["dependencies"] if "<" in name]


def test_every_package_is_in_the_wheel() -> None:
    """A folder with modules that the wheel leaves out is missed only by who installs it."""
    told = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    there = {
        ".".join(path.parent.relative_to(ROOT).parts)
        for path in (ROOT / "drake_quad").rglob("*.py")
    }
    assert {name for name in told if name != "drake_quad_models"} == there


@pytest.mark.parametrize("script", sorted(path.name for path in (ROOT / ".ci").iterdir()))
def test_scripts_of_ci_are_sound(script: str) -> None:
    """Each can be executed, and a shell reads it to its end."""
    path = ROOT / ".ci" / script
    assert path.stat().st_mode & 0o100
    subprocess.run(["bash", "-n", str(path)], check=True)


def test_the_package_asks_for_its_own_version() -> None:
    """The version is that of what is installed, without an import of anything else."""
    script = "import sys, drake_quad; print(drake_quad.__version__, 'pydrake' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert re.fullmatch(r"\d+\.\d+\.\d+\S* False\n", done.stdout)
