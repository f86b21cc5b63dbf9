"""What a plan asks of the drives: the joints' torques of a robot that stands still in its poses."""

import numpy as np

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.force_distribution import distribute
from drake_quad.planning.motion_plan import PlanSamples, rotations
from drake_quad.robot.robot_model import RobotModel
from drake_quad.stability.torque import leg_limits

GRAVITY = 9.81


def share_weight(weight: float, feet: FloatArray, com: FloatArray, who: BoolArray) -> FloatArray:
    """Forces on the feet (N, 4, 3) in W that hold the robot still, as the controllers share them.

    Args:
        weight: Of the robot [N].
        feet: (N, 4, 3) in W [m].
        com: (N, 3) the centre of mass in W [m].
        who: (N, 4) which feet stand; three at least.
    """
    up, still = (0.0, 0.0, weight), (0.0, 0.0, 0.0)
    arms, load = (feet - com[:, None]).tolist(), who.astype(float).tolist()
    return np.array([distribute(up, still, *pose) for pose in zip(arms, load, strict=True)])


def standing_torques(robot: RobotModel, samples: PlanSamples) -> FloatArray:
    """Torques of the joints (N, 4, 3) that hold the robot still in the poses of a plan [Nm].

    Legs' own weight and the standing feet's forces; what moving takes is not in it.

    Args:
        robot: The robot.
        samples: The plan at N times.
    """
    weight = GRAVITY * robot.mass
    force = share_weight(weight, samples.feet, samples.com, samples.standing)
    limits = leg_limits(robot, rotations(samples.body[:, 0]), samples.q)
    hold = 0.5 * weight * (limits.lower + limits.upper)  # see `leg_limits`
    return np.asarray(hold - (limits.rows @ force[..., None])[..., 0])


def torque_ratio(robot: RobotModel, samples: PlanSamples) -> FloatArray:
    """The greatest of these over their limits, sample by sample (N,)."""
    ratio = np.abs(standing_torques(robot, samples)) / robot.effort.reshape(4, 3)
    return np.asarray(ratio.max(axis=(1, 2)))
