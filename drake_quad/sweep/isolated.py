"""Trials in a process of their own, which can be ended, die, or be killed without harm to others.

Every place where trials are carried out has one of these: each thread of a sweep on one machine,
and each worker of a Dask cluster. So what becomes of a trial is the same everywhere.
"""

import signal
from collections.abc import Callable
from typing import Any

from drake_quad.sweep.process import Interrupted, Process, ProcessLost, Work
from drake_quad.sweep.trials import Trial
from drake_quad.sweep.work import lost, work

__all__ = ["Interrupted", "Isolated", "Work"]

# The signals by which a process ends itself. Any other comes from outside, and is no trial's fault.
OWN_END = (signal.SIGABRT, signal.SIGSEGV, signal.SIGFPE, signal.SIGBUS, signal.SIGILL)
BEGIN_TIME = 120.0  # [s] that a process may take to begin: it imports Drake

Result = dict[str, Any]


class Isolated:
    """A process that does trials, one after the other, and is replaced when it is lost or old.

    Args:
        recycle: After so many trials it is replaced: Drake's memory grows with every build.
        retries: How often a trial is tried again whose process somebody else ended.
        work: A module's own function.
    """

    def __init__(self, *, recycle: int, retries: int, work: Work = work) -> None:
        self._recycle, self._retries, self._work = recycle, retries, work
        self._process: Process | None = None

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
        if self._process is not None:
            process, self._process = self._process, None
            process.end()

    def _try(self, trial: Trial, stop: Callable[[], bool]) -> tuple[Result | None, str]:
        """What came of it; or None and why, if the process was ended from outside."""
        if self._process is None:
            self._process = Process()
        process, late = self._process, f"not done after {trial.wall_time:g} s of wall time"
        try:
            process.give(self._work, trial)
            # What passes before it has the trial, its start and its imports, is no trial's time.
            if not process.wait(BEGIN_TIME, stop):
                self.end()
                return None, "its process did not answer"
            process.take()
            if not process.wait(trial.wall_time, stop):
                self.end()
                return lost(trial, "timeout", late), ""
            result: Result = process.take()
        except ProcessLost as error:
            self.end()
            if error.code == -signal.SIGALRM:
                return lost(trial, "timeout", late), ""
            if -error.code in OWN_END:
                name = signal.Signals(-error.code).name
                return lost(trial, "crashed", f"its process ended itself by {name}"), ""
            if error.code > 0:
                reason = f"its process ended itself with exit code {error.code}"
                return lost(trial, "crashed", reason), ""
            return None, f"its process was ended from outside (exit code {error.code})"
        except Interrupted:
            self.end()
            raise
        if process.given == self._recycle:
            self.end()
        return result, ""


def _tried(result: Result, times: int) -> Result:
    return {**result, "clock": {**result["clock"], "tried": times}}
