"""A finished sweep is told again of its tables alone: report, findings and page."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import sweep_rig as rig
from command import drake_quad, refused

from drake_quad.errors import InputError
from drake_quad.sweep.rebuild_report import rebuild_report
from drake_quad.sweep.report import write_section, write_sweep_report
from drake_quad.sweep.study_loading import as_plain, parse_study, study_from

ROOT = Path(__file__).resolve().parents[2]
TEXT = rig.PLUMBING.replace("trials: 4", "trials: 20") + "gate: {rate: 0.9}\n"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep's directory, to be copied and not to be changed."""
    return swept(tmp_path_factory.mktemp("whole"))[0]


def swept(tmp_path: Path) -> tuple[Path, dict[str, Any]]:
    out = tmp_path / "one"
    told = rig.sweep_made_up(tmp_path, out, TEXT, command="drake-quad sweep study.yaml")
    write_sweep_report(rig.made(tmp_path, TEXT)[0], told, out)
    return out, told


def test_what_is_told_again_is_what_was_told(tmp_path: Path) -> None:
    """To the letter, wherever the directory is by now, and without its journal."""
    out, told = swept(tmp_path)
    write_section(tmp_path / "page.md", told, told["command"], "study")
    page = (tmp_path / "page.md").read_text()
    report = (out / "report.html").read_text()
    other = tmp_path / "elsewhere" / "one"
    other.mkdir(parents=True)
    for name in ("study.json", "sweep.json", "trials.parquet", "clock.parquet"):
        shutil.copy(out / name, other / name)
    again = rebuild_report(other, tmp_path / "elsewhere" / "page.md")
    assert again == told
    assert (tmp_path / "elsewhere" / "page.md").read_text() == page
    # Commands of its worst trials name the directory.
    assert (other / "report.html").read_text() == report.replace(str(out), str(other))
    drawn = [tmp_path / "page" / "study.svg", tmp_path / "elsewhere" / "page" / "study.svg"]
    assert drawn[0].read_bytes() == drawn[1].read_bytes() and "page/study.svg" in page
    assert "| margin.minimum | 0.0125 | " in page


def test_the_command_tells_again(tmp_path: Path) -> None:
    """By `drake-quad report`, under the study's name; a page is for sweeps alone."""
    out, told = swept(tmp_path)
    before = (out / "report.html").read_bytes()
    (out / "report.html").unlink()
    done = drake_quad("report", "one", "--page", "page.md", cwd=tmp_path)
    assert done.returncode == 0 and told["rate"]["text"] in done.stdout
    assert (tmp_path / "page.md").read_text().count("## study") == 1
    assert len((out / "report.html").read_bytes()) > 0.9 * len(before)
    (tmp_path / "run").mkdir()
    assert "--page" in refused(drake_quad("report", "run", "--page", "p.md", cwd=tmp_path))


def test_a_sweep_that_was_killed_is_told_how_to_go_on(tmp_path: Path) -> None:
    """A journal without tables: the line says by what command there will be some."""
    out, _ = swept(tmp_path)
    (out / "sweep.json").unlink()
    assert (out / "journal.jsonl").is_file()
    line = refused(drake_quad("report", "one", cwd=tmp_path))
    assert "sweep.json" in line and "drake-quad sweep STUDY --out one --resume" in line


@pytest.mark.parametrize("name", ["study.json", "sweep.json", "trials.parquet", "clock.parquet"])
@pytest.mark.parametrize("text", [None, "", "{}", "[1]", '{"definition": {"vary": 3}}'])
def test_spoilt_files_are_refused(whole: Path, tmp_path: Path, name: str, text: str | None) -> None:
    """One line, with the file's name; nothing is written anew."""
    out = Path(shutil.copytree(whole, tmp_path / "one"))
    (out / "report.html").unlink()
    (out / name).unlink()
    if text is not None:
        (out / name).write_text(text)
    with pytest.raises(InputError) as caught:
        rebuild_report(out, tmp_path / "page.md")
    assert name in str(caught.value) and "\n" not in str(caught.value)
    assert not (out / "report.html").exists() and not (tmp_path / "page.md").exists()


@pytest.mark.parametrize("path", sorted((ROOT / "studies").glob("*.yaml")), ids=lambda p: p.stem)
def test_a_study_survives_its_json(path: Path) -> None:
    """As study.json has it."""
    study = parse_study(path.read_text(encoding="utf-8"), source="x")
    assert study_from(json.loads(json.dumps(as_plain(study))), source="x") == study
