"""What is told of a table whose every cell, band and order is known beforehand."""

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
import sweep_rig as rig
from rich.console import Console
from scipy.stats import beta

from drake_quad.cli.studies import print_sweep
from drake_quad.sweep.findings import _clock, summarize_sweep, worst_first
from drake_quad.sweep.report import replayable
from drake_quad.sweep.results import clock_table, read_table
from drake_quad.sweep.study import Gate, Study, Vary
from drake_quad.sweep.trials import Trial

# Friction, rise, factor of mass, what came of it, least margin; the row's number is its index.
ROWS = [
    (0.1, 0.12, 0.91, "fell", 0.03),
    (0.2, 0.12, 0.92, "goal_reached", 0.06),
    (0.3, 0.12, 0.99, "goal_reached", 0.04),
    (0.1, 0.15, 1.01, "infeasible", None),
    (0.2, 0.15, 1.02, "fell", -0.01),
    (0.3, 0.15, 1.03, "goal_reached", 0.05),
    (0.1, 0.12, 1.04, "goal_reached", None),
    (0.3, 0.12, 1.05, "goal_reached", 0.02),
    (0.3, 0.15, 1.06, "refused", None),
    (0.3, 0.15, 1.07, "stopped", 0.01),
]
STUDY = Study(
    scenario="flat_walk",
    vary=[
        Vary(path="friction", values=[0.3, 0.1, 0.2]),
        Vary(path="rise", values=[0.12, 0.15]),
        Vary(path="mass", uniform=[0.9, 1.1], bands=2),
    ],
    trials=2,
)


def table() -> pa.Table:
    columns = list(zip(*ROWS, strict=True))
    return pa.table(
        {
            "index": range(len(ROWS)),
            "success": [outcome == "goal_reached" for outcome in columns[3]],
            "outcome": columns[3],
            "reason": ["" for _ in ROWS],
            "mode": ["physics" for _ in ROWS],
            "command": [f"again {k}" for k in range(len(ROWS))],
            "vary.friction": columns[0],
            "vary.rise": columns[1],
            "vary.mass": columns[2],
            "figure.margin.minimum": columns[4],
        }
    )


def told(study: Study = STUDY) -> dict[str, Any]:
    return summarize_sweep(study, table(), clock_table({}))


def test_the_worst_come_first() -> None:
    """Failures before successes, the least margin of each first, and those without one after."""
    order = [4, 9, 0, 3, 8, 7, 2, 5, 1, 6]
    assert worst_first(table()) == order
    worst = told()["worst"]
    assert [row["index"] for row in worst] == order
    assert [row["margin"] for row in worst] == [ROWS[k][4] for k in order]
    assert worst[0]["cell"] == "friction 0.2, rise 0.15"
    assert all(row["command"] == f"again {row['index']}" for row in worst)


@pytest.mark.parametrize(
    ("maps", "trials", "good"),
    [
        ([], [[2, 1, 2], [1, 1, 3]], [[1, 1, 2], [0, 0, 1]]),
        ([["rise", "friction"]], [[2, 1], [1, 1], [2, 3]], [[1, 0], [1, 0], [2, 1]]),
    ],
)
def test_a_maps_cells_hold_their_own_trials(
    maps: list[list[str]], trials: list[list[int]], good: list[list[int]]
) -> None:
    """A column for each of the first's values, a row for each of the second's, both rising."""
    (one,) = told(Study(**{**vars(STUDY), "maps": maps}))["maps"]
    assert one["trials"] == trials and one["good"] == good
    words = {"friction": ["0.1", "0.2", "0.3"], "rise": ["0.12", "0.15"]}
    assert one["x_labels"] == words[one["x"]] and one["y_labels"] == words[one["y"]]
    assert [one["x"], one["y"]] == (maps[0] if maps else ["friction", "rise"])


def test_every_band_has_its_own_rate_and_bounds() -> None:
    """Clopper and Pearson's bounds are quantiles of beta distributions; ends are the values'."""
    found = told()
    expected = {
        "friction": [(0.1, 0.1, 1, 3), (0.2, 0.2, 1, 2), (0.3, 0.3, 3, 5)],
        "rise": [(0.12, 0.12, 4, 5), (0.15, 0.15, 1, 5)],
        "mass": [(0.9, 1.0, 2, 3), (1.0, 1.1, 3, 7)],
    }
    for name, bands in found["bands"].items():
        for band, (low, high, good, trials) in zip(bands, expected[name], strict=True):
            assert (band["good"], band["trials"]) == (good, trials)
            assert (band["low"], band["high"]) == pytest.approx((low, high))
            assert band["rate"] == pytest.approx(good / trials)
            bounds = beta.ppf([0.025, 0.975], [good, good + 1], [trials - good + 1, trials - good])
            assert (band["bound_low"], band["bound_high"]) == pytest.approx(tuple(bounds))
            low_text, high_text = (f"{100 * bound:.1f}" for bound in bounds)
            assert band["text"] == f"{100 * good / trials:.1f} % ({low_text} to {high_text} %)"
    assert found["rate"]["good"] == 5 and found["rate"]["trials"] == found["trials"] == 10
    assert found["asked"] == 12 and not found["complete"]


def test_trials_without_a_run_stand_in_no_replays_place() -> None:
    """They are passed over before the worst are counted off, and there is no end to the list.

    Twelve trials were listed, and those of them that had no run were then dropped: with a dozen of
    these no trial was run again.
    """
    assert replayable(table(), 3) == [4, 9, 0] and replayable(table(), 4) == [4, 9, 0, 7]
    assert replayable(table(), 50) == [4, 9, 0, 7, 2, 5, 1, 6]


def some_had_no_plan(trial: Trial) -> dict[str, Any]:
    """Fourteen of forty."""
    return rig.result(trial, *(("infeasible", "no plan") if trial.index < 14 else ()))


def test_more_replays_than_are_listed_can_be_made(tmp_path: Path) -> None:
    """Of a whole sweep that lists nothing but trials without a plan."""
    text = rig.PLUMBING.replace("trials: 4", "trials: 20")
    found = rig.sweep_made_up(tmp_path, tmp_path / "a", text, work=some_had_no_plan)
    assert [row["outcome"] for row in found["worst"]] == ["infeasible"] * 12
    trials = read_table(tmp_path / "a")
    assert replayable(trials, 3) == [39, 38, 37] and len(replayable(trials, 50)) == 26


@pytest.mark.parametrize(
    ("rate", "each", "passed"),
    [(0.5, None, True), (0.5, "friction", False), (0.3, "friction", True), (0.4, "mass", True)],
)
def test_a_gate_of_each_band_is_not_made_up_for_by_the_others(
    rate: float, each: str | None, passed: bool
) -> None:
    """5 of 10 succeed; by friction 1 of 3, 1 of 2 and 3 of 5: the least decides."""
    gated = replace(STUDY, gate=Gate(rate=rate, each=each))
    found = told(gated)
    assert found["passed"] == passed and found["gate_each"] == each
    printed = io.StringIO()
    print_sweep(found, Path("out"), Console(file=printed, width=200))
    words = f"gate of at least {100 * rate:g} %" + (f" of each {each}" if each else "")
    assert f"{words}: {'passed' if passed else 'missed'}" in printed.getvalue()


def test_what_a_sweep_adds_is_told_of_the_trials_that_were_timed() -> None:
    """Of those that have both times; of tables of older programs, which have not, nothing is."""
    columns = {"index": [0, 1, 2], "wall": [9.5, 9.0, None], "simulating": [9.0, 8.5, None],
               "memory": [0.4, 0.5, None], "process": [7, 7, 8], "tried": [1, 3, 1],
               "held": [12.0, 9.0, 5.0]}  # fmt: skip
    told = _clock(pa.table(columns))
    assert told["overhead"] == pytest.approx(21.0 / 17.5 - 1.0)
    assert told["tried_again"] == 1 and told["processes"] == 2 and told["memory_max"] == 0.5
    del columns["held"]
    assert _clock(pa.table(columns))["overhead"] is None
