"""Files that are written whole, or not at all."""

from pathlib import Path

import pytest

from drake_quad.errors import InputError
from drake_quad.util.files import write_whole


@pytest.mark.parametrize("problem", [KeyboardInterrupt(), ValueError("no"), OSError(28, "full")])
def test_whatever_ends_it_nothing_half_written_stays(
    problem: BaseException, tmp_path: Path
) -> None:
    """What was there before is as it was; a full disk is told in a line, the rest goes on up."""
    path = tmp_path / "a.json"
    path.write_text("before")

    def write(to: Path) -> None:
        to.write_text("half")
        raise problem

    expected = InputError if isinstance(problem, OSError) else type(problem)
    with pytest.raises(expected):
        write_whole(path, write)
    assert [file.name for file in tmp_path.iterdir()] == ["a.json"]
    assert path.read_text() == "before"
