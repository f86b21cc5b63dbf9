"""Carries out trials on this machine, in as many processes as asked for."""

import queue
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from drake_quad.sweep.isolated import Interrupted, Isolated, Work
from drake_quad.sweep.process import LOOK_PERIOD
from drake_quad.sweep.study_config import Limits
from drake_quad.sweep.trials import Trial
from drake_quad.sweep.work import work

Result = dict[str, Any]


def carry_out(
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
        isolated = Isolated(recycle=limits.recycle, retries=limits.retries, work=work)
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
