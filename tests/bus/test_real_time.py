"""What a loop with deadlines takes of the system ends with it, and goes to no other process."""

import gc
import os
import subprocess
import sys
from pathlib import Path
from threading import Event, Thread

import pytest

from drake_quad.bus.real_time import LoopTimes, real_time, thread_ids
from drake_quad.cli.bus import time_kept

ASK = "import os; print(os.sched_getscheduler(0))"


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="the system has no schedulers")
def test_real_time_priority_ends_with_the_loop_and_is_not_inherited() -> None:
    """A process that is started inside is an ordinary one, and after the loop all is as before."""
    before = os.sched_getscheduler(0)
    with real_time() as given:
        policy = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK
        assert policy == (os.SCHED_FIFO if given["fifo"] else before)
        assert not gc.isenabled()
        child = subprocess.run(
            [sys.executable, "-c", ASK], capture_output=True, text=True, check=True, timeout=60
        )
    assert int(child.stdout) == os.SCHED_OTHER
    assert os.sched_getscheduler(0) == before
    assert gc.isenabled()


def test_threads_that_are_waited_for_come_first() -> None:
    """Those that receive messages have a higher priority than the loop, and are ordinary again."""
    end, others = Event(), thread_ids()
    receiver = Thread(target=end.wait)
    receiver.start()
    try:
        (number,) = thread_ids() - others
        with real_time(threads=[number]) as given:
            if given["fifo"]:
                policy = os.sched_getscheduler(number) & ~os.SCHED_RESET_ON_FORK
                assert policy == os.SCHED_FIFO
                own = os.sched_getparam(0).sched_priority
                assert os.sched_getparam(number).sched_priority == own + 1
        assert os.sched_getscheduler(number) == os.SCHED_OTHER
        with real_time(first=False, threads=[number]):
            assert os.sched_getscheduler(number) == os.SCHED_OTHER
    finally:
        end.set()
        receiver.join()


def test_real_time_asks_for_nothing_unless_told() -> None:
    """Without `first` only the garbage collector rests."""
    before = os.sched_getscheduler(0) if hasattr(os, "sched_getscheduler") else None
    with real_time(first=False) as given:
        assert given == {"fifo": False, "memory_locked": False}
        if before is not None:
            assert os.sched_getscheduler(0) == before
    assert gc.isenabled()


def test_how_time_was_kept_is_told_in_a_line() -> None:
    """Ticks, overruns and work, also where a loop ended before there was anything to measure."""
    times = LoopTimes(0.002)
    assert time_kept(times.figures()) == "0 ticks"
    for k in range(100):
        begun = k * 2_000_000 + (1_500_000 if k == 50 else 0)
        times.note(begun, begun + 500_000, 1_000_000)
    figures = times.figures() | {"time_stolen": 0.0}
    line = time_kept(figures)
    assert "100 ticks, 1.01% of them late" in line and "took 0.50 ms" in line
    assert line.endswith("1.0 ms old when answered") and "\n" not in line
    assert "kept its cores from it for 1.25 s" in time_kept(figures | {"time_stolen": 1.25})
    assert time_kept(figures | {"time_stolen": None}) == line


def test_time_that_a_host_takes_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the kernel tells it, in seconds, from when the loop began; None where it does not."""
    stat = tmp_path / "stat"
    monkeypatch.setattr("drake_quad.bus.real_time.Path", lambda _: stat)
    ticks = os.sysconf("SC_CLK_TCK")
    stat.write_text(f"cpu  1 2 3 4 5 6 7 {3 * ticks} 0 0\ncpu0 9 9 9 9 9 9 9 9 9 9\n")
    times = LoopTimes(0.002)
    times.note(0, 1, -1)
    times.note(2_000_000, 2_000_001, -1)
    stat.write_text(f"cpu  1 2 3 4 5 6 7 {5 * ticks} 0 0\n")
    assert times.figures()["time_stolen"] == 2.0
    stat.unlink()
    assert times.figures()["time_stolen"] is None
