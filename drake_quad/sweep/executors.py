"""Carries out trials in isolated local processes, with limits of time and memory.

Each thread of a sweep on one machine has an `IsolatedWorker`, and so has each thread of a Dask
worker: trials end alike everywhere.
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
from drake_quad.util.parallel import without_script

LOOK_PERIOD = 0.2  # [s] between looks at whether to stop
PAUSE = 5.0  # [s] longest delay of a look; after a longer one, this process was paused
END_TIME = 5.0  # [s] that a process may take to end after its pipe has ended

Result = dict[str, Any]
Work = Callable[[Trial], Result]  # carries out a trial

# Signals by which a process ends itself. Any other comes from outside, and is no trial's fault.
OWN_END = (signal.SIGABRT, signal.SIGSEGV, signal.SIGFPE, signal.SIGBUS, signal.SIGILL)
BEGIN_TIME = 120.0  # [s] that a process may take to begin: it imports Drake
# [s] to wait for news of a stop: what ended a process may have been meant for the whole sweep.
STOP_KNOWN = 0.5


class Interrupted(Exception):  # noqa: N818  (it is no error)
    """The sweep was stopped while a trial was under way."""


class ProcessLost(Exception):  # noqa: N818  (the exit code says whose fault it is)
    """The process ended before its trial did; `code` is its exit code, as in multiprocessing."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exit code {code}")
        self.code = code


class Worker:
    """A process that carries out trials, seen from outside.

    What it answers comes through one pipe, how it ended from its exit code, and one thread asks for
    both: nothing depends on which of the two is seen first.

    Attributes:
        given: Number of trials that were sent to it.
        paused: Whether it was paused together with this process, as by Ctrl-Z, during a wait.
    """

    def __init__(self) -> None:
        context = get_context("spawn")  # Drake and forks do not mix
        self._pipe, far = context.Pipe()
        self._process = context.Process(target=serve, args=(far,), daemon=True)
        # Otherwise the first process would begin the tracker, and unblock SIGINT by that.
        resource_tracker.ensure_running()
        # Ctrl-C reaches the new process too, before it has begun to ignore it.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            with without_script():
                self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        far.close()  # so that the pipe ends with the process
        self.given, self.paused = 0, False

    def send(self, work: Work, trial: Trial) -> None:
        """Sends it a trial.

        Raises:
            ProcessLost: It ended.
        """
        self.given += 1
        try:
            self._pipe.send((work, trial))
        except OSError:  # it was ended meanwhile
            raise ProcessLost(self._code()) from None

    def wait(self, seconds: float, stop: Callable[[], bool]) -> bool:
        """Whether it answers, or ends, within a time [s] in which pauses do not count.

        Raises:
            Interrupted: `stop` returned true.
        """
        until = time.monotonic() + seconds
        while not stop():
            looked = time.monotonic()
            left = until - looked
            answers = self._pipe.poll(max(0.0, min(LOOK_PERIOD, left)))
            late = time.monotonic() - looked > LOOK_PERIOD + PAUSE
            if late:  # noted before its answer is read: its own timer may have ended it meanwhile
                until += time.monotonic() - looked
                self.paused = True
            if answers:
                return True
            if left <= 0.0 and not late:
                return False
        raise Interrupted

    def receive(self) -> Any:
        """Its answer.

        Raises:
            ProcessLost: It ended.
        """
        try:
            return self._pipe.recv()
        except (EOFError, OSError):  # there is no answer, or half of one
            raise ProcessLost(self._code()) from None

    def end(self) -> None:
        """Ends it, whatever it is doing."""
        self._process.kill()
        self._process.join()
        self._pipe.close()

    def _code(self) -> int:
        """Its exit code, once it has ended."""
        self._process.join(END_TIME)
        self._process.kill()  # in case that it lives on without its pipe
        self._process.join()
        # Another thread may have asked the system first, and be about to store the answer.
        until = time.monotonic() + END_TIME
        while self._process.exitcode is None and time.monotonic() < until:
            time.sleep(0.001)
        return self._process.exitcode or 0


def serve(pipe: Connection) -> None:
    """What the process does: trial after trial, until the pipe ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that began this one
    begin_process()
    with suppress(EOFError, OSError):  # the process that began this one has ended
        while True:
            work, trial = pipe.recv()
            pipe.send(own_basis())  # which also says that it has the trial
            pipe.send(guarded(work, trial))


class NoTrialsHereError(DrakeQuadError):
    """This machine cannot carry out trials: the sweep ends, and no trial has failed by it."""


class IsolatedWorker:
    """Carries out trials one after the other in a process, which it replaces when lost or old.

    Args:
        recycle: Number of trials after which a process is replaced: Drake's memory grows with
            every build.
        retries: How often a trial is tried again if its process was ended from outside.
        work: Function that carries out a trial, at the top of a module.
    """

    def __init__(self, *, recycle: int, retries: int, work: Work = work) -> None:
        self._recycle, self._retries, self._work = recycle, retries, work
        self._process: Worker | None = None
        self._basis: Result | None = None  # its process has the trial once this is known

    def run(self, trial: Trial, stop: Callable[[], bool] = lambda: False) -> Result:
        """Carries out the trial.

        Args:
            trial: The trial.
            stop: Whether to stop.

        Returns:
            The result. Under `clock` it has the number of tries (`tried`), and the time from the
            call to the result (`held`) [s], with the start of a process and its imports. What of
            that time is not simulation is what the sweep adds.

        Raises:
            Interrupted: `stop` returned true.
            NoTrialsHereError: If no process begins, in as many tries as the trial may have, or the
                machine is at fault, for example with a full disk.
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
        # A trial that gave no result has the same sources as one that does.
        basis = {k: v for k, v in (self._basis or {}).items() if result.get(k) is None}
        clock = {**result["clock"], "tried": tried, "held": time.perf_counter() - begun}
        return {**result, **basis, "clock": clock}

    def end(self) -> None:
        """Ends the process, whatever it does."""
        if self._process is not None:
            process, self._process = self._process, None
            process.end()

    def _try(self, trial: Trial, stop: Callable[[], bool]) -> tuple[Result | None, str]:
        """The result; or None and the reason, if the process was ended from outside."""
        if self._process is None:
            self._process = Worker()
        process, late = self._process, f"not done after {trial.wall_time:g} s of wall time"
        try:
            process.send(self._work, trial)
            # The time before it has the trial, for its start and its imports, is not the trial's.
            if not process.wait(BEGIN_TIME, stop):
                self.end()
                return None, f"it did not answer in {BEGIN_TIME:g} s"
            self._basis = process.receive()
            if not process.wait(trial.wall_time, stop):
                self.end()
                return lost(trial, "timeout", late), ""
            result: Result = process.receive()
        except ProcessLost as error:
            self.end()
            if self._basis is not None:
                if (
                    error.code == -signal.SIGALRM and not process.paused
                ):  # its timer runs in a pause
                    return lost(trial, "timeout", late), ""
                if error.code > 0 or -error.code in OWN_END:
                    if process.given > 1:  # what other trials left in it may be at fault
                        return self._try(trial, stop)
                    return lost(
                        trial, "crashed", f"its process ended itself {_how(error.code)}"
                    ), ""
            _wait_for_stop(stop)
            return None, f"its process was ended (exit code {error.code})"
        except Interrupted:
            self.end()
            raise
        short = result["outcome"] == "memory"
        if short or process.given == self._recycle:
            self.end()
        if short and process.given > 1:  # memory that other trials took may be at fault
            return self._try(trial, stop)
        return result, ""


def _how(code: int) -> str:
    return f"with exit code {code}" if code > 0 else f"by {signal.Signals(-code).name}"


def _wait_for_stop(stop: Callable[[], bool]) -> None:
    """Waits as long as news of a stop may take.

    Raises:
        Interrupted: `stop` returned true.
    """
    until = time.monotonic() + STOP_KNOWN
    while time.monotonic() < until:
        if stop():
            raise Interrupted
        time.sleep(0.05)


def run_local(
    trials: Iterable[Trial],
    *,
    workers: int,
    limits: Limits,
    stop: Callable[[], bool] = lambda: False,
    work: Work = work,
) -> Iterator[tuple[int, Result]]:
    """Carries out the trials; their results do not depend on the number of workers.

    Args:
        trials: The trials, in the order in which they begin.
        workers: Number of processes.
        limits: Limits on tries, and on the age of a process.
        stop: Whether to stop; trials under way are then given up.
        work: Function that carries out a trial, at the top of a module.

    Yields:
        The index of each trial and its result, as they end.
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
        except BaseException as error:  # raised by the thread that waits
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
