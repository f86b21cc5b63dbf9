"""What the studies' commands share at their ends: a section of a page, and errors in a line."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from benchmarks.common import provenance
from drake_quad.errors import DrakeQuadError
from drake_quad.sweep.provenance import commit as commit_of_sweeps
from drake_quad.sweep.report import check_page, put_section
from drake_quad.util.files import write_whole

ROOT = Path(__file__).resolve().parents[1]
SOURCES = (ROOT / "models", ROOT / "benchmarks")  # besides drake_quad
SECTIONS = ("pushes", "blind stairs", "disturbances")  # of a new page, in its order
TITLE = """\
# Robustness

How much the robot takes that its controller is not told of. What is between *begin* and *end* is
written by the command that it names, and holds figures of that command alone.
"""


@contextmanager
def errors_in_a_line(name: str) -> Iterator[None]:
    """Ends the command `name` with a line where something cannot be used, or it is interrupted."""
    try:
        yield
    except DrakeQuadError as error:
        raise SystemExit(f"benchmarks.{name}: {error}") from None
    except KeyboardInterrupt:
        raise SystemExit(f"benchmarks.{name}: interrupted; go on with --resume") from None


def commit() -> str:
    """The commit and its date, in words; says so where the sources are not the commit's."""
    name = commit_of_sweeps(*SOURCES)
    return f"commit {name}" if name else "sources without a commit"


def describe(command: Sequence[str], libraries: Sequence[str] = ()) -> str:
    """The lines under a section's title: how it was made, of what.

    Args:
        command: Its words.
        libraries: Libraries that it used besides the usual ones.
    """
    return f"```\n{' '.join(command)}\n```\n\n{commit()}; {provenance(*libraries)}.\n"


def check_out(out: Path | None, name: str) -> None:
    """Sees, before any trial, whether the section `name` can be written on the page `out`.

    Raises:
        InputError: If not.
    """
    if out is not None:
        check_page(out, name, option="--out")


def write_section(out: Path, name: str, text: str) -> None:
    """Writes the section `name` of the page `out`; the other sections and all else stay.

    Raises:
        InputError: If it cannot be written.
    """
    if not out.exists():
        marks = [f"<!-- begin {one} -->\n<!-- end {one} -->\n" for one in SECTIONS]
        page = "\n".join([TITLE, *marks])
        write_whole(out, lambda path: path.write_text(page, encoding="utf-8"))
    put_section(out, name, text.strip(), option="--out")
