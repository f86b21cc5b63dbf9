"""YAML text as plain data, or one clear error: nothing in it hangs, chokes or is silently lost."""

import dataclasses
import difflib
import math
import re
import sys
import types
import typing
from typing import Any

import yaml

from drake_quad.errors import InputError, brief, did_you_mean

MOST_VALUES = 1_000_000  # in a document, its aliases written out
# Scalars that Python converts, or fails to convert.
CONVERTED = {f"tag:yaml.org,2002:{kind}" for kind in ("int", "float", "bool", "timestamp")}
# Numbers of YAML 1.1 that people write for other numbers: 010 is 8 there, and 1:30 is 90.
AMBIGUOUS = re.compile(r"[-+]?(0[0-9_]+|[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?)")
CONVERSION_ERRORS = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError)
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


class BareNumber(str):
    """A number without quotes that YAML 1.1 takes for text, such as 1e8: it may be either."""


class _Loader(yaml.SafeLoader):
    """Tells a number that YAML 1.1 takes for text from text in quotes; a tag is a field `_tag`."""

    def tagged(self, tag: str, node: Any) -> dict[Any, Any]:
        """A mapping with a tag, as Drake's own loader gives it; no schema here has such a field."""
        return {**self.construct_mapping(node), "_tag": tag}


_Loader.add_multi_constructor("", _Loader.tagged)
_BARE = "tag:drake_quad,2026:number"
_Loader.add_implicit_resolver(_BARE, re.compile(rf"(?:{_NUMBER.pattern})\Z"), [*"+-.0123456789"])
_Loader.add_constructor(_BARE, lambda _, node: BareNumber(node.value))


def parse_yaml(text: str, *, source: str, needs: str = "course: [...]") -> dict[str, Any]:
    """The document of a file as plain data.

    Top-level keys that begin with an underscore hold anchors for the rest, and are dropped.

    Args:
        text: The document.
        source: Name of its file, for errors.
        needs: An example of a field that it has, for errors.

    Raises:
        InputError: Not YAML, a key given twice, a number or date that is none, aliases without
            end, empty, or not a mapping.
    """

    def error(value: Any, remedy: str) -> InputError:
        return InputError(source=source, field="document", value=value, remedy=remedy)

    try:
        loader = yaml.SafeLoader("")
        _count_values(yaml.compose(text, Loader=yaml.SafeLoader), {}, loader)
        data = yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as problem:
        mark = problem.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}" if mark else "somewhere"
        reason = " ".join(word for word in (problem.context, problem.problem) if word)
        raise error(where, f"not YAML: {reason}") from None
    except RecursionError:
        raise error("text", "not YAML: brackets within brackets too deep to be read") from None
    except (yaml.YAMLError, *CONVERSION_ERRORS) as problem:
        raise error("text", f"not YAML: {' '.join(str(problem).split())}") from None
    if data is None:
        raise error("", f"empty: {needs} is needed at least")
    if not isinstance(data, dict):
        raise error(type(data).__name__, f"must be a mapping of fields, such as {needs}")
    return {key: _unshared(value) for key, value in data.items() if not str(key).startswith("_")}


def parse_value(text: str) -> Any:
    """What a piece of YAML stands for, such as an override's value: as strictly as a file's.

    Raises:
        YAMLError: It is not YAML, has a key twice, or a number or date that is none.
    """
    try:
        _count_values(yaml.compose(text, Loader=yaml.SafeLoader), {}, yaml.SafeLoader(""))
        return _unshared(yaml.load(text, Loader=_Loader))
    except CONVERSION_ERRORS as problem:
        raise yaml.YAMLError(str(problem)) from None


def bare_as_numbers(value: Any) -> Any:
    """The value with every BareNumber in it as the number: where there is no schema to decide."""
    if isinstance(value, dict):
        return {key: bare_as_numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [bare_as_numbers(item) for item in value]
    return float(value) if isinstance(value, BareNumber) else value


def _unshared(value: Any) -> Any:
    """The value without shared parts: a change at one alias does not change the others."""
    if isinstance(value, dict):
        return {key: _unshared(item) for key, item in value.items()}
    return [_unshared(item) for item in value] if isinstance(value, list) else value


def _count_values(node: Any, seen: dict[int, int], loader: yaml.SafeLoader) -> int:
    """Counts the values of a node with its aliases written out.

    Args:
        node: Node of the composed document.
        seen: Number of values of each node so far, by id; 0 while a node is being counted.
        loader: Loader that converts scalars.

    Raises:
        MarkedYAMLError: At a key that its mapping already has (YAML would drop the first), at a
            scalar that cannot be made, and where there are too many values.
    """
    if node is None:
        return 0
    if id(node) not in seen:
        seen[id(node)] = 0
        if isinstance(node, yaml.SequenceNode):
            total = 1 + sum(_count_values(item, seen, loader) for item in node.value)
        elif isinstance(node, yaml.MappingNode):
            _check_keys(node)
            total = 1 + sum(_count_values(value, seen, loader) for _, value in node.value)
        else:
            total = 1
            _check_scalar(node, loader)
        seen[id(node)] = total
    if not 0 < seen[id(node)] <= MOST_VALUES:
        many = "holds itself" if not seen[id(node)] else f"comes to more than {MOST_VALUES} values"
        raise yaml.MarkedYAMLError(
            problem=f"what is here {many}, by its aliases", problem_mark=node.start_mark
        )
    return seen[id(node)]


def _check_keys(node: yaml.MappingNode) -> None:
    """Raises yaml's own error at a key that is no word, and at one that was there before."""
    keys = set()
    for key, _ in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise yaml.MarkedYAMLError(problem="a key is a word", problem_mark=key.start_mark)
        _check_text(key)
        if key.value in keys:
            raise yaml.MarkedYAMLError(
                problem=f"{brief(key.value)[1:-1]} is given twice", problem_mark=key.start_mark
            )
        keys.add(key.value)


def _check_text(node: yaml.ScalarNode) -> None:
    """Raises yaml's own error at half a letter (a lone surrogate): no file can hold it."""
    try:
        node.value.encode()
    except UnicodeEncodeError:
        problem = f"{brief(node.value)} is no text: it has half a letter (a lone surrogate)"
        raise yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark) from None


def _check_scalar(node: yaml.ScalarNode, loader: yaml.SafeLoader) -> None:
    """Raises yaml's own error if the scalar is not of the type that it looks like."""
    _check_text(node)
    if node.tag not in CONVERTED:
        return
    if node.tag.endswith((":int", ":float")) and AMBIGUOUS.fullmatch(node.value):
        problem = f"{brief(node.value)} is another number in YAML, of base 8 or 60; say it plainly"
        raise yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)
    try:
        loader.construct_object(node)
    except CONVERSION_ERRORS:
        kind = {"int": "whole number", "float": "number", "timestamp": "date"}
        word = node.tag.rpartition(":")[2]
        problem = f"{brief(node.value)} is no {kind.get(word, word)}; text goes in quotes"
        raise yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark) from None


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
        path: Path of `data` in the document, for example `course[1]`; empty for the document.
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
        _check_choices(data, schema, path=path, source=source)
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
        quoted = schema in (float, int) and isinstance(data, str) and _NUMBER.fullmatch(data)
        raise error(f"must be {_NAMES[schema]}{', without quotes' if quoted else ''}")
    if isinstance(value, float) and not math.isfinite(value):
        raise error("must be finite")
    return value


def _check_choices(data: dict[Any, Any], schema: Any, *, path: str, source: str) -> None:
    """Checks first the fields that choose between kinds of things, such as `kind`.

    With an unknown kind, its own fields would be reported as unknown.

    Raises:
        InputError: Text in a field whose metadata has `words`, and that is none of them.
    """
    own = dataclasses.fields(schema) if dataclasses.is_dataclass(schema) else ()
    for f in own:
        words, value = f.metadata.get("words"), data.get(f.name)
        if words and isinstance(value, str) and value not in words:
            hint = did_you_mean(value, words)
            raise InputError(
                source=source,
                field=f"{path}.{f.name}".lstrip("."),
                value=value,
                remedy=f"no such {f.name}; must be {' or '.join(words)}{hint}",
            )


def _scalar(data: Any, schema: type) -> Any:
    """`data` as a `schema` (float, int, str or bool), or None where it is not one."""
    if isinstance(data, BareNumber):
        return float(data) if schema is float else str(data) if schema is str else None
    if schema is float:
        if isinstance(data, float) or type(data) is int:
            return float(data) if abs(data) <= sys.float_info.max else math.inf
        return None
    return data if type(data) is schema else None
