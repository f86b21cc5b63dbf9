"""Reads what a sweep left, whoever had it since: every value is seen to be of its kind."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa

from drake_quad.errors import InputError
from drake_quad.given_files import MOST_JSON, read_given
from drake_quad.plain_json import plain_of
from drake_quad.scenario_schema import conform
from drake_quad.sweep.study import FREE
from drake_quad.sweep.study_check_vary import LONGEST_AXIS
from drake_quad.sweep.study_config import Study

REMEDY = "give the directory of a finished `drake-quad sweep`"
SAID = {
    pa.int64(): "whole numbers",
    pa.float64(): "numbers",
    pa.bool_(): "true or false",
    pa.string(): "text",
    pa.list_(pa.string()): "lists of text",
}

Kind = tuple[Callable[[Any], bool], str]  # whether a value is of it, and what that is
TEXT: Kind = (lambda value: isinstance(value, str), "text")
TRUTH: Kind = (lambda value: isinstance(value, bool), "true or false")
MAPPING: Kind = (lambda value: isinstance(value, dict), "a mapping")
_LIST: Kind = (lambda value: isinstance(value, list), "a list")
_CASES: Kind = (
    lambda value: (
        isinstance(value, dict)
        and all(isinstance(case, list) for case in value.values())
        and all(isinstance(text, str) for case in value.values() for text in case)
    ),
    "a mapping of names to lists of overrides",
)


def read_plain(
    directory: Path, name: str, kinds: Mapping[str, Kind], *, perhaps: Mapping[str, Kind] = {}
) -> dict[str, Any]:
    """A file of plain values that a sweep left.

    Args:
        directory: The sweep's.
        name: Of the file.
        kinds: Of the values that will be read.
        perhaps: The same of values that need not be there.

    Raises:
        InputError: It cannot be read, or a value is of another kind.
    """
    path = directory / name

    def error(what: str) -> InputError:
        remedy = f"{what}; {REMEDY}"
        return InputError(source=str(directory), field=name, value=str(path), remedy=remedy)

    try:
        plain = plain_of(read_given(path, most=MOST_JSON))
    except OSError as problem:
        raise error(f"cannot be read: {problem.strerror}") from None
    if plain is None:
        raise error("is cut short, or no mapping in JSON")
    for key, (fits, said) in {**kinds, **perhaps}.items():
        if not fits(plain.get(key)) and (key in plain or key in kinds):
            remedy = f"must be {said}; {REMEDY}"
            raise InputError(source=str(path), field=key, value=plain.get(key), remedy=remedy)
    return plain


def read_definition(directory: Path, name: str) -> dict[str, Any]:
    """The study's definition as plain data, its values of the types that a study's are.

    Args:
        directory: The sweep's.
        name: Of the file that has it.

    Raises:
        InputError: It cannot be read, or a value is of another type.
    """
    plain = read_plain(directory, name, {"definition": MAPPING})["definition"]
    source, given = str(directory / name), plain.get("vary")
    varies = given if isinstance(given, list) else []
    # What varies, the part of it that can be of any type by itself: see FREE.
    free = [
        {key: one[key] for key in FREE if one.get(key) is not None} if isinstance(one, dict) else {}
        for one in varies
    ]
    rest = [
        {key: one[key] for key in one if key not in FREE} if isinstance(one, dict) else one
        for one in varies
    ]

    def fail(field: str, value: Any, what: str) -> InputError:
        remedy = f"must be {what}; {REMEDY}"
        return InputError(source=source, field=f"definition.{field}", value=value, remedy=remedy)

    for k, own in enumerate(free):
        for key, value in own.items():
            fits, said = _CASES if key == "cases" else _LIST
            if not fits(value):
                raise fail(f"vary[{k}].{key}", value, said)
    whole = {**plain, "vary": given if rest == [] else rest}
    typed: dict[str, Any] = conform(whole, Study, path="definition", source=source)
    typed["vary"] = [{**one, **own} for one, own in zip(typed["vary"], free, strict=True)]
    if "scenario" not in typed:
        raise fail("scenario", None, "a scenario's name")
    if typed.get("draws") not in ("independent", "common"):
        raise fail("draws", typed.get("draws"), "independent or common")
    for k, one in enumerate(typed["vary"]):
        axis = one.get("linspace")
        if axis is not None and not (len(axis) == 3 and 1 <= axis[2] <= LONGEST_AXIS):
            raise fail(f"vary[{k}].linspace", axis, f"from, to, and how many: 1 to {LONGEST_AXIS}")
    return typed


def check_column(
    table: pa.Table, name: str, kind: pa.DataType, source: str, *, gaps: bool = False
) -> None:
    """Sees that a column is of the type that sweeps write.

    Args:
        table: The file's.
        name: Of the column.
        kind: One of SAID.
        source: The file.
        gaps: Whether values may be missing.

    Raises:
        InputError: It is not there, of another type, or has gaps.
    """
    if name not in table.column_names:
        raise strange(source, name, None, f"is not there; must be a column of {SAID[kind]}")
    found = table[name]
    if found.type != kind:
        raise strange(source, name, str(found.type), f"must be a column of {SAID[kind]}")
    if found.null_count and not gaps:
        raise strange(source, name, None, f"must be {SAID[kind]} in every row")


def strange(source: str, name: str, value: Any, what: str) -> InputError:
    """Of a column that sweeps do not write so."""
    return InputError(source=source, field=name, value=value, remedy=f"{what}; {REMEDY}")
