"""What the importer wrote beside a robot that it brought into normal form: mapping and notes."""

import math
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError
from drake_quad.robot.importer.pipeline import MAPPING
from drake_quad.robot.importer.raw_robot import ASSUMED, REPAIRED
from drake_quad.robot.model import RobotModel
from drake_quad.util.files import MOST_YAML, read_given_text
from drake_quad.util.yaml_io import parse_yaml


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
