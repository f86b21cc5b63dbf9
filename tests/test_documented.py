"""What the documents show can be used as it stands: commands, scenarios, studies, links."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from drake_quad.cli.main import app
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import prepare
from drake_quad.sweep.study_loading import load_study_and_base

ROOT = Path(__file__).resolve().parents[1]
TOP = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md")
PAGES = sorted([*TOP, *(ROOT / "docs").rglob("*.md")])
COMMAND = re.compile(r"^\s*(?:\$ |.* && )?(?:\.venv/bin/)?drake-quad (.+)$")
DRAKE_QUAD: Any = typer.main.get_command(app)


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(), re.S)


def commands(page: Path) -> list[str]:
    """What stands after drake-quad in lines of their own, in blocks, and in tables."""
    fenced = [line for block in re.findall(r"```(?:sh)?\n(.*?)```", page.read_text(), re.S)
              for line in block.splitlines()]  # fmt: skip
    indented = re.findall(r"^    \S.*$", page.read_text(), re.M)
    rows = re.findall(r"^\|.*$", page.read_text(), re.M)
    in_tables = [code for row in rows for code in re.findall(r"`(drake-quad \w+ [^`]+)`", row)]
    lines = (*fenced, *indented, *in_tables)
    found = [match for line in lines if (match := COMMAND.match(line))]
    return [match.group(1) for match in found]


def name_of(page: Path) -> str:
    """A page by its path in the repository."""
    return page.relative_to(ROOT).as_posix()


ALL_COMMANDS = sorted({(name_of(page), one) for page in PAGES for one in commands(page)})


def parsed(words: list[str]) -> Any:
    """The context of the command as the command line reads it, without doing it."""
    with DRAKE_QUAD.make_context("drake-quad", list(words)) as context:
        name, command, rest = DRAKE_QUAD.resolve_command(context, words)
        return command.make_context(name, rest, parent=context)


@pytest.mark.parametrize(("page", "line"), ALL_COMMANDS)
def test_commands_have_their_options(page: str, line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is read from beginning to end; a run's overrides fit its scenario."""
    monkeypatch.chdir(ROOT)
    context = parsed(shlex.split(line, comments=True))
    if context.command.name == "run" and not str(context.params["scenario"]).endswith(".yaml"):
        load_scenario(context.params["scenario"], context.params["overrides"])


def test_commands_are_found() -> None:
    """The pages that have some are looked through."""
    pages = {"README.md", "docs/robots.md", "docs/sweeps.md", "docs/start/first_climb.md"}
    assert {page for page, _ in ALL_COMMANDS} >= pages
    with pytest.raises(Exception, match="--no-such"):
        parsed(["run", "flat_walk", "--no-such"])


@pytest.mark.parametrize("page", ["README.md", "docs/scenario.md"])
def test_scenarios_can_be_planned(page: str, tmp_path: Path) -> None:
    """What a page says of scenarios, all in one file: it is read, and has a plan."""
    whole: dict[str, Any] = {}
    for block in blocks(ROOT / page, "yaml"):
        whole.update(yaml.safe_load(block))
    (tmp_path / "whole.yaml").write_text(yaml.safe_dump(whole))
    assert prepare(load_scenario(tmp_path / "whole.yaml")).plan.duration > 10.0


def test_the_study_can_be_read(tmp_path: Path) -> None:
    """Its grid has the trials that it seems to have."""
    (text,) = blocks(ROOT / "docs/sweeps.md", "yaml")
    (tmp_path / "study.yaml").write_text(text)
    study, _ = load_study_and_base(tmp_path / "study.yaml")
    assert study.trials == 20 and len(study.vary) == 3


def anchors(page: Path) -> set[str]:
    """Those of a page's headings, as GitHub makes them, and those that it names itself."""
    prose = re.sub(r"```.*?```", "", page.read_text(), flags=re.S)
    headings = re.findall(r"^#+ (.+)$", prose, re.M)
    plain = [re.sub(r"[^\w\- ]", "", heading.strip().lower()) for heading in headings]
    named = re.findall(r'<a (?:id|name)="([^"]+)"', prose)
    return {*(heading.replace(" ", "-") for heading in plain), *named}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page: Path) -> None:
    """To files that are there, and to headings that they have."""
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), target
