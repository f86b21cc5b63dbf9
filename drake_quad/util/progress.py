"""A progress bar that is not there before there is something to show."""

from typing import Any, Self

from rich.progress import Progress, TaskID


class LateProgress(Progress):
    """A progress bar of rich that appears with its first update.

    A bar of rich's own appears when its block is entered, and leaves an empty line at its end where
    there is no terminal: before the one line of a refusal, too.
    """

    def __enter__(self) -> Self:
        return self

    def update(self, task_id: TaskID, *args: Any, **fields: Any) -> None:
        """Updates a task, and shows the bar from now on."""
        super().update(task_id, *args, **fields)
        self.start()

    def stop(self) -> None:
        """Takes the bar away, or leaves its last state, if it ever appeared."""
        if self.live.is_started and self.console.is_interactive:
            super().stop()
        elif self.live.is_started:
            self.live.stop()  # rich's own writes an empty line where nobody sees the bar
