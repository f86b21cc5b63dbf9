"""How far a sweep has come, while it works: a bar with pace and time left."""

from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

PACE_WINDOW = 1800.0  # [s] over which the pace is taken, for the time left
TOLD = 20  # lines of progress where there is no terminal


class Bar:
    """A bar with pace and time left; lines now and then where there is no terminal."""

    def __init__(self, console: Console) -> None:
        columns: list[Any] = [
            TextColumn("{task.completed:.0f} of {task.total:.0f} trials"),
            BarColumn(),
            TextColumn("{task.fields[pace]}"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[bad]} failed"),
        ]
        self._console = console
        self._bar = Progress(*columns, console=console, speed_estimate_period=PACE_WINDOW)
        self._before = self._bad = 0

    def begin(self, done: int, failed: int, of: int) -> None:
        """Shows it, with what was done and failed before."""
        self._before, self._bad = done, failed
        self._bar.add_task("", total=of, completed=done, pace="", bad=failed)
        self._bar.start()

    def note(self, index: int, result: dict[str, Any], done: int, of: int) -> None:
        """Shows that a trial is done, and why it failed if it did."""
        count = done - self._before
        if not result["success"]:
            self._bad += 1
            text = f"trial {index} {result['outcome']}: {result['reason']}"
            self._console.print(text, markup=False, highlight=False, soft_wrap=True)
        task = self._bar.tasks[0]
        rate = count / max(task.elapsed or 0.0, 1e-9)
        pace = f"{60.0 * rate:.1f} a minute"
        self._bar.update(task.id, completed=done, pace=pace, bad=self._bad)
        if not self._console.is_terminal and count % max(1, (of - self._before) // TOLD) == 0:
            left = (of - done) / rate
            line = f"{done} of {of} trials, {pace}, {self._bad} failed, {left:.0f} s left"
            self._console.print(line, highlight=False)

    def end(self) -> None:
        """Leaves it as it is."""
        self._bar.stop()
