"""Standard output and error of a command: a reader that goes away ends neither work nor status.

`drake-quad check go2 --save f | head` is to save its file, and to end with the status of its
answer, although `head` reads no more than ten lines.
"""

import os
import sys
from io import TextIOWrapper
from typing import TextIO, cast


class Lasting:
    """A stream that drops what is written to it once nobody reads it any more.

    Args:
        stream: Its own, which is that of file descriptor `number`.
        number: 1 or 2.
    """

    def __init__(self, stream: TextIO, number: int) -> None:
        self._stream, self._number = stream, number

    def write(self, text: str) -> int:
        """Writes the text, or drops it; the number of its letters."""
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            self._drop()
            return len(text)

    def flush(self) -> None:
        """Hands on what was written, or drops it."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            self._drop()

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)

    def _drop(self) -> None:
        """Puts nothing in the pipe's place: for this process and whatever it begins."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._number)
        os.close(nowhere)


def make_streams_last() -> None:
    """Puts a `Lasting` in the place of both standard streams.

    Letters that a terminal or a pipe does not have are written as escapes.
    """
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    if sys.stdout is not None:  # as of a process that was begun without any
        sys.stdout = cast(TextIO, Lasting(sys.stdout, 1))
    if sys.stderr is not None:
        sys.stderr = cast(TextIO, Lasting(sys.stderr, 2))
