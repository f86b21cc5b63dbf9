"""The commands that plan, run and show scenarios."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.text import Text

from drake_quad.cli_files import claim, claim_file, make_report, read_summary, stem
from drake_quad.cli_options import MESSAGES, JsonOption, ScenarioArgument, SetOption
from drake_quad.cli_print import print_plan, print_summary
from drake_quad.cli_progress import interruptible, seconds_progress
from drake_quad.errors import InputError, PlanningError

if TYPE_CHECKING:  # Drake takes a second to import: --help need not wait for it
    from drake_quad.diagram import Visualize


def run(
    scenario: ScenarioArgument = "case_study",
    out: Annotated[
        Path | None,
        typer.Option(help="Directory for the run's files; runs/<scenario> unless told."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of everything random in the run.")] = None,
    overrides: SetOption = None,
    meshcat: Annotated[bool, typer.Option("--meshcat", help="Show it live in a browser.")] = False,
    meldis: Annotated[bool, typer.Option("--meldis", help="Publish it live for Meldis.")] = False,
    report: Annotated[bool, typer.Option(help="Make report.html and scene.lcmlog.")] = True,
    as_json: JsonOption = False,
) -> None:
    """Plan and simulate a scenario, measure it, and write its report.

    Leaves summary.json, log.parquet, scenario.yaml, report.html and scene.lcmlog in the directory,
    also after Ctrl-C or a fall.
    """
    from drake_quad.scenario import load_scenario
    from drake_quad.simulation import run as simulate
    from drake_quad.simulation import write_files

    fields = [*(overrides or []), *([] if seed is None else [f"simulation.seed={seed}"])]
    if (meshcat or meldis) and not any("realtime_rate" in field for field in fields):
        fields.append("simulation.realtime_rate=1.0")  # people watch in real time
    loaded = load_scenario(scenario, fields)
    directory = out if out is not None else Path("runs") / stem(scenario)
    claim(directory)
    viewers = _viewers(meshcat=meshcat, meldis=meldis)
    try:
        with (
            interruptible(MESSAGES) as interrupted,
            seconds_progress("simulating", MESSAGES) as progress,
        ):
            result = simulate(
                loaded, source=scenario, progress=progress, stop=interrupted, visualize=viewers,
                tell=MESSAGES.print,
            )  # fmt: skip
    except PlanningError as error:
        if as_json:
            print(json.dumps({"outcome": "infeasible", "reason": error.reason}))
        raise
    write_files(result, result.scenario, directory)
    if report:
        make_report(directory, MESSAGES)
    if as_json:
        print(json.dumps({**result.summary, "directory": str(directory)}))
    else:
        print_summary(result.summary, directory, report=report)
    raise typer.Exit(0 if result.outcome == "goal_reached" else 1)


def plan(
    scenario: ScenarioArgument = "case_study",
    out: Annotated[Path | None, typer.Option(help="Directory for the files.")] = None,
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a scenario, check it on paper and certify it for every time, without physics."""
    from drake_quad.plan_certificate import certify_plan, print_certificate, write_plan
    from drake_quad.plan_report import describe_failure, describe_plan
    from drake_quad.planning.footing import footing_of
    from drake_quad.preparation import judge_plan, prepare
    from drake_quad.scenario import load_scenario

    loaded = load_scenario(scenario, overrides or [])
    if out is not None:
        claim(out)
    try:
        p = prepare(loaded, source=scenario)
        judge_plan(p)
        result = describe_plan(
            p.robot,
            p.plan,
            massless_legs=p.settings.uniform_body,
            footing=footing_of(p.robot, p.course, p.settings),
        )
        result["certificate"], certificate = certify_plan(p)
    except PlanningError as error:
        result, certificate = describe_failure(error), None
    if out is not None:
        write_plan(result, certificate, out)
    if as_json:
        print(json.dumps(result))
    elif result["feasible"]:
        print_plan(result)
        print_certificate(result["certificate"], Console())
    else:
        raise PlanningError(result["reason"])
    raise typer.Exit(0 if result["feasible"] else 1)


def report(
    directory: Annotated[Path, typer.Argument(help="A finished run's directory, or a sweep's.")],
    page: Annotated[
        Path | None, typer.Option(help="Of a sweep: Markdown page to write its section of.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Make the report of a finished run or sweep again, of the files that it left."""
    if any((directory / name).exists() for name in ("sweep.json", "journal.jsonl")):
        _report_sweep(directory, page, as_json=as_json)
        return
    if page is not None:
        remedy = "is for the directory of a sweep; leave it out"
        raise InputError(source="--page", field="page", value=str(page), remedy=remedy)
    summary = read_summary(directory, or_sweep=True)
    make_report(directory, MESSAGES)
    if as_json:
        print(json.dumps({"report": str(directory / "report.html")}))
    else:
        print_summary(summary, directory, report=True)


def _report_sweep(directory: Path, page: Path | None, *, as_json: bool) -> None:
    from drake_quad.sweep.again import tell_again
    from drake_quad.sweep.printing import print_sweep

    told = tell_again(directory, page)
    if as_json:
        print(json.dumps({"report": str(directory / "report.html")}))
    else:
        print_sweep(told, directory, Console(emoji=False))


def export(
    directory: Annotated[Path, typer.Argument(help="A finished run's directory.")],
    csv: Annotated[
        Path | None, typer.Option(help="File to write; joints.csv in the directory unless told.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write a finished run's joints as CSV, as the robot's own file means angles and axes.

    The columns are the time in s; each joint's angle in rad, speed in rad/s and torque in Nm; and
    the trunk's pose.
    """
    from drake_quad.report.joint_table import write_joint_table
    from drake_quad.report.run_files import read_run

    path = csv if csv is not None else directory / "joints.csv"
    read_summary(directory)
    claim_file(path, "--csv")
    rows = write_joint_table(read_run(directory), path)
    if as_json:
        print(json.dumps({"csv": str(path), "rows": rows}))
    else:
        Console().print(Text(f"{rows} rows in {path}"), soft_wrap=True)


def replay(
    directory: Annotated[Path, typer.Argument(help="A finished run's directory.")],
    viewer: Annotated[str, typer.Option(help="`meshcat` or `meldis`.")] = "meshcat",
    speed: Annotated[float, typer.Option(help="Times real time.")] = 1.0,
    loop: Annotated[bool, typer.Option(help="Begin again at the end.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Show a finished run again, in Meshcat or Meldis."""
    from drake_quad.report.play import play

    read_summary(directory)
    if viewer not in ("meshcat", "meldis"):
        raise InputError(
            source="--viewer", field="viewer", value=viewer, remedy="give meshcat or meldis"
        )
    if not speed > 0.0:
        raise InputError(source="--speed", field="speed", value=speed, remedy="give more than 0")
    play(directory, viewer=viewer, speed=speed, loop=loop)
    if as_json:
        print(json.dumps({"replayed": str(directory)}))


def scenarios(as_json: JsonOption = False) -> None:
    """List the scenarios that are shipped."""
    from drake_quad.scenario import shipped_scenarios

    shipped = shipped_scenarios()
    if as_json:
        print(json.dumps({"scenarios": [{"name": n, "description": d} for n, d in shipped]}))
        return
    for name, description in shipped:
        print(f"{name:16s} {description}")


def _viewers(*, meshcat: bool, meldis: bool) -> "Visualize | None":
    if not (meshcat or meldis):
        return None
    from drake_quad.viewers import MakeMeldisViewer, MakeMeshcatViewer, Together

    chosen = []
    if meshcat:
        from pydrake.geometry import StartMeshcat

        server = StartMeshcat()
        MESSAGES.print(f"watch at {server.web_url()}")
        chosen.append(MakeMeshcatViewer(server))
    if meldis:
        chosen.append(MakeMeldisViewer())
    return Together(*chosen)
