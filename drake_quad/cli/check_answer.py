"""How the answer of `check` is printed."""

import shlex
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

import drake_quad as dq
from drake_quad.errors import printable
from drake_quad.util.display import folded
from drake_quad.util.numbers import whole_millimetres

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
    colour = {"yes": "green", "no": "red"}.get(told["verdict"], "yellow")
    certificate = told.get("certificate")
    failed = certificate is not None and not certificate["certified"]
    if told["feasible"]:
        moving = told["plan"]["balance"] == "dynamic"
        little = moving or told["plan"]["margin"] < told["slacks"]["margin"]["wanted"]
        colour = "yellow" if failed or little else colour
    first, rest = told["answer"].split(": ", 1)
    console.print(
        Text.assemble((printable(first), f"bold {colour}"), printable(f": {rest}")), soft_wrap=True
    )
    if told["feasible"]:
        for line in gait_lines(told):
            console.print(Text(line), soft_wrap=True)
        if certificate is not None and failed:
            where = f"from {certificate['time']:.3f} s on, in '{certificate['segment']}'"
            line = f": {certificate['reason']}, {where}"
            console.print(Text.assemble(("not certified", "bold yellow"), line), soft_wrap=True)
        if certificate is not None and certificate["close"]:
            line = f": {certificate['close']}"
            console.print(Text.assemble(("little room", "bold yellow"), line), soft_wrap=True)
    for doubt in told["doubts"]:
        console.print(
            Text.assemble(("doubtful", "bold yellow"), printable(f": {doubt}")),
            soft_wrap=True,
        )
    for note in told.get("notes", []):
        console.print(
            Text.assemble((note["kind"], "bold"), printable(f": {note['text']}")),
            soft_wrap=True,
        )
    if told["slacks"]:
        console.print()
        console.print(folded(_table(told)), highlight=False)


def print_next(told: dict[str, Any], console: Console) -> None:
    """Prints what would work instead, where it is known, and what to do next."""
    console.print()
    if told["proof"]:
        console.print(Text(f"the proof: {told['proof']} (scripts/check_no.py checks it)"))
    if told["changes"] is not None:
        console.print(folded(_changes_table(told["changes"])), highlight=False)
    if told["sought"]:
        console.print(Text(f"Nearest: {dq.near_words(told)}."), soft_wrap=True)
    if told.get("curve"):
        console.print(folded(_curve_table(told["curve"])), highlight=False)
        console.print(Text(f"look at {told['curve']['directory']}/curve.png"), soft_wrap=True)
    if told.get("picture"):
        console.print(Text(f"picture in {told['picture']}"), soft_wrap=True)
    if told.get("remembered"):
        line = f"(found on {told['remembered']} and remembered; --anew designs the gait anew)"
        console.print(Text(line), soft_wrap=True)
    if told["stopped"]:
        line = "(stopped: the search for a quicker gait had not ended)"
        console.print(Text(line), soft_wrap=True)
    console.print(Text(_next(told)), soft_wrap=True)
    if not told["feasible"] and told["changes"] is None and "scenario" not in told["asked"]:
        line = "for the least change that would make it a yes: the same with --changes"
        console.print(Text(line), soft_wrap=True)
    pace = told["pace"] if told["feasible"] else None
    if pace is not None and pace["flights"] and pace["slow"] is None:
        line = "for a quicker gait that keeps 0.8 of this margin: the same with --prefer balanced"
        console.print(Text(line), soft_wrap=True)


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
        f"It moves one leg at a time, {dq.treads_in_words(gait['treads'], places)} every "
        f"{gait['cycle_lasts']:.2f} s{speed}; on level ground {gait['stride']:.2f} m, "
        f"{gait['speed_level']:.3f} m/s.",
        f"Rear feet follow {dq.treads_in_words(gait['lag'], places)} behind the front "
        f"ones as a cycle begins; left and right feet are {gait['stance_width']:.2f} m apart.",
        f"The body is {gait['body_height']:.2f} m above the treads and {tilt}.",
        *pace_lines(told),
        *certificate_words(told),
        f"The whole course takes {plan['duration']:.0f} s. What comes nearest to the stairs is "
        f"{plan['nearest_part']}, in '{plan['nearest_task']}'.",
    ]


def certificate_words(told: dict[str, Any]) -> list[str]:
    """What is proven of the plan, in plain words; nothing where the proof fails."""
    certificate = told["certificate"]
    if told["plan"]["balance"] == "dynamic":
        static = 1e3 * told["slacks"]["margin"]["on_course"]
        still = "could not stand still at every time" if static < 0.0 else "could stand still"
        return [
            f"It {still}: its static margin goes down to {static:.0f} mm. If a foot is late, or it "
            "is pushed, it may fall. No certificate is for such gaits."
        ]
    if certificate is None or not certificate["certified"]:
        return []
    names = ("margin", "foot_clearance", "shank_clearance")
    margin, feet, shanks = (whole_millimetres(certificate["proven"][name]) for name in names)
    return [
        f"Certified for every time: a static margin of {margin} mm at least, swing feet {feet} mm "
        f"from risers and nosings, knees and shanks {shanks} mm from the course."
    ]


def pace_lines(told: dict[str, Any]) -> list[str]:
    """Speed and time on the flights, and the limit that is nearest, in plain words."""
    pace = told["pace"]
    if pace is None:
        return []
    bound, joint = pace["bound"], pace["joint"]
    least = f"The limit that is nearest is the {bound['words']}"
    if bound["limit"] == "speed":
        least += f" ({joint['speed']:.1f} of {joint['limit']:.1f} rad/s)"
    ways = [
        f"{flight['going']} {flight['time']:.0f} s ({flight['speed']:.3f} m/s)"
        for flight in pace["flights"]
    ]
    took = f"The flights take {', '.join(ways)}. " if ways else ""
    slow = pace["slow"]
    static = " of static margin" if told["plan"]["balance"] == "dynamic" else ""
    if slow is not None:
        least += (
            f". The gait found for margin alone keeps {1e3 * slow['margin']:.0f} mm{static} at "
            f"{slow['speed']:.3f} m/s"
        )
    return [f"{took}{least}."]


def _table(told: dict[str, Any]) -> Table:
    """What is left of every limit, and what would be enough."""
    table = Table(box=None, pad_edge=False)
    table.add_column("what is left")
    for title in ("on endless stairs", "aimed at", "on this course"):
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


def _curve_table(curve: dict[str, Any]) -> Table:
    """Speed against margin, from slow to quick."""
    table = Table(box=None, pad_edge=False)
    for title in ("scenario", "speed", "the flight takes", "static margin", "zero-moment point's",
                  "joint speed, of its limit"):  # fmt: skip
        table.add_column(title, justify="left" if title == "scenario" else "right")
    for k, point in enumerate(curve["points"], start=1):
        table.add_row(
            f"point_{k}.yaml",
            f"{point['speed']:.3f} m/s",
            f"{point['time']:.0f} s",
            f"{1e3 * point['margin']:.0f} mm",
            f"{1e3 * point['zmp_margin']:.0f} mm",
            f"{point['joint_share']:.0%}",
        )
    return table


# How a figure of a change is printed, by its unit.
DIGITS = {"m": ".3f", "deg": ".0f", "Nm": ".1f", "kg": ".1f"}


def _changes_table(changes: list[dict[str, Any]]) -> Table:
    """The changes that would make it a yes, the least first."""
    table = Table(box=None, pad_edge=False)
    table.add_column("what would make it a yes, each alone")
    for title in ("now", "then", "change", "static margin"):
        table.add_column(title, justify="right")
    for change in changes:
        digits, unit, after = DIGITS[change["unit"]], change["unit"], change["after"]
        row = (change["words"], f"{change['before']:{digits}} {unit}")
        if after is None:
            table.add_row(*row, f"no plan up to {change['tried']:{digits}} {unit}", "", "")
        else:
            share, margin = f"{100 * change['share']:+.0f} %", f"{1e3 * change['margin']:.0f} mm"
            table.add_row(*row, f"{after:{digits}} {unit}", share, margin)
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
                f" --{name.replace('_', '-')} {told['asked'][name]}"
                for name in ("overhang", "width", "landing", "turn", "margin")
                if name in told["asked"]
            )
            + (" --open" if told["asked"].get("open") else "")
        )
    return f"now: drake-quad chart {robot}"
