"""The commands about many runs: `sweep` and `compare`."""

import json
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
    WorkersOption,
    claim,
    claim_file,
    interruptible,
    stem,
)
from drake_quad.errors import printable
from drake_quad.util.display import folded


def sweep(
    study: Annotated[Path, typer.Argument(help="A study's YAML file (see docs/sweeps.md).")],
    *,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; by default sweeps/<study>.")
    ] = None,
    workers: WorkersOption = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Address of a Dask cluster's scheduler.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with what is in the directory.")
    ] = False,
    limit: Annotated[
        int | None, typer.Option(help="Number of trials to do, the first ones.")
    ] = None,
    replays: Annotated[
        int, typer.Option(help="Number of the worst trials to run again, for replays.")
    ] = 0,
    page: Annotated[
        Path | None, typer.Option(help="Markdown page in which to write the study's section.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Carry out a study: many runs, their rate of success, and where it breaks.

    Leaves trials.parquet, clock.parquet, sweep.json and report.html in the directory, also after
    Ctrl-C. Exit status 1 if fewer succeed than the study's gate asks for.
    """
    directory = out if out is not None else Path("sweeps") / stem(str(study))

    def ready() -> None:
        claim_file(page, "--page", reads=[study], kinds=PAGES)
        claim(directory)

    with interruptible(MESSAGES) as interrupted:
        told = dq.run_study(
            study, directory, workers=workers, dask=dask, resume=resume, limit=limit,
            replays=replays, page=page, console=MESSAGES, stop=interrupted, ready=ready,
        )  # fmt: skip
    if as_json:
        print(json.dumps({**told, "directory": str(directory)}))
    else:
        print_sweep(told, directory, Console(emoji=False))
    raise typer.Exit(1 if told["passed"] is False or told["interrupted"] else 0)


def compare(
    before: Annotated[Path, typer.Argument(help="A sweep's directory.")],
    after: Annotated[Path, typer.Argument(help="Another's, for example of a later commit.")],
    as_json: JsonOption = False,
) -> None:
    """Is one sweep worse than another? Rates, causes, and tests of significance.

    Exit status 1 if the second is worse, significantly.
    """
    told = dq.compare_sweeps(before, after)
    if as_json:
        print(json.dumps(told.as_dict()))
    else:
        dq.print_comparison(told, Console(emoji=False))
    raise typer.Exit(1 if told.verdict == "worse" else 0)


COLOURS = {"good": "green", "warn": "yellow", "bad": "red"}


def print_sweep(told: dict[str, Any], out: Path, console: Console) -> None:
    """Prints the rate, the bands, the causes of failure, and the commands that repeat the worst."""

    def say(text: str) -> None:
        console.print(text, highlight=False, soft_wrap=True)

    def plainly(text: str) -> None:
        console.print(printable(text), markup=False, highlight=False, soft_wrap=True)

    rate = told["rate"]
    colour = COLOURS[dq.grade(told)]
    say(f"[bold {colour}]{rate['good']} of {rate['trials']}[/] trials succeeded: {rate['text']}")
    for line in dq.caveats_of(told):
        plainly(line)
    if not told["complete"]:
        plainly("go on with --resume")
    if asked := dq.gate_words(told):
        plainly(asked)
    for name, bands in told["bands"].items():
        if len(bands) == 1:
            continue
        table = Table(
            Column(Text(printable(name))), "trials", "succeeded", "with bounds at 95 %", box=None
        )
        for band in bands:
            label = Text(printable(band["label"]))
            table.add_row(label, str(band["trials"]), str(band["good"]), band["text"])
        console.print(folded(table), highlight=False)
    for cause in told["causes"]:
        plainly(f"{cause['trials']:4d} × {cause['cause']}")
    for trial in told["worst"][:3]:
        if trial["outcome"] != "goal_reached":
            command = dq.repeat_into(trial["command"], trial["index"], out)
            plainly(command)
    plainly(f"look at {out / 'report.html'}")
