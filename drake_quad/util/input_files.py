"""Files and Parquet tables that people give, read with care and within bounds.

A pipe that nobody writes to would be waited for without end, and a device such as /dev/zero read
until no memory is left. Every reader of a file that a person, or an older run, may have put there
comes here; what it raises is an OSError, whose `strerror` says what is wrong, as of any other file.

A column that has one value over and over takes a few bytes in the file, however many its rows are.
"""

import errno
import os
import stat
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

# ------------------------------------------------------------------------------------------------
# Files that people give, read with care: regular ones alone, and no more than a bound of them.
# ------------------------------------------------------------------------------------------------


MIB = 1 << 20
# How many bytes a file of each kind may have: some ten times the largest that was ever needed.
MOST_YAML = 2 * MIB  # PyYAML reads a tenth of that in a second
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
        path: Of the file.
        most: Bytes that it may have.

    Raises:
        IsADirectoryError: It is a directory.
        OSError: It is no regular file, it is larger, or it cannot be read.
    """
    check_given(path, most=most)  # before it is opened, which by itself may wait, or wind a tape
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(handle, "rb") as file:
        _check(os.fstat(file.fileno()), path, most)  # another may have come to its place
        data = file.read(most + 1)  # of some files in /proc the size is not known before
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
    """Whether anything but a directory is there: be it a pipe, which whoever reads it refuses."""
    return path.exists() and not path.is_dir()


def check_given(path: str | Path, *, most: int) -> None:
    """Sees that a file is a regular one and not too large, for whoever reads it by its name.

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
    said = f"it has {size / MIB:.1f} MiB or more, and may have at most {most // MIB} MiB"
    return OSError(errno.EFBIG, said, str(path))


# ------------------------------------------------------------------------------------------------
# Parquet tables that people give: read in parts, so that a small file cannot fill the memory.
# ------------------------------------------------------------------------------------------------


MOST_VALUES = 200_000_000  # rows times columns: an hour of a log of 300 columns at 200 Hz
MOST_MEMORY = 2048 * MIB
ROWS = 4096  # read at a time


def read_given_table(path: str | Path, columns: Sequence[str] | None = None) -> pa.Table:
    """The table of a regular file.

    Args:
        path: Of the file.
        columns: Those that are wanted, as far as they are there; all if None.

    Raises:
        OSError: It is no regular file, it or what is in it is too large, or it cannot be read.
        ArrowException: It is no Parquet, or cut short.
    """
    check_given(path, most=MOST_TABLE)
    with pq.ParquetFile(path) as file:
        schema = file.schema_arrow
        names = [name for name in schema.names if columns is None or name in columns]
        rows = file.metadata.num_rows
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
    said = f"it holds {what}, and may hold {MOST_VALUES} values in {MOST_MEMORY // MIB} MiB"
    return OSError(errno.EFBIG, said, str(path))
