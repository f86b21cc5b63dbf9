"""Runs that are spoilt and can be read all the same: one clear line."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from command import drake_quad, refused
from report_run import draw_only, make_log, short_scenario, write_run
from spoilt_rig import NESTED, change_json, filled, line_of

from drake_quad.cli.runs import print_summary, report
from drake_quad.errors import InputError
from drake_quad.report.page import write_report
from drake_quad.runs import run_log
from drake_quad.runs.read_summary import read_summary
from drake_quad.runs.reader import load_run


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    log = make_log(short_scenario(), seconds=0.2)
    return write_run(tmp_path_factory.mktemp("run"), log=log, versions={"drake": "1"})


@pytest.fixture
def ran(walked: Path, tmp_path: Path) -> Path:
    """A run's directory, to be spoilt."""
    shutil.copytree(walked, tmp_path / "run")
    return tmp_path / "run"


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        ("simulated_time", "x", ("simulated_time = 'x'", "a number")),
        ("slip_max", [1], ("slip_max = [1]", "a number")),
        ("torque_ratio_max", True, ("torque_ratio_max = True", "a number")),
        ("safety", {"safe": 1.0}, ("safety.safe = 1.0", "true or false")),
        ("margin", "x", ("margin = 'x'", "a mapping")),
        ("margin.minimum", "x", ("margin.minimum = 'x'", "a number")),
        ("margin_friction", [1], ("margin_friction = [1]", "a mapping")),
        ("outcome", 5, ("outcome = 5", "text")),
        ("margin_kind", {}, ("margin_kind = {}", "text")),
    ],
)
def test_a_spoilt_figure_of_a_run_is_named(
    ran: Path, place: str, value: Any, words: tuple[str, ...]
) -> None:
    """By file, field and value; before anything is printed or written."""
    change_json(ran / "summary.json", place, value)
    with pytest.raises(InputError) as caught:
        read_summary(ran)
    line_of(caught.value, str(ran / "summary.json"), *words)


def test_a_run_that_measured_nothing_is_printed(
    ran: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Figures that are null or not there are no fault: a run of no sample has none."""
    change_json(ran / "summary.json", "slip_max", None)
    change_json(ran / "summary.json", "margin.minimum", None)
    print_summary(read_summary(ran), ran, report=False)
    assert "goal_reached" in capsys.readouterr().out


def test_the_report_of_a_spoilt_run_ends_with_status_2(ran: Path) -> None:
    """In one line, without a traceback, and without a page."""
    change_json(ran / "summary.json", "simulated_time", "x")
    line = refused(drake_quad("report", "run", cwd=ran.parent))
    assert "run/summary.json: simulated_time = 'x': must be a number" in line
    assert not (ran / "report.html").exists()


@pytest.mark.parametrize(
    "text", [NESTED, "[]", '{"outcome": "\\ud800"}', f'{{"outcome": "fell", "a": 1{"0" * 400}}}']
)
def test_a_summary_that_nothing_can_be_made_of(ran: Path, text: str) -> None:
    """The commands refuse it; a report of the rest of the run's files says so in a notice."""
    (ran / "summary.json").write_text(text)
    with pytest.raises(InputError) as caught:
        read_summary(ran)
    line_of(caught.value, "summary.json", "in JSON")
    run = load_run(ran)
    assert run.summary == {} and any("summary.json" in notice for notice in run.notices)


def test_a_pipe_in_the_scenarios_place_is_told_of(ran: Path) -> None:
    """It is not waited for, and nobody is told that nothing is there."""
    (ran / "scenario.yaml").unlink()
    os.mkfifo(ran / "scenario.yaml")
    line = refused(drake_quad("report", "run", cwd=ran.parent))
    assert "scenario.yaml" in line and "it is a pipe" in line and "holds no" not in line
    (ran / "scenario.yaml").unlink()
    line = refused(drake_quad("report", "run", cwd=ran.parent))
    assert "holds no scenario.yaml" in line


@pytest.mark.parametrize("name", ["t", "margin"])
def test_a_log_of_no_numbers_is_refused(ran: Path, name: str) -> None:
    """Text, or gaps, where a run has its time and its margin; the column is named."""
    table = pq.read_table(ran / "log.parquet")
    for values in (["x"] * len(table), [None] * (len(table) - 1) + [0.1]):
        pq.write_table(filled(name, values)(table), ran / "log.parquet")
        with pytest.raises(InputError) as caught:
            read_summary(ran)
        line_of(caught.value, str(ran / "log.parquet"), f"{name} = ", "numbers")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t - 5.0, ("t = -5", "from 0")),
        (lambda t: t * 1e12, ("t = ", "from 0 to 10000 s")),
        (lambda t: np.where(t > t[5], np.inf, t), ("t = inf", "finite")),
        (lambda t: np.full(len(t), np.nan), ("t = nan", "finite")),
        (lambda t: t[::-1], ("t = ", "before the sample before it")),
        (lambda t: np.where(t > t[5], t + 9000.0, t), ("t = 9000", "of the sample before it")),
    ],
)
def test_times_that_are_none_are_named(
    ran: Path, change: Callable[[Any], Any], words: tuple[str, ...]
) -> None:
    """Before a picture is drawn of each: no memory is asked for as many as 1e12 s would have."""
    path = ran / "log.parquet"
    table = pq.read_table(path)
    pq.write_table(filled("t", change(table["t"].to_numpy()))(table), path)
    with pytest.raises(InputError) as caught:
        load_run(ran)
    line_of(caught.value, str(path), *words)


def test_figures_that_nothing_measured_are_left_out(
    ran: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Infinite ones and those beyond all bounds: the report is made of the rest, and says so."""
    path = ran / "log.parquet"
    table = pq.read_table(path)
    rows, spoilt = len(table), table
    for name, value in (("margin", np.inf), ("com_x", 1e300), ("FL_position_z", -np.inf)):
        spoilt = filled(name, np.full(rows, value))(spoilt)
    pq.write_table(spoilt, path)
    run = load_run(ran)
    assert np.all(np.isnan(run.log.number("margin"))) and np.all(np.isfinite(run.log.t))
    told = [notice for notice in run.notices if "left out" in notice]
    assert len(told) == 1 and f"{3 * rows} values in column " in told[0]
    assert "and 2 others that are beyond 1e+09" in told[0]
    draw_only(monkeypatch, "margin", "side")  # which are of what is left out
    assert "and 2 others that are beyond 1e+09" in write_report(ran, replay=False).read_text()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (lambda n: pa.array([f"word {k}" for k in range(n)]), "different words"),
        (lambda n: pa.array([[1.0]] * n), "must be a column of numbers or of words"),
    ],
)
def test_a_column_of_what_no_run_logs_is_refused(
    ran: Path, values: Callable[[int], pa.Array], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More words than a mission has names, or lists: Python would hold each as an object."""
    monkeypatch.setattr(run_log, "MOST_WORDS", 10)
    path = ran / "log.parquet"
    table = pq.read_table(path)
    pq.write_table(table.append_column("remark", values(len(table))), path)
    with pytest.raises(InputError) as caught:
        load_run(ran)
    line_of(caught.value, str(path), "remark", words)


def test_words_of_a_log_are_kept_once(ran: Path) -> None:
    """Plain strings, a million alike, are one object, as those are that a dictionary holds."""
    path = ran / "log.parquet"
    table = pq.read_table(path)
    names = pa.array(["ab" * 50 for _ in range(len(table))])
    pq.write_table(table.append_column("remark", names), path, use_dictionary=False)
    assert len({id(word) for word in load_run(ran).log.columns["remark"]}) == 1


def test_a_report_of_spoilt_times_ends_with_status_2(ran: Path) -> None:
    """In one line, without a traceback."""
    table = pq.read_table(ran / "log.parquet")
    spoilt = filled("t", np.linspace(0.0, 1e12, len(table)))(table)
    pq.write_table(spoilt, ran / "log.parquet")
    line = refused(drake_quad("report", "run", cwd=ran.parent))
    assert "log.parquet: t = " in line and "10000 s" in line


def test_what_of_a_log_cannot_be_used_is_told_on_the_console(
    ran: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`report` makes its page all the same, and says what is not in it."""
    table = pq.read_table(ran / "log.parquet")
    place = table.column_names.index("margin")
    endless = pa.array(np.full(len(table), np.inf))
    pq.write_table(table.set_column(place, "margin", endless), ran / "log.parquet")
    draw_only(monkeypatch, "margin")
    report(ran)
    told = capsys.readouterr().err
    assert "note: log.parquet has" in told and "margin" in told
    assert (ran / "report.html").is_file()


def test_a_log_of_one_instant_has_a_report(ran: Path) -> None:
    """All of its rows at the same time: a page, and no words of the library that draws."""
    table = pq.read_table(ran / "log.parquet")
    place = table.column_names.index("t")
    table = table.set_column(place, "t", pa.array(np.zeros(len(table))))
    pq.write_table(table, ran / "log.parquet")
    (ran / "report.html").unlink(missing_ok=True)
    done = drake_quad("report", str(ran), cwd=ran)
    assert done.returncode == 0 and "Warning" not in done.stderr
    assert (ran / "report.html").stat().st_size > 0
