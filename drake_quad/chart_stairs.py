"""Which of many stairs a robot climbs: each rise and run of a grid, planned in full."""

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from math import isfinite
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from drake_quad.check_ask import ask_stairs, check_numbers
from drake_quad.check_report import LIMITS, limit_of
from drake_quad.errors import InputError
from drake_quad.robot.load_robot import load_robot
from drake_quad.whole_files import write_whole

MOST_CELLS = 10_000
LOOK_PERIOD = 0.3  # [s] between looks at whether to stop

# Name, rise and run [m] of common rules: the steepest flight that each allows.
STANDARDS = (
    ("IBC 7 × 11 in", 0.178, 0.279),
    ("IRC 7.75 × 10 in", 0.197, 0.254),
    ("DIN 18065", 0.170, 0.290),
    ("OSHA 9.5 × 9.5 in", 0.241, 0.241),
)


@dataclass(frozen=True)
class Cell:
    """One kind of stairs, and what was found.

    Attributes:
        rise: Of the steps [m].
        run: Of the treads [m].
        margin: Least static margin of the plan [m]; None if there is none.
        quality: Least share of margin and room wanted; None if there is no plan.
        treads: That a cycle takes; None if there is no plan.
        limit: What is in the way, one of `check_report.LIMITS`; empty if nothing is.
        reason: The same in full.
    """

    rise: float
    run: float
    margin: float | None
    quality: float | None
    treads: int | None
    limit: str
    reason: str


Judge = Callable[[float, float], Cell]


@dataclass(frozen=True)
class Span:
    """Values from one to another, both counted, a step apart [m]."""

    first: float
    last: float
    step: float

    def values(self, name: str) -> list[float]:
        """The values [m], to the tenth of a millimetre.

        Raises:
            InputError: If the span, of option --`name`-..., is none.
        """
        bounds = (("from", self.first), ("to", self.last), ("step", self.step))
        for word, value in bounds:
            if not (isfinite(value) and value > 0.0):
                option = f"--{name}-{word}"
                remedy = "give metres, more than 0"
                raise InputError(source=option, field=option[2:], value=value, remedy=remedy)
        if self.last < self.first:
            option = f"--{name}-to"
            remedy = f"give no less than --{name}-from, {self.first:g}"
            raise InputError(source=option, field=option[2:], value=self.last, remedy=remedy)
        count = int((self.last - self.first) / self.step + 1e-6) + 1
        if count > MOST_CELLS:
            option = f"--{name}-step"
            remedy = f"makes {count} columns or rows: give more"
            raise InputError(source=option, field=option[2:], value=self.step, remedy=remedy)
        return [round(self.first + k * self.step, 4) for k in range(count)]


def grid_of(rises: Span, runs: Span, count: int) -> list[tuple[float, float]]:
    """Rise and run of every cell [m], run by run.

    Raises:
        InputError: If there can be no such stairs, or they are too many.
    """
    cells = [(rise, run) for run in runs.values("run") for rise in rises.values("rise")]
    if len(cells) > MOST_CELLS:
        remedy = f"{len(cells)} cells are too many: give a larger step"
        raise InputError(source="--rise-step", field="step", value=rises.step, remedy=remedy)
    for rise, run in cells:
        check_numbers(rise, run, count)
    return cells


def judge_cell(model: str, count: int, rise: float, run: float) -> Cell:
    """Plans one kind of stairs in full.

    Raises:
        InputError: If the robot cannot be used.
    """
    try:
        check = ask_stairs(model, rise=rise, run=run, count=count)
    except InputError as error:
        if error.source not in ("--rise", "--run"):
            raise
        # Of a grid's cells some may be too shallow for the robot's feet.
        return Cell(rise, run, None, None, None, "plan", f"run {run:g} m: {error.remedy}")
    found = check.designed
    if found is None:
        return Cell(rise, run, None, None, None, limit_of(check, load_robot(model)), check.reason)
    treads = found.scenario.gait.treads
    return Cell(rise, run, found.margin, found.quality, treads, "", "")


def judge_all(
    judge: Judge,
    cells: Sequence[tuple[float, float]],
    *,
    workers: int,
    progress: Callable[[int, int], object] = lambda _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
) -> list[Cell]:
    """Judges the cells in as many processes; the result is in their order whatever the number.

    Args:
        judge: Judges one; it must be picklable if there are several workers.
        cells: Rise and run of each [m].
        workers: Processes; with one, all is done in this one.
        progress: Is told how many of how many are done.
        stop: Whether to stop: those that are done are then returned.
    """
    done: dict[int, Cell] = {}
    progress(0, len(cells))
    if workers == 1:
        for k, cell in enumerate(cells):
            if stop():
                break
            done[k] = judge(*cell)
            progress(len(done), len(cells))
    else:
        with _pool(min(workers, len(cells)), stop) as pool:
            pending: dict[Future[Cell], int] = {
                pool.submit(judge, *cell): k for k, cell in enumerate(cells)
            }
            while pending and not stop():
                ready, _ = wait(pending, timeout=LOOK_PERIOD, return_when=FIRST_COMPLETED)
                for future in ready:
                    done[pending.pop(future)] = future.result()
                    progress(len(done), len(cells))
    return [done[k] for k in sorted(done)]


def chart_stairs(
    model: str,
    rises: Span,
    runs: Span,
    *,
    count: int,
    workers: int,
    judge: Judge | None = None,
    progress: Callable[[int, int], object] = lambda _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:
    """The chart as plain values, in SI units.

    Args:
        model: A robot's file or name.
        rises: Of the steps.
        runs: Of the treads.
        count: Steps of a flight.
        workers: Processes.
        judge: Instead of `judge_cell`.
        progress: As for `judge_all`.
        stop: As for `judge_all`.

    Raises:
        InputError: If anything given cannot be used, before any long work.
    """
    cells = grid_of(rises, runs, count)
    if workers < 1:
        raise InputError(
            source="--workers", field="workers", value=workers, remedy="give 1 or more processes"
        )
    robot = load_robot(model)  # once here, so that its import is made once and its faults told
    found = judge_all(
        judge or partial(judge_cell, model, count), cells,
        workers=workers, progress=progress, stop=stop,
    )  # fmt: skip
    return {
        "robot": model,
        "name": robot.name,
        "count": count,
        "rises": rises.values("rise"),
        "runs": runs.values("run"),
        "complete": len(found) == len(cells),
        "limits": LIMITS,
        "standards": [{"name": n, "rise": r, "run": d} for n, r, d in STANDARDS],
        "cells": [asdict(cell) for cell in found],
    }


def write_chart(told: dict[str, Any], directory: Path) -> None:
    """Writes chart.json."""
    text = json.dumps(told, indent=2) + "\n"
    write_whole(directory / "chart.json", lambda to: to.write_text(text, encoding="utf-8"))


def print_chart(told: dict[str, Any], directory: Path, console: Console) -> None:
    """Prints how many of the stairs can be climbed, the highest of each run, and where it is."""
    cells = told["cells"]
    works = [cell for cell in cells if cell["margin"] is not None]
    colour, total = "green" if works else "red", len(told["rises"]) * len(told["runs"])
    looked = "" if told["complete"] else f", of which {len(cells)} were looked at"
    console.print(
        f"[bold {colour}]{told['name']} climbs {len(works)} of {total} stairs[/]{looked}",
        highlight=False,
    )
    table = Table("run", "highest rise", "margin", "what is in the way above", box=None)
    for run in told["runs"]:
        here = [cell for cell in cells if cell["run"] == run]
        best = max((c for c in here if c["margin"] is not None), key=_rise, default=None)
        above = min(
            (c for c in here if c["limit"] and (best is None or c["rise"] > best["rise"])),
            key=_rise,
            default=None,
        )
        table.add_row(
            f"{run:g} m",
            "-" if best is None else f"{best['rise']:g} m",
            "-" if best is None else f"{1e3 * best['margin']:.0f} mm",
            "-" if above is None else told["limits"][above["limit"]],
        )
    console.print(table, highlight=False)
    console.print(f"look at {directory / 'chart.png'}", highlight=False, soft_wrap=True)


def _rise(cell: dict[str, Any]) -> float:
    return float(cell["rise"])


@contextmanager
def _pool(workers: int, stop: Callable[[], bool]) -> Iterator[ProcessPoolExecutor]:
    """Processes that end with the block: at once if it is to stop, or is left by an error."""
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_quiet)
    finished = False
    try:
        yield pool
        finished = not stop()
    finally:
        own = [] if finished else list((pool._processes or {}).values())
        pool.shutdown(wait=finished, cancel_futures=True)
        for process in own:
            process.terminate()


def _quiet() -> None:
    """Leaves Ctrl-C, which reaches all processes of a terminal, to the one that started them."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
