"""Files: written whole or not at all, read with care, cached; users' paths, and plain JSON.

A pipe without a writer would be waited for without end, and a device such as /dev/zero read until
no memory is left. `read_given` and its kin read every file that a person, or an older run, may have
put there; they raise an OSError, whose `strerror` says what is wrong, as of any other file.
"""

import errno
import grp
import json
import math
import os
import pwd
import stat
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import platformdirs

from drake_quad.errors import InputError

if TYPE_CHECKING:
    import pyarrow as pa

Write = Callable[[Path], object]  # given the path to fill


def write_together(
    files: Mapping[Path, Write], *, gone: Iterable[Path] = (), option: str = "--out"
) -> None:
    """Fills all files beside their places, and moves them there once all are whole.

    A kill on the way leaves no mixture of old and new that reads as whole: what is found by its
    last file is not found until all is there.

    Args:
        files: Function that writes each file, given the path to write to.
        gone: Older files that do not belong to the new ones, to be removed.
        option: Command-line option that gave their place, for the error.

    Raises:
        InputError: If one cannot be filled, with the system's reason; what was there before stays,
            and nothing half-written does, whatever ends it.
    """
    files = {_target(path): write for path, write in files.items()}
    partials = {path: _partial(path) for path in files}
    gone, now = tuple(gone), next(iter(files))
    try:
        for now in files:
            if now.exists() and not now.is_file():  # to be in place of /dev/null would harm
                kind = "is a directory" if now.is_dir() else "is no file"
                raise OSError(errno.EISDIR, kind)
        for now, write in files.items():
            _fill(now, write)
        for now in (*files, *gone):
            if now.is_dir():  # before anything is removed
                raise IsADirectoryError(errno.EISDIR, "is a directory")
        *before, last = files
        for now in (*([last] if before else []), *gone):
            now.unlink(missing_ok=True)
        for now, partial in partials.items():
            partial.replace(now)
    except BaseException as error:  # Ctrl-C, too
        for partial in partials.values():
            with suppress(OSError):  # it may never have been made
                partial.unlink()
        if not isinstance(error, OSError):
            raise
        raise InputError(
            source=option,
            field=now.name,
            value=str(now),
            remedy=f"cannot be written: {error.strerror or error}; make room, or give another "
            f"place with {option}",
        ) from None


def write_whole(path: Path, write: Write, *, option: str = "--out") -> None:
    """Writes one file, which replaces what was there before; see `write_together`."""
    write_together({path: write}, option=option)


def _target(path: Path) -> Path:
    """Where a file is written: a link stays, and what it leads to is replaced."""
    return path.resolve() if path.is_symlink() else path


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


def user_path(path: str | Path) -> Path:
    """The path with `~` and `~name` in full; as it is where there is no such user.

    Opening that path then raises a clearer error than pathlib's RuntimeError.
    """
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


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
    """Whether it is a whole number that a table can hold."""
    return type(value) is int and abs(value) < 2**63


MIB = 1 << 20
# How many bytes a file of each kind may have: some ten times the largest that was ever needed.
MOST_YAML = MIB // 2  # PyYAML takes half a minute for a MIB
MOST_JSON = 64 * MIB
MOST_TEXT = 64 * MIB  # a Markdown page, a robot's file
MOST_MESH = 512 * MIB
MOST_TABLE = 1024 * MIB
MOST_JOURNAL = 1024 * MIB

KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def read_given(path: str | Path, *, most: int) -> bytes:
    """The bytes of a regular file.

    Args:
        path: The file's path.
        most: Greatest size of the file [bytes].

    Raises:
        IsADirectoryError: It is a directory.
        OSError: It is no regular file, it is larger, or it cannot be read.
    """
    check_given(path, most=most)  # before it is opened, which by itself may wait, or wind a tape
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(handle, "rb") as file:
        _check(os.fstat(file.fileno()), path, most)  # another may have come to its place
        # Of some files in /proc the size is not known before; others may have nothing to read yet.
        data: bytes | None = file.read(most + 1)
    if data is None:
        reason = "there is nothing to read yet, and it must be a whole file"
        raise OSError(errno.EAGAIN, reason, str(path))
    if len(data) > most:
        raise _too_large(path, len(data), most)
    return data


def read_given_text(path: str | Path, *, most: int, encoding: str = "utf-8") -> str:
    """The text of a regular file, its line ends as Python has them.

    Raises:
        OSError: As `read_given`.
        UnicodeDecodeError: It is no text in this encoding.
    """
    text = read_given(path, most=most).decode(encoding)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def is_given(path: Path) -> bool:
    """Whether anything but a directory is there: `read_given` refuses a pipe, for example."""
    return path.exists() and not path.is_dir()


def check_given(path: str | Path, *, most: int) -> None:
    """Checks that a file is a regular one and not too large, before others read it by its name.

    Raises:
        OSError: As `read_given`.
    """
    _check(Path(path).stat(), path, most)


def _check(found: os.stat_result, path: str | Path, most: int) -> None:
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(found.st_mode):
        kind = KINDS.get(stat.S_IFMT(found.st_mode), "something else")
        raise OSError(errno.EINVAL, f"it is {kind}, and must be a regular file", str(path))
    if found.st_size > most:
        raise _too_large(path, found.st_size, most)


def _too_large(path: str | Path, size: int, most: int) -> OSError:
    reason = f"it has {size / MIB:.1f} MiB or more, and may have at most {most / MIB:g} MiB"
    return OSError(errno.EFBIG, reason, str(path))


MOST_VALUES = 200_000_000  # rows times columns: an hour of a log of 300 columns at 200 Hz
MOST_MEMORY = 2048 * MIB
ROWS = 4096  # read at a time


def read_given_table(
    path: str | Path, columns: Sequence[str] | None = None, *, most_rows: int
) -> "pa.Table":
    """The table of a regular file.

    Args:
        path: The file's path.
        columns: Names of the columns to read, where they are there; all if None.
        most_rows: Greatest number of rows.

    Raises:
        OSError: It is no regular file, it or what is in it is too large, or it cannot be read.
        ArrowException: It is no Parquet, or cut short.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    check_given(path, most=MOST_TABLE)
    with pq.ParquetFile(path) as file:
        schema = file.schema_arrow
        names = [name for name in schema.names if columns is None or name in columns]
        rows = file.metadata.num_rows
        if rows > most_rows:
            raise OSError(errno.EFBIG, f"it holds {rows} rows, and may hold {most_rows}", str(path))
        if rows * max(1, len(names)) > MOST_VALUES:
            raise _table_too_large(path, f"{rows} rows of {len(names)} columns")
        parts, memory = [], 0
        for part in file.iter_batches(batch_size=ROWS, columns=names, use_threads=False):
            memory += part.nbytes
            if memory > MOST_MEMORY:
                raise _table_too_large(path, f"more than {MOST_MEMORY // MIB} MiB")
            parts.append(part)
        chosen = pa.schema([schema.field(name) for name in names], metadata=schema.metadata)
    return pa.Table.from_batches(parts, schema=chosen)


def _table_too_large(path: str | Path, what: str) -> OSError:
    reason = f"it holds {what}, and may hold {MOST_VALUES} values in {MOST_MEMORY // MIB} MiB"
    return OSError(errno.EFBIG, reason, str(path))


CACHE_VARIABLE = "DRAKE_QUAD_CACHE"
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def cache_directory() -> Path:
    """The directory that the user names in DRAKE_QUAD_CACHE, or the user's cache directory.

    A user without a home directory has none; a directory below the system's place for temporary
    files serves instead.
    """
    own = os.environ.get(CACHE_VARIABLE)
    if own:
        return Path(own).absolute()
    usual = Path(platformdirs.user_cache_dir("drake_quad"))
    if usual.is_absolute() and _can_be_made(usual):
        return usual
    return Path(tempfile.gettempdir()) / f"drake_quad-{os.getuid()}"


def private_directory(path: Path) -> bool:
    """Makes a directory for this user alone; whether there is one that no other user can write to.

    What is loaded from a cache is executed. So the directory has to be this user's own, and no
    other user may write to it, or to a directory above it, by which it could be replaced.

    Args:
        path: The directory, absolute.

    Returns:
        False if it cannot be made or written to, or if it cannot be trusted.
    """
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        real = path.resolve(strict=True)
        own = real.stat()
        if own.st_uid != os.getuid() or own.st_mode & OTHERS_WRITE or not os.access(real, os.W_OK):
            return False
        return all(_safe_above(folder.stat()) for folder in real.parents)
    except OSError:
        return False


def _can_be_made(path: Path) -> bool:
    """Whether the directory is there and can be written to, or can be made."""
    there = next(folder for folder in (path, *path.parents) if folder.exists())
    return there.is_dir() and os.access(there, os.W_OK | os.X_OK)


def _safe_above(folder: os.stat_result) -> bool:
    """Whether other users cannot replace what lies in a folder of these attributes."""
    if folder.st_uid not in (0, os.getuid()):
        return False
    if folder.st_mode & stat.S_ISVTX:  # as /tmp: only its owner may move an entry
        return True
    if folder.st_mode & stat.S_IWOTH:
        return False
    return not folder.st_mode & stat.S_IWGRP or _has_group_alone(folder.st_gid)


def _has_group_alone(gid: int) -> bool:
    """Whether the group is this user's private one, as many distributions give to every user."""
    try:
        user, members = pwd.getpwuid(os.getuid()), grp.getgrgid(gid).gr_mem
    except KeyError:
        return False
    return gid == user.pw_gid and set(members) <= {user.pw_name}
