"""What was read from a robot's file, as plain values and tables, and what in it is doubtful."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from drake_quad.errors import InputError
from drake_quad.feasibility.robot_doubts import doubts
from drake_quad.robot.importer.pipeline import MAPPING
from drake_quad.robot.importer.raw_robot import ASSUMED, DOUBTFUL, REPAIRED
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.config import SimulationConfig
from drake_quad.util.files import MOST_YAML, read_given_text
from drake_quad.util.yaml_io import parse_yaml

ROLES = ("abduction", "hip", "knee")

KINDS: dict[tuple[int, ...], str] = {
    (-1, -1, -1, -1): "all knees backward",
    (1, 1, 1, 1): "all knees forward",
    (-1, -1, 1, 1): "X: front knees backward, rear knees forward",
    (1, 1, -1, -1): "O: front knees forward, rear knees backward",
}


def read_mapping(robot: RobotModel) -> dict[str, Any]:
    """What the importer wrote beside the robot: `trunk`, `joints` and `notes`.

    Returns:
        `trunk` has `p_TB` (3 numbers, [m]); `joints` has `sign` (±1) and `turn` [rad] by name; each
        of `notes` has its `kind` and `text`. The mapping is empty for a robot in its normal form.

    Raises:
        InputError: If the file is there and not the importer's.
    """
    path = Path(robot.url).parent / MAPPING
    if "://" in robot.url or not path.is_file():
        return {}

    def refuse(field: str, value: object, remedy: str) -> InputError:
        remedy += (
            "; the importer writes this file beside what it imports: delete it, or that folder"
        )
        return InputError(source=str(path), field=field, value=value, remedy=remedy)

    try:
        text = read_given_text(path, most=MOST_YAML)
    except (OSError, UnicodeDecodeError) as error:
        raise refuse("document", str(path), f"cannot be read: {error}") from None
    mapping = parse_yaml(text, source=str(path), needs="joints: {...}")
    trunk = mapping.get("trunk", {"p_TB": [0.0, 0.0, 0.0]})
    if not isinstance(trunk, dict) or not _numbers(trunk.get("p_TB"), 3):
        raise refuse("trunk", trunk, "must have p_TB, three numbers")
    joints = mapping.get("joints", {})
    if not isinstance(joints, dict):
        raise refuse("joints", joints, "must have a sign and a turn for each joint's name")
    for name, one in joints.items():
        if not isinstance(one, dict) or not _numbers([one.get("sign"), one.get("turn")], 2):
            raise refuse(f"joints.{name}", one, "must have a sign and a turn, numbers")
    notes = mapping.get("notes", [])
    if not isinstance(notes, list) or not all(
        isinstance(note, dict) and all(isinstance(note.get(key), str) for key in ("kind", "text"))
        for note in notes
    ):
        raise refuse("notes", notes, "must be a list of notes, each with a kind and a text")
    return mapping


def _numbers(values: Any, count: int) -> bool:
    """Whether it is a list of `count` finite numbers."""
    return (
        isinstance(values, list)
        and len(values) == count
        and all(type(x) in (int, float) and abs(x) <= 1e9 and math.isfinite(x) for x in values)
    )


def all_doubts(robot: RobotModel) -> list[str]:
    """Lines of `doubts`, and of what the importer found doubtful in the robot's own file."""
    mapping = read_mapping(robot)
    notes = [note for note in mapping.get("notes", []) if note["kind"] == DOUBTFUL]
    found = doubts(robot)
    odd = _odd_axes(robot, mapping.get("joints", {}), found)
    return [*found, *odd, *(note["text"] for note in shared_notes(notes))]


def assumed_of_drives_and_inertias(robot: RobotModel) -> list[dict[str, str]]:
    """Notes of efforts and inertias that the importer assumed or repaired, as `shared_notes`."""
    notes = [
        note
        for note in read_mapping(robot).get("notes", [])
        if note["kind"] in (ASSUMED, REPAIRED)
        and any(word in note["text"].partition(": ")[2] for word in ("effort", "inertia"))
    ]
    return shared_notes(notes)


def shared_notes(notes: list[dict[str, str]]) -> list[dict[str, str]]:
    """Notes of which those that say the same, of joints or links alike, are one."""
    shared: dict[tuple[str, str], list[str]] = {}
    for note in notes:
        subject, separator, text = note["text"].partition(": ")
        shared.setdefault((note["kind"], text if separator else note["text"]), []).append(
            subject if separator else ""
        )
    told = []
    for (kind, text), subjects in shared.items():
        who = ", ".join(s for s in subjects if s)
        told.append({"kind": kind, "text": f"{who + ': ' if who else ''}{text}"})
    return told


def _odd_axes(robot: RobotModel, joints: dict[str, Any], known: list[str]) -> list[str]:
    """Axes that point the other way than those of the three other legs, if not known yet."""
    lines = []
    for role in range(3):
        names = [robot.joint_names[3 * row + role] for row in range(4)]
        signs = [joints.get(name, {}).get("sign", 1) for name in names]
        for name, sign in zip(names, signs, strict=True):
            if signs.count(sign) == 1 and not any(name in line for line in known):
                lines.append(
                    f"{name}: its axis points the other way than those of the three other legs"
                )
    return lines


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
    table.add_row("trunk", Text(trunk))
    table.add_row("reach of a leg", f"{figures['reach']:.3f} m, stretched")
    table.add_row("feet", f"spheres of {1e3 * figures['foot_radius']:.1f} mm")
    table.add_row("contact friction", _friction(figures))
    origin = ", ".join(f"{1e3 * x:.0f}" for x in figures["p_TB"])
    if figures["normal_form"] == "imported":
        table.add_row("B's origin", f"amid the hips, at {origin} mm in the trunk's own frame")
    console.print(table, highlight=False)
    console.print(Text(f"file: {figures['file']} ({figures['normal_form']})"), soft_wrap=True)
    console.print()
    console.print(_legs(figures), highlight=False)
    console.print(_joints(figures), highlight=False)
    _print_notes(figures["notes"], console)
    for doubt in figures["doubts"]:
        console.print(Text.assemble(("\ndoubtful", "bold yellow"), f": {doubt}"), soft_wrap=True)


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
                Text(joint["name"]),
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
        console.print(Text(f"  {note['kind']}: {note['text']}"))
