"""What `drake-quad inspect` tells of a robot: figures as plain values, and as tables."""

from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from drake_quad.gait.legs import SHORT_NAMES
from drake_quad.inspect_doubts import all_doubts
from drake_quad.inspect_mapping import read_mapping
from drake_quad.robot.importing.records import DOUBTFUL
from drake_quad.robot.robot_model import RobotModel
from drake_quad.scenario_config import SimulationConfig

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
        robot: As loaded.
        source: What the person gave for it.

    Raises:
        InputError: If what the importer wrote of it is spoilt.
    """
    g, mapping = robot.geometry, read_mapping(robot)
    sides = tuple(int(s) for s in g.knee_sign)
    told = mapping.get("joints", {})
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
                    "sign": told.get(name, {}).get("sign", 1),
                    "turn": told.get(name, {}).get("turn", 0.0),
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


def print_robot(told: dict[str, Any], console: Console) -> None:
    """Prints the figures as tables, and all that is not as in the robot's own file.

    Names are printed as they are: rich would take `[/x]` for its own.
    """
    console.print(
        Text.assemble((told["name"], "bold"), f": {told['mass']:.2f} kg, {told['knees']}")
    )
    table = Table(show_header=False, box=None, pad_edge=False)
    com = ", ".join(f"{1e3 * x:.0f}" for x in told["trunk_com"])
    trunk = f"{told['trunk']}, {told['trunk_mass']:.2f} kg, its centre at {com} mm"
    table.add_row("trunk", Text(trunk))
    table.add_row("reach of a leg", f"{told['reach']:.3f} m, stretched")
    table.add_row("feet", f"spheres of {1e3 * told['foot_radius']:.1f} mm")
    table.add_row("contact friction", _friction(told))
    origin = ", ".join(f"{1e3 * x:.0f}" for x in told["p_TB"])
    if told["normal_form"] == "imported":
        table.add_row("B's origin", f"amid the hips, at {origin} mm in the trunk's own frame")
    console.print(table, highlight=False)
    console.print(Text(f"file: {told['file']} ({told['normal_form']})"), soft_wrap=True)
    console.print()
    console.print(_legs(told), highlight=False)
    console.print(_joints(told), highlight=False)
    _print_notes(told["notes"], console)
    for doubt in told["doubts"]:
        console.print(Text.assemble(("\ndoubtful", "bold yellow"), f": {doubt}"), soft_wrap=True)


def _friction(told: dict[str, Any]) -> str:
    """Which coefficient feet and ground have."""
    said = {
        short: mu
        for short, mu in zip(SHORT_NAMES, told["foot_friction"], strict=True)
        if mu is not None
    }
    if not said:
        return "simulation.friction, for feet and ground"
    feet = ", ".join(f"{short} {mu:.3g}" for short, mu in said.items())
    default = SimulationConfig().friction
    least = min(2.0 * mu * default / max(mu + default, 1e-12) for mu in said.values())
    return (
        f"the file states {feet}; with the ground's μ it is 2 × own × μ / (own + μ), "
        f"at simulation.friction {default:g} {least:.3g}"
    )


def _legs(told: dict[str, Any]) -> Table:
    """Lengths and masses."""
    table = Table(box=None, pad_edge=False)
    sizes = ["offset", "thigh", "shank"]
    if any(leg["raised"] for leg in told["legs"].values()):
        sizes.insert(1, "raised")
    for title in ("leg", "hip x, y, z in mm", *sizes, "knee", "masses in kg"):
        table.add_column(title, justify="left" if title in ("leg", "knee") else "right")
    for short, leg in told["legs"].items():
        lengths = [f"{1e3 * leg[key]:.1f}" for key in sizes]
        hip = ", ".join(f"{1e3 * x:.1f}" for x in leg["hip"])
        masses = ", ".join(f"{m:.2f}" for m in leg["masses"])
        table.add_row(short, hip, *lengths, leg["knee"], masses)
    return table


def _joints(told: dict[str, Any]) -> Table:
    """Limits; those that the file does not give are marked."""
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
    for short, leg in told["legs"].items():
        for joint in leg["joints"]:
            notes = [n["text"] for n in told["notes"] if n["text"].startswith(joint["name"] + ":")]
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
                Text(joint["name"]),
                f"{low:.0f} to {high:.0f}{marks['limits']}",
                f"{joint['effort']:.3g}{marks['effort']}",
                f"{joint['speed']:.3g}{marks['speed']}",
                f"{sign}q" if abs(turn) < 0.05 else f"{sign}(q {turn:+.1f}°)",
            )
    return table


def _print_notes(notes: list[dict[str, str]], console: Console) -> None:
    """What was repaired, assumed, approximated and dropped; the same of several joints as one."""
    notes = [note for note in notes if note["kind"] != DOUBTFUL]  # these are told by themselves
    if not notes:
        return
    console.print("\n[bold]not as in the file[/] (* above)", highlight=False)
    told: dict[tuple[str, str], list[str]] = {}
    for note in notes:
        subject, separator, text = note["text"].partition(": ")
        told.setdefault((note["kind"], text if separator else note["text"]), []).append(
            subject if separator else ""
        )
    for (kind, text), subjects in told.items():
        who = ", ".join(s for s in subjects if s)
        console.print(Text(f"  {kind}: {who + ': ' if who else ''}{text}"))
