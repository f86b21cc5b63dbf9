"""What is said beside a rate: wherever it stands, and only where it is so."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
import sweep_rig as rig
from matplotlib.figure import Figure
from rich.console import Console

from drake_quad.cli.studies import print_sweep
from drake_quad.sweep.charts import draw_curves, plain_style
from drake_quad.sweep.findings import _band, bins_of, count_skipped
from drake_quad.sweep.report import section, write_sweep_report
from drake_quad.sweep.statistics import KINEMATIC, SHARED, caveats_of
from drake_quad.sweep.study import Vary
from drake_quad.sweep.trials import Trial

NOTHING_DRAWN = """\
scenario: flat_walk
trials: 10
vary: [{path: simulation.friction, values: [0.5, 1.0]}]
"""


def everywhere(told: dict[str, Any], directory: Path, text: str) -> list[str]:
    """The findings on the console, in the report, and as a section; whitespace is as it comes."""
    printed = io.StringIO()
    print_sweep(told, directory / "out", Console(file=printed, width=10_000))
    write_sweep_report(rig.made(directory, text)[0], told, directory / "out")
    page = (directory / "out" / "report.html").read_text()
    return [printed.getvalue(), page, section(told, "drake-quad sweep study.yaml", "study")]


def kinematic(trial: Trial) -> dict[str, Any]:
    """Succeeds without physics."""
    return {**rig.result(trial), "mode": "kinematic"}


def alike(trial: Trial) -> dict[str, Any]:
    """What comes of its cell, whatever its seed is."""
    return {**rig.result(trial), "figures": dict.fromkeys(trial.figures, trial.values[0])}


def test_every_caveat_stands_wherever_the_rate_does(tmp_path: Path) -> None:
    """Without physics, of common draws, of part of a study, with a gate: told in all three."""
    text = rig.PLUMBING + "draws: common\ngate: {rate: 0.5, each: gait.cycle_time}\n"
    told = rig.sweep_made_up(tmp_path, tmp_path / "out", text, work=kinematic, limit=6)
    lines = ["6 of the 8 trials of the study are done.", KINEMATIC, SHARED]
    assert caveats_of(told) == lines
    asked = "gate of at least 50 % of each gait.cycle_time: passed so far"
    for shown in everywhere(told, tmp_path, text):
        for line in (*lines, asked):
            assert shown.count(line) == 1


def test_of_a_whole_study_with_physics_there_is_none(tmp_path: Path) -> None:
    """Its rate says what was found."""
    told = rig.sweep_made_up(tmp_path, tmp_path / "out")
    assert caveats_of(told) == []


@pytest.mark.parametrize(
    ("done", "missing"), [([], 0), ([0, 1, 2], 0), ([2, 0, 1], 0), ([0, 3, 5], 3), ([4], 4)]
)
def test_trials_under_way_at_the_end_are_counted(done: list[int], missing: int) -> None:
    """`--limit` leaves none behind: its trials are a smaller study. A stop leaves the longest."""
    assert count_skipped(pa.table({"index": pa.array(done, type=pa.int64())})) == missing


def test_trials_that_were_given_up_are_told(tmp_path: Path) -> None:
    """Those that end early are over-represented where later trials are done before them."""

    def out_of_order(trials: Any, work: Any) -> Any:
        return (
            (index, result) for index, result in rig.at_once(trials, work) if index not in (1, 2)
        )

    told = rig.sweep_made_up(tmp_path, tmp_path / "out", carry_out=out_of_order)
    for shown in everywhere(told, tmp_path, rig.PLUMBING):
        assert shown.count("2 trials that began earlier are not done") == 1


def test_a_trial_over_again_is_no_evidence(tmp_path: Path) -> None:
    """Of 20 trials in two cells, of nothing random, 18 are others over again: it is told."""
    told = rig.sweep_made_up(tmp_path, tmp_path / "out", NOTHING_DRAWN, work=alike)
    assert told["repeats"] == 18
    for shown in everywhere(told, tmp_path, NOTHING_DRAWN):
        assert shown.count("18 trials ended exactly as another of the same cell") == 1


def test_trials_that_differ_are_evidence(tmp_path: Path) -> None:
    """By a figure, where the seed is read; and in any way, where something is drawn."""
    told = rig.sweep_made_up(tmp_path, tmp_path / "out", NOTHING_DRAWN, work=rig.result)
    assert told["repeats"] == 0
    told = rig.sweep_made_up(tmp_path, tmp_path / "drawn", work=alike)
    assert told["repeats"] == 0


def test_trials_that_were_ended_repeat_no_other(tmp_path: Path) -> None:
    """Three that ran out of time are alike, and say nothing of what is random in the others."""

    def some_too_long(trial: Trial) -> dict[str, Any]:
        if trial.index < 6:
            return rig.result(trial)
        gone = dict.fromkeys(trial.figures)
        return {**rig.result(trial, "timeout", "not done"), "figures": gone, "mode": None}

    told = rig.sweep_made_up(tmp_path, tmp_path / "out", NOTHING_DRAWN, work=some_too_long)
    assert told["repeats"] == 0


def test_a_cell_in_which_two_differ_has_no_repeats(tmp_path: Path) -> None:
    """The seed is read there: two that came out the same did so by chance."""

    def one_cell(trial: Trial) -> dict[str, Any]:
        return rig.result(trial) if trial.index == 1 else alike(trial)

    told = rig.sweep_made_up(tmp_path, tmp_path / "out", NOTHING_DRAWN, work=one_cell)
    assert told["repeats"] == 9


def test_a_band_that_was_not_tried_keeps_nothing(tmp_path: Path) -> None:
    """Four draws of three numbers leave one of them out; what was asked of each is missed."""
    text = (
        "scenario: flat_walk\ntrials: 3\ngate: {rate: 1.0, each: simulation.friction}\nvary:\n"
        "  - {path: simulation.friction, choice: [0.4, 0.5, 0.6, 0.7]}\n"
    )
    told = rig.sweep_made_up(tmp_path, tmp_path / "out", text, work=rig.result)
    (untried, *_) = told["gate_untried"]
    assert told["rate"]["good"] == told["rate"]["trials"] == 3 and told["passed"] is False
    for shown in everywhere(told, tmp_path, text):
        assert f"missed; no trial of {untried}" in shown
    part = rig.sweep_made_up(tmp_path, tmp_path / "part", text, work=rig.result, limit=1)
    assert part["passed"] is True and part["gate_untried"] == []


def test_the_command_below_the_causes_says_whose_it_is(tmp_path: Path) -> None:
    """The commonest cause is the first of the list; the worst trial may be of another."""

    def mostly_without_a_plan(trial: Trial) -> dict[str, Any]:
        if trial.index == 5:
            return rig.result(trial, "fell", "the trunk is tilted by 40°")
        gone = dict.fromkeys(trial.figures)
        return {**rig.result(trial, "infeasible", "no plan"), "figures": gone}

    told = rig.sweep_made_up(tmp_path, tmp_path / "out", work=mostly_without_a_plan)
    written = section(told, "drake-quad sweep study.yaml", "study")
    listed = written[written.index("Causes of failure") :]
    assert listed.index("7 × infeasible") < listed.index("1 × fell")
    assert "To run the worst of them again at that commit, trial 5 (fell):" in listed


def drawn(vary: Vary, values: list[float]) -> Figure:
    """The curve over what varies so."""
    bands = [_band(band) for band in bins_of(vary, values, [True] * len(values))]
    with plain_style():
        return draw_curves({vary.path: bands})


def places(figure: Figure) -> np.ndarray:
    """Where the dots are."""
    (ax,) = figure.axes
    return np.sort([float(c.lines[0].get_xdata()[0]) for c in ax.containers])


def test_a_rate_stands_where_its_trials_are() -> None:
    """Half of the outer fifth of a normal distribution is within 1.28 deviations, not 2.4."""
    deviates = np.sort(np.random.default_rng(0).normal(size=999)).clip(-3.9, 3.9)
    at = places(drawn(Vary(path="offset", normal=[0.0, 1.0]), list(map(float, deviates))))
    assert at == pytest.approx([-1.28, -0.52, 0.0, 0.52, 1.28], abs=0.1)


def test_a_draw_by_its_logarithm_has_a_logarithmic_axis() -> None:
    """All that fails may lie in its first hundredth; bands' bars end where they do."""
    vary = Vary(path="friction", log_uniform=[0.01, 1.25], bands=4)
    figure = drawn(vary, [0.02, 0.06, 0.2, 0.7])
    (ax,) = figure.axes
    assert ax.get_xscale() == "log" and places(figure) == pytest.approx([0.02, 0.06, 0.2, 0.7])
    (bar,) = ax.containers[0].lines[2][0].get_segments()
    assert bar[:, 0] == pytest.approx([0.01, 0.01 * 125**0.25])


def test_words_are_not_joined() -> None:
    """Between two robots there is none."""
    figure = drawn(Vary(path="robot", values=["b1", "b2"]), ["b1", "b2"])  # type: ignore[list-item]
    (ax,) = figure.axes
    assert len(ax.containers) == 2 and all(len(line.get_xdata()) == 1 for line in ax.lines)
