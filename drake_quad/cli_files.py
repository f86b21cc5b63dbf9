"""The directories of the commands: named, claimed before long work, read, and reported on."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from errno import ENAMETOOLONG
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from rich.console import Console

from drake_quad.errors import InputError
from drake_quad.given_files import MOST_JSON, read_given

LONGEST = ".certificate.json.part"  # of the names that commands write in a directory


def stem(scenario: str) -> str:
    """The short name of a scenario, a study or a robot, from its file or its name."""
    return Path(scenario).name.removesuffix(".yaml").removesuffix(".scenario")


def claim(directory: Path, option: str = "--out") -> None:
    """Makes sure before any long work that the directory can be written to; makes nothing.

    Raises:
        InputError: If it cannot; it names the option by which the directory was given.
    """
    with _writing(directory, option):
        _probe(directory / LONGEST)


def claim_file(path: Path | None, option: str) -> None:
    """The same of a file, if there is to be one."""
    if path is None:
        return
    refusal = ""
    with _writing(path, option):
        if path.is_dir():
            refusal = "is a directory; give a file in it"
        elif path.exists() and not path.is_file():  # to be in place of /dev/null would harm
            refusal = "is no file that could be written anew; give another"
        else:
            _probe(path.with_name(f".{path.name}.part"))  # as long a name as `write_whole`'s
    if refusal:
        raise InputError(source=option, field=option[2:], value=str(path), remedy=refusal)


def _probe(path: Path) -> None:
    """Tries a file in the lowest folder on the way to it that is there, and all names for length.

    The file has no name: other commands may begin at the same place at the same time.
    """
    path = path.absolute()
    folder = next(p for p in path.parents if p.exists() or p.is_symlink())
    with TemporaryFile(dir=folder):
        most = os.pathconf(folder, "PC_NAME_MAX")
    if any(len(os.fsencode(name)) > most for name in path.relative_to(folder).parts):
        raise OSError(ENAMETOOLONG, os.strerror(ENAMETOOLONG))


@contextmanager
def _writing(path: Path, option: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        remedy = f"cannot be written to: {error.strerror}; give another with {option}"
        raise InputError(source=option, field=option[2:], value=str(path), remedy=remedy) from None


def read_summary(directory: Path, *, or_sweep: bool = False) -> dict[str, Any]:
    """The summary of a finished run, all of whose files can be read.

    Args:
        directory: The run's.
        or_sweep: Whether a sweep's would have done as well, for the message.

    Raises:
        InputError: A file is not there, or is none of a run's; or a value that is printed is none
            that runs write.
    """
    import pyarrow as pa

    from drake_quad.given_tables import read_given_table
    from drake_quad.plain_json import plain_of

    wanted = "`drake-quad run`" + (" or `drake-quad sweep`" if or_sweep else "")

    def fail(name: str, what: str) -> InputError:
        return InputError(
            source=str(directory),
            field=name,
            value=str(directory / name),
            remedy=f"{what}; give the directory of a finished {wanted}",
        )

    try:
        summary = plain_of(read_given(directory / "summary.json", most=MOST_JSON))
    except OSError as problem:
        there = directory.is_dir() and not isinstance(problem, FileNotFoundError)
        what = "not there" if directory.is_dir() else "no such directory"
        what = f"cannot be read: {problem.strerror}" if there else what
        raise fail("summary.json", what) from None
    if summary is None:
        raise fail("summary.json", "is cut short, or no mapping in JSON")
    if "outcome" not in summary:
        raise fail("summary.json", "is not a run's summary")
    _check_values(summary, str(directory / "summary.json"))
    try:
        log = read_given_table(directory / "log.parquet", columns=["t", "margin"])
    except FileNotFoundError:
        raise fail("log.parquet", "not there") from None
    except (OSError, ValueError, pa.ArrowException) as problem:
        reason = getattr(problem, "strerror", None)  # Arrow's own errors of bytes have none
        if reason:
            raise fail("log.parquet", f"cannot be read: {reason}") from None
        raise fail("log.parquet", "is cut short or not Parquet") from None
    if {*log.column_names} != {"t", "margin"}:
        raise fail("log.parquet", "is not a run's log")
    for name in log.column_names:
        kind, gaps = log[name].type, log[name].null_count
        if not pa.types.is_floating(kind) or gaps:
            raise InputError(
                source=str(directory / "log.parquet"),
                field=name,
                value=f"{kind}, {gaps} rows without a value" if gaps else str(kind),
                remedy=f"must be a column of numbers; give the directory of a finished {wanted}",
            )
    return summary


def _check_values(summary: dict[str, Any], source: str) -> None:
    """Sees that words are text, and that figures are numbers, verdicts true or false.

    Figures and verdicts may also be null, or not there.

    Raises:
        InputError: The first that is something else.
    """
    from drake_quad.summary_keys import FIGURES, VERDICTS, WALL_CLOCK

    def fail(path: str, value: Any, what: str) -> InputError:
        remedy = f"must be {what}; give the directory of a finished `drake-quad run`"
        return InputError(source=source, field=path, value=value, remedy=remedy)

    for name in ("outcome", "reason", "simulation", "margin_kind", "assumes"):
        if not isinstance(summary.get(name, ""), str):
            raise fail(name, summary[name], "text")
    for path in (*FIGURES, *WALL_CLOCK):
        name, _, part = path.partition(".")
        value = summary.get(name)
        if part and value is not None:
            if not isinstance(value, dict):
                raise fail(name, value, "a mapping of figures, or null")
            value = value.get(part)
        verdict = path in VERDICTS
        if value is not None and type(value) not in ((bool,) if verdict else (int, float)):
            raise fail(path, value, "true or false, or null" if verdict else "a number, or null")


def make_report(directory: Path, err: Console) -> None:
    """Writes report.html and scene.lcmlog of a finished run."""
    from drake_quad.report.build import build_report
    from drake_quad.report.scene_log import write_scene_log

    with err.status("writing report.html and scene.lcmlog"):
        build_report(directory)
        write_scene_log(directory)
