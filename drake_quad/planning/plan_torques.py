"""What a plan asks of the drives: the joints' torques of a robot that stands still in its poses."""

from collections.abc import Callable
from dataclasses import dataclass

import daqp
import numpy as np

from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.force_distribution import distribute
from drake_quad.planning.motion_plan import PlanSamples, rotations
from drake_quad.robot.robot_model import RobotModel
from drake_quad.stability.torque import leg_limits

FRICTION = 0.5
UPWARD = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
SIDEWAYS = FRICTION / np.sqrt(2.0)  # along each axis: a pyramid within the cone
NONE = 1e30  # DAQP's bound that is none
EQUAL = 5  # its mark of an equation
SOLVED = (1, 2)  # its exit flags
# Of each foot's force, what slips one way: (16, 12) rows that are to be no more than 0.
PYRAMIDS = np.kron(
    np.eye(4), [[1, 0, -SIDEWAYS], [-1, 0, -SIDEWAYS], [0, 1, -SIDEWAYS], [0, -1, -SIDEWAYS]]
)
NOTHING = np.zeros((0, 12))
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
    flat = _grasps(feet - com[:, None], who)
    square = flat @ flat.transpose(0, 2, 1) + RIDGE * np.eye(6)
    wanted = weight * UPWARD
    force = (flat.transpose(0, 2, 1) @ np.linalg.solve(square, wanted[:, None])).reshape(-1, 4, 3)
    sideways = np.abs(force[..., :2]).max(axis=-1)
    slips = np.any(sideways > SIDEWAYS * force[..., 2] + RIDGE * weight, axis=1)
    for n in np.flatnonzero(slips):
        within = _least_within(flat[n], wanted, weight)
        if within is None:
            within = share_weight(weight, feet[n : n + 1], com[n : n + 1], who[n : n + 1])[0]
        force[n] = within
    return force


def _grasps(arms: FloatArray, who: BoolArray) -> FloatArray:
    """Of forces on the feet, the wrench about the centre of mass, (N, 6, 12).

    Args:
        arms: (N, 4, 3) from the centre of mass to the feet [m].
        who: (N, 4) which feet stand.
    """
    grasp = np.zeros((len(arms), 6, 4, 3))
    grasp[:, :3] = np.eye(3)[:, None, :]
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    grasp[:, 3, :, 1], grasp[:, 3, :, 2] = -z, y
    grasp[:, 4, :, 0], grasp[:, 4, :, 2] = z, -x
    grasp[:, 5, :, 0], grasp[:, 5, :, 1] = -y, x
    return np.asarray((grasp * who[:, None, :, None]).reshape(-1, 6, 12))


SHARES: dict[str, Share] = {"ik": share_weight, "whole_body": least_forces}  # by controller.kind


def _least_within(
    grasp: FloatArray,
    wanted: FloatArray,
    weight: float,
    drives: tuple[FloatArray, FloatArray, FloatArray] = (NOTHING, NOTHING[:, 0], NOTHING[:, 0]),
) -> FloatArray | None:
    """The least forces (4, 3) that make up a wrench (6,) and do not slip; None if none do.

    They keep within what drives can, too: rows (m, 12), lower and upper bounds (m,) of the weight.
    """
    more, least, most = drives
    rows = np.concatenate([grasp, PYRAMIDS, more])
    upper = np.concatenate([np.full(12, NONE), wanted / weight, np.zeros(16), most])
    lower = np.concatenate([np.full(12, -NONE), wanted / weight, np.full(16, -NONE), least])
    sense = np.zeros(len(upper), dtype=np.int32)
    sense[12:18] = EQUAL
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


@dataclass(frozen=True)
class Overload:
    """A moment at which no forces of the standing feet hold a robot within its joints' torques.

    Attributes:
        sample: Which.
        joint: Index of the joint that takes most of its limit if the forces are the least (12).
        ratio: What it then takes of that.
    """

    sample: int
    joint: int
    ratio: float


def find_overload(robot: RobotModel, samples: PlanSamples) -> Overload | None:
    """The worst moment of a plan at which the robot could not stand still; None if it always can.

    Forces may be shared among the feet in any way within friction (FRICTION).
    """
    ratio = np.abs(standing_torques(robot, samples)) / robot.effort.reshape(4, 3)
    worst = ratio.reshape(-1, 12).max(axis=1)
    order = np.argsort(-worst, kind="stable")
    weight = GRAVITY * robot.mass
    for n in order[: int(np.sum(worst > 1.0))]:
        limits = leg_limits(robot, rotations(samples.body[n, 0]), samples.q[n])
        rows = np.zeros((4, 3, 4, 3))
        rows[range(4), :, range(4)] = limits.rows
        arms = samples.feet[n : n + 1] - samples.com[n : n + 1, None]
        grasp = _grasps(arms, samples.standing[n : n + 1])[0]
        standing = np.repeat(samples.standing[n], 3)
        drives = (rows.reshape(12, 12) * standing, limits.lower.ravel(), limits.upper.ravel())
        if _least_within(grasp, weight * UPWARD, weight, drives) is None:
            joint = int(np.argmax(ratio[n]))
            return Overload(int(n), joint, float(worst[n]))
    return None
