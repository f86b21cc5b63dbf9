"""Parquet tables that people give: read in parts, so that a small file cannot fill the memory.

A column that has one value over and over takes a few bytes in the file, however many its rows are.
"""

import errno
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from drake_quad.given_files import MIB, MOST_TABLE, check_given

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
            raise _too_large(path, f"{rows} rows of {len(names)} columns")
        parts, memory = [], 0
        for part in file.iter_batches(batch_size=ROWS, columns=names, use_threads=False):
            memory += part.nbytes
            if memory > MOST_MEMORY:
                raise _too_large(path, f"more than {MOST_MEMORY // MIB} MiB")
            parts.append(part)
        chosen = pa.schema([schema.field(name) for name in names], metadata=schema.metadata)
    return pa.Table.from_batches(parts, schema=chosen)


def _too_large(path: str | Path, what: str) -> OSError:
    said = f"it holds {what}, and may hold {MOST_VALUES} values in {MOST_MEMORY // MIB} MiB"
    return OSError(errno.EFBIG, said, str(path))
