"""Turns legs into normal form, and refuses those that have none.

In normal form a leg hangs straight down: its hip joint turns about x, hip pitch and knee about y,
and hip, knee and foot are in one plane across y. The axes stay where they are on the robot; the
points on them that are called hip, thigh and knee are chosen so that offsets along an axis vanish
or add up: the hip at the x of the hip pitch axis, thigh and knee in the foot's plane.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.robot.importer.feet import Foot
from drake_quad.robot.importer.find_legs import AXIS_TOLERANCE, between
from drake_quad.robot.importer.raw_robot import APPROXIMATED, Note, RawLeg, RawRobot

APART = 0.5  # of thigh and shank: heights of the hip pitch axis over the abduction axis, at most
THINNEST = 1e-3  # [m] radius of a foot
SQUARE = 1e-3  # [rad] out of square, from which a note is made


@dataclass(frozen=True)
class LegFrames:
    """One leg in normal form; its coordinates are in B (whose axes are forward, left, up).

    Attributes:
        sign: +1 or -1 of each joint: angle in the file = sign * (angle here + turn), (3,).
        turn: Offsets of the angles, (3,) [rad], see `sign`.
        axis: Axis of each joint as it turns here, (3, 3), a row a joint; x, y, y or very nearly.
        origin: Hip, thigh and knee, (3, 3) [m].
        foot: The foot's centre, (3,) [m].
        X: What moves each of the three links from the file's zero to this one, in B.
    """

    sign: FloatArray
    turn: FloatArray
    axis: FloatArray
    origin: FloatArray
    foot: FloatArray
    X: tuple[RigidTransform, RigidTransform, RigidTransform]

    @property
    def raised(self) -> float:
        """How far the hip pitch axis passes above the hip's [m]."""
        return float(self.origin[1, 2] - self.origin[0, 2])


def straighten(axes: FloatArray, points: FloatArray, foot: FloatArray) -> LegFrames:
    """Turns a leg's joints until it hangs straight down.

    Args:
        axes: Unit vectors of abduction, hip pitch and knee at the file's zero, (3, 3) in B.
        points: A point of each axis, (3, 3) in B [m].
        foot: The foot's centre, (3,) in B [m].
    """
    sign = np.ones(3)
    sign[0] = 1.0 if axes[0, 0] > 0.0 else -1.0
    a = axes * sign[:, None]
    turn = np.zeros(3)
    # The hip pitch axis into the horizontal, by the shorter way.
    turn[0] = -np.arctan2(a[1, 2], a[1, 1])
    turn[0] = (turn[0] + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    hip_X = about(a[0], points[0], turn[0])
    a[1:] = (hip_X.rotation().matrix() @ a[1:].T).T
    p = np.array([points[0], hip_X @ points[1], hip_X @ points[2]])
    foot = hip_X @ foot
    for k in (1, 2):
        sign[k] = 1.0 if a[k, 1] > 0.0 else -1.0
        a[k] *= sign[k]
    thigh = along(a[1], p[1], 1, foot[1])
    # The knee below the thigh, then the foot below the knee.
    turn[1] = hang(along(a[2], p[2], 1, foot[1]) - thigh)
    thigh_X = about(a[1], thigh, turn[1])
    a[2] = thigh_X.rotation() @ a[2]
    foot = thigh_X @ foot
    knee = along(a[2], thigh_X @ p[2], 1, foot[1])
    turn[2] = hang(foot - knee)
    knee_X = about(a[2], knee, turn[2])
    return LegFrames(
        sign=sign,
        turn=turn,
        axis=a,
        origin=np.array([along(a[0], p[0], 0, thigh[0]), thigh, knee]),
        foot=knee_X @ foot,
        X=(hip_X, thigh_X @ hip_X, knee_X @ thigh_X @ hip_X),
    )


def hang(v: FloatArray) -> float:
    """The turn about +y that brings `v` (3,) to -z [rad], in (-π, π]."""
    # A turn by b takes (x, z) to (x cos b + z sin b, z cos b - x sin b).
    return float(np.arctan2(v[0], -v[2]))


def along(axis: FloatArray, point: FloatArray, coordinate: int, value: float) -> FloatArray:
    """The point of a line at which one coordinate has a value, (3,)."""
    return np.asarray(point + (value - point[coordinate]) / axis[coordinate] * axis)


def about(axis: FloatArray, point: FloatArray, angle: float) -> RigidTransform:
    """The turn by `angle` about the line through `point`."""
    from scipy.spatial.transform import Rotation  # a third of a second: see mesh_files

    R = RotationMatrix(Rotation.from_rotvec(angle * axis).as_matrix())
    return RigidTransform(R, point - R @ point)


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


def check_foot(leg: RawLeg, foot: Foot, shank: float, source: str, *, overridden: bool) -> None:
    """Refuses a foot that is no ball at the end of a shank of this length [m].

    Args:
        leg: The leg.
        foot: The leg's foot.
        shank: The shank's length [m].
        source: What the person gave.
        overridden: Whether the radius is from the robot's overrides.

    Raises:
        InputError: If it is none.
    """
    if not THINNEST <= foot.radius <= 0.5 * shank:
        raise InputError(
            source=source,
            field="foot_radius" if overridden else f"{leg.groups[2].name}: radius of its foot",
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
