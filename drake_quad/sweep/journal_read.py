"""A sweep's journal, read: what can be a line of it, and what is kept of one that is damaged."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError
from drake_quad.given_files import MOST_JOURNAL, read_given
from drake_quad.plain_json import is_whole, plain_of
from drake_quad.whole_files import write_whole

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
