"""What of a robot's figures can hardly be meant, though each of them can be read."""

from typing import Any

import numpy as np

from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import LEGS, FloatArray
from drake_quad.inspect_mapping import read_mapping
from drake_quad.robot.importing.records import DOUBTFUL
from drake_quad.robot.robot_model import RobotModel

WEAK = 0.2  # of the weight: knees that hold no more on four stretched legs are a slip of a unit
LIGHTEST = 1e-3  # of the robot: a thigh or a shank that is lighter has lost its mass
UNLIKE = 2.0  # times: a link of one side that is heavier by this than the other side's
SAME = 0.02  # [rad] within which limits of two joints are alike
APART = 0.1  # [rad] from which they are unlike: Spot's own differ by half of that
ROLES = ("abduction", "hip", "knee")
LINKS = ("hip", "thigh", "shank")
SIDES = ((0, 1), (2, 3))  # rows of legs that are each other's mirror


def doubts(robot: RobotModel) -> list[str]:
    """Lines that say what is doubtful, and what may be wrong; none of a robot that is plausible."""
    return [*_weak_knees(robot), *_lost_masses(robot), *_unlike_limits(robot)]


def all_doubts(robot: RobotModel) -> list[str]:
    """The same, and what is doubtful in the robot's own file, as the importer read it."""
    mapping = read_mapping(robot)
    notes = [n["text"] for n in mapping.get("notes", []) if n["kind"] == DOUBTFUL]
    found = doubts(robot)
    return [*found, *_odd_axes(robot, mapping.get("joints", {}), found), *notes]


def _odd_axes(robot: RobotModel, joints: dict[str, Any], told: list[str]) -> list[str]:
    """Axes that point the other way than those of all three other legs; but for what is told."""
    lines = []
    for role in range(3):
        names = [robot.joint_names[3 * row + role] for row in range(4)]
        signs = [joints.get(name, {}).get("sign", 1) for name in names]
        for name, sign in zip(names, signs, strict=True):
            if signs.count(sign) == 1 and not any(name in line for line in told):
                lines.append(
                    f"{name}: its axis points the other way than those of the three other legs"
                )
    return lines


def _weak_knees(robot: RobotModel) -> list[str]:
    """Knees that cannot hold the robot by far."""
    knees = robot.effort.reshape(4, 3)[:, 2]
    held, weight = float(np.sum(knees / robot.geometry.reach)), GRAVITY * robot.mass
    if held >= WEAK * weight:
        return []
    return [
        f"all four knees' efforts, each at the end of its leg, hold {held:.3g} N, and the robot "
        f"weighs {weight:.3g} N: are masses in grams, or efforts not in Nm?"
    ]


def _lost_masses(robot: RobotModel) -> list[str]:
    """Thighs and shanks without mass, and links that are not as heavy as their mirror."""
    lines = []
    mass = robot.link_mass
    lost = mass < LIGHTEST * robot.mass
    lost[:, 0] = False  # of some robots the hip is told with the trunk
    if np.any(lost):
        names = ", ".join(
            f"{LEGS[row].short}'s {LINKS[link]}" for row, link in np.argwhere(lost).tolist()
        )
        lines.append(f"{names}: has hardly any mass; does its link lack <inertial>?")
    for left, right in SIDES:
        for link, name in enumerate(LINKS):
            a, b = float(mass[left, link]), float(mass[right, link])
            if max(a, b) > UNLIKE * min(a, b) and not (lost[left, link] or lost[right, link]):
                lines.append(
                    f"{LEGS[left].short}'s {name} has {a:.3g} kg, {LEGS[right].short}'s "
                    f"{b:.3g} kg: left and right are alike in most robots"
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
        pair = [LEGS[left].short, LEGS[right].short]
        for joints, words in (
            (reversed_, "are each other's reversed: is an axis of one leg the wrong way round?"),
            (unlike, "differ: left and right are alike in most robots"),
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
