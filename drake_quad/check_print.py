"""Prints what `drake-quad check` found: answer, gait in plain words, what is left, what next."""

import shlex
from fractions import Fraction
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from drake_quad.check_report import near_words

# What is left, in people's words, and its unit.
WORDS = {
    "reach": ("legs, from stretched or folded", "m"),
    "joints": ("joints, to their limits", "rad"),
    "torque": ("torque, of its limit", "%"),
    "margin": ("static margin", "m"),
    "legs": ("knees and shanks, to the stairs", "m"),
    "apart": ("front and rear legs, apart", "m"),
    "trunk": ("trunk, to the stairs", "m"),
}

LEVEL_DEG = 0.05  # of pitch, below which a body is called level


def print_check(told: dict[str, Any], console: Console) -> None:
    """Prints the answer, the gait, and what is left of each limit."""
    colour = "green" if told["feasible"] else "red"
    if told["feasible"] and told["plan"]["margin"] < told["slacks"]["margin"]["wanted"]:
        colour = "yellow"
    first, rest = told["answer"].split(": ", 1)
    console.print(Text.assemble((first, f"bold {colour}"), f": {rest}"), soft_wrap=True)
    if told["feasible"]:
        for line in gait_lines(told):
            console.print(Text(line), soft_wrap=True)
    for doubt in told["doubts"]:
        console.print(Text.assemble(("doubtful", "bold yellow"), f": {doubt}"), soft_wrap=True)
    if told["slacks"]:
        console.print()
        console.print(_table(told), highlight=False)


def print_next(told: dict[str, Any], console: Console) -> None:
    """Prints what would work instead, where it is known, and what to do next."""
    console.print()
    if told["sought"]:
        console.print(Text(f"Nearest: {near_words(told)}."), soft_wrap=True)
    if told.get("picture"):
        console.print(Text(f"picture in {told['picture']}"), soft_wrap=True)
    console.print(Text(_next(told)), soft_wrap=True)


def gait_lines(told: dict[str, Any]) -> list[str]:
    """The gait in plain words."""
    gait, plan = told["gait"], told["plan"]
    places = gait["places_per_tread"]
    stairs = gait["speed_stairs"]
    speed = "" if stairs is None else f", {stairs:.3f} m/s along the stairs"
    up, down = gait["pitch_up_deg"], gait["pitch_down_deg"]
    level = max(up, down) < LEVEL_DEG
    tilt = "level" if level else f"pitched by up to {up:.1f}° nose up and {down:.1f}° nose down"
    return [
        f"It moves one leg at a time, {_treads(gait['treads'], places)} every "
        f"{gait['cycle_lasts']:.2f} s{speed}; on level ground {gait['stride']:.2f} m, "
        f"{gait['speed_level']:.3f} m/s.",
        f"Rear feet follow {_treads(gait['lag'], places)} behind the front "
        f"ones as a cycle begins; left and right feet are {gait['stance_width']:.2f} m apart.",
        f"The body is {gait['body_height']:.2f} m above the treads and {tilt}.",
        f"The whole course takes {plan['duration']:.0f} s. What comes nearest to the stairs is "
        f"{plan['nearest_part']}, in '{plan['nearest_task']}'.",
    ]


def _treads(count: int, places: int) -> str:
    """So many places to step on, of which a tread has `places`, in treads."""
    share = Fraction(count, places)
    parts = {Fraction(1, 2): "half a tread", Fraction(1, 3): "a third of a tread",
             Fraction(2, 3): "two thirds of a tread", Fraction(1): "1 tread"}  # fmt: skip
    return parts.get(share, f"{float(share):.3g} treads")


def _table(told: dict[str, Any]) -> Table:
    """What is left of every limit, and what would be enough."""
    table = Table(box=None, pad_edge=False)
    table.add_column("what is left")
    for title in ("on endless stairs", "wanted", "on this course"):
        table.add_column(title, justify="right")
    for name, row in told["slacks"].items():
        words, unit = WORDS[name]

        def text(value: float | None, unit: str = unit) -> str:
            if value is None:
                return "-"
            return f"{100 * value:.0f} %" if unit == "%" else f"{value:.3f} {unit}"

        colour = "red" if row["left"] < 0 else "yellow" if row["left"] < row["wanted"] else ""
        left = text(row["left"])
        table.add_row(
            words,
            f"[{colour}]{left}[/]" if colour else left,
            text(row["wanted"]),
            text(row["on_course"]),
        )
    return table


def _next(told: dict[str, Any]) -> str:
    """What to run next."""
    robot = shlex.quote(told["robot"])
    if told["feasible"]:
        if told.get("saved"):
            return f"now: drake-quad run {shlex.quote(told['saved'])}"
        return "now: the same with --save FILE, then drake-quad run FILE"
    near = told["nearest"]
    if near is not None:
        return (
            f"now: drake-quad check {robot} --rise {near['rise']:g} --run {near['run']:g}"
            f" --count {told['asked']['count']}"
            + "".join(
                f" --{name} {told['asked'][name]}"
                for name in ("width", "landing", "turn", "margin")
                if name in told["asked"]
            )
        )
    return f"now: drake-quad chart {robot}"
