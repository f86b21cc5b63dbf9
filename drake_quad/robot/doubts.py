"""What in a robot is doubtful and may be wrong in its file: each in one plain line."""

from typing import Any

import numpy as np

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.robot.importer.raw_robot import DOUBTFUL
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.mapping import read_mapping, shared_notes
from drake_quad.robot.mass_doubts import ALIKE, SIDES, doubts_about_masses
from drake_quad.robot.model import RobotModel

WEAK = 0.2  # share of the weight: knees that hold less on stretched legs have a wrong unit
SAME = 0.02  # [rad] difference up to which limits of two joints are alike
APART = 0.1  # [rad] difference from which on they are unlike: Spot's differ by half of that
LENGTHS = 0.02  # share by which lengths of left and right may differ; those of known robots agree
FEET = 0.25  # share of the thicker foot by which the other may be thinner: HyQReal1's are by 0.11
DRIVES = 0.05  # share by which efforts and speeds of left and right may differ


def all_doubts(robot: RobotModel) -> list[str]:
    """Lines of `doubts`, and of what the importer found doubtful in the robot's own file."""
    mapping = read_mapping(robot)
    notes = [note for note in mapping.get("notes", []) if note["kind"] == DOUBTFUL]
    found = doubts(robot)
    odd = _odd_axes(robot, mapping.get("joints", {}), found)
    return [*found, *odd, *(note["text"] for note in shared_notes(notes))]


def doubts(robot: RobotModel) -> list[str]:
    """Lines that say what is doubtful and may be wrong; none for a plausible robot."""
    return [
        *_weak_knees(robot),
        *doubts_about_masses(robot),
        *_unlike_lengths(robot),
        *_unlike_drives(robot),
        *_unlike_limits(robot),
    ]


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


def _weak_knees(robot: RobotModel) -> list[str]:
    """Knees that are far from being able to hold the robot."""
    knees = robot.effort.reshape(4, 3)[:, 2]
    held, weight = float(np.sum(knees / robot.geometry.reach)), GRAVITY * robot.mass
    if held >= WEAK * weight:
        return []
    return [
        f"all four knees' efforts, each at the end of its leg, hold {held:.3g} N, and the robot "
        f"weighs {weight:.3g} N: are masses in grams, or efforts not in Nm?"
    ]


def _unlike_lengths(robot: RobotModel) -> list[str]:
    """Lengths of legs, and feet, that are not their mirror's."""
    g = robot.geometry
    # Of a smaller foot the model's shank ends nearer to the knee: here it is the file's own.
    own = g.shank + robot.foot_smaller
    sizes = (
        ("length", "thigh", 1, g.thigh, LENGTHS),
        ("length", "shank", 2, own, LENGTHS),
        ("radius", "foot", 2, robot.foot_radius - robot.foot_smaller, FEET),
    )
    lines = []
    for left, right in SIDES:
        for size, part, joint, values, most in sizes:
            a, b = float(values[left]), float(values[right])
            if abs(a - b) > most * max(a, b):
                names = robot.joint_names[3 * left + joint], robot.joint_names[3 * right + joint]
                lines.append(
                    f"the {size} of {SHORT_NAMES[left]}'s {part} (at {names[0]}) is {a:.3g} m, "
                    f"that of {SHORT_NAMES[right]}'s (at {names[1]}) {b:.3g} m: {ALIKE}"
                )
    return lines


def _unlike_drives(robot: RobotModel) -> list[str]:
    """Joints whose efforts or speeds are not their mirror's."""
    lines = []
    for what, unit, values in (("effort", "Nm", robot.effort), ("speed", "rad/s", robot.speed)):
        for left, right in SIDES:
            for joint in range(3):
                first, second = 3 * left + joint, 3 * right + joint
                a, b = float(values[first]), float(values[second])
                if abs(a - b) > DRIVES * max(a, b):
                    names = robot.joint_names[first], robot.joint_names[second]
                    lines.append(
                        f"{names[0]} has {what} {a:.3g} {unit}, {names[1]} {b:.3g} {unit}: {ALIKE}"
                    )
    return lines


def _unlike_limits(robot: RobotModel) -> list[str]:
    """Joints whose limits are not their mirror's, and whether a reversed axis would explain it."""
    lower, upper = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)
    lines = []
    for left, right in SIDES:
        unlike: list[int] = []
        reversed_: list[int] = []
        for joint in range(3):
            own = np.array([lower[left, joint], upper[left, joint]])
            other = np.array([lower[right, joint], upper[right, joint]])
            other = _reversed(other) if joint == 0 else other  # abduction is outwards on both sides
            if np.max(np.abs(own - other)) <= SAME:
                continue
            if np.max(np.abs(_reversed(own) - other)) <= SAME:
                reversed_.append(joint)
            elif np.max(np.abs(own - other)) > APART:
                unlike.append(joint)
        pair = [SHORT_NAMES[left], SHORT_NAMES[right]]
        for joints, words in (
            (reversed_, "are each other's reversed: is an axis of one leg the wrong way round?"),
            (unlike, f"differ: {ALIKE}"),
        ):
            if joints:
                names = [
                    " and ".join(robot.joint_names[3 * row + joint] for row in (left, right))
                    for joint in joints
                ]
                lines.append(f"{' to '.join(pair)}: limits of {', of '.join(names)} {words}")
    return lines


def _reversed(limits: FloatArray) -> FloatArray:
    """Limits (2,) about the axis the other way round."""
    return -limits[::-1]
