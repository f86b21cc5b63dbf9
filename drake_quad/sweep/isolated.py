"""Trials in a process of their own, which can be ended, die, or be killed without harm to others.

Every place where trials are carried out has one of these: each thread of a sweep on one machine,
and each worker of a Dask cluster. So what becomes of a trial is the same everywhere.
"""

import signal
import time
from collections.abc import Callable
from concurrent.futures import CancelledError
from concurrent.futures import TimeoutError as TimeIsUp
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing import get_context
from typing import Any

from pebble import ProcessExpired, ProcessPool

from drake_quad.sweep.trials import Trial
from drake_quad.sweep.work import begin_process, guarded, lost, work

# The signals by which a process ends itself. Any other comes from outside, and is no trial's fault.
OWN_END = (signal.SIGABRT, signal.SIGSEGV, signal.SIGFPE, signal.SIGBUS, signal.SIGILL)
LOOK_PERIOD = 0.2  # [s] between looks at whether to stop
SILENCE = 120.0  # [s] beyond a trial's time, in which its process may begin and end

Result = dict[str, Any]
Work = Callable[[Trial], Result]


class Interrupted(Exception):  # noqa: N818  (it is no error)
    """The sweep was told to stop while a trial was under way."""


class Isolated:
    """A process that does trials, one after the other, and is replaced when it is lost or old.

    Args:
        recycle: After so many trials it is replaced: Drake's memory grows with every build.
        retries: How often a trial is tried again whose process somebody else ended.
        work: A module's own function.
    """

    def __init__(self, *, recycle: int, retries: int, work: Work = work) -> None:
        self._recycle, self._retries, self._work = recycle, retries, work
        self._pool: ProcessPool | None = None

    def run(self, trial: Trial, stop: Callable[[], bool] = lambda: False) -> Result:
        """Carries out the trial; what comes of it says how often it was `tried` under `clock`.

        Raises:
            Interrupted: As soon as `stop` says so.
        """
        reason = ""
        for tried in range(1, self._retries + 2):
            result, reason = self._try(trial, stop)
            if result is not None:
                return _tried(result, tried)
        return _tried(
            lost(trial, "killed", f"{reason}, {self._retries + 1} times"), self._retries + 1
        )

    def end(self) -> None:
        """Ends the process, whatever it does."""
        if self._pool is not None:
            pool, self._pool = self._pool, None
            pool.stop()  # type: ignore[no-untyped-call]
            with suppress(RuntimeError, OSError):  # one that broke has nothing left to end
                pool.join()

    def _try(self, trial: Trial, stop: Callable[[], bool]) -> tuple[Result | None, str]:
        """What came of it; or None and why, if the process was ended from outside."""
        if self._pool is None:
            self._pool = ProcessPool(
                max_workers=1,
                max_tasks=self._recycle,
                initializer=begin_process,
                context=get_context("spawn"),  # Drake and forks do not mix
            )
        try:
            future = self._pool.schedule(guarded, args=(self._work, trial), timeout=trial.wall_time)
        except RuntimeError:  # the idle process was killed, and the pool with it
            self.end()
            return None, "its process was ended from outside"
        given_up = time.monotonic() + trial.wall_time + SILENCE
        try:
            while not stop():
                if time.monotonic() > given_up:
                    self.end()
                    return None, "its process did not answer"
                with suppress(TimeIsUp):
                    return future.result(timeout=LOOK_PERIOD), ""
                if future.done() and isinstance(future.exception(), TimeIsUp):
                    self.end()  # the time that was up is the trial's
                    reason = f"not done after {trial.wall_time:g} s of wall time"
                    return lost(trial, "timeout", reason), ""
        except ProcessExpired as error:
            self.end()
            code = error.exitcode or 0
            if code == -signal.SIGALRM:
                reason = f"not done after {trial.wall_time:g} s of wall time"
                return lost(trial, "timeout", reason), ""
            if -code in OWN_END:
                name = signal.Signals(-code).name
                return lost(trial, "crashed", f"its process ended itself by {name}"), ""
            return None, f"its process was ended from outside (exit code {code})"
        except (BrokenProcessPool, CancelledError):
            self.end()
            return None, "its process was ended from outside"
        self.end()
        raise Interrupted


def _tried(result: Result, times: int) -> Result:
    return {**result, "clock": {**result["clock"], "tried": times}}
