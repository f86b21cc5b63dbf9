"""Trials in a process of their own, which can be ended, die, or be killed without harm to others.

Every place where trials are carried out has one of these: each thread of a sweep on one machine,
and each worker of a Dask cluster. So what becomes of a trial is the same everywhere.
"""

import signal
import time
from collections.abc import Callable
from typing import Any

from drake_quad.errors import DrakeQuadError
from drake_quad.sweep.process import Interrupted, Process, ProcessLost, Work
from drake_quad.sweep.trials import Trial
from drake_quad.sweep.work import MACHINE, lost, work

__all__ = ["Interrupted", "Isolated", "Work"]

# The signals by which a process ends itself. Any other comes from outside, and is no trial's fault.
OWN_END = (signal.SIGABRT, signal.SIGSEGV, signal.SIGFPE, signal.SIGBUS, signal.SIGILL)
BEGIN_TIME = 120.0  # [s] that a process may take to begin: it imports Drake
# After which a stop is known of [s]: what ended a process may have been meant for all of the sweep.
STOP_KNOWN = 0.5

Result = dict[str, Any]


class NoTrialsHereError(DrakeQuadError):
    """This machine can do no trial: that is no trial's fault, and the sweep's end."""


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
        self._basis: Result | None = None  # of the process, once it has the trial

    def run(self, trial: Trial, stop: Callable[[], bool] = lambda: False) -> Result:
        """Carries out the trial; what comes of it says under `clock` how often it was `tried`.

        And how long it `held` its place [s], in all its tries: from here to the result, the start
        of a process and its imports counted in. What of that is no simulation is what a sweep adds.

        Raises:
            Interrupted: As soon as `stop` says so.
            NoTrialsHereError: If no process begins, in as many tries as the trial may have, or the
                machine is at fault, as one whose disk is full.
        """
        begun = time.perf_counter()
        result: Result | None = None
        tried, reason, had = 0, "", False
        while result is None and tried <= self._retries:
            tried, self._basis = tried + 1, None
            result, reason = self._try(trial, stop)
            had = had or self._basis is not None
        if result is None:
            if not had:
                raise NoTrialsHereError(
                    f"no process for trials begins: {reason}, {tried} times; what was "
                    "done is kept: --resume goes on with it once `drake-quad --help` works here"
                )
            result = lost(trial, "killed", f"{reason}, {tried} times")
        if result["outcome"] == MACHINE:
            raise NoTrialsHereError(
                f"trial {trial.index} cannot be carried out on this machine: {result['reason']}; "
                "what was done is kept: --resume goes on with it once that is mended"
            )
        # What gave no result is of the same sources as one that does.
        basis = {k: v for k, v in (self._basis or {}).items() if result.get(k) is None}
        clock = {**result["clock"], "tried": tried, "held": time.perf_counter() - begun}
        return {**result, **basis, "clock": clock}

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
                return None, f"it did not answer in {BEGIN_TIME:g} s"
            self._basis = process.take()
            if not process.wait(trial.wall_time, stop):
                self.end()
                return lost(trial, "timeout", late), ""
            result: Result = process.take()
        except ProcessLost as error:
            self.end()
            return self._judge(trial, error.code, late, process.paused, process.given, stop)
        except Interrupted:
            self.end()
            raise
        short = result["outcome"] == "memory"
        if short or process.given == self._recycle:
            self.end()
        if short and process.given > 1:  # what it had grown by before is no fault of this trial
            return self._try(trial, stop)
        return result, ""

    def _judge(
        self, trial: Trial, code: int, late: str, paused: bool, given: int,
        stop: Callable[[], bool],
    ) -> tuple[Result | None, str]:  # fmt: skip
        """As `_try`, for a process that ended before its trial did."""
        if self._basis is not None:
            if code == -signal.SIGALRM and not paused:  # its own clock goes on in a pause
                return lost(trial, "timeout", late), ""
            if code > 0 or -code in OWN_END:
                if given > 1:  # what other trials left in it, memory too, is no fault of this one
                    return self._try(trial, stop)
                how = f"with exit code {code}" if code > 0 else f"by {signal.Signals(-code).name}"
                return lost(trial, "crashed", f"its process ended itself {how}"), ""
        until = time.monotonic() + STOP_KNOWN
        while time.monotonic() < until:
            if stop():
                raise Interrupted
            time.sleep(0.05)
        return None, f"its process was ended (exit code {code})"
