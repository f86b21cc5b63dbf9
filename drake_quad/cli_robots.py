"""The commands that ask what a robot is, and what it can climb."""

import json
import os
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from drake_quad.cli_files import claim, claim_file, stem
from drake_quad.cli_options import MESSAGES, JsonOption, RobotArgument, WorkersOption
from drake_quad.cli_progress import cells_progress, interruptible


def inspect(
    robot: RobotArgument,
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
    claim_file(picture, "--picture")
    model = load_robot(robot)
    told = describe_robot(model, source=robot)
    if not as_json:
        print_robot(told, Console())
    if picture is not None:
        save_picture(model, picture)
        told["picture"] = str(picture)
    if as_json:
        print(json.dumps(told))


def check(
    robot: RobotArgument,
    rise: Annotated[
        float | None, typer.Option(help="Of the steps, in m.", show_default="0.178")
    ] = None,
    run: Annotated[
        float | None, typer.Option(help="Of the treads, in m.", show_default="0.28")
    ] = None,
    count: Annotated[
        int | None, typer.Option(help="Steps of the flight.", show_default="10")
    ] = None,
    width: Annotated[
        float | None, typer.Option(help="Of the flights, in m; as the robot needs unless told.")
    ] = None,
    landing: Annotated[
        float | None,
        typer.Option(help="Length of the landing between the flights, in m; the same."),
    ] = None,
    turn: Annotated[
        float | None,
        typer.Option(
            help="On the landing, in degrees: 0, 90 (left), 180 (two landings), -90, -180.",
            show_default="90",
        ),
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
    nearest: Annotated[
        bool, typer.Option(help="After a no, look for the nearest stairs that it climbs.")
    ] = True,
    as_json: JsonOption = False,
) -> None:
    """Can this robot climb these stairs? Designs a gait, and plans it up and down in full.

    A no comes with its reason first; to find the nearest stairs that work takes minutes more.
    """
    from drake_quad.check_command import Asked, run_check
    from drake_quad.check_print import print_check, print_next

    asked = Asked(
        robot, rise=rise, run=run, count=count, scenario=scenario, margin=margin, width=width,
        landing=landing, turn=turn,
    )  # fmt: skip
    console, said = Console(), False
    claim_file(save, "--save")
    claim_file(picture, "--picture")

    def say(told: dict[str, Any]) -> None:
        nonlocal said
        if not (as_json or said):
            print_check(told, console)
        said = True

    with MESSAGES.status("designing a gait") as status:
        told = run_check(
            asked, save=save, picture=picture, nearest=nearest, first=say, note=status.update
        )
    if as_json:
        print(json.dumps(told))
    else:
        say(told)
        print_next(told, console)
    raise typer.Exit(0 if told["feasible"] else 1)


def chart(
    robot: RobotArgument,
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
    workers: WorkersOption = None,
    as_json: JsonOption = False,
) -> None:
    """Chart which stairs this robot climbs: margins over rise and run, and what limits the rest.

    Leaves chart.json, chart.svg and chart.png in the directory, also after Ctrl-C.
    """
    from drake_quad.chart_grid import Span, grid_of
    from drake_quad.chart_picture import save_chart
    from drake_quad.chart_report import print_chart, write_chart
    from drake_quad.chart_stairs import chart_stairs
    from drake_quad.processes import check_workers

    rises, runs = Span(rise_from, rise_to, rise_step), Span(run_from, run_to, run_step)
    workers = workers if workers is not None else os.cpu_count() or 1
    grid_of(rises, runs, count)  # before there is any progress to be seen
    check_workers(workers)
    directory = out if out is not None else Path("charts") / stem(robot)
    claim(directory)
    with interruptible(MESSAGES) as interrupted, cells_progress(MESSAGES) as progress:
        told = chart_stairs(
            robot, rises, runs, count=count, workers=workers, progress=progress, stop=interrupted
        )
    write_chart(told, directory)
    save_chart(told, directory)
    if as_json:
        print(json.dumps({**told, "directory": str(directory)}))
    else:
        print_chart(told, directory, Console())
    raise typer.Exit(0 if told["complete"] else 1)
