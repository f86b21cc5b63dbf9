"""What a robot's own file calls its joints and angles, kept beside its normal form."""

from typing import Any

import numpy as np

from drake_quad.robot.importing.normal_form import NormalRobot
from drake_quad.robot.importing.records import Note


def make_mapping(robot: NormalRobot, notes: list[Note], *, source: str) -> dict[str, Any]:
    """The mapping as plain data: angle in the file = sign * (angle in normal form + turn)."""
    return {
        "source": source,
        "angles": "angle in the file = sign * (angle here + turn) [rad]",
        "trunk": {
            "link": robot.trunk.name,
            "p_TB": [float(x) for x in robot.p_TB],
            "yaw_TB_deg": float(np.rad2deg(robot.yaw)),
        },
        "joints": {
            hinge.name: {
                "leg": leg.short,
                "role": role,
                "sign": int(leg.frames.sign[k]),
                "turn": float(leg.limits.turn[k]),
            }
            for leg in robot.legs
            for k, (hinge, role) in enumerate(
                zip(leg.raw.hinges, ("abduction", "hip", "knee"), strict=True)
            )
        },
        "notes": [{"kind": note.kind, "text": note.text} for note in notes],
    }
