"""The drake-quad command: thin over the API.

Results go to stdout, progress and messages to stderr. Exit status: 0 the goal was reached, 1 it was
not, 2 the input cannot be used.
"""

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

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
    directory = out if out is not None else Path("runs") / _stem(scenario)
    _claim(directory)
    viewers = _viewers(meshcat=meshcat, meldis=meldis)
    try:
        with _interruptible() as interrupted, _progress("simulating") as progress:
            result = simulate(
                loaded, source=scenario, progress=progress, stop=interrupted, visualize=viewers
            )
    except PlanningError as error:
        if as_json:
            print(json.dumps({"outcome": "infeasible", "reason": error.reason}))
        raise
    write_files(result, result.scenario, directory)
    if report:
        _make_report(directory)
    if as_json:
        print(json.dumps({**result.summary, "directory": str(directory)}))
    else:
        _print_summary(result.summary, directory, report=report)
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
        _claim(out)
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
        _print_plan(result)
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
    summary = _read_summary(directory)
    _make_report(directory)
    if as_json:
        print(json.dumps({"report": str(directory / "report.html")}))
    else:
        _print_summary(summary, directory, report=True)


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

    _read_summary(directory)
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

    directory = out if out is not None else Path("charts") / _stem(robot)
    _claim(directory)
    with _interruptible() as interrupted, _cells_progress() as progress:
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

    directory = out if out is not None else Path("sweeps") / _stem(str(study))
    _claim(directory)
    cores = os.cpu_count() or 1
    asked = Asked(
        study, directory, workers if workers is not None else cores, dask, resume, limit, replays,
        page,
    )  # fmt: skip
    with _interruptible() as interrupted:
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


def _stem(scenario: str) -> str:
    return Path(scenario).name.removesuffix(".yaml").removesuffix(".scenario")


def _claim(directory: Path) -> None:
    """Makes sure before any long work that the directory can be written to."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        probe = directory / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise InputError(
            source="--out",
            field="directory",
            value=str(directory),
            remedy=f"cannot be written to: {error.strerror}; give another with --out",
        ) from None


def _read_summary(directory: Path) -> dict[str, Any]:
    """The summary of a finished run, all of whose files can be read."""
    import pyarrow.parquet as pq

    def fail(name: str, what: str) -> InputError:
        return InputError(
            source=str(directory),
            field=name,
            value=str(directory / name),
            remedy=f"{what}; give the directory of a finished `drake-quad run`",
        )

    try:
        summary = json.loads((directory / "summary.json").read_text(encoding="utf-8"))
    except OSError:
        raise fail("summary.json", "not there") from None
    except ValueError:
        raise fail("summary.json", "is not JSON") from None
    if not (isinstance(summary, dict) and "outcome" in summary):
        raise fail("summary.json", "is not a run's summary")
    try:
        columns = pq.read_schema(directory / "log.parquet").names
    except OSError:
        raise fail("log.parquet", "not there") from None
    except ValueError:  # Arrow's own errors are ValueErrors
        raise fail("log.parquet", "is cut short or not Parquet") from None
    if "t" not in columns or "margin" not in columns:
        raise fail("log.parquet", "is not a run's log")
    return summary


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


def _make_report(directory: Path) -> None:
    from drake_quad.report.build import build_report
    from drake_quad.report.scene_log import write_scene_log

    with _err.status("writing report.html and scene.lcmlog"):
        build_report(directory)
        write_scene_log(directory)


@contextmanager
def _interruptible() -> Iterator[Callable[[], bool]]:
    """Turns Ctrl-C or a polite kill into a stop; a second Ctrl-C is an interrupt as usual."""
    seen = False

    def note(_number: int, _frame: FrameType | None) -> None:
        nonlocal seen
        seen = True
        _err.print("\nstopping; writing what was logged")
        signal.signal(signal.SIGINT, signal.default_int_handler)

    before = signal.signal(signal.SIGINT, note), signal.signal(signal.SIGTERM, note)
    try:
        yield lambda: seen
    finally:
        signal.signal(signal.SIGINT, before[0])
        signal.signal(signal.SIGTERM, before[1])


@contextmanager
def _progress(label: str) -> Iterator[Callable[[float, float], None]]:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f} s"),
        TextColumn("{task.fields[pace]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=_err, transient=True) as bar:
        task = bar.add_task(label, total=None, pace="", start=True, visible=False)

        def show(done: float, total: float) -> None:
            elapsed = bar.tasks[0].elapsed or 1e-9
            pace = f"{done / elapsed:.1f} × real time"
            bar.update(task, completed=done, total=max(total, done), pace=pace, visible=True)

        yield show


@contextmanager
def _cells_progress() -> Iterator[Callable[[int, int], None]]:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f}"),
        TextColumn("{task.fields[pace]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with Progress(*columns, console=_err, transient=True, speed_estimate_period=600.0) as bar:
        task = bar.add_task("planning stairs", total=None, pace="", visible=False)

        def show(done: int, total: int) -> None:
            elapsed = bar.tasks[0].elapsed or 1e-9
            pace = f"{60.0 * done / elapsed:.1f} a minute"
            bar.update(task, completed=done, total=total, pace=pace, visible=True)

        yield show


def _print_summary(summary: dict[str, Any], directory: Path, *, report: bool) -> None:
    console = Console()
    good = summary.get("outcome") == "goal_reached"
    lines = summary_lines(summary)
    if good and (summary.get("time_under_three_feet") or 0.0) > 0.0:
        console.print("[yellow]not statically stable throughout: see the figures[/]")
    console.print(
        f"[bold {'green' if good else 'red'}]{summary.get('outcome')}[/]: {summary.get('reason')}",
        highlight=False,
    )
    table = Table(show_header=False, box=None, pad_edge=False)
    for label, text in lines:
        table.add_row(label, text)
    console.print(table)
    console.print(f"files in {directory}", highlight=False)
    if report:
        console.print(f"look at {directory / 'report.html'}", highlight=False)


def summary_lines(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """The few figures that are printed after a run, each with its unit."""
    margin = summary["margin"] if isinstance(summary.get("margin"), dict) else {}

    def text(value: float | None, form: str) -> str:
        return "-" if value is None else form.format(value)

    planned = summary["margin_planned"] if isinstance(summary.get("margin_planned"), dict) else {}
    seen = "replayed" if summary.get("simulation") == "kinematic" else "measured"
    kind = summary.get("margin_kind", "hull")
    names = (
        [] if kind == "hull" else [(seen, f"margin_{kind}"), ("planned", f"margin_{kind}_planned")]
    )
    beyond = [
        (
            f"smallest {kind} margin {word}",
            text((summary.get(name) or {}).get("minimum"), "{:.3f} m"),
        )
        for word, name in names
    ]
    return [
        (f"smallest margin {seen}", text(margin.get("minimum"), "{:.3f} m")),
        (
            "smallest margin planned",
            text(planned.get("minimum"), "{:.3f} m"),
        ),
        *beyond,
        ("time on fewer than three feet", text(summary.get("time_under_three_feet"), "{:.3f} s")),
        ("base off its plan by at most", text(summary.get("base_error_max"), "{:.3f} m")),
        ("a standing foot slipped at most", text(summary.get("slip_max"), "{:.4f} m")),
        ("contacts of anything but feet", text(summary.get("nonfoot_contact_samples"), "{}")),
        ("largest torque over its limit's", text(summary.get("torque_ratio_max"), "{:.0%}")),
        ("the plan's, standing still", text(summary.get("torque_ratio_planned_max"), "{:.0%}")),
        ("simulated", text(summary.get("simulated_time"), "{:.1f} s")),
        ("pace", text(summary.get("real_time_factor"), "{:.1f} × real time")),
    ]


def _print_plan(result: dict[str, Any]) -> None:
    kind = result["margin_kind"]
    beyond = [] if kind == "hull" else [f"margin_{kind}_min"]
    titles = ["smallest margin [m]", *(f"{kind} [m]" for _ in beyond)]
    table = Table("segment", "kind", "from [s]", "to [s]", *titles, "steps", box=None)
    for s in result["segments"]:
        steps = "-".join(str(step["leg"]) for step in s.get("steps", []))
        found = [s[key] for key in ("margin_min", *beyond)]
        margins = ["-" if m is None else f"{m:.3f}" for m in found]
        times = [f"{s['start']:.1f}", f"{s['end']:.1f}"]
        table.add_row(s["name"], s["kind"], *times, *margins, steps)
    console = Console()
    console.print(table)
    least = f", {kind} {result[f'planned_margin_{kind}_min']:.3f} m" if beyond else ""
    console.print(
        f"feasible: {result['duration']:.1f} s, smallest margin "
        f"{result['planned_margin_min']:.3f} m{least}, planned in {result['planning_time']:.2f} s",
        highlight=False,
    )
