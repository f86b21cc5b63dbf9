"""What every complaint about an element of a course needs: the field's path, and its value."""

import difflib
import math
from numbers import Real
from typing import Any

from drake_quad.errors import InputError
from drake_quad.terrain_elements import Element


class Checker:
    """Checks fields of one element.

    Args:
        element: As the person wrote it.
        path: Of the element in the file, for example `course[2]`.
        source: What an error names as the holder of the field, for example the file.
    """

    def __init__(self, element: Element, path: str, source: str) -> None:
        self.element = element
        self.path = path
        self.source = source

    def error(self, field: str, remedy: str, *value: Any) -> InputError:
        """The error at `field` of this element, by default with that field's value."""
        shown = value[0] if value else getattr(self.element, field)
        path = f"{self.path}.{field}"
        return InputError(source=self.source, field=path, value=shown, remedy=remedy)

    def check_word(self, field: str, words: tuple[str, ...]) -> None:
        """The field must be one of the words."""
        value = getattr(self.element, field)
        if value not in words:
            near = difflib.get_close_matches(str(value), words, n=1, cutoff=0.5)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise self.error(field, f"must be {' or '.join(words)}{hint}")

    def number(self, field: str) -> float:
        """The field as a finite float, or the error."""
        value = getattr(self.element, field)
        if value is None:
            raise self.error(field, f"{self.element.kind} must say its {field}")
        return self.finite(field, value)

    def finite(self, field: str, value: Any) -> float:
        """The value as a finite float, or the error at `field`."""
        if isinstance(value, bool) or not isinstance(value, Real):
            raise self.error(field, "must be a number", value)
        if not math.isfinite(value):
            raise self.error(field, "must be finite", value)
        return float(value)
