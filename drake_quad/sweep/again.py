"""A finished sweep told again: report and page of its tables, by the program as it is now."""

import json
import shlex
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from drake_quad.errors import InputError
from drake_quad.sweep.journal import NAME as JOURNAL
from drake_quad.sweep.page import write_report
from drake_quad.sweep.section import check_page, write_section
from drake_quad.sweep.study import study_from
from drake_quad.sweep.study_config import Study
from drake_quad.sweep.sweep import FINDINGS, STUDY
from drake_quad.sweep.table import CLOCK, CLOCK_COLUMNS, read_table
from drake_quad.sweep.told import tell

# Of the sweep itself, and not of its tables.
KEPT = ("elapsed", "commit", "study", "sources", "versions")


def tell_again(directory: Path, page: Path | None = None) -> dict[str, Any]:
    """Writes report.html of a finished sweep again, and its section of a page.

    What is told is of its tables and of the commit that made them, whatever the program is now.

    Args:
        directory: The sweep's.
        page: Markdown page to write its section of, which has the directory's name.

    Returns:
        The findings, as in sweep.json.

    Raises:
        InputError: There is no finished sweep, or a file cannot be written.
    """
    name = directory.resolve().name
    if page is not None:
        check_page(page, name)
    kept = _read(directory, FINDINGS, KEPT)
    study = _study(directory)
    clock = _read_clock(directory)
    told = {**kept, **tell(study, read_table(directory), clock)}
    write_report(study, told, directory)
    if page is not None:
        # Findings of before 3f6ff50 do not say by what command.
        write_section(
            page, told, told.get("command", f"drake-quad sweep studies/{name}.yaml"), name
        )
    return told


def _study(directory: Path) -> Study:
    plain = _read(directory, STUDY, ("definition",))
    return study_from(plain["definition"], source=str(directory / STUDY))


def _read(directory: Path, name: str, needed: tuple[str, ...]) -> dict[str, Any]:
    try:
        plain = json.loads((directory / name).read_text(encoding="utf-8"))
    except OSError as problem:
        if name == FINDINGS and (directory / JOURNAL).is_file():
            raise _unfinished(directory) from None
        raise _error(directory, name, f"cannot be read: {problem.strerror}") from None
    except ValueError:
        raise _error(directory, name, "is cut short or not JSON") from None
    if not (isinstance(plain, dict) and all(key in plain for key in needed)):
        raise _error(directory, name, "is not a sweep's")
    return plain


def _read_clock(directory: Path) -> pa.Table:
    try:
        clock = pq.read_table(directory / CLOCK)
    except (OSError, ValueError):
        raise _error(directory, CLOCK, "is not there, cut short or not Parquet") from None
    if {*CLOCK_COLUMNS} - {*clock.column_names, "held"}:  # which older sweeps did not measure
        raise _error(directory, CLOCK, "is not a sweep's table")
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
    remedy = f"{what}; give the directory of a finished `drake-quad sweep`"
    return InputError(source=str(directory), field=name, value=str(directory / name), remedy=remedy)
