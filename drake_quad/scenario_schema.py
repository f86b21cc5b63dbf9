"""YAML text against the scenario's fields: unknown keys and wrong types, by their exact paths.

yaml_load_typed checks these too, but its complaints name neither the path nor what would be
right, and it lets nan, inf and a float for a whole number pass.
"""

import dataclasses
import difflib
import math
import re
import sys
import types
import typing
from typing import Any

import yaml
from pydrake.common.yaml import yaml_load_data

from drake_quad.errors import InputError

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_NAMES = {float: "a number", int: "a whole number", str: "text", bool: "true or false"}


def parse_yaml(text: str, *, source: str) -> dict[str, Any]:
    """The document of a scenario as plain data.

    Top-level keys that begin with an underscore hold anchors for the rest, and are dropped.

    Raises:
        InputError: Not YAML, a key given twice, empty, or not a mapping.
    """

    def error(value: Any, remedy: str) -> InputError:
        return InputError(source=source, field="document", value=value, remedy=remedy)

    try:
        _refuse_twins(yaml.compose(text, Loader=yaml.SafeLoader), set())
        data = yaml_load_data(text, private=True)
    except yaml.MarkedYAMLError as problem:
        mark = problem.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}" if mark else "somewhere"
        raise error(where, f"not YAML: {problem.problem or problem.context}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as problem:
        raise error("text", f"not YAML: {str(problem).splitlines()[0]}") from None
    if data is None:
        raise error("", "empty: a scenario needs a course at least")
    if not isinstance(data, dict):
        raise error(type(data).__name__, "must be a mapping of fields, such as course: [...]")
    return {key: value for key, value in data.items() if not str(key).startswith("_")}


def _refuse_twins(node: Any, seen: set[int]) -> None:
    """Raises yaml's own error at a key that its mapping already has: YAML would drop the first."""
    if node is None or id(node) in seen:
        return
    seen.add(id(node))
    if isinstance(node, yaml.SequenceNode):
        for item in node.value:
            _refuse_twins(item, seen)
    elif isinstance(node, yaml.MappingNode):
        keys = set()
        for key, value in node.value:
            word = str(key.value)
            if word in keys:
                raise yaml.MarkedYAMLError(
                    problem=f"{word} is given twice", problem_mark=key.start_mark
                )
            keys.add(word)
            _refuse_twins(value, seen)


def field_types(schema: Any) -> dict[str, Any] | None:
    """The fields of a dataclass or of one of Drake's config structs; None of anything else."""
    if dataclasses.is_dataclass(schema):
        return {f.name: f.type for f in dataclasses.fields(schema)}
    own = getattr(schema, "__fields__", None)
    return None if own is None else {f.name: f.type for f in own}


def unwrap_optional(schema: Any) -> tuple[Any, bool]:
    """(T, True) of `T | None`, else (schema, False)."""
    if typing.get_origin(schema) in (typing.Union, types.UnionType):
        inner = [arg for arg in typing.get_args(schema) if arg is not type(None)]
        return inner[0], True
    return schema, False


def unknown_key_remedy(key: object, known: typing.Iterable[str]) -> str:
    """What to say of a key that no field has: the nearest names, or all of them."""
    known = list(known)
    near = difflib.get_close_matches(str(key), known, n=3, cutoff=0.5)
    if near:
        return f"no such field; did you mean {' or '.join(near)}?"
    return f"no such field; there are {', '.join(known)}"


def conform(data: Any, schema: Any, *, path: str, source: str) -> Any:
    """Returns `data` with numbers as the schema has them, or raises at the first misfit.

    Args:
        data: Plain data, as YAML gives it.
        schema: A dataclass, one of Drake's config structs, `list[T]`, `T | None`, or a scalar.
        path: Of `data` in the document, for example `course[1]`; empty for the document.
        source: The file.

    Raises:
        InputError: An unknown key, a wrong type, nan or inf.
    """

    def error(remedy: str) -> InputError:
        return InputError(source=source, field=path or "document", value=data, remedy=remedy)

    schema, optional = unwrap_optional(schema)
    if data is None and optional:
        return None
    fields = field_types(schema)
    if fields is not None:
        if not isinstance(data, dict):
            raise error(f"must be a mapping of {', '.join(fields)}")
        for key, value in data.items():
            if key not in fields:
                raise InputError(
                    source=source,
                    field=f"{path}.{key}".lstrip("."),
                    value=value,
                    remedy=unknown_key_remedy(key, fields),
                )
        return {
            key: conform(value, fields[key], path=f"{path}.{key}".lstrip("."), source=source)
            for key, value in data.items()
        }
    if typing.get_origin(schema) is list:
        if not isinstance(data, list):
            raise error("must be a list")
        (item,) = typing.get_args(schema)
        return [
            conform(value, item, path=f"{path}[{i}]", source=source) for i, value in enumerate(data)
        ]
    value = _scalar(data, schema)
    if value is None:
        raise error(f"must be {_NAMES[schema]}")
    if isinstance(value, float) and not math.isfinite(value):
        raise error("must be finite")
    return value


def _scalar(data: Any, schema: type) -> Any:
    """`data` as a `schema` (float, int, str or bool), or None where it is not one."""
    if schema is float:
        if isinstance(data, str) and _NUMBER.fullmatch(data):  # YAML 1.1 reads 1e-3 as text
            return float(data)
        if isinstance(data, float) or type(data) is int:
            return float(data) if abs(data) <= sys.float_info.max else math.inf
        return None
    return data if type(data) is schema else None
