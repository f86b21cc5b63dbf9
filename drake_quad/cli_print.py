"""What is printed of a run, and of a plan."""

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from drake_quad.errors import printable


def print_summary(summary: dict[str, Any], directory: Path, *, report: bool) -> None:
    """Prints how a run ended, and its figures."""
    console = Console()
    good = summary.get("outcome") == "goal_reached"
    lines = summary_lines(summary)
    if good and (summary.get("time_under_three_feet") or 0.0) > 0.0:
        console.print("[yellow]not statically stable throughout: see the figures[/]")
    outcome = (printable(str(summary.get("outcome"))), f"bold {'green' if good else 'red'}")
    console.print(Text.assemble(outcome, f": {printable(str(summary.get('reason')))}"))
    if line := safety_line(summary):
        console.print(Text(line, "green" if line.startswith("safe") else "yellow"), soft_wrap=True)
    table = Table(show_header=False, box=None, pad_edge=False)
    for label, text in lines:
        table.add_row(Text(label), Text(text))
    console.print(table)
    if summary.get("assumes"):
        console.print(Text(f"these figures assume {summary['assumes']}"), soft_wrap=True)
    console.print(Text(f"files in {directory}"))
    if report:
        console.print(Text(f"look at {directory / 'report.html'}"))


def safety_line(summary: dict[str, Any]) -> str:
    """The verdict of safety beside the outcome; empty of a run of before there was one."""
    from drake_quad.stability.safety import (
        judge_safety,  # with numpy, which --help need not wait for
    )

    told = summary.get("safety")
    wanted = told.get("margin_wanted") if isinstance(told, dict) else None
    return judge_safety(summary, wanted).words if isinstance(wanted, int | float) else ""


def summary_lines(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """The few figures that are printed after a run, each with its unit."""
    margin = summary["margin"] if isinstance(summary.get("margin"), dict) else {}

    def text(value: float | None, form: str) -> str:
        # A margin of a rounding error below zero is no negative one.
        return "-" if value is None else form.format(round(value, 6) + 0.0)

    planned = summary["margin_planned"] if isinstance(summary.get("margin_planned"), dict) else {}
    seen = "replayed" if summary.get("simulation") == "kinematic" else "measured"
    kind = summary.get("margin_kind", "hull")
    zmp = (summary.get("zmp_margin") or {}).get("minimum")
    pressure = [] if zmp is None else [("the same of the zero-moment point", text(zmp, "{:.3f} m"))]
    names = (
        [] if kind == "hull" else [(seen, f"margin_{kind}"), ("planned", f"margin_{kind}_planned")]
    )
    beyond = [
        (
            f"smallest {kind} margin {word}",
            text((summary.get(name) or {}).get("minimum"), "{:.3f} m"),
        )
        for word, name in names
    ]
    return [
        (f"smallest margin {seen}", text(margin.get("minimum"), "{:.3f} m")),
        *pressure,
        (
            "smallest margin planned",
            text(planned.get("minimum"), "{:.3f} m"),
        ),
        *beyond,
        ("time on fewer than three feet", text(summary.get("time_under_three_feet"), "{:.3f} s")),
        ("base off its plan by at most", text(summary.get("base_error_max"), "{:.3f} m")),
        ("a standing foot slipped at most", text(summary.get("slip_max"), "{:.4f} m")),
        ("contact friction", text(summary.get("contact_friction"), "{:.3g}")),
        ("contacts of anything but feet", _touched(summary)),
        ("largest torque, of its limit", text(summary.get("torque_ratio_max"), "{:.0%}")),
        ("the same, planned", text(summary.get("torque_ratio_planned_max"), "{:.0%}")),
        ("simulated", text(summary.get("simulated_time"), "{:.1f} s")),
        ("pace", text(summary.get("real_time_factor"), "{:.1f} × real time")),
    ]


def _metres(value: float) -> str:
    """A length to the millimetre [m], without a minus before a zero."""
    return f"{round(value, 3) + 0.0:.3f}"


def _touched(summary: dict[str, Any]) -> str:
    """In how many samples anything but a foot touched, and how deep the worst went in, if known."""
    count = summary.get("nonfoot_contact_samples")
    if count is None:
        return "-"
    worst = (summary.get("overlaps") or [None])[0]
    if not worst:
        return str(count)
    return (
        f"{count} samples, the deepest {1e3 * worst['depth']:.1f} mm: {worst['part']} in "
        f"{worst['inside']} at {worst['time']:.2f} s"
    )


def print_plan(result: dict[str, Any]) -> None:
    """Prints a plan's segments and what it comes to."""
    kind = result["margin_kind"]
    beyond = [] if kind == "hull" else [f"margin_{kind}_min"]
    titles = ["smallest margin [m]", *(f"{kind} [m]" for _ in beyond)]
    heads = ("segment", "kind", "from [s]", "to [s]", *titles, "steps")
    # As text: rich would take [s] for a style.
    table = Table(*(Column(Text(head)) for head in heads), box=None)
    for s in result["segments"]:
        steps = "-".join(str(step["leg"]) for step in s.get("steps", []))
        found = [s[key] for key in ("margin_min", *beyond)]
        margins = ["-" if m is None else _metres(m) for m in found]
        times = [f"{s['start']:.1f}", f"{s['end']:.1f}"]
        table.add_row(Text(s["name"]), s["kind"], *times, *margins, steps)
    console = Console()
    console.print(table)
    least = f", {kind} {_metres(result[f'planned_margin_{kind}_min'])} m" if beyond else ""
    torque = result["torque_ratio_planned_max"]
    strong = "" if torque <= 1.0 else f", if a joint gives {torque:.0%} of its torque,"
    console.print(
        f"feasible{strong}: {result['duration']:.1f} s, smallest margin "
        f"{_metres(result['planned_margin_min'])} m{least}, "
        f"planned in {result['planning_time']:.2f} s",
        highlight=False,
    )
