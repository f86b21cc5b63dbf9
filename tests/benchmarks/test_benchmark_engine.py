"""What the benchmarks' trials leave: journals to go on from, and only of what is the same."""

import importlib
import json
import os
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks.study import finding
from drake_quad.sweep.journal import DAMAGED
from drake_quad.sweep.trials import Trial

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
STUDY = """\
scenario: flat_walk
draws: common
limits: {wall_time: 0.8}
vary:
  - {path: simulation.plant.discrete_contact_approximation, values: [lagged, similar]}
  - {path: simulation.friction, uniform: [0.5, 1.25]}
"""

Main = Callable[..., None]


# What stands in for runs; at the module's top, so that a spawned process finds it.
def made_up(trial: Trial) -> dict[str, Any]:
    margin = 0.05 + 0.001 * trial.index
    figures = {"margin": margin, "margin_at_once": margin}
    return finding(trial, {"outcome": "goal_reached", "reason": "", **figures})


def endless_under_cenic(trial: Trial) -> dict[str, Any]:
    if trial.values[2] == "CENIC":
        time.sleep(1000.0)
    return made_up(trial)


def edit(trial: Trial) -> dict[str, Any]:
    if trial.index == 1:
        path = Path(os.environ["BENCHMARK_TEST_EDIT"])
        lines = path.parents[1] / "c.jsonl"
        while len(lines.read_text().splitlines()) < 2:  # the trial before is not told of yet
            time.sleep(0.02)
        path.write_text("# edited meanwhile\n")
    return made_up(trial)


@pytest.fixture
def check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Main:
    """The command, with `made_up` or another in place of runs."""
    module = importlib.import_module("benchmarks.cross_check")
    (tmp_path / "study.yaml").write_text(STUDY)

    def main(*words: str, work: Any = made_up, engines: str = "lagged CENIC") -> None:
        monkeypatch.setattr(module, "work", work)
        files = ["--study", str(tmp_path / "study.yaml"), "--lines", str(tmp_path / "c.jsonl")]
        module.main([*files, "--engines", *engines.split(), *words])

    return main


@pytest.fixture
def copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The sources of the benchmarks that count, for once a copy."""
    shutil.copytree(BENCHMARKS, tmp_path / "copy", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(importlib.import_module("benchmarks.engine"), "BENCHMARKS",
                        tmp_path / "copy")  # fmt: skip
    yield tmp_path / "copy"


def records(directory: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (directory / "c.jsonl").read_text().splitlines()[1:]]


def test_a_trial_that_hangs_is_ended_and_counted(
    check: Main, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """After its study's wall time; the other engine's trials are as they are without it."""
    check("--trials", "2", work=endless_under_cenic)
    written = capsys.readouterr().out
    assert "| lagged | 2 of 2: 100.0 %" in written and "| CENIC | 0 of 2: 0.0 %" in written
    assert written.count("| timeout |") == 2 and "| 0.052 | timeout |" in written
    assert [one["outcome"] for one in records(tmp_path)] == ["goal_reached", "timeout"] * 2
    assert "not done after 0.8 s" in records(tmp_path)[1]["reason"]


def test_a_spoilt_line_costs_its_own_trial_alone(
    check: Main, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The lines after it stay, it is done again, and more trials of the same study are added."""
    lines = tmp_path / "c.jsonl"
    check("--trials", "2")
    before, text = records(tmp_path), lines.read_text().splitlines()
    text[2] = text[2][: len(text[2]) // 2]
    lines.write_text("\n".join(text) + "\n" + '{"index": 4, "outc')
    capsys.readouterr()
    check("--trials", "3", "--resume")
    told = capsys.readouterr()
    after = records(tmp_path)
    assert sorted(one["index"] for one in after) == list(range(6))
    assert [one for one in after if one["index"] < 4 and one["index"] != 1] == [
        one for one in before if one["index"] != 1
    ]
    assert "The same 3 trials" in told.out
    done_again = [line for line in told.err.splitlines() if "trials, " in line]
    assert len(done_again) == 3 and done_again[0].startswith("4 of 6 trials")
    assert lines.with_suffix(DAMAGED).exists()


def test_records_of_anything_else_are_refused(
    check: Main, copied: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An edit in any engine's file, in drake_quad, another library, another option; all stays."""
    pytest.importorskip("mujoco")
    engine = importlib.import_module("benchmarks.engine")
    engines = "lagged MuJoCo"
    check("--trials", "1", engines=engines)
    kept = (tmp_path / "c.jsonl").read_bytes()

    def refused(match: str, engines: str = engines, resume: str = "--resume") -> None:
        with pytest.raises(SystemExit, match=match):
            check("--trials", "1", *resume.split(), engines=engines)
        assert (tmp_path / "c.jsonl").read_bytes() == kept

    for name in ("cenic", "mujoco_robot", "mujoco_drive", "mujoco_model", "cross_trials"):
        path = copied / f"{name}.py"
        text = path.read_text()
        path.write_text(text + "# edited\n")
        refused(r"c\.jsonl.*of other benchmarks")
        path.write_text(text)
    with monkeypatch.context() as patch:
        patch.setattr(engine.provenance, "sources_digest", lambda: "another")
        refused("of other sources of drake_quad")
    true = engine.version
    for other in ("mujoco", "drake"):
        with monkeypatch.context() as patch:
            patch.setattr(engine, "version", lambda n, o=other: "9" if n == o else true(n))
            refused("of other versions of the libraries")
    refused("of other options", engines="lagged")
    refused("go on with it by --resume", resume="")
    (tmp_path / "study.yaml").write_text(STUDY.replace("1.25", "1.5"))
    refused("of another study")


def test_a_change_while_a_study_runs_ends_it(
    check: Main, copied: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was done before is kept, and gone on with once the sources are as they were."""
    edited = copied / "cenic.py"
    text = edited.read_text()
    monkeypatch.setenv("BENCHMARK_TEST_EDIT", str(edited))
    with pytest.raises(SystemExit, match="changed while the study ran"):
        check("--trials", "1", work=edit)
    assert [one["index"] for one in records(tmp_path)] == [0]
    edited.write_text(text)
    check("--trials", "1", "--resume")
    assert [one["index"] for one in records(tmp_path)] == [0, 1]


def test_the_section_names_the_version_of_mujoco_where_it_was_used(load: Any) -> None:
    """And not elsewhere."""
    pytest.importorskip("mujoco")
    check = load("cross_check")
    version = importlib.import_module("importlib.metadata").version("mujoco")
    assert f"mujoco {version}" in check.section([], ["lagged", "MuJoCo"], [])
    assert "mujoco 4" not in check.section([], ["lagged", "CENIC"], [])
    assert "mujoco" in load("engine").basis(check.libraries_of(["MuJoCo"]))["versions"]
    assert "mujoco" not in load("engine").basis(check.libraries_of(["sap"]))["versions"]


def test_a_directory_is_no_file_of_records(check: Main, tmp_path: Path) -> None:
    """One line says so, before any trial."""
    with pytest.raises(SystemExit, match=r"--lines.*is a directory"):
        check("--lines", str(tmp_path))
