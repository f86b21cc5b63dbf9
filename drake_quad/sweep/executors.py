"""Carries out trials in isolated local processes, with limits of time and memory.

Every place where trials are carried out has one of these: each thread of a sweep on one machine,
and each worker of a Dask cluster. So what becomes of a trial is the same everywhere.
"""

import queue
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection
from typing import Any

from drake_quad.errors import DrakeQuadError
from drake_quad.sweep.study import Limits
from drake_quad.sweep.trials import MACHINE, Trial, begin_process, guarded, lost, own_basis, work

# ------------------------------------------------------------------------------------------------
# A process that does trials, and the pipe by which it is told of them.
# ------------------------------------------------------------------------------------------------


LOOK_PERIOD = 0.2  # [s] between looks at whether to stop
PAUSE = 5.0  # [s] beyond LOOK_PERIOD that a look may take; if longer, this process was paused
END_TIME = 5.0  # [s] that it may take to end once its pipe has

Work = Callable[[Trial], dict[str, Any]]


class Interrupted(Exception):  # noqa: N818  (it is no error)
    """The sweep was told to stop while a trial was under way."""


class ProcessLost(Exception):  # noqa: N818  (whose fault it is is told by the code)
    """The process ended before its trial did; `code` is its exit code, as multiprocessing's."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exit code {code}")
        self.code = code


class Worker:
    """A process that does trials, seen from outside: what it is told, what it says, how it ended.

    All that is known of it comes through one pipe and its exit code, and one thread asks for both,
    so nothing depends on which of two is seen first.

    Attributes:
        given: How many trials it was given.
        paused: Whether it was paused with this process, as by Ctrl-Z, while that waited for it.
    """

    def __init__(self) -> None:
        context = get_context("spawn")  # Drake and forks do not mix
        self._pipe, far = context.Pipe()
        self._process = context.Process(target=serve, args=(far,), daemon=True)
        # Else the first process begins it, by which SIGINT is let through again.
        resource_tracker.ensure_running()
        # Ctrl-C reaches it too, from its first moment on, when it knows nothing of that yet.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        far.close()  # so that the pipe ends with the process
        self.given, self.paused = 0, False

    def give(self, work: Work, trial: Trial) -> None:
        """Gives it a trial."""
        self.given += 1
        try:
            self._pipe.send((work, trial))
        except OSError:  # it was ended meanwhile
            raise ProcessLost(self._code()) from None

    def wait(self, seconds: float, stop: Callable[[], bool]) -> bool:
        """Whether it says something, or ends, within so many seconds [s], pauses apart.

        Raises:
            Interrupted: As soon as `stop` says so.
        """
        until = time.monotonic() + seconds
        while not stop():
            looked = time.monotonic()
            left = until - looked
            says = self._pipe.poll(max(0.0, min(LOOK_PERIOD, left)))
            late = time.monotonic() - looked > LOOK_PERIOD + PAUSE
            if late:  # known before what it says is: its own clock may have ended it in the pause
                until += time.monotonic() - looked
                self.paused = True
            if says:
                return True
            if left <= 0.0 and not late:
                return False
        raise Interrupted

    def take(self) -> Any:
        """What it says.

        Raises:
            ProcessLost: It ended.
        """
        try:
            return self._pipe.recv()
        except (EOFError, OSError):  # nothing more, or half of it
            raise ProcessLost(self._code()) from None

    def end(self) -> None:
        """Ends it, whatever it does: it has nothing that is worth keeping."""
        self._process.kill()
        self._process.join()
        self._pipe.close()

    def _code(self) -> int:
        """Its exit code, once it has ended."""
        self._process.join(END_TIME)
        self._process.kill()  # in case that it lives on without its pipe
        self._process.join()
        # Another thread may have asked the system first, and be about to note what it was told.
        until = time.monotonic() + END_TIME
        while self._process.exitcode is None and time.monotonic() < until:
            time.sleep(0.001)
        return self._process.exitcode or 0


def serve(pipe: Connection) -> None:
    """The life of the process: trial after trial, until the pipe ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one that began it
    begin_process()
    with suppress(EOFError, OSError):  # the one that began it has ended, however
        while True:
            work, trial = pipe.recv()
            pipe.send(own_basis())  # it has it
            pipe.send(guarded(work, trial))


# ------------------------------------------------------------------------------------------------
# Trials in a process of their own, which can be ended, die, or be killed without harm to others.
# ------------------------------------------------------------------------------------------------


__all__ = ["Interrupted", "IsolatedWorker", "Work"]

# The signals by which a process ends itself. Any other comes from outside, and is no trial's fault.
OWN_END = (signal.SIGABRT, signal.SIGSEGV, signal.SIGFPE, signal.SIGBUS, signal.SIGILL)
BEGIN_TIME = 120.0  # [s] that a process may take to begin: it imports Drake
# After which a stop is known of [s]: what ended a process may have been meant for all of the sweep.
STOP_KNOWN = 0.5

Result = dict[str, Any]


class NoTrialsHereError(DrakeQuadError):
    """This machine can do no trial: that is no trial's fault, and the sweep's end."""


class IsolatedWorker:
    """A process that does trials, one after the other, and is replaced when it is lost or old.

    Args:
        recycle: After so many trials it is replaced: Drake's memory grows with every build.
        retries: How often a trial is tried again whose process somebody else ended.
        work: A module's own function.
    """

    def __init__(self, *, recycle: int, retries: int, work: Work = work) -> None:
        self._recycle, self._retries, self._work = recycle, retries, work
        self._process: Worker | None = None
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
            self._process = Worker()
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


# ------------------------------------------------------------------------------------------------
# Carries out trials on this machine, in as many processes as asked for.
# ------------------------------------------------------------------------------------------------


def run_local(
    trials: Iterable[Trial],
    *,
    workers: int,
    limits: Limits,
    stop: Callable[[], bool] = lambda: False,
    work: Work = work,
) -> Iterator[tuple[int, Result]]:
    """Carries out the trials; what comes of each does not depend on how many workers there are.

    Args:
        trials: In the order in which they are begun.
        workers: Processes.
        limits: Of tries, and of a process's age.
        stop: Whether to stop: those under way are then given up.
        work: Of one trial: a module's own function.

    Yields:
        The index of each trial and what came of it, as they end.
    """
    pending, lock = iter(trials), threading.Lock()
    done: queue.SimpleQueue[tuple[int, Result] | BaseException | None] = queue.SimpleQueue()
    ended = threading.Event()

    def halt() -> bool:
        return ended.is_set() or stop()

    def serve() -> None:
        isolated = IsolatedWorker(recycle=limits.recycle, retries=limits.retries, work=work)
        try:
            while not halt():
                with lock:
                    trial = next(pending, None)
                if trial is None:
                    break
                done.put((trial.index, isolated.run(trial, halt)))
        except Interrupted:
            pass
        except BaseException as error:  # handed to the thread that waits
            done.put(error)
        finally:
            isolated.end()
            done.put(None)

    threads = [threading.Thread(target=serve, daemon=True) for _ in range(workers)]
    try:
        for thread in threads:
            thread.start()
        running = len(threads)
        while running:
            try:
                item = done.get(timeout=LOOK_PERIOD)
            except queue.Empty:
                continue
            if item is None:
                running -= 1
            elif isinstance(item, BaseException):
                raise item
            else:
                yield item
    finally:
        ended.set()
        for thread in threads:
            if thread.ident is not None:
                thread.join()
