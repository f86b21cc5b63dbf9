"""A sweep's table of trials, read again: whole, and as sweeps write it."""

import json
from pathlib import Path
from typing import Any

import pyarrow as pa

from drake_quad.errors import InputError
from drake_quad.given_tables import read_given_table
from drake_quad.sweep.reading import REMEDY, check_column, strange
from drake_quad.sweep.study_config import Vary
from drake_quad.sweep.table import TRIALS

# Columns that are read again, whatever for; of what they are, and how to say that.
READ = {
    "index": pa.int64(),
    "seed": pa.int64(),
    "success": pa.bool_(),
    "outcome": pa.string(),
    "reason": pa.string(),
    "overrides": pa.list_(pa.string()),
}


def read_table(directory: Path) -> pa.Table:
    """The trials of a sweep.

    Raises:
        InputError: If there are none in `directory`, they are cut short, or a column that is read
            is not as sweeps write it.
    """
    path = directory / TRIALS

    def error(remedy: str) -> InputError:
        return InputError(source=str(directory), field=TRIALS, value=str(path), remedy=remedy)

    try:
        table = read_given_table(path)
        table.validate(full=True)  # text is read as such only now
    except FileNotFoundError:
        raise error(f"not there; {REMEDY}") from None
    except (OSError, ValueError, pa.ArrowException) as problem:
        if isinstance(problem, OSError) and problem.strerror:  # else it is what Arrow says of bytes
            raise error(f"cannot be read: {problem.strerror}") from None
        raise error("is cut short or not Parquet") from None
    if not set(table.column_names) >= READ.keys():
        raise error("is not a sweep's table")
    for name, kind in READ.items():
        check_column(table, name, kind, str(path))
    rows = zip(*(table[name].to_pylist() for name in ("index", "success", "outcome")), strict=True)
    seen: set[int] = set()
    for index, success, outcome in rows:
        if index < 0 or index in seen:
            raise strange(str(path), "index", index, "must be 0 or more, and of one row alone")
        if success != (outcome == "goal_reached"):
            what = (
                f"must be whether the outcome is goal_reached; that of trial {index} is {outcome}"
            )
            raise strange(str(path), "success", success, what)
        seen.add(index)
    return table


def values_of(vary: Vary, table: pa.Table) -> list[Any]:
    """What the trials have of it, as it was before it was written."""
    column = table[f"vary.{vary.title}"]
    values = column.to_pylist()
    return [json.loads(value) for value in values] if column.type == pa.string() else values
