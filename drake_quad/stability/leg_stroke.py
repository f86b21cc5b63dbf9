"""How far the legs let the centre of mass be carried before one is at its limit."""

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.jit import jit
from drake_quad.robot.kinematics import (
    FOLDED,
    calc_feet,
    constants,
    leg_moment,
    leg_row,
    solve_leg_and_distance,
)
from drake_quad.robot.model import RobotModel

STEPS = 6  # of the way that are looked at, and
HALVINGS = 5  # of the step in which a leg comes to its limit


def leg_stroke_left(
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
        R_WB: (3, 3) orientation of B.
        q: (4, 3) joint angles now [rad].
        standing: (4,) which feet stand; other legs stay as they are.
        ways: (m, 2) unit vectors in W.
        most: (m,) greatest distances that are tried [m].
    """
    legs, trunk = constants(robot)
    feet = calc_feet(robot.geometry, q)
    limits = np.stack([robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)])
    return np.asarray(
        _strokes(legs, float(trunk[4]), limits, np.array(R_WB), np.array(q), feet,
                 np.array(standing, dtype=np.bool_), np.array(ways), np.array(most))
    )  # fmt: skip


@jit
def _strokes(
    legs: FloatArray,
    mass: float,
    limits: FloatArray,
    R_WB: FloatArray,
    q: FloatArray,
    feet: FloatArray,
    standing: BoolArray,
    ways: FloatArray,
    most: FloatArray,
) -> FloatArray:
    """`leg_stroke_left`, with the legs' constants, joints' limits (2, 4, 3) and feet in B."""
    strokes, there = np.empty(len(ways)), np.empty((4, 3))
    for i in range(len(ways)):
        x, y = ways[i, 0], ways[i, 1]
        # The way of the standing feet in B, as the body goes.
        back = (
            -(R_WB[0, 0] * x + R_WB[1, 0] * y),
            -(R_WB[0, 1] * x + R_WB[1, 1] * y),
            -(R_WB[0, 2] * x + R_WB[1, 2] * y),
        )
        low, high = 0.0, most[i]
        for step in range(1, STEPS + 1):
            distance = step / STEPS * most[i]
            if not _can_go(legs, limits, feet, standing, back, distance, there):
                high = distance
                break
            low = distance
        for _ in range(HALVINGS if high > low else 0):
            middle = 0.5 * (low + high)
            if _can_go(legs, limits, feet, standing, back, middle, there):
                low = middle
            else:
                high = middle
        _can_go(legs, limits, feet, standing, back, low, there)
        # The moment of the masses that the legs leave behind, along the way.
        moved = 0.0
        for k in range(4):
            if standing[k]:
                after = leg_moment(legs, k, (there[k, 0], there[k, 1], there[k, 2]))
                before = leg_moment(legs, k, (q[k, 0], q[k, 1], q[k, 2]))
                for j in range(3):
                    moved -= (after[j] - before[j]) * back[j]
        strokes[i] = max(low + moved / mass, 0.0)
    return strokes


@jit
def _can_go(
    legs: FloatArray,
    limits: FloatArray,
    feet: FloatArray,
    standing: BoolArray,
    back: tuple[float, float, float],
    distance: float,
    there: FloatArray,
) -> bool:
    """Whether all standing legs can be so far back, and into `there` (4, 3) how they are then."""
    good = True
    for k in range(4):
        if not standing[k]:
            continue
        angles, span, reach = solve_leg_and_distance(
            leg_row(legs, k),
            feet[k, 0] + distance * back[0],
            feet[k, 1] + distance * back[1],
            feet[k, 2] + distance * back[2],
        )
        good = good and abs(span - reach) <= 2.0 * FOLDED
        for j in range(3):
            there[k, j] = angles[j]
            good = good and limits[0, k, j] <= angles[j] <= limits[1, k, j]
    return good
