"""The commands that a sweep's files tell people to run, made anew of values that were checked.

Whoever had the files since may have written any text into them, and people paste what is printed
as a command into a shell. So no command of a file is told as it stands there.
"""

import shlex
from pathlib import Path
from typing import Any

import pyarrow as pa

from drake_quad.errors import InputError, printable
from drake_quad.scenario.load import parse_override
from drake_quad.sweep.results import REMEDY, strange
from drake_quad.sweep.trials import run_command

SWEEP = ["drake-quad", "sweep"]
LIMIT = "--limit"


def sweep_command(study: str | Path, limit: int | None) -> str:
    """The command that carries out a study, or its first so many trials."""
    words = [*SWEEP, str(study)]
    return shlex.join(words if limit is None else [*words, LIMIT, str(limit)])


def study_in(command: Any) -> str | None:
    """The study's file in a command that `sweep_command` has made; None of any other."""
    try:
        words = shlex.split(command)
        study, limit = words[2], int(words[4]) if len(words) == 5 else None
    except (ValueError, IndexError, AttributeError):
        return None
    plain = _is_name(study) and (limit is None or limit > 0)
    return study if plain and sweep_command(study, limit) == command else None


def base_in(plain: dict[str, Any], source: str) -> str:
    """The name of the scenario that a sweep's trials are of.

    Args:
        plain: What study.json holds.
        source: Its path.

    Raises:
        InputError: It is none that a command could have.
    """
    name = plain.get("base")
    if not (isinstance(name, str) and _is_name(name)):
        remedy = f"must be a scenario's name or file, in one line; {REMEDY}"
        raise InputError(source=source, field="base", value=name, remedy=remedy)
    return name


def with_commands(table: pa.Table, base: str, source: str) -> pa.Table:
    """The table of trials with each trial's command made of its overrides.

    Args:
        table: Of `read_table`.
        base: Name of the scenario, of `base_in`.
        source: The table's file.

    Raises:
        InputError: Something in the column of overrides is no override.
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
    """Whether it can be a file's name that is no option, in one line."""
    return bool(word) and not word.startswith("-") and printable(word) == word
