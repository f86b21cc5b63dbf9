"""The command's own part of a sweep, and what befalls trials that says of itself what it was."""

import io
import re
import shlex
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import sweep_rig as rig
from command import drake_quad, refused
from rich.console import Console

from drake_quad.cli.studies import sweep as sweep_command
from drake_quad.errors import InputError
from drake_quad.sweep import run as sweep_run
from drake_quad.sweep.provenance import robots_of
from drake_quad.sweep.run import Bar
from drake_quad.sweep.trials import Trial, guarded


def test_more_processes_than_a_machine_can_bear_are_refused(tmp_path: Path) -> None:
    """Before any is begun, with how many would do."""
    rig.study_file(tmp_path)
    line = refused(drake_quad("sweep", "study.yaml", "--workers", "100000", cwd=tmp_path))
    assert "--workers" in line and "100000" in line and "cores" in line
    assert [path.name for path in tmp_path.iterdir()] == ["study.yaml"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"study": Path("nosuch.yaml")}, "nosuch.yaml.*cannot be read"),
        ({"study": Path("notes")}, "notes.*did you mean scenario"),
        ({"limit": 0}, "--limit.*1 or more"),
        ({"page": Path("page.md")}, "--page.*must have both"),
        ({"page": Path("notes/page.md")}, "--page.*cannot be written to"),
        ({"page": Path("/dev/null")}, "--page.*no file that could be written"),
        ({"out": Path("notes/out")}, "--out.*cannot be written to"),
    ],
)
def test_what_is_refused_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: dict[str, Any], words: str
) -> None:
    """It is refused before any trial, and before a directory is made for them."""
    monkeypatch.chdir(tmp_path)
    rig.study_file(tmp_path)
    (tmp_path / "notes").write_text("scenaro: flat_walk\n")
    (tmp_path / "page.md").write_text("<!-- begin study -->\n")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match=words):
        sweep_command(**{"study": Path("study.yaml"), **given})
    assert {path: path.read_bytes() for path in tmp_path.rglob("*")} == before


def test_a_pages_command_can_be_pasted(tmp_path: Path) -> None:
    """Blanks in the study's name are quoted, and a part of the study is told as one."""
    study = rig.study_file(tmp_path).rename(tmp_path / "my study.yaml")
    text = rig.PLUMBING.replace("trials: 4", "trials: 1").replace("[7.0, 8.0]", "[7.0]")
    study.write_text(text)
    words = ["sweep", "my study.yaml", "--limit", "1"]
    done = drake_quad(*words, "--page", "page.md", "--workers", "1", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = (tmp_path / "page.md").read_text().splitlines()
    assert shlex.join(["drake-quad", *words]) in lines


def test_progress_knows_what_failed_before(tmp_path: Path) -> None:
    """A sweep that goes on counts on from the failures that its journal has, not from none."""
    more: dict[str, Any] = {"work": rig.some_fell, "carry_out": rig.at_once}
    rig.sweep_made_up(tmp_path, tmp_path / "a", limit=4, **more)
    console = Console(file=io.StringIO(), width=200)
    bar = Bar(console)
    rig.sweep_made_up(
        tmp_path, tmp_path / "a", resume=True, begin=bar.begin, note=bar.note, **more
    )  # fmt: skip
    bar.end()
    shown = console.file.getvalue()  # type: ignore[attr-defined]
    counts = re.findall(r"(\d+) of 8 trials, .*?, (\d+) failed", shown)
    assert counts == [("5", "2"), ("6", "2"), ("7", "3"), ("8", "3")]


@pytest.mark.parametrize("said", [
        "std::bad_alloc", "[Errno 12] Cannot allocate memory",
        "cenic.so: failed to map segment from shared object",
    ],
)  # fmt: skip
def test_memory_that_ran_out_is_told_as_such(tmp_path: Path, said: str) -> None:
    """Whoever ran out of it: Drake's C++ and the system raise what they please."""

    def work(_trial: Trial) -> dict[str, Any]:
        raise RuntimeError(said)

    assert guarded(work, rig.trials_of(tmp_path)[0])["outcome"] == "memory"


def test_a_replay_that_cannot_be_kept_costs_no_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is refused as a full disk is, when all that the sweep has found is written."""

    def in_here(trials: Iterable[Trial], **_: Any) -> Iterator[tuple[int, dict[str, Any]]]:
        return rig.at_once(trials, rig.made_up)

    def full(*_: Any) -> None:
        raise InputError(source="a", field="trials", value="a/trials", remedy="disk full")

    monkeypatch.setattr(sweep_run, "run_local", in_here)
    monkeypatch.setattr(sweep_run, "make_replays", full)
    asked = sweep_run.SweepRequest(rig.study_file(tmp_path), tmp_path / "a", 1, replays=1)
    page = tmp_path / "page.md"
    with pytest.raises(InputError, match="disk full"):
        sweep_run.run_sweep(replace(asked, page=page), Console(file=io.StringIO()), lambda: False)
    assert (tmp_path / "a" / "report.html").is_file() and "## study" in page.read_text()


def test_trials_are_ranked_whatever_figures_a_study_keeps(tmp_path: Path) -> None:
    """The worst are those of the least margin, so that is always kept."""
    told = rig.sweep_made_up(tmp_path, tmp_path / "a", rig.PLUMBING + "figures: [slip_max]\n")
    margins = [one["margin"] for one in told["worst"] if one["outcome"] == "fell"]
    assert len(margins) > 1 and margins == sorted(margins) and None not in margins
    assert set(told["figures"]) == {"slip_max", "margin.minimum"}


def test_a_blank_before_an_override_hides_no_robot(tmp_path: Path) -> None:
    """Its file is part of what makes a sweep the same."""
    cases = "- {name: robot, cases: {a: [], b: [' robot.model=other.urdf']}}\n"
    models = Path(__file__).resolve().parents[2] / "models"
    text = (models / "paper_quadruped.urdf").read_text()
    other = tmp_path / "other.urdf"
    other.write_text(text + "<!-- another -->")
    told = cases.replace("other.urdf", str(other))
    assert len(robots_of(*rig.made(tmp_path, rig.PLUMBING + "  " + told))) == 2
