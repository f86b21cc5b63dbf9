"""The runner of the documents' studies: what it runs stands on the pages, and is done once."""

import sys
from pathlib import Path

import pytest

from benchmarks import tables
from benchmarks.page import ROOT
from benchmarks.tables import TABLES, TableStudy


@pytest.mark.parametrize("study", TABLES, ids=lambda study: study.name)
def test_its_command_stands_on_its_page(study: TableStudy) -> None:
    """As people are told to run it."""
    assert study.command in (ROOT / study.page).read_text(encoding="utf-8")


def test_names_are_different() -> None:
    """Each study has a folder of its own."""
    assert len({study.name for study in TABLES}) == len(TABLES)


def test_a_study_goes_on_where_it_was_begun(tmp_path: Path) -> None:
    """With the processes that are asked for, into its folder, by this interpreter."""
    study = next(study for study in TABLES if study.name == "kicks_03")
    words = tables.words_of(study, tmp_path, 2)
    assert words[:3] == [sys.executable, "-m", "benchmarks.pushes"] and "--resume" not in words
    assert words[words.index("--workers") + 1] == "2"
    assert words[words.index("--lines") + 1] == str(tmp_path / "lines.jsonl")
    (tmp_path / "lines.jsonl").touch()
    assert tables.words_of(study, tmp_path, None)[-1] == "--resume"
    swept = tables.words_of(TableStudy("x", "", 1, "drake-quad sweep a.yaml"), tmp_path / "n", 2)
    assert swept[:4] == [sys.executable, "-m", "drake_quad", "sweep"] and swept[-2:] == [
        "--workers", "2",
    ]  # fmt: skip


def test_what_the_same_sources_did_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A finding (status 1) is done, too; what could not be carried out is not, and is told."""
    studies = tuple(
        TableStudy(f"ends_{status}", "a page", 1, f"python -c 'raise SystemExit({status})'")
        for status in (0, 1, 2)
    )
    error = "python -c 'raise SystemExit(\"benchmarks.x: sources were changed\")'"
    studies = (*studies, TableStudy("ends_early", "a page", 1, error))
    monkeypatch.setattr(tables, "TABLES", studies)
    for begun in (4, 2):
        with pytest.raises(SystemExit, match="not done: ends_2, ends_early"):
            tables.main(["--out", str(tmp_path)])
        assert capsys.readouterr().out.count("ended with status") == begun
    monkeypatch.setattr(tables, "own_sources", lambda: "others")
    assert not tables.is_done(tmp_path / "ends_0")
    with pytest.raises(SystemExit, match="2"):
        tables.main(["no_such"])
    assert (
        "there is no table no_such; there are ends_0, ends_1, ends_2, ends_early"
        in capsys.readouterr().err
    )
