"""`drake-quad sweep`: its options made into a sweep, its progress, and what it prints."""

import os
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Column, Table
from rich.text import Text

from drake_quad.errors import InputError
from drake_quad.sweep.crew import carry_out
from drake_quad.sweep.page import check_page, write_report, write_section
from drake_quad.sweep.replays import make_replays
from drake_quad.sweep.study import load_study
from drake_quad.sweep.sweep import CarryOut, sweep
from drake_quad.sweep.trials import repeat_into

PACE_WINDOW = 1800.0  # [s] over which the pace is taken, for the time left
MOST_EACH = 8  # processes a core
TOLD = 20  # lines of progress where there is no terminal


@dataclass(frozen=True)
class Asked:
    """What was asked for on the command line.

    Attributes:
        study: The study's file.
        out: The sweep's directory.
        workers: Processes on this machine.
        dask: Address of a Dask scheduler, instead of processes of this machine.
        resume: Whether to go on with what is in `out`.
        limit: Do only the study's first so many trials.
        replays: So many of the worst trials are run again, for their reports.
        page: Markdown page to write the study's section of.
    """

    study: Path
    out: Path
    workers: int
    dask: str | None = None
    resume: bool = False
    limit: int | None = None
    replays: int = 0
    page: Path | None = None


def run_sweep(asked: Asked, console: Console, stop: Callable[[], bool]) -> dict[str, Any]:
    """Carries out the sweep; its findings.

    Args:
        asked: The options.
        console: For progress.
        stop: Whether to stop, with what is done.

    Raises:
        InputError: If anything given cannot be used.
    """
    least = {"workers": 1, "limit": 1, "replays": 0}
    for name, value in ((name, getattr(asked, name)) for name in least):
        if value is not None and value < least[name]:
            remedy = f"give {least[name]} or more"
            raise InputError(source=f"--{name}", field=name, value=value, remedy=remedy)
    most = MOST_EACH * (os.cpu_count() or 1)
    if asked.workers > most:
        remedy = f"give {most} or fewer: there are {os.cpu_count()} cores"
        raise InputError(source="--workers", field="workers", value=asked.workers, remedy=remedy)
    study, base = load_study(asked.study)
    if asked.page is not None:
        check_page(asked.page, asked.study.stem)
    place = _crew if asked.dask is None else _cluster
    here = place(asked, study.limits, stop)
    bar = _Bar(console)

    def finish(told: dict[str, Any]) -> None:
        bar.end()
        if asked.replays and not stop():
            with console.status("running the worst trials again"):
                make_replays(study, base, told, asked.out, asked.replays, stop)
        write_report(study, told, asked.out)
        if asked.page is not None:
            command = shlex.join(["drake-quad", "sweep", str(asked.study)])
            write_section(asked.page, told, command, asked.study.stem)

    try:
        told = sweep(
            study, base, asked.out, here, resume=asked.resume, limit=asked.limit,
            begin=bar.begin, note=bar.note, finish=finish,
        )  # fmt: skip
    finally:
        bar.end()
    return {**told, "interrupted": stop()}


def _crew(asked: Asked, limits: Any, stop: Callable[[], bool]) -> CarryOut:
    return lambda trials, work: carry_out(
        trials, workers=asked.workers, limits=limits, stop=stop, work=work
    )


def _cluster(asked: Asked, limits: Any, stop: Callable[[], bool]) -> CarryOut:
    from drake_quad.sweep.cluster import carry_out_on, connect

    client = connect(asked.dask or "")
    return lambda trials, work: carry_out_on(client, trials, limits=limits, stop=stop, work=work)


class _Bar:
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

    def begin(self, done: int, of: int) -> None:
        """Shows it."""
        self._before = done
        self._bar.add_task("", total=of, completed=done, pace="", bad=0)
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


def print_sweep(told: dict[str, Any], out: Path, console: Console) -> None:
    """Prints the rate, the bands, the causes of failure, and the commands that repeat the worst."""

    def say(text: str) -> None:
        console.print(text, highlight=False, soft_wrap=True)

    rate = told["rate"]
    colour = "green" if told["passed"] or (told["passed"] is None and rate["good"]) else "red"
    say(f"[bold {colour}]{rate['good']} of {rate['trials']}[/] trials succeeded: {rate['text']}")
    if not told["complete"]:
        say(f"{told['trials']} of {told['asked']} trials are done: go on with --resume")
    if told["kinematic"]:
        say("[yellow]kinematic trials among them: no physics, so they prove nothing[/]")
    if told["gate"] is not None:
        word = ("kept" if told["passed"] else "missed") + ("" if told["complete"] else " so far")
        say(f"asked for at least {100 * told['gate']:g} %: {word}")
    for name, bands in told["bands"].items():
        if len(bands) == 1:
            continue
        table = Table(Column(Text(name)), "trials", "succeeded", "with bounds at 95 %", box=None)
        for band in bands:
            label = Text(band["label"])
            table.add_row(label, str(band["trials"]), str(band["good"]), band["text"])
        console.print(table, highlight=False)
    for cause in told["causes"]:
        console.print(f"{cause['trials']:4d} × {cause['cause']}", markup=False, highlight=False)
    for trial in told["worst"][:3]:
        if trial["outcome"] != "goal_reached":
            command = repeat_into(trial["command"], trial["index"], out)
            console.print(command, markup=False, highlight=False, soft_wrap=True)
    console.print(f"look at {out / 'report.html'}", markup=False, highlight=False, soft_wrap=True)
