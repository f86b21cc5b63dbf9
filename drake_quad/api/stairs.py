"""The verbs that answer whether a robot climbs stairs."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console

from drake_quad.errors import InputError, check_kind
from drake_quad.feasibility.chart import Span, StairChart, chart_grid, grid_of
from drake_quad.feasibility.check import check_flight, design_for_course
from drake_quad.feasibility.flight import Around
from drake_quad.feasibility.passport import (
    COUNT,
    Passport,
    Question,
    plan_passport,
    with_trials,
)
from drake_quad.feasibility.passport_page import PASSPORT, write_passport
from drake_quad.feasibility.result import Feasibility
from drake_quad.gait_design.preference import BALANCE, GaitPreference
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import RobotModel, differing_field
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import checked_copy
from drake_quad.scenario.motion_config import PREFER
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.elements import Stairs
from drake_quad.util.parallel import check_workers

Robot = RobotModel | str | Path


def check_stairs(
    robot: Robot,
    stairs: Stairs,
    *,
    width: float | None = None,
    landing: float | None = None,
    turn: float = 90.0,
    margin: str = HULL,
    prefer: str | None = None,
    speed: float | None = None,
    min_margin: float | None = None,
    balance: str = BALANCE[0],
    thorough: bool = True,
) -> Feasibility:
    """Whether a robot climbs a flight of stairs up and, after a turn, down again, and how.

    Args:
        robot: A robot, or its name or file.
        stairs: The flight.
        width: Width of stairs and floors [m]; as the robot needs if None.
        landing: Length of the landing [m]; as the robot needs if None.
        turn: Turn on the landing [deg], left positive.
        margin: Region that the static margin is measured in: `hull`, `friction` or `feasible`.
        prefer: What the gait is to be good at: `margin`, which is answered soonest; `balanced`, the
            quickest that keeps 0.8 of that margin; or `speed`, the quickest that is safe. If None,
            it is `balanced`, or, with `speed`, `min_margin` or `balance="dynamic"`, a safe margin
            is enough; it is `margin` if not `thorough`.
        speed: Speed on the flights that is enough [m/s]; the gait keeps the margin that is left.
        min_margin: Margin that the plan is to keep [m], as quick as that allows.
        balance: `static`; or `dynamic`: a quick gait that is balanced by its motion, whose margin
            is that of the zero-moment point.
        thorough: Whether to search for a good gait, or to take any that a quick search finds.

    Returns:
        The answer, with the gait's scenario and plan, or the reason for a no; its `nearest()`
        looks for stairs that work, and its `changes()` for what would make it a yes.

    Raises:
        InputError: If the robot cannot be used, or there are no such stairs.
    """
    check_kind(stairs, (Stairs,), "stairs", "must be Stairs, such as Stairs(rise=0.15, run=0.3)")
    return check_flight(
        _model_of(robot),
        stairs,
        around=Around(width=width, landing=landing, turn=turn),
        margin=margin,
        nearest=False,
        preference=GaitPreference.asked(
            prefer if thorough else prefer or "margin", speed, min_margin, balance
        ),
        thorough=thorough,
    )


def check_course(
    robot: Robot,
    scenario: Scenario | str | Path,
    *,
    margin: str = HULL,
    prefer: str | None = None,
    speed: float | None = None,
    min_margin: float | None = None,
    balance: str = BALANCE[0],
) -> Feasibility:
    """Whether a robot climbs the course of a scenario, with a gait of its own.

    Args:
        robot: A robot, or its name or file.
        scenario: A scenario, or a shipped one's name or a file; its robot and its gait do not
            count.
        margin: Region that the static margin is measured in: `hull`, `friction` or `feasible`.
        prefer: What the gait is to be good at, as for `check_stairs`.
        speed: Speed on the flights that is enough [m/s].
        min_margin: Margin that the plan is to keep [m].
        balance: `static` or `dynamic`, as for `check_stairs`.

    Raises:
        InputError: If robot or scenario cannot be used.
    """
    if not isinstance(scenario, Scenario):
        needed = "must be a scenario, a shipped one's name or a file"
        check_kind(scenario, (str, Path), "scenario", needed)
        scenario = str(scenario)
    return design_for_course(
        _model_of(robot),
        checked_copy(scenario) if isinstance(scenario, Scenario) else scenario,
        margin=margin,
        preference=GaitPreference.asked(prefer, speed, min_margin, balance),
    )


def chart_stairs(
    robot: Robot,
    rises: Span,
    runs: Span,
    *,
    count: int = 10,
    workers: int | None = None,
    progress: Callable[[int, int], object] = lambda _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
    ready: Callable[[], object] = lambda: None,
    tell: Callable[[str], object] = lambda _: None,
) -> StairChart:
    """Which stairs of a grid of rises and runs a robot climbs.

    Args:
        robot: A robot, or its name or file.
        rises: The rises [m].
        runs: The runs of the treads [m].
        count: Steps of each flight; `drake-quad chart` takes 4 unless it is told otherwise.
        workers: Number of processes; one for each core if None.
        progress: Called with the number of cells that are done, and of all.
        stop: Called now and then; the chart ends with the cells that are done where it is true.
        ready: Called before any long work, once rises, runs and workers can be used.
        tell: Told in a line if there is something to wait for first.

    Returns:
        The chart in SI units; a notebook shows its picture.

    Raises:
        InputError: If anything given cannot be used.
    """
    count_of = workers if workers is not None else os.cpu_count() or 1
    for name, span in (("rises", rises), ("runs", runs)):
        check_kind(span, (Span,), name, "must be a Span, such as Span(0.1, 0.2, 0.02)")
    grid_of(rises, runs, count)
    check_workers(count_of)
    ready()
    return chart_grid(
        _model_of(robot),
        rises,
        runs,
        count=count,
        workers=count_of,
        progress=progress,
        stop=stop,
        tell=tell,
    )


def make_passport(
    robot: Robot,
    out: str | Path,
    *,
    count: int = COUNT,
    prefer: str = PREFER[0],
    workers: int | None = None,
    progress: Callable[[int, int], object] = lambda _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
    ready: Callable[[], object] = lambda: None,
    tell: Callable[[str], object] = lambda _: None,
) -> Passport:
    """Which stairs of common rules a robot climbs, on paper; `try_passport` tries them.

    Args:
        robot: A robot, or its name or file.
        out: Directory for the page, the picture and the scenarios.
        count: Steps of each flight.
        prefer: What the gaits are to be good at, as for `check_stairs`.
        workers: Number of processes; one for each core if None.
        progress: Called with the number of flights that are planned, and of all.
        stop: Called now and then; where it is true, what is done so far is written, unless there
            is a passport already.
        ready: Called before any long work, once all that was given can be used.
        tell: Told in a line if there is something to wait for first.

    Returns:
        The passport; a notebook shows its picture.

    Raises:
        InputError: If anything given cannot be used, or a file cannot be written.
    """
    directory = Path(out)
    count_of = workers if workers is not None else os.cpu_count() or 1
    asked = Question(
        _model_of(robot), count=count, preference=GaitPreference(prefer), directory=directory
    )
    found = plan_passport(
        asked, workers=count_of, progress=progress, stop=stop, ready=ready, tell=tell
    )
    if found.complete or not (directory / PASSPORT).exists():
        write_passport(found, directory)
    return found


def try_passport(
    passport: Passport,
    out: str | Path,
    trials: int,
    *,
    workers: int | None = None,
    console: Console | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Passport:
    """The passport with trials in physics of each flight that there is a plan for.

    Args:
        passport: A passport that `make_passport` has written.
        out: Its directory, for the trials, too.
        trials: How many of each flight; 29 without a failure are a rate of 90 % with a confidence
            of 95 %.
        workers: Number of processes; one for each core if None.
        console: Console for progress; standard error if None.
        stop: Called now and then; where it is true, the trials so far are kept, and the next call
            goes on with them. The page is written after each flight.

    Raises:
        InputError: If there cannot be so many trials, or a file cannot be written.
    """
    from drake_quad.sweep.passport_trials import DRAWN, check_trials, run_trials

    check_trials(trials)
    count_of = workers if workers is not None else os.cpu_count() or 1
    shown = console or Console(stderr=True)
    directory, tried = Path(out), passport

    def keep(told: dict[str, dict[str, Any]]) -> None:
        nonlocal tried
        tried = with_trials(passport, told, DRAWN)
        write_passport(tried, directory)

    run_trials(
        passport, directory, trials, workers=count_of, console=shown, stop=stop, done=keep
    )  # fmt: skip
    return tried


def _model_of(robot: Robot) -> str:
    """The robot as a scenario names it.

    Raises:
        InputError: It is no robot, or one that is not as its file has it any more: a scenario of
            the answer, and processes that help, read the file.
    """
    if not isinstance(robot, RobotModel):
        check_kind(robot, (str, Path), "robot", "must be a robot, its name or its file")
        return str(robot)
    model = robot.source or robot.url
    changed = differing_field(robot, load_robot(model))
    if changed is not None:
        raise InputError(
            source=robot.name,
            field=changed,
            value="not as in its file",
            remedy=f"what counts is the robot's file, {model}: load it again if that has changed, "
            "or say there, or in a .robot.yaml beside it, what is different",
        )
    return model
