"""Limits of a leg's joints in normal form, and what is taken where a file gives none."""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.robot.importer.raw_robot import ASSUMED, REPAIRED, Note, RevoluteJoint

ABDUCTION, HIP = 0.8, 2.6  # [rad] either way, where the file gives no limit
KNEE_LEAST, KNEE_MOST = 0.05, 2.7  # [rad] bent, where the file gives no limit
SPEED = 10.0  # [rad/s]
EFFORT_SHARE = 0.4  # of the robot's weight times the leg's length
TOO_STRONG = 2.5  # times weight and length: no drive, but a file's way to say nothing
TOO_FAST = 100.0  # [rad/s], likewise
# [rad] Limits from one to two turns wide, and huge ones, are a file's way to say nothing; those
# between are a mistake, and most likely in degrees.
TWO_TURNS, HUGE = 13.0, 1500.0
ONE_SIDED = 0.35  # a knee whose shorter side is less than this of the longer bends one way
LONGER = 0.8  # and one whose shorter side is less than this of the longer, rather that way


@dataclass(frozen=True)
class JointLimits:
    """Of a leg's three joints in normal form.

    Attributes:
        lower: (3,) [rad].
        upper: (3,) [rad].
        effort: (3,) [Nm].
        speed: (3,) [rad/s].
        turn: As in LegFrames, with whole turns added so that the limits are about zero, (3,).
        notes: What was repaired or assumed.
    """

    lower: FloatArray
    upper: FloatArray
    effort: FloatArray
    speed: FloatArray
    turn: FloatArray
    notes: tuple[Note, ...]


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
        hinges: As in the file.
        sign: See LegFrames, (3,).
        turn: See LegFrames, (3,) [rad].
        reference: Angles of a standing pose, in the file's terms.
        weight: The robot's [N].
        reach: The leg's length when straight [m].
        knee: -1 or +1 if a person has said to which side the knee points, else 0.
    """
    lower, upper, turns, notes = np.zeros(3), np.zeros(3), np.array(turn), []
    for k, hinge in enumerate(hinges):
        ends = sorted((sign[k] * hinge.lower - turn[k], sign[k] * hinge.upper - turn[k]))
        given = np.all(np.isfinite(ends)) and 1e-6 < ends[1] - ends[0] < 2.0 * np.pi
        if given:
            shift = 2.0 * np.pi * np.round(0.5 * (ends[0] + ends[1]) / (2.0 * np.pi))
            turns[k] += shift
            lower[k], upper[k] = ends[0] - shift, ends[1] - shift
        elif k < 2:
            most = (ABDUCTION, HIP)[k]
            lower[k], upper[k] = -most, most
            notes.append(Note(ASSUMED, f"{hinge.name}: {_without(hinge)}; ±{most:g} rad"))
        if k == 2:
            bends = _knee(
                hinge, lower[k], upper[k], bool(given), sign[k], turns[k], reference, knee
            )
            lower[k], upper[k] = bends[0], bends[1]
            notes += bends[2]
    effort, speed = np.array([h.effort for h in hinges]), np.array([h.speed for h in hinges])
    for k, hinge in enumerate(hinges):
        if not 0.0 < effort[k] <= TOO_STRONG * weight * reach:
            told = "none" if not np.isfinite(effort[k]) else f"{effort[k]:g} Nm"
            effort[k] = EFFORT_SHARE * weight * reach
            rule = f"{effort[k]:.3g} Nm, {EFFORT_SHARE:g} of the weight times the leg's length"
            notes.append(Note(ASSUMED, f"{hinge.name}: effort {told} in the file; {rule}"))
        if not 0.0 < speed[k] <= TOO_FAST:
            told = "none" if not np.isfinite(speed[k]) else f"{speed[k]:g} rad/s"
            speed[k] = SPEED
            notes.append(Note(ASSUMED, f"{hinge.name}: speed {told} in the file; {SPEED:g} rad/s"))
    return JointLimits(lower, upper, effort, speed, turns, tuple(notes))


def _knee(
    hinge: RevoluteJoint,
    lower: float,
    upper: float,
    given: bool,
    sign: float,
    turn: float,
    reference: dict[str, float],
    wanted: float,
) -> tuple[float, float, list[Note]]:
    """The limits of a knee, which bends one way only, and what is to be said of them."""
    sides = sorted((abs(lower), abs(upper)))
    one_way = given and (lower * upper >= 0.0 or sides[0] < ONE_SIDED * sides[1])
    if one_way and wanted in (0.0, np.sign(lower + upper)):
        return lower, upper, []
    pose = reference.get(hinge.name)
    standing = 0.0 if pose is None else _wrapped(sign * pose - turn)
    zero = _wrapped(-turn)
    if wanted != 0.0:
        side, why = wanted, "as asked for"
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
    told = "limits to both sides" if given else _without(hinge)
    way = "forward" if side > 0.0 else "backward"
    text = f"{hinge.name}: {told}; points {way} {why}, bent by {KNEE_LEAST:g} to {most:.3g} rad"
    ends = sorted((side * KNEE_LEAST, side * most))
    return ends[0], ends[1], [Note(REPAIRED if given else ASSUMED, text)]


def _without(hinge: RevoluteJoint) -> str:
    """What is said of limits that count as none: that there are none, or what they are and why."""
    if not TWO_TURNS < hinge.upper - hinge.lower < HUGE:
        return "no limits"
    return (
        f"limits {hinge.lower:g} to {hinge.upper:g} rad in the file, wider than a turn, count as "
        "none (in degrees? a URDF has radians)"
    )


def _wrapped(angle: float) -> float:
    """The angle in [-π, π)."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)
