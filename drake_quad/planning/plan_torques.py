"""What a plan asks of the drives: the joints' torques of a robot that stands still in its poses."""

from collections.abc import Callable

import daqp
import numpy as np

from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.force_distribution import distribute
from drake_quad.planning.motion_plan import PlanSamples, rotations
from drake_quad.robot.robot_model import RobotModel
from drake_quad.stability.torque import leg_limits

FRICTION = 0.5
SIDEWAYS = FRICTION / np.sqrt(2.0)  # along each axis: a pyramid within the cone
NONE = 1e30  # DAQP's bound that is none
EQUAL = 5  # its mark of an equation
SOLVED = (1, 2)  # its exit flags
# Of each foot's force, what slips one way: (16, 12) rows that are to be no more than 0.
PYRAMIDS = np.kron(
    np.eye(4), [[1, 0, -SIDEWAYS], [-1, 0, -SIDEWAYS], [0, 1, -SIDEWAYS], [0, -1, -SIDEWAYS]]
)
RIDGE = 1e-9  # for three feet in a line
Share = Callable[[float, FloatArray, FloatArray, BoolArray], FloatArray]


def share_weight(weight: float, feet: FloatArray, com: FloatArray, who: BoolArray) -> FloatArray:
    """Forces on the feet (N, 4, 3) in W that hold the robot still, as `IkController` shares them.

    Args:
        weight: Of the robot [N].
        feet: (N, 4, 3) in W [m].
        com: (N, 3) the centre of mass in W [m].
        who: (N, 4) which feet stand; three at least.
    """
    up, still = (0.0, 0.0, weight), (0.0, 0.0, 0.0)
    arms, load = (feet - com[:, None]).tolist(), who.astype(float).tolist()
    return np.array([distribute(up, still, *pose) for pose in zip(arms, load, strict=True)])


def least_forces(weight: float, feet: FloatArray, com: FloatArray, who: BoolArray) -> FloatArray:
    """The same as `WholeBodyController` shares them: the sum of all forces squared is least.

    Feet that stand at different heights then push against each other, within friction. Where none
    hold the robot so they are `share_weight`'s.
    """
    arms = feet - com[:, None]
    grasp = np.zeros((len(feet), 6, 4, 3))  # of forces, the wrench about the centre of mass
    grasp[:, :3] = np.eye(3)[:, None, :]
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    grasp[:, 3, :, 1], grasp[:, 3, :, 2] = -z, y
    grasp[:, 4, :, 0], grasp[:, 4, :, 2] = z, -x
    grasp[:, 5, :, 0], grasp[:, 5, :, 1] = -y, x
    flat = (grasp * who[:, None, :, None]).reshape(-1, 6, 12)
    square = flat @ flat.transpose(0, 2, 1) + RIDGE * np.eye(6)
    wanted = weight * np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    force = (flat.transpose(0, 2, 1) @ np.linalg.solve(square, wanted[:, None])).reshape(-1, 4, 3)
    sideways = np.abs(force[..., :2]).max(axis=-1)
    slips = np.any(sideways > SIDEWAYS * force[..., 2] + RIDGE * weight, axis=1)
    for n in np.flatnonzero(slips):
        within = _least_within(flat[n], wanted, weight)
        if within is None:
            within = share_weight(weight, feet[n : n + 1], com[n : n + 1], who[n : n + 1])[0]
        force[n] = within
    return force


SHARES: dict[str, Share] = {"ik": share_weight, "whole_body": least_forces}  # by controller.kind


def _least_within(grasp: FloatArray, wanted: FloatArray, weight: float) -> FloatArray | None:
    """The least forces (4, 3) that make up a wrench (6,) and do not slip; None if none do."""
    rows = np.concatenate([grasp, PYRAMIDS])
    upper = np.concatenate([np.full(12, NONE), wanted / weight, np.zeros(16)])
    lower = np.concatenate([np.full(12, -NONE), wanted / weight, np.full(16, -NONE)])
    sense = np.concatenate([np.zeros(12), np.full(6, EQUAL), np.zeros(16)]).astype(np.int32)
    force, _, status, _ = daqp.solve(np.eye(12), np.zeros(12), rows, upper, lower, sense)
    return weight * np.asarray(force).reshape(4, 3) if status in SOLVED else None


def standing_torques(
    robot: RobotModel, samples: PlanSamples, share: Share = least_forces
) -> FloatArray:
    """Torques of the joints (N, 4, 3) that hold the robot still in the poses of a plan [Nm].

    Legs' own weight and the standing feet's forces; what moving takes is not in it.

    Args:
        robot: The robot.
        samples: The plan at N times.
        share: How feet share the weight.
    """
    weight = GRAVITY * robot.mass
    force = share(weight, samples.feet, samples.com, samples.standing)
    limits = leg_limits(robot, rotations(samples.body[:, 0]), samples.q)
    hold = 0.5 * weight * (limits.lower + limits.upper)  # see `leg_limits`
    return np.asarray(hold - (limits.rows @ force[..., None])[..., 0])


def torque_ratio(
    robot: RobotModel, samples: PlanSamples, share: Share = least_forces
) -> FloatArray:
    """The greatest of these over their limits, sample by sample (N,)."""
    ratio = np.abs(standing_torques(robot, samples, share)) / robot.effort.reshape(4, 3)
    return np.asarray(ratio.max(axis=(1, 2)))
