"""What `drake-quad sweep` prints of its findings."""

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from drake_quad.errors import printable
from drake_quad.sweep.caveats import caveats_of
from drake_quad.sweep.sweep import REPORT
from drake_quad.sweep.trials import repeat_into
from drake_quad.sweep.verdict import gate_words, grade

COLOURS = {"good": "green", "warn": "yellow", "bad": "red"}


def print_sweep(told: dict[str, Any], out: Path, console: Console) -> None:
    """Prints the rate, the bands, the causes of failure, and the commands that repeat the worst."""

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
