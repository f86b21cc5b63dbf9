"""The commands about a scenario: `run`, `plan`, `report`, `replay` and `scenarios`."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from drake_quad.cli.common import (
    MESSAGES,
    JsonOption,
    ScenarioArgument,
    SetOption,
    claim,
    claim_file,
    interruptible,
    make_report,
    read_summary,
    seconds_progress,
    stem,
)
from drake_quad.errors import InputError, PlanningError, printable

if TYPE_CHECKING:
    from drake_quad.simulation.diagram import Visualize


# ------------------------------------------------------------------------------------------------
# What is printed of a run, and of a plan.
# ------------------------------------------------------------------------------------------------


def print_summary(summary: dict[str, Any], directory: Path, *, report: bool) -> None:
    """Prints how a run ended, and its figures."""
    console = Console()
    good = summary.get("outcome") == "goal_reached"
    lines = summary_lines(summary)
    if good and (summary.get("time_under_three_feet") or 0.0) > 0.0:
        console.print("[yellow]not statically stable throughout: see the figures[/]")
    outcome = (printable(str(summary.get("outcome"))), f"bold {'green' if good else 'red'}")
    console.print(Text.assemble(outcome, f": {printable(str(summary.get('reason')))}"))
    if line := safety_line(summary):
        console.print(Text(line, "green" if line.startswith("safe") else "yellow"), soft_wrap=True)
    table = Table(show_header=False, box=None, pad_edge=False)
    for label, text in lines:
        table.add_row(Text(label), Text(text))
    console.print(table)
    if summary.get("assumes"):
        console.print(Text(f"these figures assume {summary['assumes']}"), soft_wrap=True)
    console.print(Text(f"files in {directory}"))
    if report:
        console.print(Text(f"look at {directory / 'report.html'}"))


def safety_line(summary: dict[str, Any]) -> str:
    """The verdict of safety beside the outcome; empty of a run of before there was one."""
    from drake_quad.stability.safety import (
        judge_safety,  # with numpy, which --help need not wait for
    )

    told = summary.get("safety")
    wanted = told.get("margin_wanted") if isinstance(told, dict) else None
    return judge_safety(summary, wanted).words if isinstance(wanted, int | float) else ""


def summary_lines(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """The few figures that are printed after a run, each with its unit."""
    margin = summary["margin"] if isinstance(summary.get("margin"), dict) else {}

    def text(value: float | None, form: str) -> str:
        # A margin of a rounding error below zero is no negative one.
        return "-" if value is None else form.format(round(value, 6) + 0.0)

    planned = summary["margin_planned"] if isinstance(summary.get("margin_planned"), dict) else {}
    seen = "replayed" if summary.get("simulation") == "kinematic" else "measured"
    kind = summary.get("margin_kind", "hull")
    zmp = (summary.get("zmp_margin") or {}).get("minimum")
    pressure = [] if zmp is None else [("the same of the zero-moment point", text(zmp, "{:.3f} m"))]
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
        *pressure,
        (
            "smallest margin planned",
            text(planned.get("minimum"), "{:.3f} m"),
        ),
        *beyond,
        ("time on fewer than three feet", text(summary.get("time_under_three_feet"), "{:.3f} s")),
        ("base off its plan by at most", text(summary.get("base_error_max"), "{:.3f} m")),
        ("a standing foot slipped at most", text(summary.get("slip_max"), "{:.4f} m")),
        ("contact friction", text(summary.get("contact_friction"), "{:.3g}")),
        ("contacts of anything but feet", _touched(summary)),
        ("largest torque, of its limit", text(summary.get("torque_ratio_max"), "{:.0%}")),
        ("the same, planned", text(summary.get("torque_ratio_planned_max"), "{:.0%}")),
        ("simulated", text(summary.get("simulated_time"), "{:.1f} s")),
        ("pace", text(summary.get("real_time_factor"), "{:.1f} × real time")),
    ]


def _metres(value: float) -> str:
    """A length to the millimetre [m], without a minus before a zero."""
    return f"{round(value, 3) + 0.0:.3f}"


def _touched(summary: dict[str, Any]) -> str:
    """In how many samples anything but a foot touched, and how deep the worst went in, if known."""
    count = summary.get("nonfoot_contact_samples")
    if count is None:
        return "-"
    worst = (summary.get("overlaps") or [None])[0]
    if not worst:
        return str(count)
    return (
        f"{count} samples, the deepest {1e3 * worst['depth']:.1f} mm: {worst['part']} in "
        f"{worst['inside']} at {worst['time']:.2f} s"
    )


def print_plan(result: dict[str, Any]) -> None:
    """Prints a plan's segments and what it comes to."""
    kind = result["margin_kind"]
    beyond = [] if kind == "hull" else [f"margin_{kind}_min"]
    titles = ["smallest margin [m]", *(f"{kind} [m]" for _ in beyond)]
    heads = ("segment", "kind", "from [s]", "to [s]", *titles, "steps")
    # As text: rich would take [s] for a style.
    table = Table(*(Column(Text(head)) for head in heads), box=None)
    for s in result["segments"]:
        steps = "-".join(str(step["leg"]) for step in s.get("steps", []))
        found = [s[key] for key in ("margin_min", *beyond)]
        margins = ["-" if m is None else _metres(m) for m in found]
        times = [f"{s['start']:.1f}", f"{s['end']:.1f}"]
        table.add_row(Text(s["name"]), s["kind"], *times, *margins, steps)
    console = Console()
    console.print(table)
    least = f", {kind} {_metres(result[f'planned_margin_{kind}_min'])} m" if beyond else ""
    torque = result["torque_ratio_planned_max"]
    strong = "" if torque <= 1.0 else f", if a joint gives {torque:.0%} of its torque,"
    console.print(
        f"feasible{strong}: {result['duration']:.1f} s, smallest margin "
        f"{_metres(result['planned_margin_min'])} m{least}, "
        f"planned in {result['planning_time']:.2f} s",
        highlight=False,
    )


# ------------------------------------------------------------------------------------------------
# The commands that plan, run and show scenarios.
# ------------------------------------------------------------------------------------------------


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
    from drake_quad.runs.result import write_files
    from drake_quad.scenario.load import load_scenario
    from drake_quad.simulation.run import simulate as simulate

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
    from drake_quad.planning.stance_margin import footing_of
    from drake_quad.scenario.load import load_scenario
    from drake_quad.simulation.plan_report import (
        certify_plan,
        describe_failure,
        describe_plan,
        write_plan,
    )
    from drake_quad.simulation.prepare import judge_plan, prepare

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
    from drake_quad.cli.studies import print_sweep
    from drake_quad.sweep.rebuild_report import rebuild_report

    told = rebuild_report(directory, page)
    if as_json:
        print(json.dumps({"report": str(directory / "report.html")}))
    else:
        print_sweep(told, directory, Console(emoji=False))


def export(
    directory: Annotated[Path, typer.Argument(help="A finished run's directory.")],
    csv: Annotated[
        Path | None, typer.Option(help="File to write; joints.csv in the directory unless told.")
    ] = None,
    mcap: Annotated[
        bool, typer.Option("--mcap", help="Write run.mcap, for Foxglove, and no CSV.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a finished run's joints as CSV, as the robot's own file means angles and axes.

    The columns are the time in s; each joint's angle in rad, speed in rad/s and torque in Nm; and
    the trunk's pose. With --mcap: transforms, joints, markers and margins as MCAP.
    """
    from drake_quad.report.joint_table import write_joint_table
    from drake_quad.runs.reader import load_run

    if mcap:
        _export_mcap(directory, csv, as_json=as_json)
        return
    path = csv if csv is not None else directory / "joints.csv"
    read_summary(directory)
    claim_file(path, "--csv")
    rows = write_joint_table(load_run(directory), path)
    if as_json:
        print(json.dumps({"csv": str(path), "rows": rows}))
    else:
        Console().print(Text(f"{rows} rows in {path}"), soft_wrap=True)


def _export_mcap(directory: Path, csv: Path | None, *, as_json: bool) -> None:
    from drake_quad.report.mcap_export import write_mcap
    from drake_quad.runs.reader import load_run

    if csv is not None:
        remedy = "one file at a time: leave it out, or --mcap"
        raise InputError(source="--csv", field="csv", value=str(csv), remedy=remedy)
    path = directory / "run.mcap"
    read_summary(directory)
    claim_file(path, "--mcap")
    counts = write_mcap(load_run(directory), path)
    if as_json:
        print(json.dumps({"mcap": str(path), "messages": counts, "bytes": path.stat().st_size}))
    else:
        told = ", ".join(f"{count} of {topic}" for topic, count in counts.items())
        Console().print(Text(f"{told} in {path}"), soft_wrap=True)


def replay(
    directory: Annotated[Path, typer.Argument(help="A finished run's directory.")],
    viewer: Annotated[str, typer.Option(help="`meshcat` or `meldis`.")] = "meshcat",
    speed: Annotated[float, typer.Option(help="Times real time.")] = 1.0,
    loop: Annotated[bool, typer.Option(help="Begin again at the end.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Show a finished run again, in Meshcat or Meldis."""
    from drake_quad.report.lcm_replay import play

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
    from drake_quad.scenario.load import shipped_scenarios

    shipped = shipped_scenarios()
    if as_json:
        print(json.dumps({"scenarios": [{"name": n, "description": d} for n, d in shipped]}))
        return
    for name, description in shipped:
        print(f"{name:16s} {description}")


def _viewers(*, meshcat: bool, meldis: bool) -> "Visualize | None":
    if not (meshcat or meldis):
        return None
    from drake_quad.simulation.viewers import MakeMeldisViewer, MakeMeshcatViewer, Together

    chosen = []
    if meshcat:
        from pydrake.geometry import StartMeshcat

        server = StartMeshcat()
        MESSAGES.print(f"watch at {server.web_url()}")
        chosen.append(MakeMeshcatViewer(server))
    if meldis:
        chosen.append(MakeMeldisViewer())
    return Together(*chosen)


# ------------------------------------------------------------------------------------------------
# What `drake-quad plan` prints of a certificate.
# ------------------------------------------------------------------------------------------------


def certificate_lines(told: dict[str, Any]) -> list[str]:
    """What is proven, or the first time at which it fails and why, for people."""
    proven = told["proven"]
    where = f"from {told['time']:.3f} s on, in '{told['segment']}'" if told["segment"] else ""
    if not told["certified"]:
        return [f"not certified: {told['reason']}, {where}"]
    figures = [
        ("static margin at least", f"{proven['margin']:.4f} m"),
        ("swing feet from risers and nosings at least", f"{proven['foot_clearance']:.4f} m"),
        ("knees and shanks from the course at least", f"{proven['shank_clearance']:.4f} m"),
        ("joints inside their limits by at least", f"{proven['joint_room']:.3f} rad"),
        ("torques to stand still at most", f"{1.0 - proven['torque_room']:.1%} of their limits"),
    ]
    head = (
        f"certified for every time, in {told['intervals']} intervals, "
        f"{told['certifying_time']:.2f} s:"
    )
    lines = [f"  {name} {value}" for name, value in figures]
    return [head, *lines, "  body and feet continuous to the acceleration, also between tasks"]


def print_certificate(told: dict[str, Any], console: Console) -> None:
    """Prints `certificate_lines`."""
    for line in certificate_lines(told):
        console.print(Text(line), soft_wrap=True)
