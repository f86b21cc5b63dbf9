"""A trial of a sweep's table can be run again, by its command or for its replay: it is the same."""

import json
import shlex
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
import sweep_rig as rig
from command import drake_quad

from drake_quad.sweep.trials import figure_at

# The figures depend on all that is drawn. The first trial cannot be planned, and has no run.
STUDY = """\
scenario: flat_walk
set:
  - simulation.mode=kinematic
  - "mission=[{kind: stand, duration: 0.4}]"
vary:
  - {path: "mission[0].duration", name: how long, uniform: [0.3, 0.5]}
  - {path: gait.stance_width, uniform: [0.5, 0.56]}
  - {name: body, cases: {too high: [gait.body_height=1.3], "it's low": [gait.body_height=0.83]}}
figures: [seed, simulated_time, samples, margin.minimum, margin.median, position_ratio_max]
"""

Swept = tuple[Path, dict[str, Any], str]


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Swept:
    """By the command, with replays: where, the row that had a run, and what was told on the way."""
    directory = tmp_path_factory.mktemp("swept")
    rig.study_file(directory, STUDY)
    options = ("--out", "a", "--workers", "1", "--replays", "2", "--json")
    done = drake_quad("sweep", "study.yaml", *options, cwd=directory)
    assert done.returncode == 0, done.stderr
    failed, row = pq.read_table(directory / "a" / "trials.parquet").to_pylist()
    assert failed["outcome"] == "refused" and json.loads(row["vary.body"]) == "it's low"
    return directory, row, done.stderr


def same(row: dict[str, Any], directory: Path) -> None:
    """The run's outcome, figures and scenario are the table's, to the bit."""
    summary = json.loads((directory / "summary.json").read_text())
    assert (summary["outcome"], summary["reason"]) == (row["outcome"], row["reason"])
    figures = {name: value for name, value in row.items() if name.startswith("figure.")}
    assert len(figures) == 6 and None not in figures.values()
    assert figures == {name: figure_at(summary, name[len("figure.") :]) for name in figures}
    assert (directory / "scenario.yaml").read_text() == row["scenario"]


def test_a_tables_command_runs_that_very_trial_again(swept: Swept) -> None:
    """Pasted where the sweep began: outcome, figures and scenario are the table's, to the bit."""
    directory, row, _ = swept
    program, *words = shlex.split(row["command"])
    assert program == "drake-quad"
    done = drake_quad(*words, "--out", "again", "--no-report", cwd=directory)
    assert done.returncode == 0, done.stderr
    same(row, directory / "again")


def test_replays_can_be_asked_for_with_the_sweep(swept: Swept) -> None:
    """They are those very trials, linked to; that fewer than asked for had a run is told."""
    directory, row, told = swept
    assert "--replays 2: 1 made, 0 were there before; no other finished trial had a run" in told
    assert sorted(path.name for path in (directory / "a" / "trials").iterdir()) == ["000001"]
    page = (directory / "a" / "report.html").read_text()
    assert page.count('href="trials/000001/report.html"') == 1
    assert (directory / "a" / "trials" / "000001" / "report.html").stat().st_size > 100_000
    same(row, directory / "a" / "trials" / "000001")
