"""Files that are written whole or not at all, users' paths, and JSON that anything reads."""

import json
import math
import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from errno import EISDIR
from html import escape
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError

# ------------------------------------------------------------------------------------------------
# Files that are whole or not there: written beside their place, then moved into it.
# ------------------------------------------------------------------------------------------------


Write = Callable[[Path], object]  # given the path to fill


def write_together(
    files: Mapping[Path, Write], *, gone: Iterable[Path] = (), option: str = "--out"
) -> None:
    """Fills all files beside their places, and moves them there once all are whole.

    A kill on the way leaves no mixture of old and new that reads as whole: what is found by its
    last file is not found until all is there.

    Args:
        files: What fills each; is given the path to fill.
        gone: Older files that would belong to none of the new: they are removed.
        option: By which their place was asked for, to be named by the error.

    Raises:
        InputError: If one cannot be filled, with the system's reason; what was there before stays.
    """
    partials = {path: _partial(path) for path in files}
    gone, now = tuple(gone), next(iter(files))
    try:
        for now, write in files.items():
            _fill(now, write)
        for now in (*files, *gone):
            if now.is_dir():  # before anything is removed
                raise IsADirectoryError(EISDIR, "is a directory")
        *before, last = files
        for now in (*([last] if before else []), *gone):
            now.unlink(missing_ok=True)
        for now, partial in partials.items():
            partial.replace(now)
    except OSError as error:
        for partial in partials.values():
            with suppress(OSError):  # it may never have been made
                partial.unlink()
        raise InputError(
            source=option,
            field=now.name,
            value=str(now),
            remedy=f"cannot be written: {error.strerror or error}; make room, or give another "
            f"place with {option}",
        ) from None


def write_whole(path: Path, write: Write, *, option: str = "--out") -> None:
    """The same of one file, which is moved over what was there before; see `write_together`."""
    write_together({path: write}, option=option)


def _partial(path: Path) -> Path:
    return path.with_name(f".{path.name}.part")


def _fill(path: Path, write: Write) -> None:
    """Fills the file beside `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = _partial(path)
    partial.unlink(missing_ok=True)  # of a kill; or a pipe, or a link to a file elsewhere
    write(partial)
    with partial.open("rb") as written:  # or a power cut could leave its name without its text
        os.fsync(written.fileno())


# ------------------------------------------------------------------------------------------------
# Paths as people type them.
# ------------------------------------------------------------------------------------------------


def user_path(path: str | Path) -> Path:
    """The path with `~` and `~name` in full; as it is where there is no such user.

    Then no file is there either, which whoever opens it says better than pathlib's RuntimeError.
    """
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


# ------------------------------------------------------------------------------------------------
# JSON of files that others may have spoilt: plain data, or nothing.
# ------------------------------------------------------------------------------------------------


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


# ------------------------------------------------------------------------------------------------
# Plain values as notebooks show them.
# ------------------------------------------------------------------------------------------------


def html_table(rows: Iterable[tuple[str, str]]) -> str:
    """Names and values as a table in HTML."""
    cells = (f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows)
    return f"<table>{''.join(cells)}</table>"
