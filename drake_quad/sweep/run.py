"""A sweep from end to end: trials, journal, tables, findings, progress and report."""

import json
import shlex
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeRemainingColumn

from drake_quad.errors import DrakeQuadError, InputError
from drake_quad.robot.digest import robot_digest
from drake_quad.simulation.precompile import kernels_for, precompiling
from drake_quad.sweep.executors import Work, run_local
from drake_quad.sweep.findings import summarize_sweep
from drake_quad.sweep.journal import Journal
from drake_quad.sweep.provenance import commit, describe, own_versions, robots_of
from drake_quad.sweep.report import (
    check_page,
    make_replays,
    otherwise,
    replayable,
    replays_in,
    write_section,
    write_sweep_report,
)
from drake_quad.sweep.results import CLOCK, FINDINGS, REPORT, STUDY, TRIALS, fitting, write_tables
from drake_quad.sweep.study import Base, Limits, Study
from drake_quad.sweep.study_loading import as_plain, load_study_and_base
from drake_quad.sweep.trials import (
    TRIALS_DIRECTORY,
    Trial,
    count_trials,
    make_trials,
    sweep_command,
    work,
)
from drake_quad.util.files import write_whole
from drake_quad.util.parallel import check_workers
from drake_quad.util.progress import LateProgress
from drake_quad.util.versions import MODELS

MADE = (TRIALS, CLOCK, FINDINGS, REPORT)  # files that are made from the journal
LEAVINGS = (*MADE, TRIALS_DIRECTORY)

CHANGED = {
    "sources": "the sources of drake_quad differ",
    "versions": "the libraries' versions differ",
    "robot": "the robot's files differ",
}

Result = dict[str, Any]
# Carries out trials, and yields the index and the result of each as they end.
CarryOut = Callable[[Iterable[Trial], Work], Iterator[tuple[int, Result]]]
# Receives each trial that is done: index, result, number of trials done, number of all.
Note = Callable[[int, Result, int, int], object]

PACE_WINDOW = 1800.0  # [s] the pace of this time gives the time left
PROGRESS_LINES = 20  # lines of progress where there is no terminal


class SourcesChangedError(DrakeQuadError):
    """Trials of two versions of the program do not make one study."""


def carry_out_study(
    study: Study,
    base: Base,
    out: Path,
    carry_out: CarryOut,
    *,
    resume: bool = False,
    limit: int | None = None,
    begin: Callable[[int, int, int], object] = lambda _done, _failed, _of: None,
    note: Note = lambda _index, _result, _done, _of: None,
    finish: Callable[[dict[str, Any], pa.Table], object] = lambda _findings, _trials: None,
    work: Work = work,
    command: str = "",
    files: Sequence[Path] = (),
) -> dict[str, Any]:
    """Carries out the trials that are not done, and writes tables and findings into `out`.

    Args:
        study: The study.
        base: Its scenario.
        out: The sweep's directory.
        carry_out: Function that carries out trials, here or on a cluster.
        resume: Whether to go on with the trials that are there.
        limit: Number of trials to carry out, the study's first; None for all.
        begin: Receives the number of trials that were done before, how many of them failed, and
            the number of all, once all input has been accepted.
        note: Receives each trial that is done.
        finish: Receives findings and the trials' table, while the directory is still locked.
        work: Function that carries out a trial, at the top of a module.
        command: Command line of the sweep, for the findings.
        files: Files that the findings depend on besides the program. If they were changed since the
            commit, the findings say so.

    Returns:
        The findings, as in sweep.json.

    Raises:
        InputError: `out` cannot be used, or holds another study's sweep.
        SourcesChangedError: The program was changed while the sweep ran; what was done is kept.
    """
    identity = describe(study, base)
    made_of = commit(MODELS, *files)  # before the trials: a commit may come while they run
    basis = {
        "sources": [identity["sources"]],
        "versions": [own_versions()],
        "robot": robots_of(study, base),
    }
    journal = Journal(out, identity, LEAVINGS, fits=fitting(study))
    journal.open(resume=resume)
    begun = time.perf_counter()
    try:
        # Nothing old may be there that could be read as this sweep's.
        for name in MADE:
            with suppress(FileNotFoundError):
                (out / name).unlink()
        _write(out / STUDY, {"definition": as_plain(study), "base": base.name, **identity})
        of = min(count_trials(study), limit or count_trials(study))
        pending = (
            trial
            for trial in make_trials(study, base, first=0, last=of)
            if trial.index not in journal.done
        )
        failed = sum(not result["success"] for result in journal.done.values())
        begin(len(journal.done), failed, max(of, len(journal.done)))
        for index, result in carry_out(pending, work):
            if result["outcome"] == "refused" and result["robot"] is None:
                _check_refusal(study, base, index, result["reason"])
            for name, own in basis.items():
                if result[name] is not None and result[name] not in own:
                    raise SourcesChangedError(
                        f"{CHANGED[name]} where trial {index} was carried out (changed since, or "
                        "another machine); the trials before it are kept, and --resume goes on "
                        "once they are the same again"
                    )
            journal.add(index, result)
            note(index, result, len(journal.done), max(of, len(journal.done)))
        trials, clock = write_tables(study, base, journal.done, out)
        findings = {
            **summarize_sweep(study, trials, clock),
            "elapsed": time.perf_counter() - begun,
            "commit": made_of,
            "command": command,
            **identity,
        }
        _write(out / FINDINGS, findings)
        finish(findings, trials)
    finally:
        journal.close()
    return findings


def _check_refusal(study: Study, base: Base, index: int, reason: str) -> None:
    """Checks that a trial whose robot could not be loaded is refused here, too.

    Raises:
        SourcesChangedError: It is not: the other machine lacks something, which is no finding.
    """
    (trial,) = make_trials(study, base, first=index, last=index + 1)
    try:
        robot_digest(base.load(list(trial.overrides)).robot.model)
    except InputError:
        return
    raise SourcesChangedError(
        f"trial {index} was refused where it was carried out, and would not be here: {reason}; "
        "the trials before it are kept, and --resume goes on once that is mended there"
    )


def _write(path: Path, plain: dict[str, Any]) -> None:
    text = json.dumps(plain, indent=1) + "\n"
    write_whole(path, lambda to: to.write_text(text, encoding="utf-8"))


class Bar:
    """A progress bar with pace and time left; without a terminal, lines now and then."""

    def __init__(self, console: Console) -> None:
        columns: list[Any] = [
            TextColumn("{task.completed:.0f} of {task.total:.0f} trials"),
            BarColumn(),
            TextColumn("{task.fields[pace]}"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[bad]} failed"),
        ]
        self._console = console
        self._bar = LateProgress(*columns, console=console, speed_estimate_period=PACE_WINDOW)
        self._before = self._bad = 0

    def begin(self, done: int, failed: int, of: int) -> None:
        """Shows the bar, with the trials that were done before."""
        self._before, self._bad = done, failed
        self._bar.add_task("", total=of, completed=done, pace="", bad=failed)
        self._bar.start()

    def note(self, index: int, result: dict[str, Any], done: int, of: int) -> None:
        """Counts a trial, and prints why it failed if it did."""
        count = done - self._before
        if not result["success"]:
            self._bad += 1
            text = f"trial {index} {result['outcome']}: {result['reason']}"
            self._console.print(text, markup=False, highlight=False, soft_wrap=True)
        task = self._bar.tasks[0]
        rate = count / max(task.elapsed or 0.0, 1e-9)
        pace = f"{60.0 * rate:.1f} a minute"
        self._bar.update(task.id, completed=done, pace=pace, bad=self._bad)
        if (
            not self._console.is_terminal
            and count % max(1, (of - self._before) // PROGRESS_LINES) == 0
        ):
            left = (of - done) / rate
            line = f"{done} of {of} trials, {pace}, {self._bad} failed, {left:.0f} s left"
            self._console.print(line, highlight=False)

    def end(self) -> None:
        """Stops the bar, and leaves it on the screen."""
        self._bar.stop()


@dataclass(frozen=True)
class SweepRequest:
    """The options of `drake-quad sweep`.

    Attributes:
        study: The study's file.
        out: The sweep's directory.
        workers: Number of processes on this machine.
        dask: Address of a Dask scheduler, instead of processes of this machine.
        resume: Whether to go on with the trials in `out`.
        limit: Number of trials to carry out, the study's first; None for all.
        replays: Number of the worst trials to run again, for their reports.
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
    """Carries out the sweep, and returns its findings.

    Args:
        asked: The options.
        console: Console for progress and messages.
        stop: Whether to stop, and to keep the trials that are done.
        ready: Called once all input has been accepted, before anything is written: a study that is
            refused leaves nothing behind. It may raise an InputError, too.

    Raises:
        InputError: If anything given cannot be used.
    """
    with ExitStack() as opened:  # a refusal leaves no connection behind
        return _run_sweep(asked, console, stop, ready, opened)


def _run_sweep(
    asked: SweepRequest, console: Console, stop: Callable[[], bool],
    ready: Callable[[], object], opened: ExitStack,
) -> dict[str, Any]:  # fmt: skip
    """See `run_sweep`; what is `opened` is closed at its end."""
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
        _local(asked, study.limits, stop)
        if asked.dask is None
        else _cluster(asked.dask, study.limits, console, stop, opened)
    )
    ready()
    if asked.dask is None:  # once for all processes
        with precompiling(_kernels(study, base), console.print) as wait:
            wait()
    bar = Bar(console)
    files = [asked.study, *([] if base.text is None else [Path(base.name)])]

    def finish(findings: dict[str, Any], trials: pa.Table) -> None:
        bar.end()
        write_sweep_report(study, findings, asked.out)
        if asked.page is not None:
            _write_section(asked, findings, console, stop)
        if asked.replays and not stop():
            _replay(asked, study, base, trials, console, stop)
            write_sweep_report(study, findings, asked.out)  # with links to them

    try:
        findings = carry_out_study(
            study, base, asked.out, here, resume=asked.resume, limit=asked.limit,
            begin=bar.begin, note=bar.note, finish=finish,
            command=sweep_command(asked.study, asked.limit), files=files,
        )  # fmt: skip
    finally:
        bar.end()
    return {**findings, "interrupted": stop()}


def _kernels(study: Study, base: Base) -> tuple[str, ...]:
    """The kernels that the study's own scenario needs."""
    scenario = base.load(study.set)
    return kernels_for(scenario.controller.kind, scenario.estimator.kind, scenario.sensors.contacts)


def _write_section(
    asked: SweepRequest, findings: dict[str, Any], console: Console, stop: Callable[[], bool]
) -> None:
    """Writes the section, unless Ctrl-C left only a part of the study."""
    if not stop() and asked.page is not None:
        write_section(asked.page, findings, findings["command"], asked.study.stem)
        return
    words = ["drake-quad", "report", str(asked.out), "--page", str(asked.page)]
    line = f"interrupted: {asked.page} is as it was; `{shlex.join(words)}` writes the trials done"
    console.print(line, markup=False, highlight=False, soft_wrap=True)


def _replay(
    asked: SweepRequest, study: Study, base: Base, trials: pa.Table, console: Console,
    stop: Callable[[], bool],
) -> None:  # fmt: skip
    """Runs the worst trials again; says if they are too few, or if one ends otherwise."""
    worst = replayable(trials, asked.replays)
    there = len(worst) - len(set(worst) - replays_in(asked.out).keys())
    with console.status("running the worst trials again"):
        made, without = make_replays(study, base, worst, asked.out, stop)
    for index, why in without.items():
        line = f"trial {index} cannot be run again here: {why}"
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    for index, outcome in otherwise(trials, asked.out).items():
        line = f"trial {index} ended otherwise here: {outcome}; another processor may cause that"
        console.print(line, highlight=False, soft_wrap=True)
    if len(made) + there < asked.replays:
        why = "stopped" if stop() else "no other finished trial had a run"
        line = f"--replays {asked.replays}: {len(made)} made, {there} were there before; {why}"
        console.print(line, highlight=False, soft_wrap=True)


def _local(asked: SweepRequest, limits: Limits, stop: Callable[[], bool]) -> CarryOut:
    return lambda trials, work: run_local(
        trials, workers=asked.workers, limits=limits, stop=stop, work=work
    )


def _cluster(
    address: str, limits: Limits, console: Console, stop: Callable[[], bool], opened: ExitStack
) -> CarryOut:
    from drake_quad.sweep.dask_executor import connect, run_on_dask

    client = connect(address)
    opened.callback(client.close)  # which may be closed already
    if not client.scheduler_info()["workers"]:
        words = f"{address} has no worker yet: waiting for one (dask worker {address})"
        console.print(words, markup=False, highlight=False, soft_wrap=True)
    return lambda trials, work: run_on_dask(client, trials, limits=limits, stop=stop, work=work)
