"""Work in several processes, with results in order whatever the number of workers."""

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from threading import RLock
from typing import Any, TypeVar

from drake_quad.errors import InputError
from drake_quad.util.numbers import is_integer

_ONE_AT_A_TIME = RLock()
LOOK_PERIOD = 0.3  # [s] between looks at whether to stop
Result = TypeVar("Result")


def map_in_processes(
    evaluate: Callable[..., Result],
    cells: Sequence[tuple[Any, ...]],
    *,
    workers: int,
    progress: Callable[[int, int], object] = lambda _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
) -> list[Result]:
    """Evaluates the cells in as many processes; the result is in their order whatever the number.

    Args:
        evaluate: Function of a cell's values; it must be picklable if there are several workers.
        cells: The values of each cell, as rise and run of a chart's.
        workers: Number of processes; with one, all is done in this process.
        progress: Called with the number of cells done, and the number of all.
        stop: Function that says whether to stop; the results so far are then returned.

    Raises:
        InputError: If a process was ended from outside.
    """
    done: dict[int, Result] = {}
    progress(0, len(cells))
    if workers == 1:
        for k, cell in enumerate(cells):
            if stop():
                break
            done[k] = evaluate(*cell)
            progress(len(done), len(cells))
    else:
        with _pool(min(workers, len(cells)), stop) as pool:
            with without_script():
                pending: dict[Future[Result], int] = {
                    pool.submit(evaluate, *cell): k for k, cell in enumerate(cells)
                }
            while pending and not stop():
                ready, _ = wait(pending, timeout=LOOK_PERIOD, return_when=FIRST_COMPLETED)
                for future in ready:
                    done[pending.pop(future)] = _result(future, workers)
                    progress(len(done), len(cells))
    return [done[k] for k in sorted(done)]


def _result(future: Future[Result], workers: int) -> Result:
    """What a process found.

    Raises:
        InputError: If the system ended the process, as it does for want of memory.
    """
    try:
        return future.result()
    except BrokenProcessPool:
        remedy = "the system ended a process, most likely for want of memory: give fewer"
        raise InputError(
            source="--workers", field="workers", value=workers, remedy=remedy
        ) from None


@contextmanager
def without_script() -> Iterator[None]:
    """Processes that are begun within do not run the script that this process was begun with.

    They need nothing of it. `multiprocessing` has each import it, and a script that asks for
    several processes at its top, not under `if __name__ == "__main__"`, would ask for more in each.
    Threads that begin processes wait for each other.
    """
    with _ONE_AT_A_TIME:
        main = sys.modules["__main__"]
        names = ("__spec__", "__file__")
        kept = {name: main.__dict__[name] for name in names if name in main.__dict__}
        main.__spec__ = None
        main.__dict__.pop("__file__", None)
        try:
            yield
        finally:
            main.__dict__.update(kept)


@contextmanager
def _pool(workers: int, stop: Callable[[], bool]) -> Iterator[ProcessPoolExecutor]:
    """Processes that end with the block: at once if it is to stop, or is left by an error."""
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_quiet)
    finished = False
    try:
        yield pool
        finished = not stop()
    finally:
        # The executor itself has no way to end work that is under way (Python 3.14 has).
        own = [] if finished else list((pool._processes or {}).values())
        pool.shutdown(wait=finished, cancel_futures=True)
        for process in own:
            process.terminate()


def _quiet() -> None:
    """Leaves Ctrl-C, which reaches all processes of a terminal, to the one that started them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


MOST_PER_CORE = 8  # processes a core


def check_workers(workers: int) -> None:
    """Makes sure that so many processes are some, and no more than the machine bears.

    Raises:
        InputError: Naming the option, its value and what would be right.
    """
    cores = os.cpu_count() or 1
    if not (is_integer(workers) and 1 <= workers <= MOST_PER_CORE * cores):
        remedy = f"give 1 to {MOST_PER_CORE * cores} processes: there are {cores} cores"
        raise InputError(source="--workers", field="workers", value=workers, remedy=remedy)
