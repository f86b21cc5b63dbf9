"""What a plan asks of the drives: the joints' torques of a robot that stands still in its poses."""

import numpy as np

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.motion_plan import PlanSamples, rotations
from drake_quad.robot.robot_model import RobotModel
from drake_quad.stability.torque import leg_limits

GRAVITY = 9.81


def share_weight(weight: float, feet: FloatArray, com: FloatArray, who: BoolArray) -> FloatArray:
    """Vertical forces on the feet (N, 4) that hold the robot still [N].

    Three feet have but one choice. Of four feet's the least in the sum of squares is taken, as the
    controllers' `planning.force_distribution` does; a foot does not pull: what it would have to
    pull is left out.

    Args:
        weight: Of the robot [N].
        feet: (N, 4, 2) in W [m].
        com: (N, 2) the centre of mass in W [m].
        who: (N, 4) which feet stand; three at least.
    """
    arms = np.where(who[..., None], feet - com[:, None], 0.0)
    rows = np.stack([who.astype(float), arms[..., 0], arms[..., 1]], axis=1)  # (N, 3, 4)
    wanted = np.array([weight, 0.0, 0.0])
    return np.where(who, np.maximum(np.linalg.pinv(rows) @ wanted, 0.0), 0.0)


def standing_torques(robot: RobotModel, samples: PlanSamples) -> FloatArray:
    """Torques of the joints (N, 4, 3) that hold the robot still in the poses of a plan [Nm].

    Legs' own weight and the standing feet's vertical forces; what moving takes is not in it.

    Args:
        robot: The robot.
        samples: The plan at N times.
    """
    weight = GRAVITY * robot.mass
    force = share_weight(weight, samples.feet[..., :2], samples.com[:, :2], samples.standing)
    limits = leg_limits(robot, rotations(samples.body[:, 0]), samples.q)
    hold = 0.5 * weight * (limits.lower + limits.upper)  # see `leg_limits`
    return np.asarray(hold - limits.rows[..., 2] * force[..., None])


def torque_ratio(robot: RobotModel, samples: PlanSamples) -> FloatArray:
    """The greatest of these over their limits, sample by sample (N,)."""
    ratio = np.abs(standing_torques(robot, samples)) / robot.effort.reshape(4, 3)
    return np.asarray(ratio.max(axis=(1, 2)))
