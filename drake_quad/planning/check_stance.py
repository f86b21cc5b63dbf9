"""Whether the robot can stand as it is to begin, before anything is planned from there."""

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import LEGS
from drake_quad.planning.motion_plan import Stance, rotations
from drake_quad.robot.leg_kinematics import solve_legs
from drake_quad.robot.robot_model import RobotModel

MISSED = 1e-6  # [m] that counts as reached


def check_stance(robot: RobotModel, stance: Stance) -> None:
    """Checks that every leg reaches its foot's place, within its joints' limits.

    A path planned from a stance that is out of reach has no legs to keep within their limits: what
    its program then says, if it is solved at all, is of no help.

    Raises:
        PlanningError: With the leg and by how much, its data as `check_plan` gives them.
    """
    q, missed = solve_legs(robot.geometry, (stance.feet - stance.body[:3]) @ rotations(stance.body))
    row = int(np.argmax(missed))
    if missed[row] > MISSED:
        raise PlanningError(
            f"leg {LEGS[row].short} misses its place by {missed[row]:.3f} m as the robot stands at "
            "first",
            excess=float(missed[row]),
            leg=row + 1,
            body=stance.body.tolist(),
            foot=stance.feet[row].tolist(),
        )
    over = np.maximum(robot.q_lower - q.ravel(), q.ravel() - robot.q_upper)
    j = int(np.argmax(over))
    if over[j] > 0.0:
        raise PlanningError(
            f"joint {robot.joint_names[j]} would be {over[j]:.3f} rad beyond its limits as the "
            "robot stands at first",
            joint=robot.joint_names[j],
            excess=float(over[j]),
            body=stance.body.tolist(),
            foot=stance.feet[j // 3].tolist(),
        )
