"""What a comparison of two sweeps says, of hand-made tables: what was tested, and why so."""

import io
import json
from math import comb
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from compare_rig import CELLS, STILL, Success, files_of, study_of, swept_of
from rich.console import Console

from drake_quad.errors import InputError
from drake_quad.sweep.compare import compare_sweeps, print_comparison
from drake_quad.sweep.statistics import KINEMATIC, SHARED
from drake_quad.sweep.study import Gate, Study, SuccessBound


def compared(
    directory: Path, before: Success, after: Success, *studies: Study, scenario: str = ""
) -> tuple[dict[str, Any], str]:
    """What is told of two sweeps, as plain values and as lines."""
    one = files_of(directory / "one", before, studies[0], "a", scenario)
    other = files_of(directory / "other", after, studies[-1], "b", scenario)
    found = compare_sweeps(one, other)
    told = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    console = Console(file=io.StringIO(), width=300)
    print_comparison(found, console)
    return told, console.file.getvalue()  # type: ignore[attr-defined]


def well(good: int, of: int) -> list[bool]:
    return [index < good for index in range(of)]


def common(whole: list[float], cells: int = CELLS) -> list[bool]:
    """Trials in the order of a sweep's, so many of each draw's cells good."""
    return [cell < round(rate * cells) for rate in whole for cell in range(cells)]


def test_without_pairs_fishers_test_decides_which_way(tmp_path: Path) -> None:
    """18 of 20 and 9 of 20 that share no trial: worse, in the other order better, and why so."""
    # Of all tables with these sums those that are no more probable than this one.
    ways = {k: comb(20, k) * comb(20, 27 - k) for k in range(7, 21)}
    p = sum(way for way in ways.values() if way <= ways[18]) / comb(40, 27)
    assert p < 0.05
    studies = study_of(), study_of(seed=1)
    for name, good, verdict in (("a", (18, 9), "worse"), ("b", (9, 18), "better")):
        (tmp_path / name).mkdir()
        told, text = compared(tmp_path / name, well(good[0], 20), well(good[1], 20), *studies)
        assert told["verdict"] == verdict and told["p"] == pytest.approx(p)
        assert told["paired"] is None and "Fisher" in told["test"] and told["units"] == [20, 20]
        assert text.count(verdict) == 1 and "20 of 20 trials have other draws or seeds" in text
        assert "differ in seed" in text


def test_too_few_trials_tell_nothing(tmp_path: Path) -> None:
    """Four lost of four: by chance once in eight times. That is said, not that nothing changed."""
    told, text = compared(tmp_path, well(4, 4), well(0, 4), study_of())
    assert told["verdict"] == "cannot be told" and told["p"] == pytest.approx(0.125)
    assert "4 trials are too few" in text and "0.125" in text


def test_the_trials_that_both_have_are_told_of(tmp_path: Path) -> None:
    """The rates are of all; where the test has fewer, so are those that it is of."""
    told, text = compared(tmp_path, well(20, 500), well(12, 20), study_of())
    assert told["verdict"] == "worse" and "4.0 %" in text and "60.0 %" in text
    assert "compared by the 20 trials that both have: 20 and 12 of them succeeded" in text
    (tmp_path / "whole").mkdir()
    _, text = compared(tmp_path / "whole", well(20, 20), well(12, 20), study_of())
    assert "compared by" not in text


@pytest.mark.parametrize("trials", [1, 3])
def test_where_nothing_is_random_nothing_is_chance(tmp_path: Path, trials: int) -> None:
    """A robot that was lost of six is lost by a change: it is worse, whatever a test says."""
    study = study_of(cells=6, trials=trials)
    for name, before, after, verdict in (
        ("lost", well(6, 6), well(5, 6), "worse"),
        ("won", well(5, 6), well(6, 6), "better"),
        ("both", [True, False], [False, True], "worse"),
        ("none", well(5, 6), well(5, 6), "no different"),
    ):
        (tmp_path / name).mkdir()
        told, text = compared(tmp_path / name, before, after, study, scenario=STILL)
        assert told["verdict"] == verdict and told["p"] is None
        assert "nothing is random" in text and "by chance" not in text


@pytest.mark.parametrize(
    "scenario",
    [STILL.replace("truth", "ekf"), STILL.replace("false", "true"), STILL.replace("0.0", "0.002"),
     STILL.replace("feet", "joints"), STILL.replace("told", "seen"),
     "", "nonsense", "world: [", "world: 3"],
)  # fmt: skip
def test_where_a_seed_is_read_a_grid_is_a_sample(tmp_path: Path, scenario: str) -> None:
    """Sensors' noise is chance, too, whatever else is drawn; so it is where nobody knows."""
    before, after = [True] * 94 + [False] * 6, [False] + [True] * 99
    told, text = compared(tmp_path, before, after, study_of(cells=100, trials=1), scenario=scenario)
    assert told["verdict"] == "no different" and told["p"] == pytest.approx(0.125)
    assert "by chance" in text and "nothing is random" not in text


@pytest.mark.parametrize(("outcome", "verdict"), [("timeout", "cannot be told"), ("fell", "worse")])
def test_what_a_machine_ended_was_changed_by_no_program(
    tmp_path: Path, outcome: str, verdict: str
) -> None:
    """A trial may run out of time on a busy machine: it is to be run again."""
    study = study_of(cells=6, trials=1)
    one = files_of(tmp_path / "one", well(6, 6), study, scenario=STILL)
    other = files_of(tmp_path / "other", well(5, 6), study, scenario=STILL)
    table = pq.read_table(other / "trials.parquet")
    outcomes = pa.array([*["goal_reached"] * 5, outcome])
    place = table.column_names.index("outcome")
    pq.write_table(table.set_column(place, "outcome", outcomes), other / "trials.parquet")
    told = compare_sweeps(one, other)
    assert told.verdict == verdict and told.p is None and told.why is not None
    assert ("run them again" in told.why) == (outcome == "timeout")


@pytest.mark.parametrize("mode", ["physics", "kinematic"])
def test_a_side_without_physics_proves_nothing(tmp_path: Path, mode: str) -> None:
    """It is said of that side."""
    for name in ("one", "other"):
        directory = files_of(tmp_path / name, well(3, 20), study_of())
    modes = pa.array([mode] * 20)
    table = pq.read_table(directory / "trials.parquet").append_column("mode", modes)
    pq.write_table(table, directory / "trials.parquet")
    console = Console(file=io.StringIO(), width=300)
    print_comparison(compare_sweeps(tmp_path / "one", directory), console)
    said = console.file.getvalue()  # type: ignore[attr-defined]
    assert (f"{directory}: {KINEMATIC}" in said) == (mode == "kinematic")


def test_a_draw_that_fails_in_all_cells_is_one_thing_that_failed(tmp_path: Path) -> None:
    """35 trials lost by one draw of eight are no difference; of eight draws that all fail they are.

    Trial by trial the first would have p = 6e-11. What is counted is said, and is in the JSON.
    """
    study = study_of(cells=CELLS, draws="common", trials=8)
    (tmp_path / "a").mkdir()
    told, text = compared(tmp_path / "a", common([1.0] * 8), common([1.0] * 7 + [0.0]), study)
    assert told["verdict"] == "no different" and told["p"] == 1.0
    assert (told["unit"], told["units"], told["sharing"]) == ("draw", [8], CELLS)
    assert len(told["paired"]["lost"]) == CELLS
    assert told["paired"]["draws"] == {"worse": 1, "better": 0, "same": 7}
    assert "counts draws" in text and "1 worse, 0 better, 7 same" in text
    (tmp_path / "b").mkdir()
    told, _ = compared(tmp_path / "b", common([1.0] * 8), common([0.9] * 8), study)
    assert told["verdict"] == "worse" and told["p"] == pytest.approx(2.0 / 2**8)


def test_five_draws_tell_nothing(tmp_path: Path) -> None:
    """However many cells the grid has: five coins on one side are no proof, and so it is said."""
    study = study_of(cells=CELLS, draws="common", trials=5)
    told, text = compared(tmp_path, common([1.0] * 5), common([0.0] * 5), study)
    assert told["verdict"] == "cannot be told" and told["p"] == pytest.approx(0.0625)
    assert "5 draws are too few" in text


def test_common_draws_that_are_not_paired(tmp_path: Path) -> None:
    """Whole draws of grids of as many cells are compared; of other grids nothing can be told."""
    one = study_of(cells=4, draws="common", trials=6)
    other = study_of(cells=4, draws="common", trials=7, seed=1)
    after = common([0.25] * 7, 4)[:-1]  # the seventh draw was not done in every cell
    (tmp_path / "a").mkdir()
    told, text = compared(tmp_path / "a", common([1.0] * 6, 4), after, one, other)
    assert told["verdict"] == "worse" and told["p"] == pytest.approx(2.0 / comb(12, 6))
    assert (told["unit"], told["units"], told["paired"]) == ("draw", [6, 6], None)
    for k, unlike in enumerate((study_of(cells=5, draws="common", seed=1), study_of(seed=1))):
        (tmp_path / f"{k}").mkdir()
        told, text = compared(tmp_path / f"{k}", well(20, 20), well(0, 20), one, unlike)
        assert told["verdict"] == "cannot be told" and told["p"] is told["test"] is None
        assert "cannot be told: where all cells share their draws" in text
        assert told["before"]["sharing"] == 4 and text.count(SHARED) == 2 - k


@pytest.mark.parametrize(
    ("differ", "fields"),
    [
        ([], {"description": "Does it walk?!"}),
        ([], {"gate": Gate(rate=0.9), "maps": [["a", "b"]]}),
        (["trials"], {"trials": 6}),
        (["set"], {"set": ["controller.kind=ik"]}),
        (["success"], {"success": [SuccessBound("margin.minimum", least=0.1)]}),
    ],
)
def test_trials_are_the_same_whatever_is_said_of_the_study(
    tmp_path: Path, differ: list[str], fields: dict[str, Any]
) -> None:
    """Another description, gate, map or name, more trials, or other files: still pairs.

    What bears on the trials all the same, as what counts as success, is told.
    """
    one, other = study_of(cells=2, trials=5), study_of(cells=2, **{"trials": 5, **fields})
    other.vary[0].name = "another name"
    told, text = compared(tmp_path, well(10, 10), well(2, 10), one, other)
    assert told["before"]["study"] != told["after"]["study"]  # by their files' digests
    assert told["paired"]["lost"] == list(range(2, 10)) and told["verdict"] == "worse"
    assert told["unpaired"] is None and told["differ"] == differ
    assert "not paired" not in text and all(f"differ in {name}" in text for name in differ)


@pytest.mark.parametrize(
    ("after", "scenario", "why"),
    [
        (well(3, 9), "descend", "their scenarios are flat_walk and descend"),
        (dict.fromkeys(range(9, 20), True), "flat_walk", "no trial was done in both"),
    ],
)
def test_why_trials_are_not_paired_is_told(
    tmp_path: Path, after: Success, scenario: str, why: str
) -> None:
    """In print and as plain values."""
    other = study_of()
    other.scenario = scenario
    told, text = compared(tmp_path, well(3, 9), after, study_of(), other)
    assert told["paired"] is None and told["unpaired"] == why
    assert f"the trials are not paired: {why}" in text


def test_one_trial_that_is_another_is_enough(tmp_path: Path) -> None:
    """By its overrides or its seed: then none are paired, and it is named."""
    study = study_of()
    first = swept_of(well(3, 9), study)
    one, other = (files_of(tmp_path / name, well(3, 9), study) for name in ("one", "other"))
    for k, name in enumerate(("seed", "overrides")):
        changed = first.table[name].to_pylist()
        changed[4] = 9 if name == "seed" else ["gait.cycle_time=9.0"]
        place = first.table.column_names.index(name)
        table = first.table.set_column(place, name, pa.array(changed))
        pq.write_table(table, (one, other)[k] / "trials.parquet")
        why = compare_sweeps(one, other).unpaired
        assert why == "1 of 9 trials have other draws or seeds, trial 4 the first"
        pq.write_table(first.table, (one, other)[k] / "trials.parquet")


WAYLESS = '{"definition": {"vary": [{"path": "a"}], "draws": "independent", "trials": 9}}'


@pytest.mark.parametrize("draws", ["independent", "common"])
@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"definition": {"vary": [{"path": 1}]}}', WAYLESS,
     WAYLESS.replace('"a"', '"a", "values": []')],
)  # fmt: skip
def test_a_study_that_cannot_be_read_is_refused(tmp_path: Path, text: str, draws: str) -> None:
    """Without it nobody knows which trials share a draw."""
    text = text.replace("independent", draws)
    one = files_of(tmp_path / "one", well(3, 9), study_of())
    (one / "study.json").write_text(text)
    with pytest.raises(InputError, match=r"study\.json"):
        compare_sweeps(one, one)
