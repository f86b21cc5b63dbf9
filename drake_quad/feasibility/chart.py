"""Which stairs a robot climbs, over a grid of rise and run."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from math import floor, inf
from typing import Any

from drake_quad.errors import InputError
from drake_quad.feasibility.check import check_flight
from drake_quad.feasibility.check_report import LIMITS, limit_of
from drake_quad.feasibility.flight import check_stairs_numbers
from drake_quad.feasibility.standard_stairs import CHARTED, Standard
from drake_quad.robot.loader import load_robot
from drake_quad.simulation.precompile import DESIGN, precompiling
from drake_quad.terrain.elements import RISE_MAX, RUN_MAX, Stairs
from drake_quad.util.display import one_line
from drake_quad.util.numbers import is_finite_real
from drake_quad.util.parallel import check_workers, map_in_processes

MOST_CELLS = 10_000
FINEST = 1e-4  # [m] values are rounded to it: smaller steps would give some of them twice
MOST = {"rise": RISE_MAX, "run": RUN_MAX}


@dataclass(frozen=True)
class Span:
    """Values from `first` to `last`, both included, a step apart [m]."""

    first: float
    last: float
    step: float

    def values(self, name: str) -> list[float]:
        """The values of `name`, rise or run [m], to the tenth of a millimetre.

        Raises:
            InputError: If there is no such span; it names the option --`name`-from, -to or -step.
        """
        most = MOST[name]
        for word, value, bound in (
            ("from", self.first, most), ("to", self.last, most), ("step", self.step, inf)
        ):  # fmt: skip
            if not (is_finite_real(value) and FINEST <= value <= bound):
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
    check_stairs_numbers(Stairs(up[0], along[0], count))
    cells = len(up) * len(along)
    if cells > MOST_CELLS:
        remedy = f"{cells} cells are too many, more than {MOST_CELLS}: give a larger step"
        raise _wrong("--rise-step", rises.step, remedy)
    return [(rise, run) for run in along for rise in up]


def _wrong(option: str, value: float, remedy: str) -> InputError:
    return InputError(source=option, field=option[2:], value=value, remedy=remedy)


@dataclass(frozen=True)
class Cell:
    """One kind of stairs, and whether the robot climbs it.

    Attributes:
        rise: Rise of the steps [m].
        run: Run of the treads [m].
        margin: Smallest static margin of the plan [m]; None if there is no plan.
        quality: The least share of what is wanted of margin, clearance and torque, at most 1; None
            if there is no plan.
        treads: Number of treads that a gait cycle goes over; None if there is no plan.
        limit: What is in the way, one of `check_report.LIMITS`; empty if nothing is.
        reason: What is in the way, in a sentence.
        proven: Whether it is proven that no statically stable gait climbs them.
    """

    rise: float
    run: float
    margin: float | None
    quality: float | None
    treads: float | None
    limit: str
    reason: str
    proven: bool = False


@dataclass(frozen=True)
class StairChart:
    """Which stairs of a grid a robot climbs, in SI units.

    Attributes:
        robot: Robot name or file, as the person gave it.
        name: Name that the robot's file has.
        count: Number of steps of each flight.
        rises: Rises of the grid [m].
        runs: Runs of the grid [m].
        complete: Whether all cells were judged.
        limits: What can be in the way, and words for it.
        standards: Flights of common rules, to be marked.
        cells: The cells that were judged, in the grid's order.
    """

    robot: str
    name: str
    count: int
    rises: list[float]
    runs: list[float]
    complete: bool
    limits: dict[str, str]
    standards: tuple[Standard, ...]
    cells: list[Cell]

    def as_dict(self) -> dict[str, Any]:
        """The chart as plain values, as chart.json holds them."""
        return {**asdict(self), "standards": [asdict(one) for one in self.standards]}

    def __repr__(self) -> str:
        climbed = sum(cell.margin is not None for cell in self.cells)
        yes = f"{climbed} of {len(self.cells)} cells are climbed"
        return one_line(self, self.name, yes, "" if self.complete else "not complete")

    def _repr_html_(self) -> str:
        """The picture of the chart, where a notebook shows it."""
        from drake_quad.feasibility.chart_picture import chart_svg

        return chart_svg(self)


Judge = Callable[[float, float], Cell]


def judge_cell(model: str, count: int, rise: float, run: float) -> Cell:
    """Plans one kind of stairs in full.

    Raises:
        InputError: If the robot cannot be used.
    """
    try:
        check = check_flight(model, Stairs(rise, run, count), nearest=False)
    except InputError as error:
        if error.source not in ("--rise", "--run"):
            raise
        # Some cells of a grid may be too shallow for the robot's feet.
        return Cell(rise, run, None, None, None, "plan", f"run {run:g} m: {error.remedy}")
    found = check.designed
    if found is None:
        limit, proven = limit_of(check, load_robot(model)), check.proof is not None
        return Cell(rise, run, None, None, None, limit, check.reason, proven)
    treads = found.scenario.gait.treads / found.scenario.gait.places_per_tread
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
    tell: Callable[[str], object] = lambda _: None,
) -> StairChart:
    """Judges every cell of a grid.

    Args:
        model: Robot name or file.
        rises: Rises of the steps.
        runs: Runs of the treads.
        count: Number of steps of a flight.
        workers: Number of processes.
        judge: Function to use instead of `judge_cell`.
        progress: Receives the number of cells that are done and of all cells.
        stop: Whether to stop.
        tell: Told in a line if there is something to wait for first.

    Raises:
        InputError: If anything given cannot be used, before any long work.
    """
    cells = grid_of(rises, runs, count)
    check_workers(workers)
    robot = load_robot(model)  # here first: it is imported once, and what is wrong is said once
    with precompiling(DESIGN, tell) as wait:
        wait()
    found = map_in_processes(
        judge or partial(judge_cell, model, count), cells,
        workers=workers, progress=progress, stop=stop,
    )  # fmt: skip
    return StairChart(
        robot=model,
        name=robot.name,
        count=count,
        rises=rises.values("rise"),
        runs=runs.values("run"),
        complete=len(found) == len(cells),
        limits=LIMITS,
        standards=CHARTED,
        cells=found,
    )
