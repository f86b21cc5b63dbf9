"""The command `passport`: which stairs of common rules a robot climbs."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

import drake_quad as dq
from drake_quad.cli.common import (
    MESSAGES,
    JsonOption,
    RobotArgument,
    WorkersOption,
    cells_progress,
    claim,
    interruptible,
    stem,
)

WIDE = 44  # of a title
COLOURS = {"yes": "green", "no": "red", "unknown": "yellow"}


def passport(
    robot: RobotArgument,
    *,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; by default passports/<robot>.")
    ] = None,
    count: Annotated[int, typer.Option(help="Number of steps of each flight.")] = 10,
    prefer: Annotated[
        str,
        typer.Option(
            help="What the gaits are to be good at: `margin`; `balanced`, the quickest that keeps "
            "0.8 of that margin; or `speed`, the quickest that is safe."
        ),
    ] = "margin",
    trials: Annotated[
        int | None,
        typer.Option(
            help="Trials in physics of each flight with a plan; 29 take an hour or more. 29 of 29 "
            "are a rate of 90 % with a confidence of 95 %."
        ),
    ] = None,
    workers: WorkersOption = None,
    as_json: JsonOption = False,
) -> None:
    """Which stairs of common rules does this robot climb, how fast, and with what margin?

    Leaves passport.md, passport.json, passport.svg, passport.png and the scenario of each plan in
    the directory; with --trials the trials, too.
    """
    directory = out if out is not None else Path("passports") / stem(robot)
    if trials is not None:
        dq.check_trials(trials)
    with interruptible(MESSAGES) as interrupted:
        with cells_progress(MESSAGES) as progress:
            found = dq.make_passport(
                robot, directory, count=count, prefer=prefer, workers=workers, progress=progress,
                stop=interrupted, ready=lambda: claim(directory, files=("passport.json",)),
                tell=MESSAGES.print,
            )  # fmt: skip
        if not found.entries:
            raise KeyboardInterrupt  # before there was anything to keep
        if trials is not None and not interrupted():
            found = dq.try_passport(
                found, directory, trials, workers=workers, console=MESSAGES, stop=interrupted
            )
    if as_json:
        print(json.dumps({**found.as_dict(), "directory": str(directory)}))
    else:
        print_passport(found, directory, Console())
    if interrupted():
        MESSAGES.print("interrupted: not all is there; the same command goes on with trials")
    raise typer.Exit(0 if found.complete and not interrupted() else 1)


def print_passport(found: "dq.Passport", directory: Path, console: Console) -> None:
    """Prints a line or two for each kind of stairs, and where the page is."""
    tried = any(entry.trials for entry in found.entries)
    heads = dq.passport_columns(tried=tried)
    for entry in found.entries:
        name, _, answer, margin, speed, limit, others, *rates = dq.passport_cells(
            entry, tried=tried
        )
        size = f"{entry.stairs.rise:g} × {entry.stairs.run:g} m"
        figures = f": {margin} mm, {speed} m/s" if entry.margin is not None else ""
        title = f"{name} ({size})".ljust(WIDE)
        console.print(Text.assemble(title, (answer, COLOURS[entry.verdict]), figures))
        where = "nearest limit" if entry.margin is not None else "in the way"
        console.print(Text(f"    {where}: {limit}"))
        if entry.others:
            console.print(Text(f"    with {heads[6]}: {others}"))
        if entry.trials is not None:
            console.print(Text(f"    reached the goal: {rates[0]}"))
            console.print(Text(f"    cost of transport: {rates[1]}"))
    assumes = f"These answers assume {found.assumes}. {found.drawn}".strip()
    console.print(Text(assumes))
    console.print(Text(f"look at {directory / 'passport.png'}"), soft_wrap=True)
