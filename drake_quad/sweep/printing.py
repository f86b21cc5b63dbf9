"""What `drake-quad sweep` prints of its findings."""

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from drake_quad.sweep.sweep import REPORT
from drake_quad.sweep.trials import repeat_into


def print_sweep(told: dict[str, Any], out: Path, console: Console) -> None:
    """Prints the rate, the bands, the causes of failure, and the commands that repeat the worst."""

    def say(text: str) -> None:
        console.print(text, highlight=False, soft_wrap=True)

    rate = told["rate"]
    colour = "green" if told["passed"] or (told["passed"] is None and rate["good"]) else "red"
    say(f"[bold {colour}]{rate['good']} of {rate['trials']}[/] trials succeeded: {rate['text']}")
    if not told["complete"]:
        say(f"{told['trials']} of {told['asked']} trials are done: go on with --resume")
    if told["kinematic"]:
        say("[yellow]kinematic trials among them: no physics, so they prove nothing[/]")
    if told["gate"] is not None and told["passed"] is not None:
        word = ("kept" if told["passed"] else "missed") + ("" if told["complete"] else " so far")
        of = "" if told["gate_each"] is None else f" of each {told['gate_each']}"
        words = f"asked for at least {100 * told['gate']:g} %{of}: {word}"
        console.print(words, markup=False, highlight=False, soft_wrap=True)
    for name, bands in told["bands"].items():
        if len(bands) == 1:
            continue
        table = Table(Column(Text(name)), "trials", "succeeded", "with bounds at 95 %", box=None)
        for band in bands:
            label = Text(band["label"])
            table.add_row(label, str(band["trials"]), str(band["good"]), band["text"])
        console.print(table, highlight=False)
    for cause in told["causes"]:
        console.print(f"{cause['trials']:4d} × {cause['cause']}", markup=False, highlight=False)
    for trial in told["worst"][:3]:
        if trial["outcome"] != "goal_reached":
            command = repeat_into(trial["command"], trial["index"], out)
            console.print(command, markup=False, highlight=False, soft_wrap=True)
    console.print(f"look at {out / REPORT}", markup=False, highlight=False, soft_wrap=True)
