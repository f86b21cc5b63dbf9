"""Writes the report of a finished sweep again, from its tables.

Whoever had the files since may have written any text into them, and people paste a printed command
into a shell. So every command is made anew from values that were checked.
"""

import shlex
from pathlib import Path
from typing import Any

import pyarrow as pa

from drake_quad.errors import InputError, printable
from drake_quad.scenario.load import parse_override
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
    strange,
    validate_results,
)
from drake_quad.sweep.study import Study
from drake_quad.sweep.study_checks import MOST_TRIALS
from drake_quad.sweep.study_loading import study_from
from drake_quad.sweep.trials import run_command, sweep_command
from drake_quad.util.files import is_number, read_given_table, user_path

# Findings that the tables do not give.
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


COMMAND: dict[str, Kind] = {  # findings older than commit 3f6ff50 have none
    "command": (lambda value: study_in(value) is not None, "`drake-quad sweep STUDY [--limit N]`")
}


def rebuild_report(directory: str | Path, page: str | Path | None = None) -> dict[str, Any]:
    """Writes report.html of a finished sweep again, and its section of a page.

    The figures are those of its tables and of the commit that made them.

    Args:
        directory: The sweep's directory.
        page: Markdown page to write its section of, under the name of the study's file.

    Returns:
        The findings, as in sweep.json.

    Raises:
        InputError: There is no finished sweep, or a file cannot be written.
    """
    directory, page = user_path(directory), None if page is None else user_path(page)
    if not (directory / FINDINGS).exists() and (directory / JOURNAL).exists():
        raise _unfinished(directory)
    kept = read_plain(directory, FINDINGS, KEPT, perhaps=COMMAND)
    # The section has the name of the study's file, or of the directory if that is not known.
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
    findings = {**kept, **summarize_sweep(study, table, clock)}
    write_sweep_report(study, findings, directory)
    if page is not None:
        write_section(
            page,
            findings,
            findings.get("command", sweep_command(f"studies/{name}.yaml", None)),
            name,
        )
    return findings


def _study(directory: Path) -> Study:
    return study_from(read_definition(directory, STUDY), source=str(directory / STUDY))


def _read_clock(directory: Path) -> pa.Table:
    try:
        clock = read_given_table(directory / CLOCK, most_rows=MOST_TRIALS)
    except (OSError, ValueError, pa.ArrowException) as problem:
        reason = getattr(problem, "strerror", None)  # Arrow's own errors of bytes have none
        if reason and not isinstance(problem, FileNotFoundError):
            raise _error(directory, CLOCK, f"cannot be read: {reason}") from None
        raise _error(directory, CLOCK, "is not there, cut short or not Parquet") from None
    for name, kind in CLOCK_COLUMNS.items():
        if name in clock.column_names or name != "held":  # older sweeps did not measure it
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


def study_in(command: Any) -> str | None:
    """The study's file in a command that `sweep_command` made; None if it made no such command."""
    try:
        words = shlex.split(command)
        study, limit = words[2], int(words[4]) if len(words) == 5 else None
    except (ValueError, IndexError, AttributeError):
        return None
    plain = _is_name(study) and (limit is None or limit > 0)
    return study if plain and sweep_command(study, limit) == command else None


def base_in(plain: dict[str, Any], source: str) -> str:
    """The name of the sweep's scenario.

    Args:
        plain: Contents of study.json.
        source: Path of study.json.

    Raises:
        InputError: No command could have such a name.
    """
    name = plain.get("base")
    if not (isinstance(name, str) and _is_name(name)):
        remedy = f"must be a scenario's name or file, in one line; {REMEDY}"
        raise InputError(source=source, field="base", value=name, remedy=remedy)
    return name


def with_commands(table: pa.Table, base: str, source: str) -> pa.Table:
    """The table of trials with each trial's command made of its overrides.

    Args:
        table: The table, as `read_table` returned it.
        base: Name of the scenario, as `base_in` returned it.
        source: The table's file.

    Raises:
        InputError: The column of overrides holds something else.
    """
    commands = []
    for overrides in table["overrides"].to_pylist():
        for text in overrides:
            try:
                parse_override(text)
                fits = printable(text) == text
            except (InputError, TypeError):
                fits = False
            if not fits:
                raise strange(source, "overrides", text, "must be overrides, path=value, each")
        commands.append(run_command(base, overrides))
    column = table.column_names.index("command")
    return table.set_column(column, "command", pa.array(commands, type=pa.string()))


def _is_name(word: str) -> bool:
    """Whether it can be a file's name in a command: no option, and one line."""
    return bool(word) and not word.startswith("-") and printable(word) == word
