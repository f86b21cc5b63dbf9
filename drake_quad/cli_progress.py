"""What is shown while a command works, and how Ctrl-C ends it without loss."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


@contextmanager
def interruptible(err: Console) -> Iterator[Callable[[], bool]]:
    """Turns Ctrl-C or a polite kill into a stop; a second Ctrl-C is an interrupt as usual."""
    seen = False

    def note(_number: int, _frame: FrameType | None) -> None:
        nonlocal seen
        seen = True
        err.print("\nstopping; writing what was logged")
        signal.signal(signal.SIGINT, signal.default_int_handler)

    before = signal.signal(signal.SIGINT, note), signal.signal(signal.SIGTERM, note)
    try:
        yield lambda: seen
    finally:
        signal.signal(signal.SIGINT, before[0])
        signal.signal(signal.SIGTERM, before[1])


@contextmanager
def seconds_progress(label: str, err: Console) -> Iterator[Callable[[float, float], None]]:
    """A bar over simulated time [s], with its pace."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f} s"),
        TextColumn("{task.fields[pace]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=err, transient=True) as bar:
        task = bar.add_task(label, total=None, pace="", start=True, visible=False)

        def show(done: float, total: float) -> None:
            elapsed = bar.tasks[0].elapsed or 1e-9
            pace = f"{done / elapsed:.1f} × real time"
            bar.update(task, completed=done, total=max(total, done), pace=pace, visible=True)

        yield show


@contextmanager
def cells_progress(err: Console) -> Iterator[Callable[[int, int], None]]:
    """A bar over the cells of a chart."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f}"),
        TextColumn("{task.fields[pace]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with Progress(*columns, console=err, transient=True, speed_estimate_period=600.0) as bar:
        task = bar.add_task("planning stairs", total=None, pace="", visible=False)

        def show(done: int, total: int) -> None:
            elapsed = bar.tasks[0].elapsed or 1e-9
            pace = f"{60.0 * done / elapsed:.1f} a minute"
            bar.update(task, completed=done, total=total, pace=pace, visible=True)

        yield show
