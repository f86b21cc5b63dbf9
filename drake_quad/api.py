"""The verbs of the public API: each takes what a person has at hand, and calls the packages.

`import drake_quad as dq` gives them as `dq.plan`, `dq.certify` and so on; verbs that need no such
help (`load_robot`, `simulate`) are the packages' own.
"""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from drake_quad.certificate.certify import Certificate
from drake_quad.errors import InputError, PlanningError
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
from drake_quad.planning.foothold_pattern import TROT
from drake_quad.report.lcm_replay import play
from drake_quad.robot.doubts import all_doubts
from drake_quad.robot.model import RobotModel
from drake_quad.runs.reader import RecordedRun
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario
from drake_quad.scenario.motion_config import PREFER
from drake_quad.scenario.validate import value_at
from drake_quad.simulation.plan_report import (
    certify_plan,
    describe_failure,
    judged_plan,
    write_plan,
)
from drake_quad.simulation.prepare import PreparedScenario, prepare
from drake_quad.stability.margin_kinds import HULL
from drake_quad.sweep.run import SweepRequest, run_sweep
from drake_quad.sweep.study import Study
from drake_quad.sweep.study_loading import load_study_and_base
from drake_quad.terrain.elements import Stairs
from drake_quad.util.parallel import check_workers

if TYPE_CHECKING:
    from drake_quad.simulation.diagram import Visualize

Robot = RobotModel | str | Path


def _nothing(*_: object) -> None:
    """Stands for a listener that nobody gave."""


def _never() -> bool:
    """Answers that nobody has asked to stop."""
    return False


def plan(scenario: Scenario | str | Path, overrides: Sequence[str] = ()) -> PreparedScenario:
    """Plans a scenario's whole mission on paper.

    Args:
        scenario: A scenario, or a shipped one's name or a file.
        overrides: Fields to change in a scenario given by name or file, such as
            `gait.pitch=slope`.

    Returns:
        Robot, course and plan; `simulate` runs it, `certify` proves what holds of it.

    Raises:
        InputError: If something in the scenario cannot be.
        PlanningError: If there is no plan.
    """
    if isinstance(scenario, Scenario):
        return prepare(scenario)
    return prepare(load_scenario(scenario, list(overrides)), source=str(scenario))


def certify(prepared: PreparedScenario) -> Certificate:
    """Proves what holds of a plan at every time: margin, clearances, joint limits, torques.

    The scenario's `certify` says how much margin and clearance is asked for.

    Args:
        prepared: What `plan` returned.

    Returns:
        The certificate; its `failure` is None if everything asked for is proven.

    Raises:
        InputError: If the plan's swings go along arcs, or two legs swing at once: of neither is
            anything proven.
    """
    found, certificate = certify_plan(prepared)
    if certificate is None:
        field, other = "spin.swing_path", "chord"
        if prepared.scenario.gait.pattern == TROT:
            field, other = "gait.pattern", "wave"
        raise InputError(
            source="scenario",
            field=field,
            value=value_at(prepared.scenario, field),
            remedy=f"{found['reason']}; take {other}",
        )
    return certificate


def report_plan(
    scenario: Scenario, *, source: str = "scenario", out: Path | None = None
) -> dict[str, Any]:
    """Plans a scenario, judges the plan, and certifies it, for `drake-quad plan`.

    Args:
        scenario: A scenario, loaded and checked.
        source: Name of its file, for errors.
        out: Directory for plan.json and certificate.json, if they are to be written.

    Returns:
        The plan as plain values, as `drake-quad plan --json` prints it, with its `certificate` and
        with `doubts`, what in the robot's file may be wrong; without a plan, `feasible` is false
        and `reason` says why.

    Raises:
        InputError: If something in the scenario cannot be, or a file cannot be written.
    """
    doubts: list[str] = []
    try:
        prepared = prepare(scenario, source=source)
        doubts = all_doubts(prepared.robot)
        found, certificate = judged_plan(prepared)
    except PlanningError as error:
        found, certificate = describe_failure(error), None
    found["doubts"] = doubts
    if out is not None:
        write_plan(found, certificate, out)
    return found


def make_viewers(
    *,
    meshcat: bool = False,
    meldis: bool = False,
    foxglove: bool = False,
    tell: Callable[[str], object] = _nothing,
) -> "Visualize | None":
    """Viewers for `simulate`; None if none is wanted.

    Args:
        meshcat: Whether to show the simulation live in a browser.
        meldis: Whether to publish it live for Meldis.
        foxglove: Whether to serve it live for Foxglove, on this machine.
        tell: Called with the address to watch at.
    """
    if not (meshcat or meldis or foxglove):
        return None
    from pydrake.geometry import StartMeshcat

    from drake_quad.simulation.viewers import MakeMeldisViewer, MakeMeshcatViewer, Together

    chosen = []
    if foxglove:  # its port may be taken
        from drake_quad.simulation.foxglove_live import HOST, FoxgloveServer, MakeFoxgloveViewer

        live = FoxgloveServer()
        tell(f"open the connection ws://{HOST}:{live.port} in Foxglove")
        chosen.append(MakeFoxgloveViewer(live))
    if meshcat:
        server = StartMeshcat()
        tell(f"watch at {server.web_url()}")
        chosen.append(MakeMeshcatViewer(server))
    if meldis:
        chosen.append(MakeMeldisViewer())
    return Together(*chosen)


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
    scenario: str | Path,
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
        scenario: A shipped scenario's name or a file; its robot and its gait do not count.
        margin: Region that the static margin is measured in: `hull`, `friction` or `feasible`.
        prefer: What the gait is to be good at, as for `check_stairs`.
        speed: Speed on the flights that is enough [m/s].
        min_margin: Margin that the plan is to keep [m].
        balance: `static` or `dynamic`, as for `check_stairs`.

    Raises:
        InputError: If robot or scenario cannot be used.
    """
    return design_for_course(
        _model_of(robot),
        str(scenario),
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
    progress: Callable[[int, int], object] = _nothing,
    stop: Callable[[], bool] = _never,
    ready: Callable[[], object] = _nothing,
    tell: Callable[[str], object] = _nothing,
) -> StairChart:
    """Which stairs of a grid of rises and runs a robot climbs.

    Args:
        robot: A robot, or its name or file.
        rises: The rises [m].
        runs: The runs of the treads [m].
        count: Steps of each flight.
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
    progress: Callable[[int, int], object] = _nothing,
    stop: Callable[[], bool] = _never,
    ready: Callable[[], object] = _nothing,
    tell: Callable[[str], object] = _nothing,
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
    stop: Callable[[], bool] = _never,
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


def replay(
    run: RecordedRun | str | Path,
    viewer: str = "meshcat",
    *,
    speed: float = 1.0,
    loop: bool = False,
) -> None:
    """Shows a run again, until it ends or is interrupted.

    Args:
        run: A run or its directory.
        viewer: `meshcat`, in a browser, or `meldis`.
        speed: How much faster than it happened it plays.
        loop: Whether it begins again at its end.

    Raises:
        InputError: If there is no run to show.
    """
    play(run, viewer, speed=speed, loop=loop)


def load_study(path: str | Path) -> Study:
    """Reads a study's file and checks it against the scenario that it varies.

    Raises:
        InputError: If it cannot be read, or anything in it cannot be used.
    """
    return load_study_and_base(path)[0]


def run_study(
    study: str | Path,
    out: str | Path,
    *,
    workers: int | None = None,
    dask: str | None = None,
    resume: bool = False,
    limit: int | None = None,
    replays: int = 0,
    page: Path | None = None,
    console: Console | None = None,
    stop: Callable[[], bool] = _never,
    ready: Callable[[], object] = _nothing,
) -> dict[str, Any]:
    """Carries out a study, and writes its tables and its report.

    Args:
        study: The study's file.
        out: Directory to write into.
        workers: Number of processes; one for each core if None.
        dask: Address of a Dask scheduler to use instead of processes of this machine.
        resume: Whether to go on with what is in `out`.
        limit: Carry out only the study's first so many trials.
        replays: Number of the worst trials that are run again, for their replays.
        page: Markdown page to write the study's section of.
        console: Console for progress; standard error if None.
        stop: Called now and then; the study stops where it returns true.
        ready: Called before anything is written, once all that was given can be used.

    Returns:
        The findings, as sweep.json holds them, and whether the study was `interrupted`.

    Raises:
        InputError: If anything given cannot be used.
    """
    asked = SweepRequest(
        study=Path(study),
        out=Path(out),
        workers=workers if workers is not None else os.cpu_count() or 1,
        dask=dask,
        resume=resume,
        limit=limit,
        replays=replays,
        page=page,
    )
    return run_sweep(asked, console or Console(stderr=True), stop, ready)


def _model_of(robot: Robot) -> str:
    """The robot as a scenario names it."""
    return robot.source or robot.url if isinstance(robot, RobotModel) else str(robot)
