"""The clock that both sides of a bus keep: the machine's, a slower one of it, or a test's."""

import time
from typing import Protocol

NS = 1_000_000_000  # in a second


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
