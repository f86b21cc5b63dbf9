"""What was read from a robot's file, as plain values and tables, and what in it is doubtful."""

from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from drake_quad.errors import printable
from drake_quad.robot.doubts import all_doubts
from drake_quad.robot.importer.raw_robot import DOUBTFUL
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.mapping import read_mapping, shared_notes
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.config import SimulationConfig
from drake_quad.util.display import folded

ROLES = ("abduction", "hip", "knee")

KINDS: dict[tuple[int, ...], str] = {
    (-1, -1, -1, -1): "all knees backward",
    (1, 1, 1, 1): "all knees forward",
    (-1, -1, 1, 1): "X: front knees backward, rear knees forward",
    (1, 1, -1, -1): "O: front knees forward, rear knees backward",
}


def describe_robot(robot: RobotModel, *, source: str) -> dict[str, Any]:
    """The robot's figures as plain values, in SI units.

    Args:
        robot: The robot.
        source: Robot name or file, as the person gave it.

    Raises:
        InputError: If what the importer wrote about it is damaged.
    """
    g, mapping = robot.geometry, read_mapping(robot)
    sides = tuple(int(s) for s in g.knee_sign)
    mapped = mapping.get("joints", {})
    legs = {}
    for k, short in enumerate(SHORT_NAMES):
        mine = slice(3 * k, 3 * k + 3)
        legs[short] = {
            "hip": g.p_BH[k].tolist(),
            "offset": float(g.offset[k]),
            "raised": float(g.raised[k]),
            "thigh": float(g.thigh[k]),
            "shank": float(g.shank[k]),
            "knee": "forward" if sides[k] > 0 else "backward",
            "masses": robot.link_mass[k].tolist(),
            "joints": [
                {
                    "name": name,
                    "role": role,
                    "lower": float(low),
                    "upper": float(high),
                    "effort": float(effort),
                    "speed": float(speed),
                    "sign": mapped.get(name, {}).get("sign", 1),
                    "turn": mapped.get(name, {}).get("turn", 0.0),
                }
                for name, role, low, high, effort, speed in zip(
                    robot.joint_names[mine],
                    ROLES,
                    robot.q_lower[mine],
                    robot.q_upper[mine],
                    robot.effort[mine],
                    robot.speed[mine],
                    strict=True,
                )
            ],
        }
    return {
        "robot": source,
        "name": robot.name,
        "file": robot.url,
        "normal_form": "as it is" if not mapping else "imported",
        "trunk": robot.trunk,
        "p_TB": mapping.get("trunk", {}).get("p_TB", [0.0, 0.0, 0.0]),
        "mass": robot.mass,
        "trunk_mass": robot.trunk_mass,
        "trunk_com": robot.trunk_com.tolist(),
        "knees": KINDS.get(sides, "mixed"),
        "reach": float(g.reach.min()),
        "foot_radius": robot.foot_radius,
        "foot_friction": [None if np.isnan(mu) else float(mu) for mu in robot.foot_friction],
        "legs": legs,
        "notes": mapping.get("notes", []),
        "doubts": all_doubts(robot),
    }


def print_robot(figures: dict[str, Any], console: Console) -> None:
    """Prints the figures as tables, and all that differs from the robot's own file.

    Names are printed as `Text`, because rich would take `[/x]` for markup.
    """
    console.print(
        Text.assemble((figures["name"], "bold"), f": {figures['mass']:.2f} kg, {figures['knees']}")
    )
    table = Table(show_header=False, box=None, pad_edge=False)
    com = ", ".join(f"{1e3 * x:.0f}" for x in figures["trunk_com"])
    trunk = f"{figures['trunk']}, {figures['trunk_mass']:.2f} kg, its centre at {com} mm"
    table.add_row("trunk", Text(printable(trunk)))
    table.add_row("reach of a leg", f"{figures['reach']:.3f} m, stretched")
    table.add_row("feet", f"spheres of {1e3 * figures['foot_radius']:.1f} mm")
    table.add_row("contact friction", _friction(figures))
    origin = ", ".join(f"{1e3 * x:.0f}" for x in figures["p_TB"])
    if figures["normal_form"] == "imported":
        table.add_row("B's origin", f"amid the hips, at {origin} mm in the trunk's own frame")
    console.print(folded(table), highlight=False)
    file = printable(f"file: {figures['file']} ({figures['normal_form']})")
    console.print(Text(file), soft_wrap=True)
    console.print()
    console.print(folded(_legs(figures)), highlight=False)
    console.print(folded(_joints(figures)), highlight=False)
    _print_notes(figures["notes"], console)
    for doubt in figures["doubts"]:
        console.print(
            Text.assemble(("\ndoubtful", "bold yellow"), printable(f": {doubt}")),
            soft_wrap=True,
        )


def _friction(figures: dict[str, Any]) -> str:
    """The friction coefficient of feet and ground, in words."""
    stated = {
        short: mu
        for short, mu in zip(SHORT_NAMES, figures["foot_friction"], strict=True)
        if mu is not None
    }
    if not stated:
        return "simulation.friction, for feet and ground"
    feet = ", ".join(f"{short} {mu:.3g}" for short, mu in stated.items())
    default = SimulationConfig().friction
    least = min(2.0 * mu * default / max(mu + default, 1e-12) for mu in stated.values())
    return (
        f"the file states {feet}; with the ground's μ it is 2 × own × μ / (own + μ), "
        f"at simulation.friction {default:g} {least:.3g}"
    )


def _legs(figures: dict[str, Any]) -> Table:
    """The table of lengths and masses."""
    table = Table(box=None, pad_edge=False)
    sizes = ["offset", "thigh", "shank"]
    if any(leg["raised"] for leg in figures["legs"].values()):
        sizes.insert(1, "raised")
    for title in ("leg", "hip x, y, z in mm", *sizes, "knee", "masses in kg"):
        table.add_column(title, justify="left" if title in ("leg", "knee") else "right")
    for short, leg in figures["legs"].items():
        lengths = [f"{1e3 * leg[key]:.1f}" for key in sizes]
        hip = ", ".join(f"{1e3 * x:.1f}" for x in leg["hip"])
        masses = ", ".join(f"{m:.2f}" for m in leg["masses"])
        table.add_row(short, hip, *lengths, leg["knee"], masses)
    return table


def _joints(figures: dict[str, Any]) -> Table:
    """The table of joint limits; those that the file does not give are marked."""
    table = Table(box=None, pad_edge=False, title_justify="left")
    for title in (
        "",
        "joint",
        "limits in deg",
        "effort in Nm",
        "speed in rad/s",
        "angle in the file",
    ):
        table.add_column(
            title, justify="right" if " in " in title and "file" not in title else "left"
        )
    for short, leg in figures["legs"].items():
        for joint in leg["joints"]:
            notes = [
                n["text"] for n in figures["notes"] if n["text"].startswith(joint["name"] + ":")
            ]
            marks = {
                key: "*" if any(word in text for text in notes) else ""
                for key, word in (
                    ("limits", "limits"),
                    ("effort", ": effort"),
                    ("speed", ": speed"),
                )
            }
            low, high = np.rad2deg(joint["lower"]), np.rad2deg(joint["upper"])
            sign, turn = "-" if joint["sign"] < 0 else "", np.rad2deg(joint["turn"])
            table.add_row(
                short,
                Text(printable(joint["name"])),
                f"{low:.0f} to {high:.0f}{marks['limits']}",
                f"{joint['effort']:.3g}{marks['effort']}",
                f"{joint['speed']:.3g}{marks['speed']}",
                f"{sign}q" if abs(turn) < 0.05 else f"{sign}(q {turn:+.1f}°)",
            )
    return table


def _print_notes(notes: list[dict[str, str]], console: Console) -> None:
    """Prints what was repaired, assumed, approximated or dropped; joints alike share a line."""
    notes = [note for note in notes if note["kind"] != DOUBTFUL]  # these are printed apart
    if not notes:
        return
    console.print("\n[bold]differs from the file[/] (* above)", highlight=False)
    for note in shared_notes(notes):
        console.print(Text(printable(f"  {note['kind']}: {note['text']}")))
