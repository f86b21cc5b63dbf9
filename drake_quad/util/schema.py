"""Fields of YAML documents: unit, meaning, words and bounds of each beside it, and their check."""

import dataclasses
import math
import typing
from typing import Any

from drake_quad.errors import InputError, did_you_mean

CHOICES, BOUNDS, TEXT, UNIT, INSIDE = "choices", "bounds", "text", "unit", "inside"


@dataclasses.dataclass(frozen=True)
class FieldBound:
    """What a number of a field must be, and what to say where it is not.

    Attributes:
        remedy: What would be right.
        least: The number is at least this.
        above: The number is more than this.
        most: The number is at most this.
        below: The number is less than this.
    """

    remedy: str
    least: float = -math.inf
    above: float = -math.inf
    most: float = math.inf
    below: float = math.inf

    def holds(self, value: float | list[float]) -> bool:
        """Whether the number, or each of a list of numbers, is within."""
        numbers = value if isinstance(value, list) else [value]
        return all(self.above < x < self.below and self.least <= x <= self.most for x in numbers)


def positive() -> FieldBound:
    """More than 0."""
    return FieldBound("must be more than 0", above=0.0)


def not_negative() -> FieldBound:
    """At least 0."""
    return FieldBound("must not be negative", least=0.0)


def within(least: float, most: float) -> FieldBound:
    """From `least` to `most`, both included."""
    return FieldBound(f"must be from {least:g} to {most:g}", least=least, most=most)


def up_to(most: float, unit: str) -> FieldBound:
    """More than 0 and at most `most`."""
    return FieldBound(f"must be more than 0 {unit}, {most:g} {unit} at most", above=0.0, most=most)


def number(default: Any, unit: str, text: str, *bounds: FieldBound) -> Any:
    """A dataclass's field of one number, or of a list of numbers.

    Args:
        default: Its default; a list is copied for each instance.
        unit: Its unit, as the documents have it.
        text: What it means, a sentence for the documents.
        *bounds: What it must be; the first that does not hold is reported.
    """
    metadata = {UNIT: unit, TEXT: text, BOUNDS: bounds}
    if isinstance(default, list):
        return dataclasses.field(default_factory=default.copy, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def choice(default: str, choices: typing.Sequence[str], text: str) -> Any:
    """A dataclass's field of one of a few words."""
    return dataclasses.field(default=default, metadata={CHOICES: tuple(choices), TEXT: text})


def part(factory: Any, text: str, inside: typing.Mapping[str, Any] | None = None) -> Any:
    """A dataclass's field that holds other fields, or a list of such.

    Args:
        factory: It makes the default.
        text: What it is, a sentence for the documents.
        inside: Bounds within one of Drake's config structs, which can hold no metadata: the
            bounds (a tuple) or the words (a function that returns them) of its fields, by name.
    """
    metadata = {TEXT: text, INSIDE: inside or {}}
    return dataclasses.field(default_factory=factory, metadata=metadata)


Fail = typing.Callable[[str, Any, str], InputError]


def check_fields(holder: Any, path: str, fail: Fail) -> None:
    """Checks all values of a dataclass against what stands beside its fields; None is let pass.

    Args:
        holder: The dataclass, whose types are right.
        path: Its path in the document; empty for the document.
        fail: Makes the error from a field's path, its value, and what would be right.

    Raises:
        InputError: What `fail` makes of the first value that is wrong, in the order of fields.
    """
    for f in dataclasses.fields(holder):
        own, value = f"{path}.{f.name}".lstrip("."), getattr(holder, f.name)
        _check_value(value, f.metadata.get(CHOICES, ()), f.metadata.get(BOUNDS, ()), own, fail)
        for name, rule in f.metadata.get(INSIDE, {}).items():
            inner, words = getattr(value, name), rule() if callable(rule) else ()
            _check_value(inner, words, () if words else rule, f"{own}.{name}", fail)
        if dataclasses.is_dataclass(value):
            check_fields(value, own, fail)
        elif isinstance(value, list) and value and dataclasses.is_dataclass(value[0]):
            for k, item in enumerate(value):
                check_fields(item, f"{own}[{k}]", fail)


def _check_value(
    value: Any,
    words: typing.Sequence[str],
    bounds: typing.Sequence[FieldBound],
    path: str,
    fail: Fail,
) -> None:
    """Raises what `fail` makes of a word that is none of the words, or a number out of bounds."""
    if value is None:
        return
    if words and value not in words:
        hint = did_you_mean(value, words)
        raise fail(path, value, f"must be {', '.join(words[:-1])} or {words[-1]}{hint}")
    for bound in bounds:
        if not bound.holds(value):
            raise fail(path, value, bound.remedy)
