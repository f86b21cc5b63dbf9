"""What the benchmarks share: stopwatches, Markdown tables, and what they were run with."""

import os
import platform
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any
from unittest.mock import patch

import numpy as np


@dataclass
class Stopwatch:
    """Collects the wall time of every call of what it was put on."""

    seconds: list[float] = field(default_factory=list)

    def wrap(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Returns `function` with this stopwatch on it."""

        def timed(*args: Any, **kwargs: Any) -> Any:
            begun = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                self.seconds.append(time.perf_counter() - begun)

        return timed

    @property
    def total(self) -> float:
        """All calls together [s]."""
        return float(sum(self.seconds))

    @property
    def median(self) -> float:
        """The median call [s]; nan if there was none."""
        return float(np.median(self.seconds)) if self.seconds else float("nan")


@contextmanager
def stopwatch(owner: Any, name: str) -> Iterator[Stopwatch]:
    """Puts a stopwatch on `owner.name` (a function of a module or a method of a class)."""
    watch = Stopwatch()
    with patch.object(owner, name, watch.wrap(getattr(owner, name))):
        yield watch


def median_time(call: Callable[[], Any], *, repeats: int) -> float:
    """Median wall time of `call` [s], after one call that does not count."""
    watch = Stopwatch()
    timed = watch.wrap(call)
    call()
    for _ in range(repeats):
        timed()
    return watch.median


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table, first column to the left, the others to the right."""
    rule = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join("| " + " | ".join(row) + " |" for row in (header, rule, *rows))


def text(value: Any, form: str, scale: float = 1.0) -> str:
    """A figure for a table; a dash for one that was not measured."""
    return "-" if value is None else format(scale * value, form)


def versions(*peers: str) -> dict[str, str]:
    """What the figures depend on besides the machine; `peers` are further packages' names."""
    names = ("drake_quad", "drake", "numpy", "piqp", *peers)
    return {**{name: version(name) for name in names}, "python": platform.python_version()}


def machine() -> str:
    """The machine's kind, without its name."""
    return f"{os.cpu_count()} cores, {platform.machine()}"


def provenance(*peers: str) -> str:
    """Versions and machine in a line."""
    listed = ", ".join(f"{name} {number}" for name, number in versions(*peers).items())
    return f"{listed}; {machine()}"
