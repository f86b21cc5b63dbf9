"""`drake-quad chart`: the same whatever the number of processes, and files that are whole."""

import copy
import io
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from chart_rig import made_up, made_up_slowly
from command import drake_quad, refused
from design_rig import asked
from hypothesis import given, strategies as st
from rich.console import Console
from rig import URL

from drake_quad.cli.robots import print_chart, write_chart
from drake_quad.errors import InputError
from drake_quad.feasibility import chart as chart_stairs_module
from drake_quad.feasibility.chart import (
    Judge,
    Span,
    StairChart,
    chart_grid,
    grid_of,
    judge_cell,
)
from drake_quad.feasibility.chart_picture import LETTERS, draw_chart, save_chart
from drake_quad.feasibility.check_report import LIMITS
from drake_quad.terrain.elements import Stairs

RISES, RUNS = Span(0.05, 0.25, 0.05), Span(0.25, 0.45, 0.1)


def chart(workers: int, judge: Judge = made_up, **more: Any) -> StairChart:
    return chart_grid(URL, RISES, RUNS, count=4, workers=workers, judge=judge, **more)


def test_one_and_two_workers_give_the_same() -> None:
    """All cells, in the grid's order, however they were shared out."""
    one, two = chart(1), chart(2)
    assert one == two and one.complete
    assert [(c.rise, c.run) for c in one.cells] == grid_of(RISES, RUNS, 4)


@pytest.mark.parametrize("workers", [1, 2])
def test_what_was_done_is_there_when_it_is_stopped(workers: int, tmp_path: Path) -> None:
    """A stop after three cells leaves at least those, says so, and can be drawn."""
    seen = 0

    def note(done: int, _total: int) -> None:
        nonlocal seen
        seen = done

    told = chart(workers, made_up_slowly, progress=note, stop=lambda: seen >= 3)
    cells = told.cells
    assert 3 <= len(cells) < 15 and not told.complete
    assert all(c in chart(1).cells for c in cells)
    write_chart(told.as_dict(), tmp_path)
    assert json.loads((tmp_path / "chart.json").read_text())["complete"] is False


def test_files_are_the_same_each_time(tmp_path: Path) -> None:
    """Bit by bit; each cell's margin, or the letter of its limit, is in the picture."""
    told = chart(1)
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_chart(told.as_dict(), tmp_path / name)
        save_chart(told, tmp_path / name)
    for file in ("chart.json", "chart.svg", "chart.png"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    (ax, _scale) = draw_chart(told).axes
    texts = [t.get_text() for t in ax.texts]
    for cell in told.cells:
        shown = LETTERS[cell.limit] if cell.margin is None else f"{1e3 * cell.margin:.0f}"
        assert shown in texts
        texts.remove(shown)
    assert any(t.startswith("IBC") for t in texts)


def test_every_limit_has_a_letter_of_its_own() -> None:
    """No two limits look alike."""
    assert set(LETTERS) == set(LIMITS) and len(set(LETTERS.values())) == len(LETTERS)


def test_charts_without_a_cell_that_works_or_of_one_cell_are_drawn() -> None:
    """No margins to colour, or no neighbour to take a size from: a picture all the same."""
    for rises, runs in ((Span(0.2, 0.25, 0.05), Span(0.25, 0.25, 0.1)),
                        (Span(0.1, 0.1, 0.1), Span(0.4, 0.4, 0.1))):  # fmt: skip
        told = chart_grid(URL, rises, runs, count=4, workers=1, judge=made_up)
        assert draw_chart(told).axes


@pytest.mark.long
def test_a_cell_is_what_check_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    """The margin of a plan in full; a limit where there is none, as of treads like ladders'."""
    monkeypatch.setattr(chart_stairs_module, "check_flight", asked)
    for rise, run in ((0.12, 0.32), (0.1, 2.0)):
        designed = asked(URL, Stairs(rise, run, 2)).designed
        works = judge_cell(URL, 2, rise, run)
        assert designed is not None and works.margin == designed.margin > 0.0
        assert works.limit == ""
    assert judge_cell(URL, 2, 0.12, 0.05).limit in LIMITS


def test_a_cycle_over_places_is_told_in_treads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three places a cycle, two to a tread, are one and a half treads."""
    found = copy.deepcopy(asked(URL, Stairs(0.12, 0.32, 2)))
    assert found.designed is not None
    found.designed.scenario.gait.treads, found.designed.scenario.gait.places_per_tread = 3, 2
    monkeypatch.setattr(chart_stairs_module, "check_flight", lambda *_, **__: found)
    assert judge_cell(URL, 2, 0.12, 0.32).treads == 1.5


@given(
    st.floats(0.01, 0.5), st.integers(1, 30), st.floats(0.005, 0.1), st.floats(0.0, 0.9)
)  # fmt: skip
def test_spans_count_both_ends(first: float, count: int, step: float, beyond: float) -> None:
    """From the first, a step apart, never beyond the last."""
    last = first + (count - 1 + beyond) * step
    values = Span(first, last, step).values("run")
    assert len(values) == count and values[0] == pytest.approx(first, abs=1e-4)
    assert values[-1] <= last + 1e-4


@pytest.mark.parametrize(
    ("rises", "runs", "workers", "named"),
    [
        (Span(-0.1, 0.2, 0.1), RUNS, 1, "--rise-from: rise-from = -0.1"),
        (Span(0.2, 0.1, 0.1), RUNS, 1, "--rise-to: rise-to = 0.1"),
        (RISES, Span(0.2, float("nan"), 0.1), 1, "--run-to: run-to = nan"),
        (RISES, Span(0.2, 0.4, 0.0), 1, "--run-step: run-step = 0.0"),
        (RISES, Span(0.2, 0.4, 1e-7), 1, "--run-step"),
        (Span(0.1, 9.0, 0.1), RUNS, 1, "--rise-to: rise-to = 9.0"),
        (RISES, RUNS, 0, "--workers: workers = 0"),
    ],
)
def test_a_grid_that_is_none_is_refused(rises: Span, runs: Span, workers: int, named: str) -> None:
    """Before any long work, with option and value."""
    with pytest.raises(InputError, match=re.escape(named)):
        chart_grid(URL, rises, runs, count=4, workers=workers, judge=made_up)


def test_command_writes_its_files_and_one_object(tmp_path: Path) -> None:
    """A chart of one cell, as JSON on stdout and in the directory."""
    spans = ("--rise-from", "0.12", "--rise-to", "0.12", "--run-from", "0.32", "--run-to", "0.32")
    done = drake_quad(
        "chart", URL, *spans, "--count", "2", "--workers", "1", "--out", "c", "--json", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    (cell,) = told["cells"]
    assert cell["margin"] > 0.0
    assert {p.name for p in (tmp_path / "c").iterdir()} == {"chart.json", "chart.svg", "chart.png"}
    line = refused(drake_quad("chart", URL, "--count", "0", cwd=tmp_path))
    assert "--count" in line


def test_where_none_is_climbed_the_console_says_what_is_in_the_way() -> None:
    """Of the lowest flight on the first run; where some are climbed nobody asks."""
    console = Console(record=True, width=120, file=io.StringIO())
    cells = [replace(c, margin=None, limit="plan", reason="too shallow") for c in chart(1).cells]
    told = replace(chart(1), cells=cells).as_dict()
    print_chart(told, Path("c"), console)
    assert "of 0.05 m on 0.25 m: too shallow" in console.export_text()
    told["cells"][3]["margin"] = 0.05
    print_chart(told, Path("c"), console)
    assert "too shallow" not in console.export_text()


def test_that_kernels_are_compiled_first_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A person who waits for them knows what for."""
    told: list[object] = []

    @contextmanager
    def precompiling(_: object, tell: Any) -> Iterator[Any]:
        tell("compiling")
        yield lambda: None

    monkeypatch.setattr(chart_stairs_module, "precompiling", precompiling)
    chart(1, tell=told.append)
    assert told == ["compiling"]
