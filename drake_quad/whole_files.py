"""Files that are whole or not there: written beside their place, then moved into it."""

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from drake_quad.errors import InputError


def write_whole(path: Path, write: Callable[[Path], object], *, option: str = "--out") -> None:
    """Has `write` fill a file beside `path` and moves it there.

    Args:
        path: Of the file.
        write: Is given the path to fill.
        option: By which its place was asked for, to be named by the error.

    Raises:
        InputError: If it cannot be written, with the system's reason; what was there before stays.
    """
    partial = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(partial)
        with partial.open("rb") as written:  # or a power cut could leave its name without its text
            os.fsync(written.fileno())
        partial.replace(path)
    except OSError as error:
        with suppress(OSError):  # it may never have been made
            partial.unlink()
        raise InputError(
            source=option,
            field=path.name,
            value=str(path),
            remedy=f"cannot be written: {error.strerror or error}; make room, or give another "
            f"place with {option}",
        ) from None
