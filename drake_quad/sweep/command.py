"""A sweep as a person asks for it: its processes, its progress, its report."""

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from drake_quad.errors import InputError
from drake_quad.simulation.precompile import kernels_for, precompiling
from drake_quad.sweep.commands import sweep_command
from drake_quad.sweep.executors import run_local
from drake_quad.sweep.replays import make_replays, otherwise, replayable, replays_in
from drake_quad.sweep.report import check_page, write_section, write_sweep_report
from drake_quad.sweep.run import CarryOut, carry_out_study
from drake_quad.sweep.study import Base, Limits, Study
from drake_quad.sweep.study_loading import load_study_and_base
from drake_quad.util.parallel import check_workers

# ------------------------------------------------------------------------------------------------
# How far a sweep has come, while it works: a bar with pace and time left.
# ------------------------------------------------------------------------------------------------


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


# ------------------------------------------------------------------------------------------------
# `drake-quad sweep`: its options made into a sweep.
# ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SweepRequest:
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


def run_sweep(
    asked: SweepRequest, console: Console, stop: Callable[[], bool],
    ready: Callable[[], object] = lambda: None,
) -> dict[str, Any]:  # fmt: skip
    """Carries out the sweep; its findings.

    Args:
        asked: The options.
        console: For progress.
        stop: Whether to stop, with what is done.
        ready: Called before anything is written, once all that was given can be used: a study that
            is refused leaves nothing behind. It may refuse, too.

    Raises:
        InputError: If anything given cannot be used.
    """
    check_workers(asked.workers)
    least = {"limit": 1, "replays": 0}
    for name, value in ((name, getattr(asked, name)) for name in least):
        if value is not None and value < least[name]:
            remedy = f"give {least[name]} or more"
            raise InputError(source=f"--{name}", field=name, value=value, remedy=remedy)
    study, base = load_study_and_base(asked.study)
    if asked.page is not None:
        check_page(asked.page, asked.study.stem)
    here = (
        _crew(asked, study.limits, stop)
        if asked.dask is None
        else _cluster(asked.dask, study.limits, console, stop)
    )
    ready()
    if asked.dask is None:  # or each of the processes would compile the same kernels
        with precompiling(_kernels(study, base), console.print) as wait:
            wait()
    bar = Bar(console)
    files = [asked.study, *([] if base.text is None else [Path(base.name)])]

    def finish(told: dict[str, Any], trials: pa.Table) -> None:
        bar.end()
        write_sweep_report(study, told, asked.out)
        if asked.page is not None:
            _write_section(asked, told, console, stop)
        if asked.replays and not stop():
            _replay(asked, study, base, trials, console, stop)
            write_sweep_report(study, told, asked.out)  # with links to them

    try:
        told = carry_out_study(
            study, base, asked.out, here, resume=asked.resume, limit=asked.limit,
            begin=bar.begin, note=bar.note, finish=finish,
            command=sweep_command(asked.study, asked.limit), files=files,
        )  # fmt: skip
    finally:
        bar.end()
    return {**told, "interrupted": stop()}


def _kernels(study: Study, base: Base) -> tuple[str, ...]:
    """What the runs of the study need, but for what it varies."""
    scenario = base.load(study.set)
    return kernels_for(scenario.controller.kind, scenario.estimator.kind)


def _write_section(
    asked: SweepRequest, told: dict[str, Any], console: Console, stop: Callable[[], bool]
) -> None:
    """Writes it, unless that would put what was done before Ctrl-C in place of a whole study."""
    if not stop() and asked.page is not None:
        write_section(asked.page, told, told["command"], asked.study.stem)
        return
    words = ["drake-quad", "report", str(asked.out), "--page", str(asked.page)]
    line = f"interrupted: {asked.page} is as it was; `{shlex.join(words)}` writes what is done"
    console.print(line, markup=False, highlight=False, soft_wrap=True)


def _replay(
    asked: SweepRequest, study: Study, base: Base, trials: pa.Table, console: Console,
    stop: Callable[[], bool],
) -> None:  # fmt: skip
    """Runs the worst trials again; says so if these are fewer than asked for, or end otherwise."""
    worst = replayable(trials, asked.replays)
    there = len(worst) - len(set(worst) - replays_in(asked.out).keys())
    with console.status("running the worst trials again"):
        made, without = make_replays(study, base, worst, asked.out, stop)
    for index, why in without.items():
        line = f"trial {index} cannot be run again here: {why}"
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    for index, outcome in otherwise(trials, asked.out).items():
        told = f"trial {index} came out otherwise here: {outcome}; another processor may do that"
        console.print(told, highlight=False, soft_wrap=True)
    if len(made) + there < asked.replays:
        why = "stopped" if stop() else "no other trial that is done had a run"
        told = f"--replays {asked.replays}: {len(made)} made, {there} were there before; {why}"
        console.print(told, highlight=False, soft_wrap=True)


def _crew(asked: SweepRequest, limits: Limits, stop: Callable[[], bool]) -> CarryOut:
    return lambda trials, work: run_local(
        trials, workers=asked.workers, limits=limits, stop=stop, work=work
    )


def _cluster(address: str, limits: Limits, console: Console, stop: Callable[[], bool]) -> CarryOut:
    from drake_quad.sweep.dask_executor import connect, run_on_dask

    client = connect(address)
    if not client.scheduler_info()["workers"]:
        words = f"{address} has no worker yet: waiting for one (dask worker {address})"
        console.print(words, markup=False, highlight=False, soft_wrap=True)
    return lambda trials, work: run_on_dask(client, trials, limits=limits, stop=stop, work=work)
