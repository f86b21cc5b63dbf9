"""Carries out trials on a Dask cluster, each in a process beside the worker that has it."""

import gc
import logging
import multiprocessing
import queue
import threading
import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any

from drake_quad.errors import DrakeQuadError, InputError
from drake_quad.sweep.executors import LOOK_PERIOD, IsolatedWorker, Work
from drake_quad.sweep.study import Limits
from drake_quad.sweep.trials import Trial, lost, work

CONNECT_TIME = 10.0  # [s]
IDLE = 60.0  # [s] without a trial after which a worker's process is ended: it takes 400 MB

Result = dict[str, Any]
_own = threading.local()  # each thread of a worker has its own


class ClusterGoneError(DrakeQuadError):
    """The scheduler went away; the journal has the trials that were done."""


def connect(address: str) -> Any:
    """Connects to a cluster, before anything is begun.

    Args:
        address: Address of the scheduler, for example `tcp://127.0.0.1:8786`.

    Returns:
        A distributed.Client.

    Raises:
        InputError: If Dask is not installed, or nobody answers at `address`.
    """
    try:
        from distributed import Client
    except ImportError:
        raise _error(address, "Dask is not installed: pip install distributed") from None
    # An error of the connection is reported here, in one line.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=CONNECT_TIME)
    except Exception as problem:  # each of its transports has its own
        reason = (str(problem) or type(problem).__name__).splitlines()[0]
    # A client that failed is closed when it is collected, and takes a lock for that. A new client
    # holds that lock while it begins: collected just then, the two would wait for each other.
    gc.collect()
    raise _error(address, f"no scheduler answers: {reason}")


def run_on_dask(
    client: Any,
    trials: Iterable[Trial],
    *,
    limits: Limits,
    stop: Callable[[], bool] = lambda: False,
    work: Work = work,
) -> Iterator[tuple[int, Result]]:
    """Carries out the trials on the cluster, with the same results as on one machine.

    A trial whose worker dies goes to another, as often as the scheduler's `allowed-failures`.

    Args:
        client: Client that `connect` returned; it is closed at the end.
        trials: The trials, in the order in which they begin.
        limits: Limits on tries, and on the age of a process.
        stop: Whether to stop; trials under way are then given up, by the workers too.
        work: Function that carries out a trial, at the top of a module.

    Yields:
        The index of each trial and its result, as they end.

    Raises:
        ClusterGoneError: If the scheduler does not answer any more, or a worker can do no trial.
    """
    from distributed.scheduler import KilledWorker

    name = uuid.uuid4().hex  # two sweeps with one key would share its result on the cluster
    with client:
        pending = {
            client.submit(do, trial, limits, work, name, pure=False, key=f"{name}-{trial.index}"):
            trial for trial in trials
        }  # fmt: skip
        done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        for future in pending:
            future.add_done_callback(done.put)
        try:
            while pending and not stop():
                try:
                    future = done.get(timeout=LOOK_PERIOD)
                except queue.Empty:
                    continue
                trial = pending.pop(future)
                failed = future.status == "error"
                try:
                    result: Result = future.result()
                except KilledWorker as error:
                    result = lost(trial, "killed", str(error))
                except Exception as error:
                    if not failed:
                        raise
                    # The worker has no drake_quad, or another one, or no process begins there.
                    reason = " ".join(f"{type(error).__name__}: {error}".split())
                    raise ClusterGoneError(f"a worker cannot carry out trials: {reason}") from None
                yield trial.index, result
            with suppress(queue.Empty):  # results that are there are kept, also after a stop
                while True:
                    future = done.get_nowait()
                    if future.status == "finished":
                        trial = pending.pop(future)
                        yield trial.index, future.result()
        except (CancelledError, OSError) as problem:
            if stop():
                return
            raise ClusterGoneError(
                f"the Dask scheduler went away ({type(problem).__name__}); what was done is kept: "
                "go on with --resume"
            ) from None
        finally:
            client.cancel(list(pending), force=True)


def do(trial: Trial, limits: Limits, work: Work, sweep: str) -> Result:
    """What a worker does with a trial: carries it out in the process of the current thread.

    Each sweep has processes of its own, because drake_quad may have been changed since the last. A
    process without a trial for a while is ended, as a worker never learns that a sweep is over.
    """
    isolated: IsolatedWorker | None = getattr(_own, "isolated", None)
    idle: threading.Timer | None = getattr(_own, "idle", None)
    if idle is not None:
        idle.cancel()
        idle.join()  # it may be ending the process now
    if isolated is None or _own.of != sweep:
        # Dask's workers are daemons, to which multiprocessing allows no children. These ones end
        # with their worker all the same (`begin_process`).
        multiprocessing.current_process()._config["daemon"] = False  # type: ignore[attr-defined]
        if isolated is not None:
            isolated.end()
        isolated = IsolatedWorker(recycle=limits.recycle, retries=limits.retries, work=work)
        _own.isolated, _own.of = isolated, sweep
    result = isolated.run(trial, _given_up())
    _own.idle = threading.Timer(IDLE, isolated.end)
    _own.idle.daemon = True
    _own.idle.start()
    return result


def _given_up() -> Callable[[], bool]:
    """Makes the check whether this worker's task was cancelled: its sweep was stopped, or is gone.

    Dask does not interrupt what runs. Without this check the trials of a stopped sweep would keep
    the workers from those of the next one until they end.
    """
    from distributed import get_worker
    from distributed.worker import thread_state

    tasks, key = get_worker().state.tasks, thread_state.key

    def given_up() -> bool:
        task = tasks.get(key)
        return task is None or task.state == "cancelled"

    return given_up


def _error(address: str, remedy: str) -> InputError:
    return InputError(source="--dask", field="address", value=address, remedy=remedy)
