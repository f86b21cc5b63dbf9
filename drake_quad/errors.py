"""The one tree of errors. An error carries the offending data, and its text says what to do."""

from typing import Any


class DrakeQuadError(Exception):
    """Root of every error that drake_quad raises on purpose."""


class InputError(DrakeQuadError):
    """Something that a person gave cannot be used: the command line exits with status 2.

    Args:
        source: The file (or option) that holds the value.
        field: Dotted path of the field in it, for example `course[1].rise`.
        value: The value as given.
        remedy: What is wrong and what would be right, in a few words.
    """

    def __init__(self, *, source: str, field: str, value: Any, remedy: str) -> None:
        self.source = source
        self.field = field
        self.value = value
        self.remedy = remedy
        super().__init__(" ".join(f"{source}: {field} = {value!r}: {remedy}".split()))


class PlanningError(DrakeQuadError):
    """No plan exists for the task as posed: the command line exits with status 1.

    Args:
        reason: Which constraint fails, by how much, and where.
        data: The figures behind the reason.
    """

    def __init__(self, reason: str, **data: Any) -> None:
        self.reason = reason
        self.data = data
        super().__init__(reason)
