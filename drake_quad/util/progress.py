"""A progress bar that is not there before there is something to show."""

import time
from typing import Any, Self

from rich.progress import Progress, ProgressColumn, TaskID, TextColumn


class LateProgress(Progress):
    """A progress bar of rich that appears with its first update.

    A bar of rich's own appears when its block is entered, and leaves an empty line at its end where
    there is no terminal: before the one line of a refusal, too. Without a terminal a bar cannot be
    drawn anew, so a line is printed now and then.
    """

    def __init__(self, *columns: ProgressColumn, every: float | None = None, **given: Any) -> None:
        """Takes the columns.

        Args:
            columns: As for rich's bar.
            every: Time between lines without a terminal [s]; None for none.
            given: Passed on.
        """
        super().__init__(*columns, **given)
        self._every, self._said = every, time.monotonic()

    def __enter__(self) -> Self:
        return self

    def update(self, task_id: TaskID, *args: Any, **fields: Any) -> None:
        """Updates a task, and shows the bar from now on."""
        super().update(task_id, *args, **fields)
        if self._every is None or self.console.is_interactive:
            self.start()
        elif time.monotonic() - self._said >= self._every:
            self._said = time.monotonic()
            task = self._tasks[task_id]
            words = [str(c.render(task)) for c in self.columns if isinstance(c, TextColumn)]
            self.console.print(" ".join(words), markup=False, highlight=False, soft_wrap=True)

    def stop(self) -> None:
        """Takes the bar away, or leaves its last state, if it ever appeared."""
        if self.live.is_started and self.console.is_interactive:
            super().stop()
        elif self.live.is_started:
            self.live.stop()  # rich's own writes an empty line where nobody sees the bar
            if not self.live.transient:
                self.console.line()  # after the bar's last state
