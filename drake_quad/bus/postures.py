"""Postures between sitting and standing, there and back, and what a robot may be told."""

from dataclasses import replace

import numpy as np

from drake_quad.bus.drive_limits import SafetyLimits
from drake_quad.common import FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.errors import InputError
from drake_quad.planning.motion_plan import Stance, pose_robot
from drake_quad.robot.kinematics import calc_feet
from drake_quad.robot.model import RobotModel

COUNT = 41
SIT_SHARE = 0.3  # of the height to stand at: lower than this legs need not fold
INSIDE = 0.02  # [rad] that postures keep to the joints' limits


def lowest_stance(robot: RobotModel, stance: Stance) -> Stance:
    """The same stance with the trunk as low as the joints allow over feet that stay where they are.

    Raises:
        InputError: The robot cannot stand so at all.
    """
    heights = np.linspace(stance.body[2], SIT_SHARE * stance.body[2], 60)
    bodies = np.tile(stance.body, (len(heights), 1))
    bodies[:, 2] = heights
    q, excess, _ = pose_robot(robot, bodies, np.tile(stance.feet, (len(heights), 1, 1)))
    q = q.reshape(-1, 12)
    inside = (q >= robot.q_lower + INSIDE) & (q <= robot.q_upper - INSIDE)
    fits = (excess.max(axis=1) < 1e-6) & inside.all(axis=1)
    if not fits[0]:
        raise InputError(
            source=robot.name, field="gait.body_height", value=float(stance.body[2]),
            remedy="the legs cannot stand so",
        )  # fmt: skip
    last = len(heights) if fits.all() else int(np.argmin(fits))
    return replace(stance, body=bodies[last - 1])


def sit_to_stand(robot: RobotModel, stance: Stance) -> FloatArray:
    """Joint angles (COUNT, 12) from the lowest stance up to `stance`, feet where they are [rad]."""
    bodies = np.tile(stance.body, (COUNT, 1))
    bodies[:, 2] = np.linspace(lowest_stance(robot, stance).body[2], stance.body[2], COUNT)
    q, _, _ = pose_robot(robot, bodies, np.tile(stance.feet, (COUNT, 1, 1)))
    return q.reshape(COUNT, 12)


def lower(robot: RobotModel, q: FloatArray, up: FloatArray) -> FloatArray:
    """Joint angles from as low as the joints allow up to `q`, the feet staying where they are.

    A walk ends with its feet where the gait has them, or a robot stops on stairs: to go back to
    where they stood before the walk would drag them over the ground.

    Args:
        robot: The robot.
        q: Joint angles as it stands (12,) [rad].
        up: Which way is up, in B (3,).

    Returns:
        Joint angles (COUNT, 12), the last of them `q` [rad].
    """
    up = up / np.linalg.norm(up)
    feet = calc_feet(robot.geometry, q.reshape(4, 3))
    height = -float(np.mean(feet @ up))
    down = np.linspace(0.0, max(1.0 - SIT_SHARE, 0.0) * max(height, 0.0), 60)
    nearer = feet + down[:, None, None] * up
    found, excess, _ = pose_robot(robot, np.zeros((len(down), 5)), nearer)
    found = found.reshape(-1, 12)
    inside = (found >= robot.q_lower + INSIDE) & (found <= robot.q_upper - INSIDE)
    fits = (excess.max(axis=1) < 1e-6) & inside.all(axis=1)
    fits[0] = True  # there it stands
    deepest = down[len(down) - 1 if fits.all() else int(np.argmin(fits)) - 1]
    nearer = feet + np.linspace(deepest, 0.0, COUNT)[:, None, None] * up
    found, _, _ = pose_robot(robot, np.zeros((COUNT, 5)), nearer)
    postures: FloatArray = found.reshape(COUNT, 12)
    postures[-1] = q
    return postures


def safety_limits(robot: RobotModel, control: ControlSettings) -> SafetyLimits:
    """What the drives of `robot` may be told under a controller with these settings."""
    return SafetyLimits(
        q_lower=robot.q_lower,
        q_upper=robot.q_upper,
        speed=robot.speed,
        effort=robot.effort,
        stiffness=control.kp,
        damping=control.kd,
        period=control.period,
    )
