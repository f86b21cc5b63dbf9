"""Overrides of single fields: `gait.duty_factor=0.8`, `course[1].rise=0.2`."""

import re
import typing
from typing import Any, NamedTuple

import yaml

from drake_quad.errors import InputError
from drake_quad.scenario_config import Scenario
from drake_quad.scenario_schema import field_types, unknown_key_remedy, unwrap_optional
from drake_quad.yaml_text import parse_value

_STEP = re.compile(r"([A-Za-z_]\w*)((?:\[\d{1,6}\])*)")


class Override(NamedTuple):
    """One override, taken apart."""

    text: str
    path: str
    steps: tuple[str | int, ...]  # names and indices from the document down
    value: Any

    def covers(self, field: str) -> bool:
        """Whether `field` is the overridden one, or lies within it."""
        return field == self.path or field.startswith((f"{self.path}.", f"{self.path}["))


def parse_override(text: str) -> Override:
    """Takes `path=value` apart; the value is read as YAML.

    Raises:
        InputError: No `=`, not a path, or not YAML.
    """
    path, equals, value = text.partition("=")
    path = path.strip()
    matches = [_STEP.fullmatch(part) for part in path.split(".")]
    if not equals or not all(matches):
        raise InputError(
            source="override",
            field=path,
            value=text,
            remedy="must be path=value, such as gait.duty_factor=0.8 or course[1].rise=0.2",
        )
    steps: list[str | int] = []
    for match in matches:
        assert match is not None
        steps.append(match[1])
        steps.extend(int(index) for index in re.findall(r"\d+", match[2]))
    try:
        parsed = parse_value(value)
    except (yaml.YAMLError, ValueError, RecursionError) as problem:
        why = getattr(problem, "problem", None)
        remedy = "the value is not YAML" + (f": {why}" if why else "")
        raise InputError(source="override", field=path, value=value, remedy=remedy) from None
    return Override(text=text, path=path, steps=tuple(steps), value=parsed)


def apply_override(data: dict[str, Any], override: Override) -> None:
    """Writes the override's value into a document, making the mappings on the way to it.

    Raises:
        InputError: If there is no such field, or no such element of a list.
    """
    schema: Any = Scenario
    target: Any = data
    walked = ""
    for k, step in enumerate(override.steps):
        last = k == len(override.steps) - 1
        schema, _ = unwrap_optional(schema)
        if isinstance(step, int):
            if typing.get_origin(schema) is not list:
                raise _error(override, f"{walked} is not a list")
            if not isinstance(target, list) or step >= len(target):
                length = len(target) if isinstance(target, list) else 0
                raise _error(override, f"{walked} has {length} elements, counted from 0")
            (schema,) = typing.get_args(schema)
            walked = f"{walked}[{step}]"
            empty: Any = {}
        else:
            fields = field_types(schema)
            if fields is None:
                raise _error(override, f"{walked} has no fields")
            if step not in fields:
                raise _error(override, unknown_key_remedy(step, fields))
            if not isinstance(target, dict):
                raise _error(override, f"{walked} is not a mapping")
            schema = fields[step]
            walked = f"{walked}.{step}".lstrip(".")
            empty = [] if typing.get_origin(unwrap_optional(schema)[0]) is list else {}
        if last:
            target[step] = override.value
        elif isinstance(target, dict):
            target = target.setdefault(step, empty)
        else:
            target = target[step]


def _error(override: Override, remedy: str) -> InputError:
    """The error of an override that has no place to go."""
    return InputError(source="override", field=override.path, value=override.value, remedy=remedy)
