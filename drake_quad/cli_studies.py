"""The commands that carry out studies, and compare what came of them."""

import json
import os
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from drake_quad.cli_files import claim, claim_file, stem
from drake_quad.cli_options import MESSAGES, JsonOption, WorkersOption
from drake_quad.cli_progress import interruptible


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
    from drake_quad.sweep.command import Asked, run_sweep
    from drake_quad.sweep.printing import print_sweep

    directory = out if out is not None else Path("sweeps") / stem(str(study))

    def ready() -> None:
        claim_file(page, "--page")
        claim(directory)

    cores = os.cpu_count() or 1
    asked = Asked(
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
        print(json.dumps(told))
    else:
        print_comparison(told, Console(emoji=False))
    raise typer.Exit(1 if told["verdict"] == "worse" else 0)
