"""What a loop with deadlines takes of the system ends with it, and goes to no other process."""

import gc
import os
import subprocess
import sys

import pytest

from drake_quad.bus.real_time import real_time

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


def test_real_time_asks_for_nothing_unless_told() -> None:
    """Without `first` only the garbage collector rests."""
    before = os.sched_getscheduler(0) if hasattr(os, "sched_getscheduler") else None
    with real_time(first=False) as given:
        assert given == {"fifo": False, "memory_locked": False}
        if before is not None:
            assert os.sched_getscheduler(0) == before
    assert gc.isenabled()
