"""Files that are whole or not there: written beside their place, then moved into it."""

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from drake_quad.errors import InputError

Write = Callable[[Path], object]  # given the path to fill


def write_together(files: Mapping[Path, Write], *, gone: Iterable[Path] = ()) -> None:
    """Fills all files beside their places, and moves them there once all are whole.

    A kill on the way leaves no mixture of old and new that reads as whole: what is found by its
    last file is not found until all is there.

    Args:
        files: What fills each; all in one directory.
        gone: Older files that would belong to none of the new: they are removed.

    Raises:
        InputError: If they cannot be written; what was there before stays.
    """
    partials = {path: _partial(path) for path in files}
    now = next(iter(files))
    try:
        for now, write in files.items():
            _fill(now, write)
        for now in (*gone, list(files)[-1]):
            now.unlink(missing_ok=True)
        for now, partial in partials.items():
            partial.replace(now)
    except OSError as error:
        for partial in partials.values():
            with suppress(OSError):
                partial.unlink()
        raise _unwritten(now, error, "--out") from None


def write_whole(path: Path, write: Write, *, option: str = "--out") -> None:
    """Has `write` fill a file beside `path` and moves it there.

    Args:
        path: Of the file.
        write: Is given the path to fill.
        option: By which its place was asked for, to be named by the error.

    Raises:
        InputError: If it cannot be written, with the system's reason; what was there before stays.
    """
    partial = _partial(path)
    try:
        _fill(path, write)
        partial.replace(path)
    except OSError as error:
        with suppress(OSError):  # it may never have been made
            partial.unlink()
        raise _unwritten(path, error, option) from None


def _partial(path: Path) -> Path:
    return path.with_name(f".{path.name}.part")


def _fill(path: Path, write: Write) -> None:
    """Fills the file beside `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = _partial(path)
    write(partial)
    with partial.open("rb") as written:  # or a power cut could leave its name without its text
        os.fsync(written.fileno())


def _unwritten(path: Path, error: OSError, option: str) -> InputError:
    return InputError(
        source=option,
        field=path.name,
        value=str(path),
        remedy=f"cannot be written: {error.strerror or error}; make room, or give another "
        f"place with {option}",
    )
