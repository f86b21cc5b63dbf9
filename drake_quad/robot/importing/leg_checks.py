"""Refuses legs that the normal form does not have, and notes those that it has nearly."""

import numpy as np

from drake_quad.errors import InputError
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.importing.find_foot import Foot
from drake_quad.robot.importing.find_legs import AXIS_TOLERANCE, between
from drake_quad.robot.importing.leg_frames import LegFrames
from drake_quad.robot.importing.records import APPROXIMATED, Note, RawLeg, RawRobot

APART = 0.5  # of thigh and shank: heights of the hip pitch axis over the abduction axis, at most
THINNEST = 1e-3  # [m] radius of a foot
SQUARE = 1e-3  # [rad] out of square, from which it is worth a note


def heading(lines: list[FloatArray]) -> tuple[float, str]:
    """Forward direction in T from the axes of the first joints (n, 3): its yaw [rad], and a note.

    A robot goes along its abduction axes. Along x it is +x; along y, +y is taken for it.
    """
    if all(between(axis, np.array([1.0, 0.0, 0.0])) <= AXIS_TOLERANCE for axis in lines):
        return 0.0, ""
    return 0.5 * np.pi, "its legs abduct about y, so its front is taken to be along +y"


def corners(hips: FloatArray, raw: RawRobot, source: str) -> list[int]:
    """Which of the legs is FL, FR, RL and RR, by their hips (4, 3) about their centre."""
    found = [(bool(x <= 0.0), bool(y <= 0.0)) for x, y, _ in hips]
    wanted = [(False, False), (False, True), (True, False), (True, True)]
    if sorted(found) != wanted:
        where = {
            leg.hinges[0].name: p.round(3).tolist() for leg, p in zip(raw.legs, hips, strict=True)
        }
        raise InputError(
            source=source,
            field="hips",
            value=where,
            remedy="the hips must be at four corners: front and rear, left and right",
        )
    return [found.index(corner) for corner in wanted]


def check_directions(leg: RawLeg, axes: FloatArray, source: str) -> None:
    """Refuses a leg whose joints do not turn about x and twice across it, as seen from B."""
    x = np.array([1.0, 0.0, 0.0])
    faults = (
        (0, between(axes[0], x), "turns about the robot's forward axis"),
        (1, 0.5 * np.pi - between(axes[0], axes[1]), "turns across the first"),
        (2, between(axes[1], axes[2]), "turns as the second does"),
    )
    for k, angle, rule in faults:
        if angle > AXIS_TOLERANCE:
            raise InputError(
                source=source,
                field=leg.hinges[k].name,
                value=np.round(axes[k], 3).tolist(),
                remedy=f"axis, {np.rad2deg(angle):.0f}° off: joint {k + 1} of a leg {rule}",
            )


def check_names(raw: RawRobot, source: str) -> None:
    """Refuses links and joints whose names no URDF can hold: twice, `world`, or with `::`."""
    links = [raw.trunk.name, *(group.name for leg in raw.legs for group in leg.groups)]
    joints = [hinge.name for leg in raw.legs for hinge in leg.hinges]
    for kind, names in (("link", links), ("joint", joints)):
        for name in names:
            fault = "is the name of more than one" if names.count(name) > 1 else ""
            if (kind, name) == ("link", "world"):
                fault = "is the name of what the robot stands in"
            if "::" in name:
                fault = "holds ::, which stands between names of models"
            if fault:
                remedy = f"{fault}; give each {kind} of the robot a name of its own"
                raise InputError(source=source, field=f"{kind}.name", value=name, remedy=remedy)


def check_foot(leg: RawLeg, foot: Foot, shank: float, source: str, *, said: bool) -> None:
    """Refuses a foot that is no ball at the end of a shank of this length [m].

    Args:
        leg: The leg.
        foot: Its foot.
        shank: The shank's length [m].
        source: What the person gave.
        said: Whether a person said the radius.

    Raises:
        InputError: If it is none.
    """
    if not THINNEST <= foot.radius <= 0.5 * shank:
        raise InputError(
            source=source,
            field="foot_radius" if said else f"{leg.groups[2].name}: radius of its foot",
            value=foot.radius,
            remedy=f"must be from {THINNEST:g} m to half of the shank, {0.5 * shank:.3g} m here",
        )


def check_lengths(leg: RawLeg, frames: LegFrames, notes: list[Note], source: str) -> None:
    """Refuses a leg that the normal form does not have; notes one that it has nearly."""
    first, second, third = (h.name for h in leg.hinges)
    lengths = frames.origin[1, 2] - frames.origin[2, 2], frames.origin[2, 2] - frames.foot[2]
    if min(lengths) < 1e-3:
        raise InputError(
            source=source,
            field=f"{second}, {third}: thigh and shank",
            value=[round(float(x), 4) for x in lengths],
            remedy="both must have a length",
        )
    most = APART * sum(lengths)
    if abs(frames.raised) > most:
        raise InputError(
            source=source,
            field=f"{first}, {second}: height between their axes",
            value=f"{1e3 * frames.raised:.0f} mm",
            remedy=f"at most half of thigh and shank, {1e3 * most:.0f} mm here",
        )
    tilt = np.arccos(np.clip(np.diag(frames.axis[:, [0, 1, 1]]), -1.0, 1.0))
    if tilt.max() > SQUARE:
        name = leg.hinges[int(tilt.argmax())].name
        text = f"{name}: its axis is {np.rad2deg(tilt.max()):.2f}° out of square"
        notes.append(Note(APPROXIMATED, f"{text}; gaits are planned as if it were not"))
