"""The clock that both sides of a bus keep, and what a loop with deadlines asks of the system.

A clock is the machine's, a slower one of it, or a test's.
"""

import ctypes
import gc
import os
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from drake_quad.util.collector import frozen_objects

NS = 1_000_000_000  # in a second
PRIORITY = 20  # of SCHED_FIFO: above all that is not real time, below the kernel's own
LOCK_ALL = 3  # MCL_CURRENT | MCL_FUTURE
STEAL = 8  # column of /proc/stat
LONGEST = 5  # ticks that are told of one by one
EDGES = (0.0, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)  # [ms] of histograms


class Clock(Protocol):
    """A clock that never goes back."""

    def now_ns(self) -> int:
        """The time [ns]."""

    def sleep_until(self, time_ns: int) -> None:
        """Returns at that time, or at once if it is past."""


class WallClock:
    """The machine's monotonic clock, which all of its processes share.

    Args:
        rate: Its seconds in a second: below 1 both sides do all of their work, watchdogs too, in
            slow motion, for machines that are too busy for real time.
    """

    def __init__(self, rate: float = 1.0) -> None:
        self._rate = rate

    def now_ns(self) -> int:
        """The time [ns]."""
        now = time.monotonic_ns()
        return now if self._rate == 1.0 else int(now * self._rate)

    def sleep_until(self, time_ns: int) -> None:
        """Returns at that time, or at once if it is past."""
        left = time_ns - self.now_ns()
        if left > 0:
            time.sleep(left / NS / self._rate)


class ManualClock:
    """A clock that goes on when it is told to: the same run, whatever the machine does."""

    def __init__(self, time_ns: int = NS) -> None:
        self._time_ns = time_ns

    def now_ns(self) -> int:
        """The time [ns]."""
        return self._time_ns

    def sleep_until(self, time_ns: int) -> None:
        """Is that time at once."""
        self._time_ns = max(self._time_ns, time_ns)


def stolen_time() -> float | None:
    """For how long a virtual machine's host has kept its cores from it, all of them together [s].

    Since the machine began; None where the system does not tell. A process whose core is kept
    cannot run meanwhile, whatever its priority.
    """
    try:
        of_all_cores = Path("/proc/stat").read_text().split("\n", 1)[0].split()
        return int(of_all_cores[STEAL]) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, ValueError):
        return None


def thread_ids() -> set[int]:
    """The system's numbers of this process's threads; none where /proc has none."""
    try:
        return {int(task.name) for task in Path("/proc/self/task").iterdir()}
    except OSError:
        return set()


@contextmanager
def real_time(*, first: bool = True, threads: Iterable[int] = ()) -> Iterator[dict[str, bool]]:
    """Real-time priority and locked memory where they are allowed, no garbage collector.

    Args:
        first: Whether to ask for SCHED_FIFO and locked memory at all.
        threads: Other threads of this process that the loop waits for, such as those that receive
            a bus's messages, by `thread_ids`' numbers. They come before the loop itself.

    Yields:
        What was given: `fifo`, `memory_locked`.
    """
    given = {"fifo": False, "memory_locked": False}
    before, raised = None, list[int]()
    if first and hasattr(os, "sched_setscheduler"):
        with suppress(OSError):
            before = (os.sched_getscheduler(0), os.sched_getparam(0))
            # Processes that are started meanwhile are ordinary ones again.
            policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
            os.sched_setscheduler(0, policy, os.sched_param(PRIORITY))
            given["fifo"] = True
            for thread in threads:
                with suppress(OSError):  # it may have ended
                    os.sched_setscheduler(thread, policy, os.sched_param(PRIORITY + 1))
                    raised.append(thread)
        with suppress(OSError, AttributeError):
            given["memory_locked"] = ctypes.CDLL(None).mlockall(LOCK_ALL) == 0
    collecting = gc.isenabled()
    try:
        with frozen_objects():
            gc.disable()
            yield given
    finally:
        if collecting:
            gc.enable()
        if given["fifo"] and before is not None:
            with suppress(OSError):
                os.sched_setscheduler(0, *before)
            for thread in raised:
                with suppress(OSError):
                    os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))
        if given["memory_locked"]:
            ctypes.CDLL(None).munlockall()


class LoopTimes:
    """The times of a loop's ticks, kept without allocation until they are asked for.

    Args:
        period: Time between ticks [s].
        capacity: How many ticks are kept; of more, the last.
    """

    def __init__(self, period: float, capacity: int = 200_000) -> None:
        self._period_ns = round(period * NS)
        self._rows = np.zeros((capacity, 3), dtype=np.int64)  # begun, work, age of the state
        self._count, self._first_ns, self._stolen_before = 0, 0, stolen_time()

    def note(self, begun_ns: int, ended_ns: int, age_ns: int) -> None:
        """Notes a tick: when it began and ended, and how old the state was that it answered.

        Args:
            begun_ns: When the tick began [ns].
            ended_ns: When its command was out [ns].
            age_ns: Age of the state then [ns]; negative if there is none.
        """
        row = self._rows[self._count % len(self._rows)]
        row[0], row[1], row[2] = begun_ns, ended_ns - begun_ns, age_ns
        if self._count == 0:
            self._first_ns = begun_ns
        self._count += 1

    def figures(self) -> dict[str, Any]:
        """Figures and histograms, all in ms: what `docs/bus.md` lists."""
        count, size = self._count, len(self._rows)
        rows = self._rows[:count] if count <= size else np.roll(self._rows, -(count % size), axis=0)
        if len(rows) < 2:
            return {"ticks": count}
        before, stolen = self._stolen_before, stolen_time()
        period = np.diff(rows[:, 0]) * 1e-6
        wanted = self._period_ns * 1e-6
        jitter, work = np.abs(period - wanted), rows[:, 1] * 1e-6
        age = rows[rows[:, 2] >= 0, 2] * 1e-6
        longest = np.argsort(work)[: -LONGEST - 1 : -1]
        return {
            "ticks": count,
            "time_stolen": None if before is None or stolen is None else stolen - before,
            "longest_ticks": [
                {"at": float(1e-9 * (rows[k, 0] - self._first_ns)), "work_ms": float(work[k])}
                for k in longest
            ],
            "overruns": int(np.sum(period > 1.5 * wanted)),
            "overrun_share": float(np.mean(period > 1.5 * wanted)),
            "period_ms": _figures(period),
            "jitter_ms": _figures(jitter),
            "work_ms": _figures(work),
            "state_age_ms": _figures(age),
        }


def _figures(values: Any) -> dict[str, Any]:
    if not len(values):
        return {}
    shares = np.percentile(values, [50.0, 99.0, 99.9])
    counts, _ = np.histogram(values, [*EDGES, np.inf])
    return {
        "mean": float(np.mean(values)),
        "median": float(shares[0]),
        "p99": float(shares[1]),
        "p99_9": float(shares[2]),
        "max": float(np.max(values)),
        "histogram": {"edges": list(EDGES), "counts": counts.tolist()},
    }
