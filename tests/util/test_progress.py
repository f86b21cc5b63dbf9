"""The bar that appears with its first update."""

import io

import pytest
from rich.console import Console

from drake_quad.util.progress import LateProgress


def test_a_bar_that_was_never_updated_writes_nothing() -> None:
    """A refusal before the first update is one line, without an empty one before it."""
    written = io.StringIO()
    with pytest.raises(ValueError), LateProgress(console=Console(file=written)) as bar:
        bar.add_task("walking", total=2)
        raise ValueError
    assert written.getvalue() == ""


def test_a_bar_shows_its_task_from_the_first_update_on() -> None:
    """What it shows last stays, as with a bar of rich."""
    written = io.StringIO()
    with LateProgress(console=Console(file=written, force_terminal=True)) as bar:
        task = bar.add_task("walking", total=2)
        assert not bar.live.is_started
        bar.update(task, completed=1)
        assert bar.live.is_started
    assert "walking" in written.getvalue() and "50%" in written.getvalue()
    assert not bar.live.is_started


def test_a_bar_that_nobody_sees_leaves_no_empty_line() -> None:
    """Where there is no terminal a transient bar writes nothing at all."""
    written = io.StringIO()
    with LateProgress(console=Console(file=written), transient=True) as bar:
        bar.update(bar.add_task("walking", total=2), completed=1)
    assert written.getvalue() == ""
