"""A quadruped in normal form: what is written to a URDF."""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.robot.importer.legs import (
    Foot,
    LegFrames,
    check_directions,
    check_foot,
    check_lengths,
    check_names,
    corners,
    find_foot,
    heading,
    straighten,
)
from drake_quad.robot.importer.limits import JointLimits, limit_leg
from drake_quad.robot.importer.overrides import Overrides
from drake_quad.robot.importer.raw_robot import (
    ASSUMED,
    GeometryInstance,
    Note,
    RawLeg,
    RawRobot,
    RigidGroup,
    RigidMass,
)
from drake_quad.robot.legs import SHORT_NAMES


@dataclass(frozen=True)
class NormalLink:
    """A link; its frame is parallel to B and at its joint.

    Attributes:
        name: The moving link's name in the file.
        rigid: In its frame.
        collision: Shapes, poses in its frame.
        visual: Likewise.
        shapeless: Whether a collision mesh of it is missing.
        end: Where the next joint, or the foot, is, (3,) [m]; of the trunk the left front hip.
    """

    name: str
    rigid: RigidMass
    collision: tuple[GeometryInstance, ...]
    visual: tuple[GeometryInstance, ...]
    shapeless: bool
    end: FloatArray


@dataclass(frozen=True)
class NormalLeg:
    """A leg.

    Attributes:
        short: FL, FR, RL or RR.
        raw: As in the file.
        frames: How it hangs, in axes parallel to B's about the trunk's own origin.
        limits: Of its joints.
        links: Hip, thigh, shank.
        foot: In B.
    """

    short: str
    raw: RawLeg
    frames: LegFrames
    limits: JointLimits
    links: tuple[NormalLink, NormalLink, NormalLink]
    foot: Foot


@dataclass(frozen=True)
class NormalRobot:
    """A quadruped.

    Attributes:
        name: The robot's.
        trunk: With B as its frame.
        legs: FL, FR, RL, RR.
        centre: The hips' centroid in the frame of the legs' figures, (3,) [m].
        p_TB: B's origin, the centroid of the four hips, in the file's trunk frame, (3,) [m].
        yaw: B's heading in the file's trunk frame [rad].
        mass: Of all [kg].
        notes: All that is not as in the file.
    """

    name: str
    trunk: NormalLink
    legs: tuple[NormalLeg, ...]
    centre: FloatArray
    p_TB: FloatArray
    yaw: float
    mass: float
    notes: tuple[Note, ...]


def normalise(raw: RawRobot, overrides: Overrides, *, source: str) -> NormalRobot:
    """Brings a quadruped into normal form.

    Raises:
        InputError: If a leg is none of the normal form, or the hips are not at four corners.
    """
    notes: list[Note] = []
    check_names(raw, source)
    yaw, said = heading([leg.hinges[0].axis for leg in raw.legs])
    if overrides.forward_deg is not None:
        yaw = float(np.deg2rad(overrides.forward_deg))
    elif said:
        notes.append(Note(ASSUMED, said))
    X_BT = RigidTransform(RotationMatrix.MakeZRotation(-yaw), np.zeros(3))
    groups = [raw.trunk, *(g for leg in raw.legs for g in leg.groups)]
    mass = sum(g.rigid.mass for g in groups)
    drafts = []
    for leg in raw.legs:
        axes = np.array([X_BT.rotation() @ h.axis for h in leg.hinges])
        points = np.array([X_BT @ h.point for h in leg.hinges])
        check_directions(leg, axes, source)
        foot = find_foot(leg.groups[2], leg.hinges[2].point, radius=overrides.foot_radius)
        frames = straighten(axes, points, X_BT @ foot.centre)
        check_lengths(leg, frames, notes, source)
        shank = float(frames.origin[2, 2] - frames.foot[2])
        check_foot(leg, foot, shank, source, said=overrides.foot_radius is not None)
        drafts.append((leg, frames, foot))
    hips = np.array([frames.origin[0] for _, frames, _ in drafts])
    centre = np.round(hips.mean(axis=0), 12)
    order = corners(hips - centre, raw, source)
    # From T to B: turned about the trunk's origin, then moved to the hips' centre.
    X_BT = RigidTransform(X_BT.rotation(), -centre)
    legs = []
    for short, row in zip(SHORT_NAMES, order, strict=True):
        leg, frames, foot = drafts[row]
        limits = limit_leg(
            leg.hinges,
            sign=frames.sign,
            turn=frames.turn,
            reference=raw.reference,
            weight=mass * GRAVITY,
            reach=float(np.linalg.norm(frames.foot - frames.origin[1])),
            knee=overrides.knee_side(short),
        )
        names = [h.name for h in leg.hinges]
        limits = overrides.applied(limits, short=short, names=names)
        notes += [*limits.notes, *([foot.note] if foot.note else [])]
        links = _links(leg, frames, X_BT)
        legs.append(NormalLeg(short, leg, frames, limits, links, foot))
    trunk = _link(raw.trunk, X_BT, np.round(legs[0].frames.origin[0] - centre, 12))
    p_TB = X_BT.inverse().translation()
    return NormalRobot(
        raw.name, trunk, tuple(legs), centre, np.array(p_TB), yaw, float(mass), tuple(notes)
    )


def _links(
    leg: RawLeg, frames: LegFrames, X_BT: RigidTransform
) -> tuple[NormalLink, NormalLink, NormalLink]:
    """Hip, thigh and shank, straightened, each in its own frame."""
    turned = RigidTransform(X_BT.rotation(), np.zeros(3))  # `frames` is about T's origin
    ends = [*frames.origin[1:], frames.foot]
    made = [
        _link(group, RigidTransform(-origin) @ X @ turned, np.round(end - origin, 12))
        for group, X, origin, end in zip(leg.groups, frames.X, frames.origin, ends, strict=True)
    ]
    return made[0], made[1], made[2]


def _link(group: RigidGroup, X: RigidTransform, end: FloatArray) -> NormalLink:
    """A group told in a frame L, where `X` is X_LT."""
    return NormalLink(
        name=group.name,
        rigid=group.rigid.moved(X),
        collision=tuple(piece.moved(X) for piece in group.collision),
        visual=tuple(piece.moved(X) for piece in group.visual),
        shapeless=group.shapeless,
        end=end,
    )
