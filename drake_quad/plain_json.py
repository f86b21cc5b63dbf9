"""JSON of files that others may have spoilt: plain data, or nothing."""

import json
import math
from typing import Any


def plain_of(text: bytes) -> dict[str, Any] | None:
    """The mapping that a line, or a whole file, has as JSON; None if it has none."""
    try:
        value = json.loads(text, parse_int=_whole)
        # Halves of letters, of which JSON knows, can be written to no file again.
        json.dumps(value, ensure_ascii=False).encode()
    except (ValueError, RecursionError, OverflowError):
        return None
    return value if isinstance(value, dict) else None


def _whole(text: str) -> int:
    """A whole number; OverflowError of one that is no number of a table or a picture."""
    value = int(text)
    float(value)
    return value


def is_number(value: Any) -> bool:
    """Whether it is a number that a table can hold; true and false are none."""
    return (type(value) is float and math.isfinite(value)) or is_whole(value)


def is_whole(value: Any) -> bool:
    """The same of whole numbers."""
    return type(value) is int and abs(value) < 2**63
