"""Worker processes that outlive what a trial may do to one of them, and the bar that shows them.

Each process has trials of its own, in order, so that it can keep what one leaves for the next; or
all take from one queue. A process is replaced after some trials, for Drake's memory grows with
every build, and after a trial that killed it.
"""

import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from benchmarks.study import OK, Records, Result, Trial, sources_digest

# The signals by which a process ends itself. Any other comes from outside, and is no trial's fault.
OWN_END = (signal.SIGABRT, signal.SIGSEGV, signal.SIGFPE, signal.SIGBUS, signal.SIGILL)
PACE_WINDOW = 1800.0  # [s] over which the pace is taken, for the time left
TOLD = 20  # lines of progress where there is no terminal

Work = Callable[[Trial], Result]


class Worker:
    """One process, and the trial that it has."""

    def __init__(self, work: Work, queue: deque[Trial]) -> None:
        """Starts it; `work` must be a module's own function."""
        context = multiprocessing.get_context("spawn")  # Drake and forks do not mix
        self.queue, self.given = queue, 0
        self.pipe, far = context.Pipe()
        self._process = context.Process(target=serve, args=(work, far), daemon=True)
        self._process.start()
        far.close()  # so that the pipe ends with the process
        self.trial: Trial = {}

    def give(self) -> None:
        """Gives it the next trial of its queue."""
        self.trial = self.queue.popleft()
        self.given += 1
        self.pipe.send(self.trial)

    def take(self) -> Result:
        """What came of its trial.

        Raises:
            RuntimeError: If somebody else ended the process.
        """
        try:
            result: Result = self.pipe.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            code = self._process.exitcode or 0
            if -code not in OWN_END:
                raise RuntimeError(
                    f"a worker was ended from outside (exit code {code}), for want of memory "
                    "perhaps: go on with --resume"
                ) from None
            name = signal.Signals(-code).name
            self.given = -1  # there is no process to give more to
            return {"outcome": "stopped", "reason": f"its process ended itself by {name}"}
        return result

    def end(self) -> None:
        """Ends the process."""
        self.pipe.close()
        self._process.terminate()
        self._process.join()


def serve(work: Work, pipe: Connection) -> None:
    """A worker's life: trial after trial until the pipe ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one that started this
    while True:
        try:
            trial: Trial = pipe.recv()
        except EOFError:
            return
        try:
            result = work(trial)
        except Exception as error:  # a trial that cannot be carried out is a finding too
            text = " ".join(f"{type(error).__name__}: {error}".split())
            result = {"outcome": "stopped", "reason": text}
        pipe.send(result)


def carry_out(
    work: Work, queues: Sequence[deque[Trial]], *, recycle: int
) -> Iterator[tuple[Trial, Result]]:
    """Carries out all trials, a process a queue (the same queue may be given twice).

    Args:
        work: Of one trial: a module's own function.
        queues: Of the trials; they are emptied.
        recycle: After so many trials a process is replaced.

    Yields:
        Each trial and what came of it, as they end.

    Raises:
        RuntimeError: If a worker was ended from outside, or the sources were changed meanwhile.
    """
    digest = sources_digest()
    workers: list[Worker] = []

    def start(queue: deque[Trial]) -> None:
        if not queue:
            return
        if sources_digest() != digest:
            raise RuntimeError("the sources were changed while the study ran")
        workers.append(Worker(work, queue))
        workers[-1].give()

    try:
        for queue in queues:
            start(queue)
        while workers:
            ready = wait([worker.pipe for worker in workers])
            for worker in [worker for worker in workers if worker.pipe in ready]:
                trial, result = worker.trial, worker.take()
                yield trial, result
                if worker.queue and 0 <= worker.given < recycle:
                    worker.give()
                    continue
                workers.remove(worker)
                worker.end()
                start(worker.queue)
    finally:
        for worker in workers:
            worker.end()


def carry_on(
    work: Work,
    queues: Sequence[deque[Trial]],
    records: Records,
    *,
    recycle: int,
    name: Callable[[Result], str],
) -> None:
    """Carries out all trials, records each as it ends, and shows on stderr how far it is.

    Args:
        work: Of one trial: a module's own function.
        queues: Of the trials; they are emptied.
        records: To add to.
        recycle: After so many trials a process is replaced.
        name: What to call a trial that did not end well.
    """
    console = Console(stderr=True)
    pending = sum(len(queue) for queue in {id(queue): queue for queue in queues}.values())
    columns: list[Any] = [
        TextColumn("{task.completed:.0f} of {task.total:.0f} trials"),
        BarColumn(),
        TextColumn("{task.fields[pace]}"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[bad]} not well"),
    ]
    with Progress(*columns, console=console, speed_estimate_period=PACE_WINDOW) as bar:
        task, bad = bar.add_task("", total=pending, pace="", bad=0), 0
        for count, (trial, result) in enumerate(carry_out(work, queues, recycle=recycle), start=1):
            records.add(trial, result)
            if result["outcome"] not in OK:
                bad += 1
                text = f"{result['outcome']}: {name({**trial, **result})}: {result['reason']}"
                console.print(text, markup=False, highlight=False, soft_wrap=True)
            pace = f"{60.0 * count / max(bar.tasks[0].elapsed or 0.0, 1e-9):.1f} a minute"
            bar.update(task, advance=1, pace=pace, bad=bad)
            if not console.is_terminal and count % max(1, pending // TOLD) == 0:
                console.print(f"{count} of {pending} trials, {pace}, {bad} not well")
