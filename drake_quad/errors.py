"""The one tree of errors. An error holds the offending data, and its text gives the remedy."""

import errno
import reprlib
from collections.abc import Iterable
from typing import Any

LONGEST = 400  # letters of a value, or of a field's path, in a line
LONGEST_PATH = 1000
LONGEST_REMEDY = 3000
# Errors of the system for a full, broken or read-only disk, too many files, or too little memory.
MACHINE_FAULTS = (
    errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EMFILE, errno.ENFILE, errno.ENOMEM,
)  # fmt: skip


class _Brief(reprlib.Repr):
    """repr() that neither follows aliases without end nor chokes on what has no repr().

    Depth times width bound the work: ten lists of ten times another, nine levels of them, are a
    few lines of YAML and more than any memory holds when written out.
    """

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxlong = 4, 40
        self.maxdict = self.maxlist = self.maxtuple = self.maxset = 30
        self.maxstring = self.maxother = LONGEST

    def repr_int(self, x: int, level: int) -> str:
        """As it is, or how long it is: Python writes out no more than 4300 digits."""
        if x.bit_length() > 4000:
            return f"<a whole number of about {int(0.30103 * x.bit_length())} digits>"
        return super().repr_int(x, level)

    def repr_dict(self, x: dict[Any, Any], level: int) -> str:
        """In the order given; reprlib sorts."""
        if level <= 0:
            return "{...}"
        shown = list(x.items())[: self.maxdict]
        pieces = [f"{self.repr1(k, level - 1)}: {self.repr1(v, level - 1)}" for k, v in shown]
        return "{" + ", ".join([*pieces, *(["..."] if len(x) > len(shown) else [])]) + "}"


_BRIEF = _Brief()


def brief(value: object) -> str:
    """A value for an error's line: its repr(), shortened if it is long, made in a bounded time."""
    return _cut(_BRIEF.repr(value), LONGEST)


def printable(text: str) -> str:
    """The text with what would steer a terminal, or break its line, written out as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def did_you_mean(value: object, words: Iterable[str]) -> str:
    """The end of an error's line that names the word most like a value; empty if none is."""
    import difflib

    near = difflib.get_close_matches(str(value), list(words), n=1, cutoff=0.5)
    return f"; did you mean {near[0]}?" if near else ""


class DrakeQuadError(Exception):
    """Root of every error that drake_quad raises on purpose."""


class InputError(DrakeQuadError):
    """Something that a person gave cannot be used: the command line exits with status 2.

    The text has what is very long shortened; the attributes are as given.

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
        where = f"{_cut(source, LONGEST_PATH)}: {_cut(field, LONGEST)} = {brief(value)}"
        super().__init__(" ".join(f"{where}: {_cut(remedy, LONGEST_REMEDY)}".split()))


class MachineError(InputError):
    """This machine cannot do what it should, as one whose disk is full: status 2 as well.

    The input may be right: another machine may do it, or this one once it is repaired.
    """


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


def _cut(text: str, longest: int) -> str:
    """The text, or its beginning and end with how much there is of it."""
    if len(text) <= longest:
        return text
    return f"{text[: longest // 2]}... ({len(text)} letters) ...{text[-longest // 4 :]}"


def check_kind(value: object, kinds: tuple[type, ...], what: str, remedy: str) -> None:
    """Makes sure that what was given is of one of some classes.

    Raises:
        InputError: It is not.
    """
    if not isinstance(value, kinds):
        raise InputError(source=what, field="type", value=type(value).__name__, remedy=remedy)
