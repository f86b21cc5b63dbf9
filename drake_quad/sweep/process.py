"""A process that does trials, and the pipe by which it is told of them."""

import signal
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection
from typing import Any

from drake_quad.sweep.trials import Trial
from drake_quad.sweep.work import begin_process, guarded, own_basis

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


class Process:
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
