"""The verbs of the public API: each takes what a person has at hand, and calls the packages.

`import drake_quad as dq` gives them as `dq.plan`, `dq.certify` and so on; verbs that need no such
help (`load_robot`, `simulate`) are the packages' own.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from drake_quad.certificate.certify import Certificate
from drake_quad.errors import InputError
from drake_quad.feasibility.chart import Span, StairChart, chart_grid
from drake_quad.feasibility.check import Around, Feasibility, check_flight, design_for_course
from drake_quad.report.lcm_replay import play
from drake_quad.robot.model import RobotModel
from drake_quad.runs.reader import RecordedRun
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.plan_report import certify_plan
from drake_quad.simulation.prepare import PreparedScenario, prepare
from drake_quad.stability.equilibrium_region import HULL
from drake_quad.sweep.run import SweepRequest, run_sweep
from drake_quad.sweep.study import Study
from drake_quad.sweep.study_loading import load_study_and_base
from drake_quad.terrain.elements import Stairs

Robot = RobotModel | str | Path


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
        InputError: If the plan's swings go along arcs, of which nothing is proven.
    """
    found, certificate = certify_plan(prepared)
    if certificate is None:
        raise InputError(
            source="scenario",
            field="spin.swing_path",
            value=prepared.scenario.spin.swing_path,
            remedy=f"{found['reason']}; take chord",
        )
    return certificate


def check_stairs(
    robot: Robot,
    stairs: Stairs,
    *,
    width: float | None = None,
    landing: float | None = None,
    turn: float = 90.0,
    margin: str = HULL,
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
        thorough: Whether to search for a good gait, or to take any that a quick search finds.

    Returns:
        The answer, with the gait's scenario and plan, or the reason for a no.

    Raises:
        InputError: If the robot cannot be used, or there are no such stairs.
    """
    return check_flight(
        _model_of(robot),
        stairs,
        around=Around(width=width, landing=landing, turn=turn),
        margin=margin,
        thorough=thorough,
    )


def check_course(robot: Robot, scenario: str | Path, *, margin: str = HULL) -> Feasibility:
    """Whether a robot climbs the course of a scenario, with a gait of its own.

    Args:
        robot: A robot, or its name or file.
        scenario: A shipped scenario's name or a file; its robot and its gait do not count.
        margin: Region that the static margin is measured in: `hull`, `friction` or `feasible`.

    Raises:
        InputError: If robot or scenario cannot be used.
    """
    return design_for_course(_model_of(robot), str(scenario), margin=margin)


def chart_stairs(
    robot: Robot,
    rises: Span,
    runs: Span,
    *,
    count: int = 10,
    workers: int | None = None,
) -> StairChart:
    """Which stairs of a grid of rises and runs a robot climbs.

    Args:
        robot: A robot, or its name or file.
        rises: The rises [m].
        runs: The runs of the treads [m].
        count: Steps of each flight.
        workers: Number of processes; one for each core if None.

    Returns:
        The chart in SI units; a notebook shows its picture.

    Raises:
        InputError: If anything given cannot be used.
    """
    return chart_grid(
        _model_of(robot), rises, runs, count=count, workers=workers or os.cpu_count() or 1
    )


def replay(run: RecordedRun | str | Path, viewer: str = "meshcat", *, speed: float = 1.0) -> None:
    """Shows a run again, until it ends or is interrupted.

    Args:
        run: A run or its directory.
        viewer: `meshcat`, in a browser, or `meldis`.
        speed: How much faster than it happened it plays.

    Raises:
        InputError: If there is no run to show.
    """
    play(run, viewer, speed=speed)


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
    resume: bool = False,
    limit: int | None = None,
) -> dict[str, Any]:
    """Carries out a study, and writes its tables and its report.

    Args:
        study: The study's file.
        out: Directory to write into.
        workers: Number of processes; one for each core if None.
        resume: Whether to go on with what is in `out`.
        limit: Carry out only the study's first so many trials.

    Returns:
        The findings, as sweep.json holds them.

    Raises:
        InputError: If anything given cannot be used.
    """
    asked = SweepRequest(
        Path(study), Path(out), workers or os.cpu_count() or 1, resume=resume, limit=limit
    )
    return run_sweep(asked, Console(stderr=True), lambda: False)


def _model_of(robot: Robot) -> str:
    """The robot as a scenario names it."""
    return robot.source or robot.url if isinstance(robot, RobotModel) else str(robot)
