"""The commands about a scenario: `run`, `plan`, `report`, `replay` and `scenarios`."""

import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

import drake_quad as dq
from drake_quad.cli.common import (
    MESSAGES,
    PAGES,
    JsonOption,
    ScenarioArgument,
    SetOption,
    claim,
    claim_file,
    interruptible,
    make_report,
    seconds_progress,
    stem,
    tell_notices,
)
from drake_quad.errors import InputError, PlanningError, printable
from drake_quad.util.display import folded

PLAN_FILES = ("plan.json", "certificate.json")  # what `plan --out` writes


def print_summary(summary: dict[str, Any], directory: Path, *, report: bool) -> None:
    """Prints how a run ended, and its figures."""
    console = Console()
    good = summary.get("outcome") == "goal_reached"
    lines = dq.summary_lines(summary)
    if good and (summary.get("time_under_three_feet") or 0.0) > 0.0:
        console.print("[yellow]not statically stable throughout: see the figures[/]")
    outcome = (printable(str(summary.get("outcome"))), f"bold {'green' if good else 'red'}")
    console.print(Text.assemble(outcome, f": {printable(str(summary.get('reason')))}"))
    if line := dq.safety_line(summary):
        console.print(Text(line, "green" if line.startswith("safe") else "yellow"), soft_wrap=True)
    table = Table(show_header=False, box=None, pad_edge=False)
    for label, text in lines:
        table.add_row(Text(label), Text(text))
    console.print(folded(table))
    if summary.get("assumes"):
        console.print(Text(f"these figures assume {summary['assumes']}"), soft_wrap=True)
    console.print(Text(f"files in {directory}"))
    if report:
        console.print(Text(f"look at {directory / 'report.html'}"))


def _metres(value: float) -> str:
    """A length to the millimetre [m], without a minus before a zero."""
    return f"{round(value, 3) + 0.0:.3f}"


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
    console.print(folded(table))
    least = f", {kind} {_metres(result[f'planned_margin_{kind}_min'])} m" if beyond else ""
    torque = result["torque_ratio_planned_max"]
    if result["balance"] == "dynamic":
        moving = _metres(result["planned_zmp_margin_min"])
        least += f", balanced by its motion: zero-moment point {moving} m within its feet"
        beside = result.get("planned_zmp_line_distance_max")
        if beside is not None:
            least += (
                f" where three or four stand, at most {_metres(beside)} m beside two feet's line"
            )
    strong = (
        ""
        if torque <= 1.0
        else ", if its feet share the weight so that no joint has to give "
        f"{torque:.0%} of its torque"
    )
    margin, safe = result["planned_margin_min"], result["safe_margin"]
    little = result["balance"] == "static" and margin < safe
    short = f", less than the {_metres(safe)} m of a run that counts as safe" if little else ""
    console.print(
        f"feasible{strong}: {result['duration']:.1f} s, smallest margin "
        f"{_metres(margin)} m{short}{least}, "
        f"planned in {result['planning_time']:.2f} s",
        highlight=False,
    )
    print_doubts(result["doubts"], console)


def print_doubts(doubts: list[str], console: Console) -> None:
    """Prints what in the robot's file may be wrong."""
    for doubt in doubts:
        console.print(Text(f"doubtful in the robot's file: {doubt}", "yellow"), soft_wrap=True)


def run(
    scenario: ScenarioArgument = "case_study",
    *,
    out: Annotated[
        Path | None,
        typer.Option(help="Directory for the run's files; by default runs/<scenario>."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of everything random in the run.")] = None,
    overrides: SetOption = None,
    meshcat: Annotated[bool, typer.Option("--meshcat", help="Show it live in a browser.")] = False,
    meldis: Annotated[bool, typer.Option("--meldis", help="Publish it live for Meldis.")] = False,
    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="Serve it live for Foxglove, at port 8765.")
    ] = False,
    report: Annotated[bool, typer.Option(help="Make report.html and scene.lcmlog.")] = True,
    as_json: JsonOption = False,
) -> None:
    """Plan and simulate a scenario, measure it, and write its report.

    Leaves summary.json, log.parquet, scenario.yaml, report.html and scene.lcmlog in the directory,
    also after Ctrl-C or a fall.
    """
    fields = [*(overrides or []), *([] if seed is None else [f"simulation.seed={seed}"])]
    live = meshcat or meldis or foxglove
    if live and not any("realtime_rate" in field for field in fields):
        fields.append("simulation.realtime_rate=1.0")  # people watch in real time
    loaded = dq.load_scenario(scenario, fields)
    directory = out if out is not None else Path("runs") / stem(scenario)
    claim(directory)
    _keep_input(scenario, directory)
    viewers = (
        dq.make_viewers(meshcat=meshcat, meldis=meldis, foxglove=foxglove, tell=MESSAGES.print)
        if live
        else None
    )
    try:
        with (
            interruptible(MESSAGES) as interrupted,
            seconds_progress("simulating", MESSAGES) as progress,
        ):
            result = dq.simulate(
                loaded, source=scenario, progress=progress, stop=interrupted, visualize=viewers,
                tell=MESSAGES.print,
            )  # fmt: skip
    except PlanningError as error:
        if as_json:
            print(json.dumps({"outcome": "infeasible", "reason": error.reason}))
        raise
    result.save(directory)
    if report:
        make_report(directory, MESSAGES)
    if as_json:
        print(json.dumps({**result.summary, "directory": str(directory)}))
    else:
        print_summary(result.summary, directory, report=report)
    raise typer.Exit(0 if result.outcome == "goal_reached" else 1)


def _keep_input(scenario: str, directory: Path) -> None:
    """Makes sure that a scenario which somebody wrote is not overwritten by its run's.

    That of an earlier run may be: it lies beside the run's summary.

    Raises:
        InputError: It would be.
    """
    if (directory / "summary.json").exists():
        return
    claim_file(directory / "scenario.yaml", "--out", reads=[scenario])


def plan(
    scenario: ScenarioArgument = "case_study",
    *,
    out: Annotated[Path | None, typer.Option(help="Directory for the files.")] = None,
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a scenario, check it on paper and certify it for every time, without physics."""
    loaded = dq.load_scenario(scenario, overrides or [])
    if out is not None:
        claim(out)
    result = dq.report_plan(loaded, source=scenario, out=out)
    if as_json:
        print(json.dumps(result))
    elif result["feasible"]:
        print_plan(result)
        print_certificate(result["certificate"], Console())
        print_lines(belief_lines(result["belief"]), Console())
        if out is not None:
            names = [name for name in PLAN_FILES if (out / name).exists()]
            Console().print(Text(f"{' and '.join(names)} in {out}"), soft_wrap=True)
    else:
        print_doubts(result["doubts"], MESSAGES)  # the robot's file may be why
        raise PlanningError(result["reason"])
    raise typer.Exit(0 if result["feasible"] else 1)


def report(
    directory: Annotated[Path, typer.Argument(help="A finished run's directory, or a sweep's.")],
    page: Annotated[
        Path | None, typer.Option(help="Markdown page in which to renew a sweep's section.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Make the report of a finished run or sweep again, from the files that it left."""
    if any((directory / name).exists() for name in ("sweep.json", "journal.jsonl")):
        _report_sweep(directory, page, as_json=as_json)
        return
    if page is not None:
        remedy = "is for the directory of a sweep; leave it out"
        raise InputError(source="--page", field="page", value=str(page), remedy=remedy)
    summary = dq.read_summary(directory, or_sweep=True)
    make_report(directory, MESSAGES)
    if as_json:
        print(json.dumps({"report": str(directory / "report.html")}))
    else:
        print_summary(summary, directory, report=True)


def _report_sweep(directory: Path, page: Path | None, *, as_json: bool) -> None:
    from drake_quad.cli.studies import print_sweep

    claim_file(page, "--page", kinds=PAGES)
    told = dq.rebuild_report(directory, page)
    if as_json:
        print(json.dumps({"report": str(directory / "report.html")}))
    else:
        print_sweep(told, directory, Console(emoji=False))


def export(
    directory: Annotated[Path, typer.Argument(help="A finished run's directory.")],
    csv: Annotated[
        Path | None, typer.Option(help="File to write; by default joints.csv in the directory.")
    ] = None,
    mcap: Annotated[
        bool, typer.Option("--mcap", help="Write run.mcap, for Foxglove, and no CSV.")
    ] = False,
    ros2: Annotated[
        bool, typer.Option("--ros2", help="Write ros2_bag, for ros2 bag and RViz, and no CSV.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Export a finished run as CSV, MCAP or a bag of ROS 2.

    Angles and axes of the CSV's joints are those of the robot's own file.

    The columns are the time in s; each joint's angle in rad, speed in rad/s and torque in Nm; and
    the trunk's pose. With --mcap or --ros2: transforms, joints, markers and margins as MCAP, for
    Foxglove or as a bag of ROS 2.
    """
    if mcap or ros2:
        _export_messages(directory, csv, mcap=mcap, ros2=ros2, as_json=as_json)
        return
    path = csv if csv is not None else directory / "joints.csv"
    dq.read_summary(directory)
    files = [file for file in directory.iterdir() if file.suffix != ".csv"]
    claim_file(path, "--csv", reads=files)
    rows = dq.write_joint_table(tell_notices(dq.load_run(directory), MESSAGES), path)
    if as_json:
        print(json.dumps({"csv": str(path), "rows": rows}))
    else:
        Console().print(Text(f"{rows} rows in {path}"), soft_wrap=True)


def _export_messages(
    directory: Path, csv: Path | None, *, mcap: bool, ros2: bool, as_json: bool
) -> None:
    """Writes the run as messages over time."""
    if csv is not None or (mcap and ros2):
        given = {"--csv": csv, "--mcap": mcap or None, "--ros2": ros2 or None}
        named = [name for name, value in given.items() if value is not None]
        remedy = f"one kind of file at a time: leave out all but one of {', '.join(named)}"
        value = True if csv is None else str(csv)
        raise InputError(source=named[0], field=named[0][2:], value=value, remedy=remedy)
    option, path = (
        ("--mcap", directory / "run.mcap") if mcap else ("--ros2", directory / "ros2_bag")
    )
    dq.read_summary(directory)
    if mcap:
        claim_file(path, option)
    run = tell_notices(dq.load_run(directory), MESSAGES)
    counts = dq.write_mcap(run, path) if mcap else dq.write_ros2_bag(run, path)
    size = sum(file.stat().st_size for file in ([path] if mcap else path.iterdir()))
    if as_json:
        print(json.dumps({option[2:]: str(path), "messages": counts, "bytes": size}))
    else:
        told = ", ".join(f"{count} of {topic}" for topic, count in counts.items())
        Console().print(Text(f"{told} in {path}"), soft_wrap=True)


def replay(
    directory: Annotated[Path, typer.Argument(help="A finished run's directory.")],
    viewer: Annotated[
        str, typer.Option(help="Where to show it: `meshcat` or `meldis`.")
    ] = "meshcat",
    speed: Annotated[float, typer.Option(help="Speed of the replay, in times real time.")] = 1.0,
    loop: Annotated[bool, typer.Option(help="Begin again at the end, until Ctrl-C.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Show a finished run again, in Meshcat or Meldis."""
    dq.read_summary(directory)
    if viewer not in ("meshcat", "meldis"):
        raise InputError(
            source="--viewer", field="viewer", value=viewer, remedy="give meshcat or meldis"
        )
    if not speed > 0.0:
        raise InputError(source="--speed", field="speed", value=speed, remedy="give more than 0")
    dq.replay(directory, viewer=viewer, speed=speed, loop=loop)
    if as_json:
        print(json.dumps({"replayed": str(directory)}))


def scenarios(as_json: JsonOption = False) -> None:
    """List the scenarios that are shipped."""
    shipped = dq.shipped_scenarios()
    if as_json:
        print(json.dumps({"scenarios": [{"name": n, "description": d} for n, d in shipped]}))
        return
    for name, description in shipped:
        print(f"{name:16s} {description}")


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
    smooth = "  body and feet continuous to the acceleration, also between tasks"
    return [head, *lines, smooth, *_tolerance_lines(told["tolerances"])]


def _tolerance_lines(told: dict[str, Any] | None) -> list[str]:
    """What is proven within tolerances, for people."""
    if told is None:
        return []
    asked, proven = told["asked"], told["proven"]
    tilt = 180.0 / math.pi * max(asked["tilt"], asked["turn"])
    lines = [
        f"also for treads up to {1e3 * asked['rise']:.1f} mm higher or lower and risers "
        f"{1e3 * asked['run']:.1f} mm off, masses {asked['mass']:.0%} more, a centre of mass "
        f"{1e3 * asked['com']:.0f} mm off, the body {1e3 * asked['body']:.1f} mm and "
        f"{tilt:.1f}° off its plan, standing feet {1e3 * asked['foot']:.1f} mm, swing feet "
        f"{1e3 * asked['swing']:.1f} mm, and feet that bear {1e3 * asked['late']:.0f} ms late:"
    ]
    if told["share"] < 1.0:
        lines.append(
            f"  not for all of that: with {told['fails_at']:.2f} of each "
            f"{told['reason']}, from {told['time']:.3f} s on, in '{told['segment']}'"
        )
        if not proven:
            return [*lines, "  so nothing is proven beyond the plan as it is"]
        lines.append(f"  but with {told['share']:.2f} of each:")
    return [
        *lines,
        f"  static margin at least {proven['margin']:.4f} m",
        f"  swing feet from risers and nosings at least {proven['foot_clearance']:.4f} m, standing "
        f"ones from edges {proven['foothold_room']:.4f} m",
        f"  knees and shanks from the course at least {proven['shank_clearance']:.4f} m",
        f"  joints inside their limits by at least {proven['joint_room']:.3f} rad, torques at most "
        f"{1.0 - proven['torque_room']:.1%} of theirs",
    ]


def belief_lines(proofs: list[dict[str, Any]]) -> list[str]:
    """What is proven for all stairs that a map that was seen takes for possible, for people."""
    lines = []
    for told in proofs:
        proven = told["proven"]
        box = (
            f"for all stairs that may be, by what was seen (risers within "
            f"{1e3 * told['place']:.1f} mm of the map, treads within {1e3 * told['height']:.1f} mm)"
        )
        if not proven:
            lines.append(f"not {box}: {told['reason']}")
            continue
        lines += [
            f"{box}, and {told['share']:.2f} of the tolerances of tracking:",
            f"  static margin at least {proven['margin']:.4f} m",
            f"  swing feet from risers and nosings at least {proven['foot_clearance']:.4f} m, "
            f"standing ones from edges {proven['foothold_room']:.4f} m",
            f"  knees and shanks from the stairs at least {proven['shank_clearance']:.4f} m",
        ]
    return lines


def print_certificate(told: dict[str, Any], console: Console) -> None:
    """Prints `certificate_lines`."""
    print_lines(certificate_lines(told), console)


def print_lines(lines: list[str], console: Console) -> None:
    """Prints lines as they are, whatever brackets are in them."""
    for line in lines:
        console.print(Text(line), soft_wrap=True)
