"""How results are spoilt, and how the line is read that says so."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa

from drake_quad.errors import InputError

NESTED = "[" * 200_000  # deeper than Python's stack
Change = Callable[[dict[str, Any]], object]


def change_json(path: Path, place: str, value: Any) -> None:
    """Puts a value in at a dotted place; one that is None is taken out."""
    plain = json.loads(path.read_text())
    *way, last = [int(step) if step.isdecimal() else step for step in place.split(".")]
    inner = plain
    for step in way:
        inner = inner[step]
    if value is None:
        del inner[last]
    else:
        inner[last] = value
    path.write_text(json.dumps(plain))


def line_of(told: InputError, *words: str) -> str:
    """The error's text, if it is one line that has these words."""
    line = str(told)
    assert "\n" not in line and all(word in line for word in words), line
    return line


def without(name: str) -> Callable[[pa.Table], pa.Table]:
    return lambda table: table.drop_columns([name])


def filled(name: str, values: Any) -> Callable[[pa.Table], pa.Table]:
    return lambda table: table.set_column(table.column_names.index(name), name, pa.array(values))


def spoil_line(path: Path, number: int, change: Change) -> bytes:
    """Changes a line of a journal; all of it as it is then."""
    lines = path.read_text().splitlines()
    line = json.loads(lines[number])
    change(line)
    lines[number] = json.dumps(line)
    path.write_text("\n".join(lines) + "\n")
    return path.read_bytes()
