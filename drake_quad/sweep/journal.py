"""A sweep's append-only journal: written as trials end, and read back.

The journal is a file of JSON lines. The first line identifies the study and the sources. A sweep
that is killed leaves half a line at most; `--resume` drops that line and carries out its trial
again. It does the same with a line that was damaged later: one that is no JSON any more, or no
result of the study.
"""

import fcntl
import json
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, TextIO

from drake_quad.errors import InputError
from drake_quad.util.files import MIB, MOST_JOURNAL, is_whole, plain_of, read_given, write_whole

NAME = "journal.jsonl"
LONGEST_LINE = 16 * MIB  # a trial with its scenario has some kilobytes
DAMAGED = ".damaged.jsonl"  # a copy beside the journal, if not all of it could be read
IDENTITY = {
    "study": "of another study, or of this one before it was changed",
    "sources": "of other sources of drake_quad",
    "versions": "of other versions of the libraries",
}
NEEDED = {"index", "outcome", "reason", "success", "figures", "scenario", "clock"}

Result = dict[str, Any]
Fits = Callable[[Result], bool]


def read_journal(
    directory: Path,
    name: str = NAME,
    *,
    fits: Fits = lambda _: True,
    keep_damaged: bool = False,
) -> tuple[dict[str, Any], dict[int, Result]]:
    """The first line of the journal in `directory`, and its whole lines by index.

    Damaged lines count as missing: half a line, a line that is no JSON or longer than any, a value
    of the wrong type, a misspelt name, and several lines with one index.

    Args:
        directory: The sweep's directory.
        name: Name of the journal's file.
        fits: Whether a line can be a result of the study.
        keep_damaged: Whether to keep a copy beside the journal if more than its end is damaged.

    Raises:
        InputError: There is no journal, or the file is something else.
    """
    path = directory / name

    def error(remedy: str) -> InputError:
        return InputError(source=str(directory), field=name, value=str(path), remedy=remedy)

    try:
        whole = read_given(path, most=MOST_JOURNAL)
    except FileNotFoundError:
        raise error("not there; give the directory of a `drake-quad sweep`") from None
    except OSError as problem:
        raise error(f"cannot be read: {problem.strerror}") from None
    # Line by line: of a file that somebody else made, no more is kept than a study has trials.
    lines = iter(BytesIO(whole.rstrip(b"\n")))
    head = next(lines, b"")
    first = plain_of(head) if len(head) <= LONGEST_LINE else None
    if first is None or not set(IDENTITY) <= first.keys():
        raise error("is not the journal of a sweep")
    done: dict[int, Result] = {}
    twice: set[int] = set()
    damaged = False
    for line in lines:
        one = plain_of(line) if len(line) <= LONGEST_LINE else None
        # Damage is at one place of a line, and one name at most is missing.
        if one is not None and len(NEEDED - one.keys()) > 1:
            raise error("has lines that are no trials: it was written by something else")
        if one is None or not (_is_result(one) and fits(one)):
            damaged |= one is not None or line.endswith(b"\n")  # the end of a killed sweep is none
        elif one["index"] in done:
            twice.add(one["index"])
        else:
            done[one["index"]] = one
    for index in twice:
        del done[index]
    if keep_damaged and (damaged or twice):
        write_whole(_unused(path), lambda to: to.write_bytes(whole))
    return first, done


def _unused(path: Path) -> Path:
    """The file for a copy of a damaged journal, beside it; earlier copies stay."""
    copy, number = path.with_suffix(DAMAGED), 1
    while copy.exists():
        number += 1
        copy = path.with_suffix(f".{number}{DAMAGED}")
    return copy


def _is_result(line: Result) -> bool:
    """Whether all that every result has is there and of its type."""
    return (
        is_whole(line.get("index"))
        and line["index"] >= 0
        and type(line.get("success")) is bool
        and all(isinstance(line.get(name), str) for name in ("outcome", "reason"))
        and all(isinstance(line.get(name), dict) for name in ("figures", "clock"))
        and isinstance(line.get("scenario", 0), str | None)
    )


@dataclass
class Journal:
    """The journal of a sweep: one line for each finished trial, whole after every one.

    Attributes:
        directory: The sweep's directory.
        study: Identity of the study, by the keys of IDENTITY and perhaps others: a journal of
            another study is refused.
        leavings: Names of other files that a sweep leaves there. Without a journal nobody knows
            what they are of, and they stay.
        done: Results of the trials so far, by index.
        fits: Whether a line can be a result of the study; one that cannot counts as missing.
        name: Name of the journal's file; other than NAME in a directory that it shares.
        option: Option that asked for the directory, named by errors.
    """

    directory: Path
    study: dict[str, Any]
    leavings: Sequence[str] = ()
    done: dict[int, Result] = field(default_factory=dict)
    fits: Fits = lambda _: True
    name: str = NAME
    option: str = "--out"
    _file: TextIO | None = None

    def open(self, *, resume: bool) -> None:
        """Begins the journal, or goes on with it; holds it alone until `close`.

        Raises:
            InputError: There is one and `resume` is not asked for, it is another study's, or
                another sweep is at work on it.
        """
        path = self.directory / self.name
        self.directory.mkdir(parents=True, exist_ok=True)
        lock = self._open_lock()
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as problem:
            lock.close()
            if not isinstance(problem, BlockingIOError):
                raise self._error(f"no file can be locked there: {problem.strerror}") from None
            raise self._error("another sweep is at work there: wait, or give another") from None
        self._lock = lock
        try:
            if path.exists() and (path.stat().st_size or not path.is_file()):
                if not resume:
                    raise self._error("holds a sweep: go on with it by --resume, or give another")
                # No line of another study fits; that is not damage, and needs no copy.
                self._check(read_journal(self.directory, self.name, fits=lambda _: False)[0])
                _, self.done = read_journal(
                    self.directory, self.name, fits=self.fits, keep_damaged=True
                )
            else:
                left = [name for name in self.leavings if (self.directory / name).exists()]
                if left:
                    raise self._error(
                        f"holds {left[0]} of a sweep without its journal: give another"
                    )
            # The file is written anew: its last line may be half a line.
            lines = [json.dumps(self.study), *(json.dumps(one) for one in self.done.values())]
            write_whole(path, lambda to: to.write_text("\n".join(lines) + "\n", "utf-8"))
            self._file = path.open("a", encoding="utf-8")
        except BaseException:
            self.close()
            raise

    def _open_lock(self) -> TextIO:
        """Opens the file that is locked while a sweep is at work here.

        Raises:
            InputError: There is something else in its place.
        """
        path = self.directory / f".{self.name}.lock"
        ways = os.O_WRONLY | os.O_CREAT | os.O_NONBLOCK | os.O_CLOEXEC  # a pipe is not waited for
        try:
            lock = os.fdopen(os.open(path, ways, 0o666), "w")
        except OSError as problem:
            remedy = f"{path.name} in it cannot be opened: {problem.strerror}; give another"
            raise self._error(remedy) from None
        return lock

    def add(self, index: int, result: Result) -> None:
        """Appends a result; after that it is safe, however this process ends."""
        assert self._file is not None and index not in self.done
        whole = {"index": index, **result}
        path = self.directory / self.name
        try:
            self._file.write(json.dumps(whole) + "\n")
            self._file.flush()
            os.fsync(self._file.fileno())
            gone = os.fstat(self._file.fileno()).st_nlink == 0
        except OSError as problem:
            raise InputError(
                source=self.option,
                field=self.name,
                value=str(path),
                remedy=f"cannot be written: {problem.strerror}; make room, and go on with --resume",
            ) from None
        if gone:
            raise InputError(
                source=self.option,
                field=self.name,
                value=str(path),
                remedy="was removed while the sweep ran: begin it again",
            )
        self.done[index] = whole

    def close(self) -> None:
        """Closes the file and unlocks the directory."""
        try:
            if self._file is not None:
                with suppress(OSError):  # an error of writing was reported before
                    self._file.close()
                self._file = None
        finally:
            self._lock.close()

    def _check(self, study: dict[str, Any]) -> None:
        own = json.loads(json.dumps(self.study))
        for key in own:
            if study.get(key) != own[key]:
                whose = IDENTITY.get(key, f"of other {key}")
                raise self._error(
                    f"holds a sweep {whose}: its trials would not match; give another"
                )

    def _error(self, remedy: str) -> InputError:
        field, path = "directory", self.directory
        if self.name != NAME:
            field, path = "file", path / self.name
        return InputError(source=self.option, field=field, value=str(path), remedy=remedy)
