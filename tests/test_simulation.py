"""A run: the same to the bit, whole when cut short, and honest about why it ended."""

import itertools
import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from drake_quad.errors import InputError, PlanningError
from drake_quad.scenario import load_scenario
from drake_quad.simulation import RunResult, prepare, run, write_files


def short(overrides: list[str], seconds: float = 3.0) -> RunResult:
    """The first seconds of the level walk."""
    chunks = itertools.count()
    return run(load_scenario("flat_walk", overrides), stop=lambda: next(chunks) >= 4 * seconds - 1)


@pytest.fixture(scope="module")
def first() -> RunResult:
    return short([])


def test_the_same_scenario_gives_the_same_run_to_the_bit(first: RunResult) -> None:
    """Two runs of one scenario have equal logs, every column, every bit."""
    assert short([]).table.equals(first.table)


def test_the_saved_scenario_gives_the_same_run(first: RunResult, tmp_path: Path) -> None:
    """scenario.yaml, as a run leaves it, runs to the same log."""
    write_files(first, load_scenario("flat_walk"), tmp_path)
    chunks = itertools.count()
    again = run(load_scenario(tmp_path / "scenario.yaml"), stop=lambda: next(chunks) >= 11)
    assert again.table.equals(first.table)
    assert pq.read_table(tmp_path / "log.parquet").equals(first.table)
    assert json.loads((tmp_path / "summary.json").read_text())["outcome"] == "stopped"


def test_another_friction_gives_another_run(first: RunResult) -> None:
    """The comparison of logs can tell runs apart."""
    assert not short(["simulation.friction=0.5"]).table.equals(first.table)


def test_a_robot_without_strength_falls_or_stops() -> None:
    """With joints of no stiffness the run ends early, says why, and keeps its log."""
    result = short(["controller.kp=1", "controller.kd=0.1"], seconds=20.0)
    assert result.outcome in ("fell", "stopped") and result.reason != "interrupted"
    assert result.table.num_rows > 10
    assert result.summary["outcome"] == result.outcome


def test_a_swing_on_ice_slips() -> None:
    """Slip is measured: on ice the feet slide, on the floor they do not."""
    slip = short(["simulation.friction=0.02"], seconds=8.0).summary["slip_max"]
    assert slip > 0.001 > short([], seconds=8.0).summary["slip_max"]


def test_stairs_out_of_reach_name_the_rise() -> None:
    """A rise that the legs cannot reach is an input error that names field and value."""
    with pytest.raises(InputError) as caught:
        prepare(load_scenario("case_study", ["course[1].rise=0.6"]), source="mine.yaml")
    assert (caught.value.field, caught.value.value) == ("course[1].rise", 0.6)
    assert "mine.yaml" in str(caught.value) and "short" in str(caught.value)


def test_a_plan_without_margin_is_refused() -> None:
    """At β = 3/4 the margin cannot stay positive with the legs' mass: no plan, and why."""
    with pytest.raises(PlanningError, match="margin"):
        prepare(load_scenario("flat_walk", ["gait.duty_factor=0.75"]))


def test_a_place_that_cannot_be_written_is_an_input_error(first: RunResult, tmp_path: Path) -> None:
    """A file where the directory should be: one error that names --out."""
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--out"):
        write_files(first, load_scenario("flat_walk"), tmp_path / "file" / "run")
