"""The summary of a finished run, read back and checked: what is printed or compared of it."""

from pathlib import Path
from typing import Any

import pyarrow as pa

from drake_quad.errors import InputError
from drake_quad.runs.run_log import MOST_SAMPLES
from drake_quad.runs.summary_figures import FIGURES, VERDICTS, WALL_CLOCK, WORDS
from drake_quad.util.files import MOST_JSON, plain_of, read_given, read_given_table


def read_summary(directory: str | Path, *, or_sweep: bool = False) -> dict[str, Any]:
    """The summary of a finished run, all of whose files can be read; `load_run` tolerates more.

    Args:
        directory: Directory of the run.
        or_sweep: Whether the error says that a sweep's directory would have done as well.

    Raises:
        InputError: A file is not there, or is none of a run's; or a value that is printed is none
            that runs write.
    """
    directory = Path(directory)
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
        log = read_given_table(
            directory / "log.parquet", columns=["t", "margin"], most_rows=MOST_SAMPLES
        )
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

    def fail(path: str, value: Any, what: str) -> InputError:
        remedy = f"must be {what}; give the directory of a finished `drake-quad run`"
        return InputError(source=source, field=path, value=value, remedy=remedy)

    for name in WORDS:
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
