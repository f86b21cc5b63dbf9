"""Before any long work: a place that cannot be written to is refused, and nothing is left there."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from drake_quad.cli.common import claim, claim_file
from drake_quad.errors import InputError
from drake_quad.util.files import write_together


def test_commands_begin_side_by_side(tmp_path: Path) -> None:
    """Many at once in one folder do not disturb each other, nor what is there already."""
    (tmp_path / ".writable").write_text("mine")
    with ThreadPoolExecutor(16) as pool:
        list(pool.map(claim, [tmp_path / f"run{k}" for k in range(500)]))
        list(pool.map(claim_file, [tmp_path / "one.html"] * 500, ["--file"] * 500))
    assert [path.name for path in tmp_path.iterdir()] == [".writable"]
    assert (tmp_path / ".writable").read_text() == "mine"


@pytest.mark.parametrize("place", ["n" * 256, f"{'n' * 256}/out", "notes/out", "/proc/out"])
def test_what_can_be_no_directory_is_refused(tmp_path: Path, place: str) -> None:
    """A name that is too long anywhere on the way, below a file, and where nothing is written."""
    (tmp_path / "notes").touch()
    with pytest.raises(InputError, match=r"--out.*cannot be written to"):
        claim(tmp_path / place)
    assert [path.name for path in tmp_path.iterdir()] == ["notes"]


def test_a_file_needs_room_for_its_other_name(tmp_path: Path) -> None:
    """Of 255 letters it can be, but not filled beside its place."""
    claim_file(tmp_path / ("n" * 249), "--file")
    with pytest.raises(InputError, match=r"--file.*too long"):
        claim_file(tmp_path / ("n" * 250), "--file")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match=r"--file.*is no file"):
        claim_file(tmp_path / "pipe", "--file")


@pytest.mark.parametrize("name", ["old", "first", "last"])
def test_a_directory_in_a_files_place_costs_nothing(tmp_path: Path, name: str) -> None:
    """It is told of, and what was there before stays, all of it."""
    first, last, old = (tmp_path / name for name in ("first", "last", "old"))
    for path in (first, last, old):
        path.write_text("before")
    (tmp_path / name).unlink()
    (tmp_path / name).mkdir()
    files = {path: lambda to: to.write_text("after") for path in (first, last)}
    with pytest.raises(InputError, match=rf"{name}.*is a directory"):
        write_together(files, gone=[old])
    assert {path.name for path in tmp_path.iterdir()} == {"first", "last", "old"}
    others = {first, last, old} - {tmp_path / name}
    assert all(path.read_text() == "before" for path in others)
