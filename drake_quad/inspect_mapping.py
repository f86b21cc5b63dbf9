"""Reads what the importer wrote of a robot's own file, beside its normal form."""

import math
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError
from drake_quad.given_files import MOST_YAML, read_given_text
from drake_quad.robot.importing.import_robot import MAPPING
from drake_quad.robot.robot_model import RobotModel
from drake_quad.yaml_text import parse_yaml


def read_mapping(robot: RobotModel) -> dict[str, Any]:
    """What the importer wrote: `trunk`, `joints` and `notes`; nothing of a file never imported.

    Returns:
        `trunk` has `p_TB` (3 numbers, [m]); `joints` by name `sign` (±1) and `turn` [rad]; each of
        `notes` its `kind` and `text`. What the file leaves out is left out.

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
    """Whether these are just so many finite numbers."""
    return (
        isinstance(values, list)
        and len(values) == count
        and all(type(x) in (int, float) and abs(x) <= 1e9 and math.isfinite(x) for x in values)
    )
