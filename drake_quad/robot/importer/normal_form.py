"""A quadruped in normal form: what is written to a URDF."""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.robot.importer.feet import Foot, find_foot
from drake_quad.robot.importer.leg_frames import (
    LegFrames,
    check_directions,
    check_foot,
    check_lengths,
    check_names,
    corners,
    heading,
    straighten,
)
from drake_quad.robot.importer.overrides import Overrides
from drake_quad.robot.importer.raw_robot import (
    ASSUMED,
    DOUBTFUL,
    REPAIRED,
    GeometryInstance,
    JointLimits,
    Note,
    RawLeg,
    RawRobot,
    RevoluteJoint,
    RigidGroup,
    RigidMass,
)
from drake_quad.robot.legs import SHORT_NAMES

ABDUCTION, HIP = 0.8, 2.6  # [rad] either way, where the file gives no limit
KNEE_LEAST, KNEE_MOST = 0.05, 2.7  # [rad] bent, where the file gives no limit
SPEED = 10.0  # [rad/s]
EFFORT_SHARE = 0.4  # of the robot's weight times the leg's length
TOO_STRONG = 2.5  # times weight and length: no drive, but a file's way to say nothing
# And so many times: no such way, but another unit. Solo12's file says nothing with 127 times.
OTHER_UNIT = 200.0
TOO_FAST = 100.0  # [rad/s], likewise
# [rad] Limits from one to two turns wide, and huge ones, are a file's way to say nothing; those
# between are a mistake, and most likely in degrees.
TWO_TURNS, HUGE = 13.0, 1500.0
ONE_SIDED = 0.35  # a knee whose shorter side is less than this of the longer bends one way
LONGER = 0.8  # and one whose shorter side is less than this of the longer, rather that way


@dataclass(frozen=True)
class NormalLink:
    """A link; its frame is parallel to B and at its joint.

    Attributes:
        name: The moving link's name in the file.
        rigid: Mass properties in the link's frame.
        collision: Collision shapes, poses in the link's frame.
        visual: Visual shapes, poses in the link's frame.
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
        raw: The leg as in the file.
        frames: How it hangs, in axes parallel to B's about the trunk's own origin.
        limits: Limits of the leg's joints.
        links: The leg's hip, thigh and shank.
        foot: The leg's foot, in B.
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
        name: The robot's name.
        trunk: The trunk, with B as its frame.
        legs: The legs FL, FR, RL, RR.
        centre: The hips' centroid in the frame of the legs' figures, (3,) [m].
        p_TB: B's origin, the centroid of the four hips, in the file's trunk frame, (3,) [m].
        yaw: B's heading in the file's trunk frame [rad].
        mass: The whole robot's mass [kg].
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
    yaw, assumption = heading([leg.hinges[0].axis for leg in raw.legs])
    if overrides.forward_deg is not None:
        yaw = float(np.deg2rad(overrides.forward_deg))
    elif assumption:
        notes.append(Note(ASSUMED, assumption))
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
        check_foot(leg, foot, shank, source, overridden=overrides.foot_radius is not None)
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
    """A group in the coordinates of a frame L, where `X` is X_LT."""
    return NormalLink(
        name=group.name,
        rigid=group.rigid.moved(X),
        collision=tuple(piece.moved(X) for piece in group.collision),
        visual=tuple(piece.moved(X) for piece in group.visual),
        shapeless=group.shapeless,
        end=end,
    )


def limit_leg(
    hinges: tuple[RevoluteJoint, RevoluteJoint, RevoluteJoint],
    *,
    sign: FloatArray,
    turn: FloatArray,
    reference: dict[str, float],
    weight: float,
    reach: float,
    knee: float = 0.0,
) -> JointLimits:
    """The limits of one leg.

    Args:
        hinges: The leg's joints as in the file.
        sign: Signs of the joints' angles, (3,), see LegFrames.
        turn: Offsets of the joints' angles, (3,) [rad], see LegFrames.
        reference: Angles of a standing pose, in the file's terms.
        weight: The robot's weight [N].
        reach: The leg's length when straight [m].
        knee: -1 or +1 if the overrides give the side to which the knee points, else 0.
    """
    lower, upper, turns, notes = np.zeros(3), np.zeros(3), np.array(turn), []
    for k, hinge in enumerate(hinges):
        ends = sorted((sign[k] * hinge.lower - turn[k], sign[k] * hinge.upper - turn[k]))
        given = np.all(np.isfinite(ends)) and 1e-6 < ends[1] - ends[0] < 2.0 * np.pi
        if given:
            shift = 2.0 * np.pi * np.round(0.5 * (ends[0] + ends[1]) / (2.0 * np.pi))
            turns[k] += shift
            lower[k], upper[k] = ends[0] - shift, ends[1] - shift
            if beyond_turns(hinge.lower, hinge.upper):
                text = f"{_limits_in_file(hinge)}, more than a turn from zero {IN_DEGREES}"
                notes.append(Note(DOUBTFUL, f"{hinge.name}: {text}"))
        elif k < 2:
            most = (ABDUCTION, HIP)[k]
            lower[k], upper[k] = -most, most
            text = f"{hinge.name}: {_without(hinge)}; ±{most:g} rad"
            notes.append(Note(_kind_without(hinge), text))
        if k == 2:
            limits = (float(lower[k]), float(upper[k])) if given else None
            pose = reference.get(hinge.name)
            standing = 0.0 if pose is None else _wrapped(sign[k] * pose - turns[k])
            zero = _wrapped(-turns[k])
            (lower[k], upper[k]), knee_notes = _knee(hinge, limits, standing, zero, side=knee)
            notes += knee_notes
    effort, speed = np.array([h.effort for h in hinges]), np.array([h.speed for h in hinges])
    for k, hinge in enumerate(hinges):
        if not 0.0 < effort[k] <= TOO_STRONG * weight * reach:
            given = "none" if not np.isfinite(effort[k]) else f"{effort[k]:g} Nm"
            absurd = OTHER_UNIT * weight * reach < effort[k] < np.inf
            effort[k] = EFFORT_SHARE * weight * reach
            rule = f"{effort[k]:.3g} Nm, {EFFORT_SHARE:g} of the weight times the leg's length"
            kind = ASSUMED
            if absurd:
                kind, given = DOUBTFUL, f"{given} (is it in Nm? no drive has so much)"
                rule = f"assumed are {rule}"
            notes.append(Note(kind, f"{hinge.name}: effort {given} in the file; {rule}"))
        if not 0.0 < speed[k] <= TOO_FAST:
            given = "none" if not np.isfinite(speed[k]) else f"{speed[k]:g} rad/s"
            speed[k] = SPEED
            notes.append(Note(ASSUMED, f"{hinge.name}: speed {given} in the file; {SPEED:g} rad/s"))
    return JointLimits(lower, upper, effort, speed, turns, tuple(notes))


def _knee(
    hinge: RevoluteJoint,
    given: tuple[float, float] | None,
    standing: float,
    zero: float,
    *,
    side: float,
) -> tuple[tuple[float, float], list[Note]]:
    """The limits of a knee, which bends one way only, and notes of what was repaired or assumed.

    Args:
        hinge: The knee's joint.
        given: Limits in normal form [rad], if the file has any.
        standing: Angle in the file's standing pose [rad]; 0 if there is none.
        zero: Angle at the file's zero [rad].
        side: -1 or +1 if the overrides give the side to which the knee points, else 0.
    """
    lower, upper = given or (0.0, 0.0)
    sides = sorted((abs(lower), abs(upper)))
    one_way = lower * upper >= 0.0 or sides[0] < ONE_SIDED * sides[1]
    if given and one_way and side in (0.0, np.sign(lower + upper)):
        return given, []
    if side != 0.0:
        why = "as asked for"
    elif abs(standing) > 0.1:
        side, why = float(np.sign(standing)), "as in the file's standing pose"
    elif given and sides[0] < LONGER * sides[1]:
        side, why = float(np.sign(lower + upper)), "where its limits reach farther"
    elif abs(zero) > 0.1:
        side, why = float(np.sign(zero)), "as at the file's zero"
    else:
        side, why = -1.0, "for want of anything that says otherwise"
    most = KNEE_MOST if not given else min(KNEE_MOST, upper if side > 0.0 else -lower)
    if most <= KNEE_LEAST:
        most = KNEE_MOST
    found = "limits to both sides" if given else _without(hinge)
    way = "forward" if side > 0.0 else "backward"
    text = f"{hinge.name}: {found}; points {way} {why}, bent by {KNEE_LEAST:g} to {most:.3g} rad"
    ends = sorted((side * KNEE_LEAST, side * most))
    return (ends[0], ends[1]), [Note(REPAIRED if given else _kind_without(hinge), text)]


def beyond_turns(lower: float, upper: float) -> bool:
    """Whether limits [rad] are farther from zero than a turn, and do not say that there are none.

    Huge ones do, and up to two turns to either side: ANYmal B's and Solo12's files have such.
    """
    most = max(abs(lower), abs(upper))
    none = not upper - lower < HUGE or (lower == -upper and most <= 4.0 * np.pi)
    return bool(most > 2.0 * np.pi and not none)


IN_DEGREES = "(in degrees? a URDF has radians)"


def _without(hinge: RevoluteJoint) -> str:
    """Words for limits that count as none: that there are none, or what they are and why."""
    wide = TWO_TURNS < hinge.upper - hinge.lower < HUGE
    if not wide and not beyond_turns(hinge.lower, hinge.upper):
        return "no limits"
    return f"{_limits_in_file(hinge)}, wider than a turn, count as none {IN_DEGREES}"


def _limits_in_file(hinge: RevoluteJoint) -> str:
    return f"limits {hinge.lower:g} to {hinge.upper:g} rad in the file"


def _kind_without(hinge: RevoluteJoint) -> str:
    """Kind of the note of limits that count as none."""
    return DOUBTFUL if beyond_turns(hinge.lower, hinge.upper) else ASSUMED


def _wrapped(angle: float) -> float:
    """The angle in [-π, π)."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)
