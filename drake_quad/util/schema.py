"""Plain data against the scenario's fields: unknown keys and wrong types, by their exact paths.

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

from drake_quad.errors import InputError

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_NAMES = {float: "a number", int: "a whole number", str: "text", bool: "true or false"}


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
        _check_words(data, schema, path=path, source=source)
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


def _check_words(data: dict[Any, Any], schema: Any, *, path: str, source: str) -> None:
    """Sees first that what says which of several things this is, says one that there is.

    Else its own fields would be called unknown.

    Raises:
        InputError: Text in a field whose metadata has `words`, and that is none of them.
    """
    own = dataclasses.fields(schema) if dataclasses.is_dataclass(schema) else ()
    for f in own:
        words, value = f.metadata.get("words"), data.get(f.name)
        if words and isinstance(value, str) and value not in words:
            near = difflib.get_close_matches(value, words, n=1, cutoff=0.5)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise InputError(
                source=source,
                field=f"{path}.{f.name}".lstrip("."),
                value=value,
                remedy=f"no such {f.name}; must be {' or '.join(words)}{hint}",
            )


def _scalar(data: Any, schema: type) -> Any:
    """`data` as a `schema` (float, int, str or bool), or None where it is not one."""
    if schema is float:
        if isinstance(data, str) and _NUMBER.fullmatch(data):  # YAML 1.1 reads 1e-3 as text
            return float(data)
        if isinstance(data, float) or type(data) is int:
            return float(data) if abs(data) <= sys.float_info.max else math.inf
        return None
    return data if type(data) is schema else None
