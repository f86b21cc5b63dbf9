"""What of a robot's figures can hardly be meant, though each of them can be read."""

import numpy as np

from drake_quad.gait.gravity import GRAVITY
from drake_quad.robot.robot_model import RobotModel

WEAK = 0.2  # of the weight: knees that hold no more on four stretched legs are a slip of a unit


def doubts(robot: RobotModel) -> list[str]:
    """Lines that say what is doubtful, and what may be wrong; none of a robot that can stand."""
    knees = robot.effort.reshape(4, 3)[:, 2]
    held, weight = float(np.sum(knees / robot.geometry.reach)), GRAVITY * robot.mass
    if held >= WEAK * weight:
        return []
    return [
        f"all four knees' efforts, each at the end of its leg, hold {held:.3g} N, and the robot "
        f"weighs {weight:.3g} N: are masses in grams, or efforts not in Nm?"
    ]
