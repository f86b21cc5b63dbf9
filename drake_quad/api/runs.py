"""The verbs that plan, prove, simulate in studies, and show again."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from drake_quad.certificate.certify import Certificate
from drake_quad.errors import InputError, PlanningError
from drake_quad.planning.foothold_pattern import TROT
from drake_quad.report.lcm_replay import play
from drake_quad.robot.doubts import all_doubts
from drake_quad.runs.reader import RecordedRun
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import checked_copy, load_scenario
from drake_quad.scenario.validate import value_at
from drake_quad.simulation.belief_proof import prove_believed
from drake_quad.simulation.plan_report import (
    certify_plan,
    describe_failure,
    judged_plan,
    write_plan,
)
from drake_quad.simulation.prepare import PreparedScenario, prepare
from drake_quad.sweep.run import SweepRequest, run_sweep
from drake_quad.sweep.study import Study
from drake_quad.sweep.study_loading import load_study_and_base
from drake_quad.util.files import user_path

if TYPE_CHECKING:
    from drake_quad.simulation.diagram import Visualize


def plan(scenario: Scenario | str | Path, overrides: Sequence[str] = ()) -> PreparedScenario:
    """Plans a scenario's whole mission on paper.

    Args:
        scenario: A scenario, or a shipped one's name or a file. A scenario is copied, and checked
            as a file is.
        overrides: Fields to change, such as `gait.pitch=slope`.

    Returns:
        Robot, course and plan; `simulate` runs it, `certify` proves what holds of it.

    Raises:
        InputError: If something in the scenario cannot be.
        PlanningError: If there is no plan.
    """
    if isinstance(overrides, str):
        overrides = [overrides]
    if isinstance(scenario, Scenario):
        return prepare(checked_copy(scenario, overrides))
    return prepare(load_scenario(scenario, list(overrides)), source=str(scenario))


def certify(prepared: PreparedScenario | Scenario | str | Path) -> Certificate:
    """Proves what holds of a plan at every time: margin, clearances, joint limits, torques.

    The scenario's `certify` says how much margin and clearance is asked for.

    Args:
        prepared: What `plan` returned, or what it takes.

    Returns:
        The certificate; its `failure` is None if everything asked for is proven.

    Raises:
        InputError: If something in the scenario cannot be; or if the plan's swings go along arcs,
            or two legs swing at once: of neither is anything proven.
        PlanningError: If there is no plan.
    """
    if not isinstance(prepared, PreparedScenario):
        prepared = plan(prepared)
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
    scenario: Scenario | str | Path,
    *,
    source: str = "scenario",
    out: str | Path | None = None,
) -> dict[str, Any]:
    """Plans a scenario, judges the plan, and certifies it, for `drake-quad plan`.

    Args:
        scenario: A scenario, which is copied and checked, or a shipped one's name or a file.
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
    if isinstance(scenario, Scenario):
        scenario = checked_copy(scenario, source=source)
    else:
        scenario, source = load_scenario(scenario), str(scenario)
    try:
        prepared = prepare(scenario, source=source)
        doubts = all_doubts(prepared.robot)
        found, certificate = judged_plan(prepared)
        found["belief"] = prove_believed(prepared, prepared.plan.plans)
    except PlanningError as error:
        found, certificate = describe_failure(error) | {"belief": []}, None
    found["doubts"] = doubts
    if out is not None:
        write_plan(found, certificate, user_path(out))
    return found


def make_viewers(
    *,
    meshcat: bool = False,
    meldis: bool = False,
    foxglove: bool = False,
    tell: Callable[[str], object] = lambda _: None,
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
    page: str | Path | None = None,
    console: Console | None = None,
    stop: Callable[[], bool] = lambda: False,
    ready: Callable[[], object] = lambda: None,
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
        study=user_path(study),
        out=user_path(out),
        workers=workers if workers is not None else os.cpu_count() or 1,
        dask=dask,
        resume=resume,
        limit=limit,
        replays=replays,
        page=None if page is None else user_path(page),
    )
    return run_sweep(asked, console or Console(stderr=True), stop, ready)
