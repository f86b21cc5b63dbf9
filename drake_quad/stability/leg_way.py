"""How far the robot can be carried aside before a leg that stands is at its limits."""

import numpy as np

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.robot.leg_kinematics import calc_feet, solve_legs
from drake_quad.robot.robot_model import RobotModel, calc_com

STEPS = 6  # of the way that are looked at, and
HALVINGS = 5  # of the step in which a leg comes to its limit


def leg_way(
    robot: RobotModel,
    R_WB: FloatArray,
    q: FloatArray,
    standing: BoolArray,
    ways: FloatArray,
    most: FloatArray,
) -> FloatArray:
    """How far the whole robot's centre of mass can go along unit vectors (m, 2) [m].

    The body keeps its height and orientation, the standing feet their places; the legs are within
    reach and within the joints' limits. Looked for from here outwards, to a small part of `most`.

    Args:
        robot: The robot.
        R_WB: (3, 3).
        q: (4, 3) joint angles now [rad].
        standing: (4,) which feet stand; other legs stay as they are.
        ways: (m, 2) in W.
        most: (m,) how far the body is looked after [m].
    """
    g = robot.geometry
    feet, lower, upper = calc_feet(g, q), robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)
    back = -np.pad(ways, ((0, 0), (0, 1))) @ R_WB  # of the feet in B, as the body goes

    def posed(distance: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Joint angles (..., m, 4, 3), and whether they can be, at distances (..., m)."""
        at = feet + distance[..., None, None] * back[:, None, :]
        found, excess = solve_legs(g, at)
        good = (excess <= 0.0) & np.all((found >= lower) & (found <= upper), axis=-1)
        return np.where(standing[:, None], found, q), np.all(good | ~standing, axis=-1)

    share = np.linspace(0.0, 1.0, STEPS + 1)[1:, None]
    _, good = posed(share * most)
    whole = np.sum(np.cumprod(good, axis=0), axis=0)  # steps before a leg is at its limit
    low = whole / STEPS * most
    high = np.minimum(whole + 1, STEPS) / STEPS * most
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        _, good = posed(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    there, _ = posed(low)
    moved = (calc_com(robot, there) - calc_com(robot, q)) @ R_WB.T
    return np.maximum(low + np.sum(moved[:, :2] * ways, axis=-1), 0.0)
