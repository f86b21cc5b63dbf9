"""The drake-quad command: thin over the API.

Results go to stdout, progress and messages to stderr. Exit status: 0 the goal was reached, 1 it was
not, 2 the input cannot be used.
"""

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from drake_quad.cli_files import claim, make_report, read_summary, stem
from drake_quad.cli_print import print_plan, print_summary
from drake_quad.cli_progress import cells_progress, interruptible, seconds_progress
from drake_quad.errors import DrakeQuadError, InputError, PlanningError

if TYPE_CHECKING:  # Drake takes a second to import: --help need not wait for it
    from drake_quad.diagram import Visualize

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Can my quadruped climb these stairs, how, and how safely? "
    "Plans a statically stable gait, simulates it in Drake's contact physics, and measures it.",
)
_err = Console(stderr=True)

ScenarioArgument = Annotated[
    str, typer.Argument(help="A shipped scenario's name (see `scenarios`), or a YAML file.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="PATH=VALUE", help="Override a field, e.g. gait.duty_factor=0.8."
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]


@app.command()
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
        with interruptible(_err) as interrupted, seconds_progress("simulating", _err) as progress:
            result = simulate(
                loaded, source=scenario, progress=progress, stop=interrupted, visualize=viewers
            )
    except PlanningError as error:
        if as_json:
            print(json.dumps({"outcome": "infeasible", "reason": error.reason}))
        raise
    write_files(result, result.scenario, directory)
    if report:
        make_report(directory, _err)
    if as_json:
        print(json.dumps({**result.summary, "directory": str(directory)}))
    else:
        print_summary(result.summary, directory, report=report)
    raise typer.Exit(0 if result.outcome == "goal_reached" else 1)


@app.command()
def plan(
    scenario: ScenarioArgument = "case_study",
    out: Annotated[Path | None, typer.Option(help="Directory for the files.")] = None,
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a scenario, check it on paper and certify it for every time, without physics."""
    from drake_quad.plan_certificate import certify_plan, print_certificate, write_certificate
    from drake_quad.plan_report import describe_failure, describe_plan
    from drake_quad.planning.footing import footing_of
    from drake_quad.scenario import load_scenario
    from drake_quad.simulation import prepare

    loaded = load_scenario(scenario, overrides or [])
    if out is not None:
        claim(out)
    try:
        p = prepare(loaded, source=scenario)
        result = describe_plan(
            p.robot,
            p.plan,
            massless_legs=p.settings.uniform_body,
            footing=footing_of(p.robot, p.course, p.settings),
        )
        result["certificate"], certificate = certify_plan(p)
        if out is not None:
            write_certificate(certificate, out)
    except PlanningError as error:
        result = describe_failure(error)
    if out is not None:
        (out / "plan.json").write_text(json.dumps(result, indent=2) + "\n")
    if as_json:
        print(json.dumps(result))
    elif result["feasible"]:
        print_plan(result)
        print_certificate(result["certificate"], Console())
    else:
        raise PlanningError(result["reason"])
    raise typer.Exit(0 if result["feasible"] else 1)


@app.command()
def report(
    directory: Annotated[Path, typer.Argument(help="A finished run's directory.")],
    as_json: JsonOption = False,
) -> None:
    """Make report.html and scene.lcmlog of a finished run again."""
    summary = read_summary(directory)
    make_report(directory, _err)
    if as_json:
        print(json.dumps({"report": str(directory / "report.html")}))
    else:
        print_summary(summary, directory, report=True)


@app.command()
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


@app.command()
def inspect(
    robot: Annotated[
        str, typer.Argument(help="A URDF, SDF, MJCF or .robot.yaml, or a robot's name.")
    ],
    picture: Annotated[
        Path | None, typer.Option(help="Draw it into this file (.svg, .png or .pdf).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Tell what is read from a robot's file, and what is repaired or assumed."""
    from drake_quad.inspect_picture import check_picture, save_picture
    from drake_quad.inspect_report import describe_robot, print_robot
    from drake_quad.robot.load_robot import load_robot

    check_picture(picture)
    model = load_robot(robot)
    told = describe_robot(model, source=robot)
    if picture is not None:
        save_picture(model, picture)
        told["picture"] = str(picture)
    if as_json:
        print(json.dumps(told))
    else:
        print_robot(told, Console())


@app.command()
def check(
    robot: Annotated[
        str, typer.Argument(help="A URDF, SDF, MJCF or .robot.yaml, or a robot's name.")
    ],
    rise: Annotated[
        float | None, typer.Option(help="Of the steps, in m.", show_default="0.178")
    ] = None,
    run: Annotated[
        float | None, typer.Option(help="Of the treads, in m.", show_default="0.28")
    ] = None,
    count: Annotated[
        int | None, typer.Option(help="Steps of the flight.", show_default="10")
    ] = None,
    scenario: Annotated[
        str | None, typer.Option(help="The course of this scenario instead of a flight.")
    ] = None,
    margin: Annotated[
        str,
        typer.Option(help="Of the plan: over the feet's `hull`, within `friction`, `feasible`."),
    ] = "hull",
    save: Annotated[
        Path | None, typer.Option(help="Write the designed scenario into this file.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the climb into this file (.svg, .png or .pdf).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Can this robot climb these stairs? Designs a gait, and plans it up and down in full."""
    from drake_quad.check_command import Asked, run_check

    asked = Asked(robot, rise=rise, run=run, count=count, scenario=scenario, margin=margin)
    with _err.status("designing a gait") as status:
        told = run_check(asked, save=save, picture=picture, note=status.update)
    if as_json:
        print(json.dumps(told))
    else:
        from drake_quad.check_print import print_check

        print_check(told, Console())
    raise typer.Exit(0 if told["feasible"] else 1)


@app.command()
def chart(
    robot: Annotated[
        str, typer.Argument(help="A URDF, SDF, MJCF or .robot.yaml, or a robot's name.")
    ],
    rise_from: Annotated[float, typer.Option(help="Lowest rise, in m.")] = 0.05,
    rise_to: Annotated[float, typer.Option(help="Highest rise, in m.")] = 0.25,
    rise_step: Annotated[float, typer.Option(help="Between rises, in m.")] = 0.025,
    run_from: Annotated[float, typer.Option(help="Shallowest tread, in m.")] = 0.25,
    run_to: Annotated[float, typer.Option(help="Deepest tread, in m.")] = 0.60,
    run_step: Annotated[float, typer.Option(help="Between treads, in m.")] = 0.05,
    count: Annotated[int, typer.Option(help="Steps of each flight.")] = 4,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; charts/<robot> unless told.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes; as many as there are cores unless told.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Chart which stairs this robot climbs: margins over rise and run, and what limits the rest.

    Leaves chart.json, chart.svg and chart.png in the directory, also after Ctrl-C.
    """
    from drake_quad.chart_grid import Span
    from drake_quad.chart_picture import save_chart
    from drake_quad.chart_report import print_chart, write_chart
    from drake_quad.chart_stairs import chart_stairs

    directory = out if out is not None else Path("charts") / stem(robot)
    claim(directory)
    with interruptible(_err) as interrupted, cells_progress(_err) as progress:
        told = chart_stairs(
            robot,
            Span(rise_from, rise_to, rise_step),
            Span(run_from, run_to, run_step),
            count=count,
            workers=workers if workers is not None else os.cpu_count() or 1,
            progress=progress,
            stop=interrupted,
        )
    write_chart(told, directory)
    save_chart(told, directory)
    if as_json:
        print(json.dumps({**told, "directory": str(directory)}))
    else:
        print_chart(told, directory, Console())
    raise typer.Exit(0 if told["complete"] else 1)


@app.command()
def sweep(
    study: Annotated[Path, typer.Argument(help="A study's YAML file (see docs/sweeps.md).")],
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; sweeps/<study> unless told.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes; as many as there are cores unless told.")
    ] = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a Dask cluster to use.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with what is there.")] = False,
    limit: Annotated[int | None, typer.Option(help="Do only the first so many trials.")] = None,
    replays: Annotated[int, typer.Option(help="Run the worst so many again, for replays.")] = 0,
    page: Annotated[
        Path | None, typer.Option(help="Markdown page to write the study's section of.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Carry out a study: many runs, their rate of success, and where it breaks.

    Leaves trials.parquet, clock.parquet, sweep.json and report.html in the directory, also after
    Ctrl-C. Exit status 1 if fewer succeed than the study's gate asks for.
    """
    from drake_quad.sweep.command import Asked, print_sweep, run_sweep

    directory = out if out is not None else Path("sweeps") / stem(str(study))
    claim(directory)
    cores = os.cpu_count() or 1
    asked = Asked(
        study, directory, workers if workers is not None else cores, dask, resume, limit, replays,
        page,
    )  # fmt: skip
    with interruptible(_err) as interrupted:
        told = run_sweep(asked, _err, interrupted)
    if as_json:
        print(json.dumps({**told, "directory": str(directory)}))
    else:
        print_sweep(told, directory, Console())
    raise typer.Exit(1 if told["passed"] is False or told["interrupted"] else 0)


@app.command()
def compare(
    before: Annotated[Path, typer.Argument(help="A sweep's directory.")],
    after: Annotated[Path, typer.Argument(help="Another's, for example of a later commit.")],
    as_json: JsonOption = False,
) -> None:
    """Is one sweep worse than another? Rates, causes, and tests of significance.

    Exit status 1 if the second is worse, significantly.
    """
    from drake_quad.sweep.compare import compare_sweeps, print_comparison

    told = compare_sweeps(before, after)
    if as_json:
        print(json.dumps(told))
    else:
        print_comparison(told, Console())
    raise typer.Exit(1 if told["verdict"] == "worse" else 0)


@app.command()
def scenarios(as_json: JsonOption = False) -> None:
    """List the scenarios that are shipped."""
    from drake_quad.scenario import shipped_scenarios

    shipped = shipped_scenarios()
    if as_json:
        print(json.dumps({"scenarios": [{"name": n, "description": d} for n, d in shipped]}))
        return
    for name, description in shipped:
        print(f"{name:16s} {description}")


def main() -> None:
    """Entry point: errors on purpose become one line and an exit status."""
    try:
        app()
    except InputError as error:
        _fail(str(error), 2)
    except PlanningError as error:
        _fail(f"no plan: {error.reason}", 1)
    except DrakeQuadError as error:
        _fail(str(error), 1)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        _fail(f"{where}{error.strerror or error}", 2)
    except KeyboardInterrupt:
        _fail("interrupted", 130)


def _fail(message: str, status: int) -> None:
    print(f"drake-quad: {' '.join(message.split())}", file=sys.stderr)
    raise SystemExit(status)


def _viewers(*, meshcat: bool, meldis: bool) -> "Visualize | None":
    if not (meshcat or meldis):
        return None
    from drake_quad.viewers import MakeMeldisViewer, MakeMeshcatViewer, Together

    chosen = []
    if meshcat:
        from pydrake.geometry import StartMeshcat

        server = StartMeshcat()
        _err.print(f"watch at {server.web_url()}")
        chosen.append(MakeMeshcatViewer(server))
    if meldis:
        chosen.append(MakeMeldisViewer())
    return Together(*chosen)
