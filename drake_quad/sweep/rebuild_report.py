"""A finished sweep told again: report and page of its tables, by the program as it is now."""

import shlex
from pathlib import Path
from typing import Any

import pyarrow as pa

from drake_quad.errors import InputError
from drake_quad.sweep.commands import base_in, study_in, sweep_command, with_commands
from drake_quad.sweep.findings import summarize_sweep
from drake_quad.sweep.journal import NAME as JOURNAL
from drake_quad.sweep.report import check_page, write_section, write_sweep_report
from drake_quad.sweep.results import (
    CLOCK,
    CLOCK_COLUMNS,
    FINDINGS,
    REMEDY,
    STUDY,
    TEXT,
    TRIALS,
    Kind,
    check_column,
    read_definition,
    read_plain,
    read_table,
    validate_results,
)
from drake_quad.sweep.study import Study
from drake_quad.sweep.study_loading import study_from
from drake_quad.util.files import is_number, read_given_table

# Of the sweep itself, and not of its tables.
KEPT: dict[str, Kind] = {
    "elapsed": (is_number, "a number"),
    "commit": TEXT,
    "study": TEXT,
    "sources": TEXT,
    "versions": (
        lambda value: isinstance(value, dict) and all(isinstance(v, str) for v in value.values()),
        "a mapping of libraries to their versions",
    ),
}
COMMAND: dict[str, Kind] = {  # which findings of before 3f6ff50 do not have
    "command": (lambda value: study_in(value) is not None, "`drake-quad sweep STUDY [--limit N]`")
}


def rebuild_report(directory: Path, page: Path | None = None) -> dict[str, Any]:
    """Writes report.html of a finished sweep again, and its section of a page.

    What is told is of its tables and of the commit that made them, whatever the program is now.

    Args:
        directory: The sweep's.
        page: Markdown page to write its section of, which has the name of the study's file.

    Returns:
        The findings, as in sweep.json.

    Raises:
        InputError: There is no finished sweep, or a file cannot be written.
    """
    if not (directory / FINDINGS).exists() and (directory / JOURNAL).exists():
        raise _unfinished(directory)
    kept = read_plain(directory, FINDINGS, KEPT, perhaps=COMMAND)
    # What a sweep's section is called: as its study's file, or as its directory if not known.
    file = study_in(kept.get("command"))
    name = directory.resolve().name if file is None else Path(file).stem
    if page is not None:
        check_page(page, name)
    study = _study(directory)
    base = base_in(read_plain(directory, STUDY, {}), str(directory / STUDY))
    clock = _read_clock(directory)
    table = read_table(directory)
    validate_results(study, table, str(directory / TRIALS))
    table = with_commands(table, base, str(directory / TRIALS))
    told = {**kept, **summarize_sweep(study, table, clock)}
    write_sweep_report(study, told, directory)
    if page is not None:
        write_section(
            page, told, told.get("command", sweep_command(f"studies/{name}.yaml", None)), name
        )
    return told


def _study(directory: Path) -> Study:
    return study_from(read_definition(directory, STUDY), source=str(directory / STUDY))


def _read_clock(directory: Path) -> pa.Table:
    try:
        clock = read_given_table(directory / CLOCK)
    except (OSError, ValueError, pa.ArrowException) as problem:
        reason = getattr(problem, "strerror", None)  # Arrow's own errors of bytes have none
        if reason and not isinstance(problem, FileNotFoundError):
            raise _error(directory, CLOCK, f"cannot be read: {reason}") from None
        raise _error(directory, CLOCK, "is not there, cut short or not Parquet") from None
    for name, kind in CLOCK_COLUMNS.items():
        if name in clock.column_names or name != "held":  # which older sweeps did not measure
            check_column(clock, name, kind, str(directory / CLOCK), gaps=True)
    return clock


def _unfinished(directory: Path) -> InputError:
    resume = f"`drake-quad sweep STUDY --out {shlex.quote(str(directory))} --resume`"
    return InputError(
        source=str(directory),
        field=FINDINGS,
        value=str(directory / FINDINGS),
        remedy=f"not there, as the sweep was killed or still runs; go on with it by {resume}",
    )


def _error(directory: Path, name: str, what: str) -> InputError:
    where = str(directory / name)
    return InputError(source=str(directory), field=name, value=where, remedy=f"{what}; {REMEDY}")
