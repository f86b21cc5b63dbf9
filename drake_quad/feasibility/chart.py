"""Which stairs a robot climbs, over a grid of rise and run."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from math import floor, inf
from typing import Any

from drake_quad.errors import InputError
from drake_quad.feasibility.check import check_flight, check_flight_numbers
from drake_quad.feasibility.check_report import LIMITS, limit_of
from drake_quad.robot.loader import load_robot
from drake_quad.simulation.precompile import DESIGN, precompiling
from drake_quad.terrain.elements import RISE_MAX, RUN_MAX
from drake_quad.util.parallel import check_workers, map_in_processes

# ------------------------------------------------------------------------------------------------
# The grid of a chart: which rises and runs are looked at.
# ------------------------------------------------------------------------------------------------


MOST_CELLS = 10_000
FINEST = 1e-4  # [m] to which values are rounded: steps below it would give some of them twice
MOST = {"rise": RISE_MAX, "run": RUN_MAX}


@dataclass(frozen=True)
class Span:
    """Values from one to another, both counted, a step apart [m]."""

    first: float
    last: float
    step: float

    def values(self, name: str) -> list[float]:
        """The values of `name`, rise or run [m], to the tenth of a millimetre.

        Raises:
            InputError: If the span, of option --`name`-..., is none.
        """
        most = MOST[name]
        for word, value, bound in (
            ("from", self.first, most), ("to", self.last, most), ("step", self.step, inf)
        ):  # fmt: skip
            if not (FINEST <= value <= bound and value < inf):
                to = f"{FINEST:g} or more" if bound == inf else f"{FINEST:g} to {bound:g}"
                raise _wrong(f"--{name}-{word}", value, f"give metres, {to}")
        if self.last < self.first:
            remedy = f"give no less than --{name}-from, {self.first:g}"
            raise _wrong(f"--{name}-to", self.last, remedy)
        count = int((self.last - self.first) / self.step + 1e-6) + 1
        if count > MOST_CELLS:
            remedy = f"makes {count} columns or rows: give more"
            raise _wrong(f"--{name}-step", self.step, remedy)
        # From a whole tenth: or the finest steps would round to some values twice, to others never.
        first = FINEST * floor(self.first / FINEST + 1e-6)
        return [round(first + k * self.step, 4) for k in range(count)]


def grid_of(rises: Span, runs: Span, count: int) -> list[tuple[float, float]]:
    """Rise and run of every cell [m], run by run.

    Raises:
        InputError: If there can be no such stairs, or they are too many.
    """
    up, along = rises.values("rise"), runs.values("run")
    check_flight_numbers(up[0], along[0], count)
    cells = len(up) * len(along)
    if cells > MOST_CELLS:
        remedy = f"{cells} cells are too many, more than {MOST_CELLS}: give a larger step"
        raise _wrong("--rise-step", rises.step, remedy)
    return [(rise, run) for run in along for rise in up]


def _wrong(option: str, value: float, remedy: str) -> InputError:
    """What is said of an option that cannot be."""
    return InputError(source=option, field=option[2:], value=value, remedy=remedy)


# ------------------------------------------------------------------------------------------------
# Which of many stairs a robot climbs: each rise and run of a grid, planned in full.
# ------------------------------------------------------------------------------------------------


# Name, rise and run [m]: the steepest flights that the International Building Code (1011.5.2), the
# International Residential Code (R311.7.5) and OSHA (1910.25) allow, and DIN 18065's usual one.
STANDARDS = (
    ("IBC 7 × 11 in", 0.178, 0.279),
    ("IRC 7.75 × 10 in", 0.197, 0.254),
    ("DIN 18065, 0.17 × 0.29 m", 0.170, 0.290),
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


def judge_cell(model: str, count: int, rise: float, run: float) -> Cell:
    """Plans one kind of stairs in full.

    Raises:
        InputError: If the robot cannot be used.
    """
    try:
        check = check_flight(model, rise=rise, run=run, count=count, nearest=False)
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


def chart_grid(
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
        progress: As for `map_in_processes`.
        stop: As for `map_in_processes`.

    Raises:
        InputError: If anything given cannot be used, before any long work.
    """
    cells = grid_of(rises, runs, count)
    check_workers(workers)
    robot = load_robot(model)  # once here, so that its import is made once and its faults told
    with precompiling(DESIGN) as wait:
        wait()
    found = map_in_processes(
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
