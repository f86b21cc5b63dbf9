"""Why Drake's parser refuses a file, in words of the file's and on one line."""

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager

_CONDITION = re.compile(r"Failure at \S+ in (\w+)\(\): condition '(.*?)' failed\.?(.*)")
_SDFORMAT = re.compile(r"SDFormat Error.*?Msg: (.*)")


def parser_reason(error: BaseException, said: list[str], names: dict[str, str]) -> str:
    """One line that says why, without the innards of Drake.

    Args:
        error: What the parser raised.
        said: What it logged before, see `quiet`.
        names: What to say for texts that mean nothing to who gave the file, such as its copy's
            path.
    """
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    reason = lines[0] if lines else "Drake's parser gives no reason"
    broken = _CONDITION.search(reason)
    if broken:
        reason = f"what {broken[1]} needs does not hold: {broken[2]}.{broken[3]}"
    told = [found[1] for found in map(_SDFORMAT.search, said) if found]
    if told:
        reason = f"{reason}: {told[0]}"
    for text, instead in names.items():
        # SDFormat writes an absolute path after a slash of its own.
        reason = reason.replace(f"/{text}", instead).replace(text, instead)
    return reason if " " in reason else f"Drake's parser fails on it ({reason})"


@contextmanager
def quiet(level: int = logging.ERROR) -> Iterator[list[str]]:
    """Without Drake's log on the screen; what is in it from a level on is in the list."""
    logger, said = logging.getLogger("drake"), _Said()
    before, propagate, handlers = logger.level, logger.propagate, logger.handlers
    logger.setLevel(level)
    logger.propagate, logger.handlers = False, [said]
    try:
        yield said.lines
    finally:
        logger.propagate, logger.handlers = propagate, handlers
        logger.setLevel(before)


class _Said(logging.Handler):
    """Keeps what is logged."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keeps one message."""
        self.lines.append(record.getMessage())
