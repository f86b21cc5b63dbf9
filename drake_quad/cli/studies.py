"""The commands about many runs: `sweep` and `compare`."""

import json
import os
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from drake_quad.cli.common import (
    MESSAGES,
    JsonOption,
    WorkersOption,
    claim,
    claim_file,
    interruptible,
    stem,
)
from drake_quad.errors import printable

# ------------------------------------------------------------------------------------------------
# The commands that carry out studies, and compare what came of them.
# ------------------------------------------------------------------------------------------------


def sweep(
    study: Annotated[Path, typer.Argument(help="A study's YAML file (see docs/sweeps.md).")],
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; sweeps/<study> unless told.")
    ] = None,
    workers: WorkersOption = None,
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
    from drake_quad.sweep.run import SweepRequest, run_sweep

    directory = out if out is not None else Path("sweeps") / stem(str(study))

    def ready() -> None:
        claim_file(page, "--page")
        claim(directory)

    cores = os.cpu_count() or 1
    asked = SweepRequest(
        study, directory, workers if workers is not None else cores, dask, resume, limit, replays,
        page,
    )  # fmt: skip
    with interruptible(MESSAGES) as interrupted:
        told = run_sweep(asked, MESSAGES, interrupted, ready)
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
    from drake_quad.sweep.compare import compare_sweeps, print_comparison

    told = compare_sweeps(before, after)
    if as_json:
        print(json.dumps(told.as_dict()))
    else:
        print_comparison(told, Console(emoji=False))
    raise typer.Exit(1 if told.verdict == "worse" else 0)


# ------------------------------------------------------------------------------------------------
# What `drake-quad sweep` prints of its findings.
# ------------------------------------------------------------------------------------------------


COLOURS = {"good": "green", "warn": "yellow", "bad": "red"}


def print_sweep(told: dict[str, Any], out: Path, console: Console) -> None:
    """Prints the rate, the bands, the causes of failure, and the commands that repeat the worst."""
    from drake_quad.sweep.results import REPORT
    from drake_quad.sweep.statistics import caveats_of, gate_words, grade
    from drake_quad.sweep.trials import repeat_into

    def say(text: str) -> None:
        console.print(text, highlight=False, soft_wrap=True)

    def plainly(text: str) -> None:
        console.print(printable(text), markup=False, highlight=False, soft_wrap=True)

    rate = told["rate"]
    colour = COLOURS[grade(told)]
    say(f"[bold {colour}]{rate['good']} of {rate['trials']}[/] trials succeeded: {rate['text']}")
    for line in caveats_of(told):
        plainly(line)
    if not told["complete"]:
        plainly("go on with --resume")
    if asked := gate_words(told):
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
        console.print(table, highlight=False)
    for cause in told["causes"]:
        plainly(f"{cause['trials']:4d} × {cause['cause']}")
    for trial in told["worst"][:3]:
        if trial["outcome"] != "goal_reached":
            command = repeat_into(trial["command"], trial["index"], out)
            plainly(command)
    plainly(f"look at {out / REPORT}")
