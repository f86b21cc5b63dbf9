"""A sweep's append-only journal: written as trials end, and read back.

A file of JSON lines. The first says what the study is and of which sources. A sweep that is killed
leaves half a line at most; whoever goes on with it drops that line and does its trial again. So it
is with a line that something spoilt, whether it is no JSON any more or no result of the study.
"""

import fcntl
import json
import os
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

from drake_quad.errors import InputError
from drake_quad.util.files import MOST_JOURNAL, is_whole, plain_of, read_given, write_whole

# ------------------------------------------------------------------------------------------------
# A sweep's journal, read: what can be a line of it, and what is kept of one that is damaged.
# ------------------------------------------------------------------------------------------------


NAME = "journal.jsonl"
DAMAGED = ".damaged.jsonl"  # beside it: what there was, where not all of it could be read
SAID = {
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
    """What the journal in `directory` says of its study, and its whole lines by index.

    Lines that are spoilt count as not there: half of one, what is no JSON, a value of the wrong
    kind, a misspelt name, and lines of one index, of which nobody knows whose they are.

    Args:
        directory: Of the sweep.
        name: Of its file.
        fits: Whether a line can be a result of the study.
        keep_damaged: Whether to keep a copy beside it if more than its end is spoilt.

    Raises:
        InputError: There is none, or it is not one.
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
    first, *lines = [plain_of(line) for line in whole.rstrip(b"\n").split(b"\n")]
    if first is None or not set(SAID) <= first.keys():
        raise error("is not the journal of a sweep")
    read = [line for line in lines if line is not None]
    # What is spoilt is so at one place, and lacks one name at most.
    if any(len(NEEDED - one.keys()) > 1 for one in read):
        raise error("has lines that are no trials: it was written by something else")
    good = [one for one in read if _is_result(one) and fits(one)]
    often = Counter(one["index"] for one in good)
    done = {one["index"]: one for one in good if often[one["index"]] == 1}
    if keep_damaged and (None in lines[:-1] or len(done) < len(read)):
        write_whole(_unused(path), lambda to: to.write_bytes(whole))
    return first, done


def _unused(path: Path) -> Path:
    """Where a copy of a damaged journal goes: beside it, and not over that of an earlier damage."""
    copy, number = path.with_suffix(DAMAGED), 1
    while copy.exists():
        number += 1
        copy = path.with_suffix(f".{number}{DAMAGED}")
    return copy


def _is_result(line: Result) -> bool:
    """Whether what is read of any result is there and of its kind; of what study, `fits` knows."""
    return (
        is_whole(line.get("index"))
        and line["index"] >= 0
        and type(line.get("success")) is bool
        and all(isinstance(line.get(name), str) for name in ("outcome", "reason"))
        and all(isinstance(line.get(name), dict) for name in ("figures", "clock"))
        and isinstance(line.get("scenario", 0), str | None)
    )


# ------------------------------------------------------------------------------------------------
# The journal of a sweep: a line a finished trial, whole after every one, whatever happens.
# ------------------------------------------------------------------------------------------------


@dataclass
class Journal:
    """The journal in a directory.

    Attributes:
        directory: Of the sweep.
        study: What it is of, by the keys of SAID and perhaps others: any other's is refused.
        leavings: Names of what else a sweep leaves there: without a journal nothing can be said
            of it, and it stays.
        done: What came of the trials so far, by index.
        fits: Whether a line can be a result of the study, which the journal itself knows nothing
            of; one that cannot counts as not there.
        name: Of its file; in a directory that is not its own, another than NAME.
        option: By which it was asked for, to be named by errors.
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
                # Of another study no line fits: that is no damage, of which to keep a copy.
                self._check(read_journal(self.directory, self.name)[0])
                _, self.done = read_journal(
                    self.directory, self.name, fits=self.fits, keep_damaged=True
                )
            else:
                left = [name for name in self.leavings if (self.directory / name).exists()]
                if left:
                    raise self._error(
                        f"holds {left[0]} of a sweep without its journal: give another"
                    )
            # Written anew: the last line may be half of one.
            lines = [json.dumps(self.study), *(json.dumps(one) for one in self.done.values())]
            write_whole(path, lambda to: to.write_text("\n".join(lines) + "\n", "utf-8"))
            self._file = path.open("a", encoding="utf-8")
        except BaseException:
            self.close()
            raise

    def _open_lock(self) -> TextIO:
        """The file that is locked while a sweep is at work here.

        Raises:
            InputError: There is something in its place that is no file.
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
        """Appends what came of a trial; once it returns no end of this process loses it."""
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
        """Gives it free."""
        try:
            if self._file is not None:
                with suppress(OSError):  # what could not be written was told of
                    self._file.close()
                self._file = None
        finally:
            self._lock.close()

    def _check(self, study: dict[str, Any]) -> None:
        own = json.loads(json.dumps(self.study))
        for key in own:
            if study.get(key) != own[key]:
                said = SAID.get(key, f"of other {key}")
                raise self._error(f"holds a sweep {said}: its trials would not match; give another")

    def _error(self, remedy: str) -> InputError:
        field, path = "directory", self.directory
        if self.name != NAME:
            field, path = "file", path / self.name
        return InputError(source=self.option, field=field, value=str(path), remedy=remedy)
