"""A loop with deadlines: it keeps them, asleep or busy, and leaves its core some rest."""

from itertools import pairwise

import pytest

from drake_quad.bus.processes import LATE, RESTS, each_period
from drake_quad.bus.real_time import NS

PERIOD = 0.002
PERIOD_NS = round(PERIOD * NS)


class CountingClock:
    """A clock that goes on by a microsecond each time that it is read, and by what is slept."""

    def __init__(self) -> None:
        self.time_ns, self.slept_ns = 0, 0

    def now_ns(self) -> int:
        """The time; to read it takes a microsecond."""
        self.time_ns += 1000
        return self.time_ns

    def sleep_until(self, time_ns: int) -> None:
        """Is that time, and notes how much was slept."""
        self.slept_ns += max(time_ns - self.time_ns, 0)
        self.time_ns = max(self.time_ns, time_ns)


def run(work: float, *, busy: bool, ticks: int = 50) -> tuple[list[int], float, float]:
    """When ticks begin [ns], the share of time that was slept, and the time given up [s]."""
    clock, begun = CountingClock(), list[int]()

    def tick() -> bool:
        begun.append(clock.time_ns)
        clock.time_ns += round(work * NS)
        return len(begun) < ticks

    given_up = each_period(clock, PERIOD, tick, busy=busy)
    return begun, clock.slept_ns / clock.time_ns, given_up


@pytest.mark.parametrize("busy", [False, True])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
def test_ticks_begin_at_their_deadlines(share: float, busy: bool) -> None:
    """To some readings of the clock, whatever part of a period a tick takes."""
    begun, slept, given_up = run(share * PERIOD, busy=busy)
    late = [t - begun[0] - k * PERIOD_NS for k, t in enumerate(begun)]
    assert max(abs(t) for t in late) <= 5000 and given_up == 0.0
    # Busy, it sleeps no longer than it has to, and never so little that the system would stop it.
    assert slept == pytest.approx(RESTS if busy else 1.0 - share, abs=0.03)
    assert 1.0 - RESTS < 0.95


def test_a_tick_that_takes_too_long_gets_no_rest() -> None:
    """Ticks follow without a pause, and what is LATE behind is given up."""
    begun, slept, given_up = run(1.5 * PERIOD, busy=True, ticks=400)
    assert slept == 0.0 and given_up > LATE
    gaps = {after - before for before, after in pairwise(begun)}
    assert max(gaps) <= 1.5 * PERIOD_NS + 5000
