"""The commands about a robot and stairs: `inspect`, `check` and `chart`."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

import drake_quad as dq
from drake_quad.cli.check_answer import print_check, print_next
from drake_quad.cli.common import (
    MESSAGES,
    JsonOption,
    RobotArgument,
    WorkersOption,
    cells_progress,
    claim,
    claim_apart,
    claim_file,
    interruptible,
    stem,
)
from drake_quad.util.display import folded
from drake_quad.util.files import write_whole


def inspect(
    robot: RobotArgument,
    picture: Annotated[
        Path | None, typer.Option(help="Draw it into this file (.svg, .png or .pdf).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show what is read from a robot's file, and what is repaired or assumed."""
    dq.check_picture_path(picture)
    claim_file(picture, "--picture", reads=[robot])
    model = dq.load_robot(robot)
    told = dq.describe_robot(model, source=robot)
    if not as_json:
        dq.print_robot(told, Console())
    if picture is not None:
        dq.save_picture(dq.draw_robot(model), picture, salt=model.name)
        told["picture"] = str(picture)
    if as_json:
        print(json.dumps(told))


def check(
    robot: RobotArgument,
    *,
    rise: Annotated[
        float | None, typer.Option(help="Rise of the steps \\[m].", show_default="0.178")
    ] = None,
    run: Annotated[
        float | None, typer.Option(help="Run of the treads \\[m].", show_default="0.28")
    ] = None,
    count: Annotated[
        int | None, typer.Option(help="Number of steps of the flight.", show_default="10")
    ] = None,
    overhang: Annotated[
        float | None,
        typer.Option(
            help="How far each tread reaches beyond the riser under it \\[m].", show_default="0"
        ),
    ] = None,
    open_risers: Annotated[
        bool, typer.Option("--open", help="The risers are open: nothing is between the treads.")
    ] = False,
    width: Annotated[
        float | None,
        typer.Option(help="Width of the flights \\[m]; by default as the robot needs."),
    ] = None,
    landing: Annotated[
        float | None,
        typer.Option(
            help="Length of the landing between the flights \\[m]; by default as the robot needs."
        ),
    ] = None,
    turn: Annotated[
        float | None,
        typer.Option(
            help="Turn on the landing \\[deg]: 0, 90 (left), 180 (two landings), -90 or -180.",
            show_default="90",
        ),
    ] = None,
    scenario: Annotated[
        str | None, typer.Option(help="Scenario whose course is walked instead of a flight.")
    ] = None,
    margin: Annotated[
        str,
        typer.Option(
            help="Region in which the plan's margin is measured: that of the feet (`hull`), within "
            "`friction`, or within torque limits too (`feasible`)."
        ),
    ] = "hull",
    prefer: Annotated[
        str | None,
        typer.Option(
            help="What the gait is to be good at: `margin`, which is answered soonest; `balanced`, "
            "the quickest that keeps 0.8 of that margin; or `speed`, the quickest that is safe. "
            "With --speed, --min-margin or --balance dynamic a safe margin is enough, unless you "
            "give this option, too.",
            show_default="balanced",
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(help="Speed on the flights that is enough \\[m/s]."),
    ] = None,
    min_margin: Annotated[
        float | None,
        typer.Option(help="Margin to keep \\[m], as quick as that allows."),
    ] = None,
    balance: Annotated[
        str,
        typer.Option(
            help="How the gait is balanced: `static`, over its feet at every time; or `dynamic`, "
            "by its motion, which is quicker: the margin is that of the zero-moment point."
        ),
    ] = "static",
    save: Annotated[
        Path | None, typer.Option(help="File to write the designed scenario into.")
    ] = None,
    proof: Annotated[
        Path | None,
        typer.Option(help="File to write the proof into, if it is proven that there is no climb."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="File to draw the climb into (.svg, .png or .pdf).")
    ] = None,
    curve: Annotated[
        Path | None,
        typer.Option(
            help="Directory to write speed against margin into: picture, figures and scenarios."
        ),
    ] = None,
    nearest: Annotated[
        bool, typer.Option(help="After a no, look for the nearest stairs that it climbs.")
    ] = True,
    changes: Annotated[
        bool,
        typer.Option(
            "--changes",
            help="After a no, look for the least change of the robot or of the stairs, each "
            "alone, that makes it a yes; instead of the nearest stairs.",
        ),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            help="Number of processes that look for --changes; by default as many as there are "
            "cores."
        ),
    ] = None,
    anew: Annotated[
        bool,
        typer.Option(
            "--anew",
            help="Design the gait anew. Else an answer to the same question, of the same robot's "
            "file by the same version, is given again.",
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Can this robot climb these stairs? Designs a gait, and plans it up and down in full.

    Where no plan is found it looks for a proof that no gait climbs these stairs. If there is none
    either, the answer is unknown. To find the nearest stairs that work, or with --changes what
    would make it a yes, takes minutes more.
    """
    asked = dq.CheckRequest(
        robot, rise=rise, run=run, count=count, overhang=overhang, open=open_risers or None,
        scenario=scenario, margin=margin, width=width, landing=landing, turn=turn, prefer=prefer,
        speed=speed, min_margin=min_margin, balance=balance,
    )  # fmt: skip
    console, said = Console(), False
    given = [robot, *([] if scenario is None else [scenario])]
    claim_file(save, "--save", reads=given, kinds=(".yaml", ".yml"))
    claim_file(proof, "--proof", reads=given, kinds=(".json",))
    claim_file(picture, "--picture", reads=given)
    if curve is not None:
        claim(curve, "--curve")
    claim_apart({"--save": save, "--proof": proof, "--picture": picture, "--curve": curve})

    def say(told: dict[str, Any]) -> None:
        nonlocal said
        if not (as_json or said):
            print_check(told, console)
        said = True

    hint = ""

    @contextmanager
    def quickening() -> Iterator[Callable[[], bool]]:
        nonlocal hint
        with interruptible(MESSAGES, "stopping; the answer is the best gait so far") as stop:
            hint = " (Ctrl-C: answer with the best so far)"
            yield stop
            hint = ""

    with MESSAGES.status("designing a gait") as status:
        told = dq.run_check(
            asked, save=save, proof=proof, picture=picture, curve=curve, nearest=nearest,
            changes=changes, workers=workers, remembered=not anew, first=say,
            note=lambda words: status.update(words + hint), stopping=quickening,
        )  # fmt: skip
    if proof is not None and told["proof"] is None:
        why = "there is a plan" if told["feasible"] else "no proof was found"
        MESSAGES.print(Text(f"{proof} is not written: {why}"), soft_wrap=True)
    for path in (save, picture, curve):
        if path is not None and not told["feasible"]:
            MESSAGES.print(Text(f"{path} is not written: there is no plan"), soft_wrap=True)
    if as_json:
        print(json.dumps(told))
    else:
        say(told)
        print_next(told, console)
    pace = told.get("pace")
    fulfilled = pace is None or pace["wish"]["fulfilled"]
    raise typer.Exit(0 if told["feasible"] and fulfilled else 1)


def chart(
    robot: RobotArgument,
    *,
    rise_from: Annotated[float, typer.Option(help="Lowest rise \\[m].")] = 0.05,
    rise_to: Annotated[float, typer.Option(help="Highest rise \\[m].")] = 0.25,
    rise_step: Annotated[float, typer.Option(help="Step between rises \\[m].")] = 0.025,
    run_from: Annotated[float, typer.Option(help="Shallowest tread \\[m].")] = 0.25,
    run_to: Annotated[float, typer.Option(help="Deepest tread \\[m].")] = 0.60,
    run_step: Annotated[float, typer.Option(help="Step between treads' depths \\[m].")] = 0.05,
    count: Annotated[int, typer.Option(help="Number of steps of each flight.")] = 4,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; by default charts/<robot>.")
    ] = None,
    workers: WorkersOption = None,
    as_json: JsonOption = False,
) -> None:
    """Chart which stairs this robot climbs: margins over rise and run, and what limits the rest.

    Leaves chart.json, chart.svg and chart.png in the directory, also after Ctrl-C.
    """
    rises = dq.Span(rise_from, rise_to, rise_step)
    runs = dq.Span(run_from, run_to, run_step)
    directory = out if out is not None else Path("charts") / stem(robot)

    def ready() -> None:
        claim(directory, files=("chart.json",))

    words = "stopping; the stairs that were looked at so far are told"
    with interruptible(MESSAGES, words) as interrupted, cells_progress(MESSAGES) as progress:
        found = dq.chart_stairs(
            robot, rises, runs, count=count, workers=workers, progress=progress,
            stop=interrupted, ready=ready, tell=MESSAGES.print,
        )  # fmt: skip
    told = found.as_dict()
    if not found.cells:
        raise KeyboardInterrupt  # before there was anything to keep
    written = told["complete"] or not (directory / "chart.json").exists()
    if written:
        write_chart(told, directory)
        dq.save_chart(found, directory)
    else:
        line = f"interrupted: {directory} keeps the chart that was there before"
        MESSAGES.print(Text(line), soft_wrap=True)
    if as_json:
        print(json.dumps({**told, "directory": str(directory)}))
    else:
        print_chart(told, directory if written else None, Console())
    raise typer.Exit(0 if told["complete"] else 1)


def write_chart(told: dict[str, Any], directory: Path) -> None:
    """Writes chart.json."""
    text = json.dumps(told, indent=2) + "\n"
    write_whole(directory / "chart.json", lambda to: to.write_text(text, encoding="utf-8"))


def print_chart(told: dict[str, Any], directory: Path | None, console: Console) -> None:
    """Prints how many of the stairs can be climbed, the highest of each run, and where it is."""
    cells = told["cells"]
    works = [cell for cell in cells if cell["margin"] is not None]
    colour, total = "green" if works else "red", len(told["rises"]) * len(told["runs"])
    looked = "" if told["complete"] else f", of which {len(cells)} were looked at"
    climbs = f"{told['name']} climbs {len(works)} of {total} stairs"
    proven = sum(cell["proven"] for cell in cells)
    unknown = len(cells) - len(works) - proven
    rest = f"; no gait climbs {proven}, which is proven; {unknown} are unknown"
    console.print(Text.assemble((climbs, f"bold {colour}"), looked, rest), soft_wrap=True)
    table = Table("run", "highest rise", "margin", "what is in the way above", box=None)
    for run in told["runs"]:
        here = [cell for cell in cells if cell["run"] == run]
        best = max((c for c in here if c["margin"] is not None), key=_rise, default=None)
        above = min(
            (c for c in here if c["limit"] and (best is None or c["rise"] > best["rise"])),
            key=_rise,
            default=None,
        )
        table.add_row(
            f"{run:g} m",
            "-" if best is None else f"{best['rise']:g} m",
            "-" if best is None else f"{1e3 * best['margin']:.0f} mm",
            "-" if above is None else told["limits"][above["limit"]],
        )
    console.print(folded(table), highlight=False)
    if cells and not works and cells[0]["reason"]:
        first = f"of {cells[0]['rise']:g} m on {cells[0]['run']:g} m: {cells[0]['reason']}"
        console.print(Text(first), soft_wrap=True)
    if directory is not None:
        console.print(Text(f"look at {directory / 'chart.png'}"), soft_wrap=True)


def _rise(cell: dict[str, Any]) -> float:
    return float(cell["rise"])
