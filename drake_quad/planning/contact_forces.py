"""How standing feet share the weight, and the joint torques that a plan needs."""

from dataclasses import dataclass
from typing import Protocol

import daqp
import numpy as np

from drake_quad.common import GRAVITY, BoolArray, FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import PlanSamples
from drake_quad.planning.stance_margin import Slopes
from drake_quad.planning.wrench_distribution import UPRIGHT, distribute_wrench
from drake_quad.robot.model import RobotModel
from drake_quad.stability.equilibrium_region import LEVEL, leg_limits
from drake_quad.stability.support_polygon import nearest_on_segment

FRICTION = 0.5
UPWARD = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
SIDEWAYS = FRICTION / np.sqrt(2.0)  # along each axis: a pyramid within the cone
NONE = 1e30  # DAQP's bound that is none
EQUAL = 5  # its mark of an equation
SOLVED = (1, 2)  # its exit flags
# Rows (16, 12) of the feet's forces that friction pyramids keep at 0 or below.
PYRAMIDS = np.kron(
    np.eye(4), [[1, 0, -SIDEWAYS], [-1, 0, -SIDEWAYS], [0, 1, -SIDEWAYS], [0, -1, -SIDEWAYS]]
)
NOTHING = np.zeros((0, 12))
RIDGE = 1e-9  # for three feet in a line


@dataclass(frozen=True, eq=False)
class Cones:
    """The friction cones under the feet of a robot in many poses.

    Attributes:
        normals: (N, 4, 3) unit normals of the ground.
        friction: Coefficient that the controller's forces stay within.
    """

    normals: FloatArray
    friction: float

    def pyramids(self) -> FloatArray:
        """Rows (N, 32, 12) that pyramids within the cones keep at 0 or below.

        As the whole-body controller has them: eight sides on a slope, with an edge straight down
        it, and on level ground four, which are here twice.
        """
        n = self.normals
        level = n[..., 2] >= 1.0 - LEVEL
        down = np.where(level[..., None], [1.0, 0.0, 0.0], n * [1.0, 1.0, 0.0])
        down = down - np.sum(down * n, axis=-1, keepdims=True) * n
        down /= np.linalg.norm(down, axis=-1, keepdims=True)
        aside = np.cross(n, down)
        side = np.arange(8, dtype=float)
        turn = np.pi * side
        angle = np.where(level[..., None], 0.5 * turn, 0.25 * (turn + 0.5 * np.pi))
        most = np.full(level.shape, self.friction * np.cos(np.pi / 8.0))
        most[level] = self.friction * np.sqrt(0.5)
        sides = np.cos(angle)[..., None] * down[..., None, :]
        sides = sides + np.sin(angle)[..., None] * aside[..., None, :]
        sides = sides - most[..., None, None] * n[..., None, :]
        rows = np.zeros((len(n), 4, 8, 4, 3))
        for leg in range(4):
            rows[:, leg, :, leg] = sides[:, leg]
        return rows.reshape(-1, 32, 12)

    def of(self, n: int) -> "Cones":
        """Those of one pose."""
        return Cones(self.normals[n : n + 1], self.friction)


class ShareWeight(Protocol):
    """How feet share a robot's weight: `share_vertical_load` or `min_norm_forces`."""

    def __call__(
        self,
        weight: float,
        feet: FloatArray,
        com: FloatArray,
        who: BoolArray,
        cones: Cones | None = None,
    ) -> FloatArray:
        """Forces on the feet (N, 4, 3) in W; see there."""


def share_vertical_load(
    weight: float,
    feet: FloatArray,
    com: FloatArray,
    who: BoolArray,
    cones: Cones | None = None,
) -> FloatArray:
    """Forces on the feet (N, 4, 3) in W that hold the robot still, as `IkController` shares them.

    Args:
        weight: Robot weight [N].
        feet: (N, 4, 3) in W [m].
        com: (N, 3) the centre of mass in W [m].
        who: (N, 4) which feet stand; three at least.
        cones: Of the N poses; None: about the vertical, FRICTION wide.
    """
    up, still = (0.0, 0.0, weight), (0.0, 0.0, 0.0)
    arms, load = (feet - com[:, None]).tolist(), who.astype(float).tolist()
    axes = [UPRIGHT] * len(arms) if cones is None else cones.normals.tolist()
    friction = FRICTION if cones is None else cones.friction
    return np.array(
        [
            distribute_wrench(up, still, arm, share, friction=friction, normals=axis)
            for arm, share, axis in zip(arms, load, axes, strict=True)
        ]
    )


def min_norm_forces(
    weight: float,
    feet: FloatArray,
    com: FloatArray,
    who: BoolArray,
    cones: Cones | None = None,
) -> FloatArray:
    """The same as `WholeBodyController` shares them: the sum of all forces squared is least.

    Feet that stand at different heights then push against each other, within friction. Where none
    hold the robot so they are `share_vertical_load`'s.
    """
    flat = _grasps(feet - com[:, None], who)
    square = flat @ flat.transpose(0, 2, 1) + RIDGE * np.eye(6)
    wanted = weight * UPWARD
    force = (flat.transpose(0, 2, 1) @ np.linalg.solve(square, wanted[:, None])).reshape(-1, 4, 3)
    if cones is None:
        sideways = np.abs(force[..., :2]).max(axis=-1)
        slips = np.any(sideways > SIDEWAYS * force[..., 2] + RIDGE * weight, axis=1)
    else:
        beyond = cones.pyramids() @ force.reshape(-1, 12, 1)
        slips = np.any(beyond[..., 0] > RIDGE * weight, axis=1)
    for n in np.flatnonzero(slips):
        mine = None if cones is None else cones.of(int(n))
        rows = PYRAMIDS if mine is None else mine.pyramids()[0]
        within = _least_within(flat[n], wanted, weight, pyramids=rows)
        if within is None:
            one = feet[n : n + 1], com[n : n + 1], who[n : n + 1]
            within = share_vertical_load(weight, *one, mine)[0]
        force[n] = within
    # What the programs leave by rounding: some 1e-15 N at a foot in the air, or pulling at another.
    force[..., 2] = np.maximum(force[..., 2], 0.0)
    return np.asarray(force * who[..., None])


def _grasps(arms: FloatArray, who: BoolArray) -> FloatArray:
    """Matrices (N, 6, 12) from forces on the feet to their wrench about the centre of mass.

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


SHARES: dict[str, ShareWeight] = {
    "ik": share_vertical_load,
    "whole_body": min_norm_forces,
}  # by controller.kind


def _least_within(
    grasp: FloatArray,
    wanted: FloatArray,
    weight: float,
    drives: tuple[FloatArray, FloatArray, FloatArray] = (NOTHING, NOTHING[:, 0], NOTHING[:, 0]),
    *,
    pyramids: FloatArray = PYRAMIDS,
) -> FloatArray | None:
    """The least forces (4, 3) that make up a wrench (6,) and do not slip; None if none do.

    They keep within what drives can, too: rows (m, 12), lower and upper bounds (m,) of the weight.
    """
    more, least, most = drives
    rows = np.concatenate([grasp, pyramids, more])
    sides = len(pyramids)
    upper = np.concatenate([np.full(12, NONE), wanted / weight, np.zeros(sides), most])
    lower = np.concatenate([np.full(12, -NONE), wanted / weight, np.full(sides, -NONE), least])
    sense = np.zeros(len(upper), dtype=np.int32)
    sense[12:18] = EQUAL
    force, _, status, _ = daqp.solve(np.eye(12), np.zeros(12), rows, upper, lower, sense)
    return weight * np.asarray(force).reshape(4, 3) if status in SOLVED else None


def cones_under(samples: PlanSamples, ground: Slopes | None) -> Cones | None:
    """The friction cones under a plan's feet; None on level ground."""
    if ground is None:
        return None
    return Cones(ground.normals(samples.feet[..., :2]), ground.friction)


def held_com(samples: PlanSamples) -> FloatArray:
    """The centre of mass (N, 3) in W [m], over two feet moved to the nearest place of their line.

    Two feet hold no robot still whose centre of mass is beside their line; that moment is what the
    motion takes. What is left is how they share the weight along it.
    """
    com = np.array(samples.com)
    for n in np.flatnonzero(samples.standing.sum(axis=1) == 2):
        a, b = samples.feet[n, samples.standing[n], :2].tolist()
        com[n, :2] = nearest_on_segment((com[n, 0], com[n, 1]), (a[0], a[1]), (b[0], b[1]))
    return com


def static_joint_torques(
    robot: RobotModel,
    samples: PlanSamples,
    share: ShareWeight = min_norm_forces,
    ground: Slopes | None = None,
) -> FloatArray:
    """Torques of the joints (N, 4, 3) that hold the robot still in the poses of a plan [Nm].

    Legs' own weight and the standing feet's forces; what moving takes is not in it. On two feet
    they hold it but for the moment about their line, see `held_com`.

    Args:
        robot: The robot.
        samples: The plan at N times.
        share: How feet share the weight.
        ground: Ground with slopes; None where all is level.
    """
    weight = GRAVITY * robot.mass
    cones = cones_under(samples, ground)
    force = share(weight, samples.feet, held_com(samples), samples.standing, cones)
    limits = leg_limits(robot, rotations(samples.body[:, 0]), samples.q)
    hold = 0.5 * weight * (limits.lower + limits.upper)  # see `leg_limits`
    return np.asarray(hold - (limits.rows @ force[..., None])[..., 0])


def torque_ratio(
    robot: RobotModel,
    samples: PlanSamples,
    share: ShareWeight = min_norm_forces,
    ground: Slopes | None = None,
) -> FloatArray:
    """The greatest of these over their limits, sample by sample (N,)."""
    torques = static_joint_torques(robot, samples, share, ground)
    ratio = np.abs(torques) / robot.effort.reshape(4, 3)
    return np.asarray(ratio.max(axis=(1, 2)))


@dataclass(frozen=True)
class Overload:
    """A moment at which no forces of the standing feet hold a robot within its joints' torques.

    Attributes:
        sample: Index of the sample.
        joint: Index of the joint with the largest torque ratio under the least forces (12).
        ratio: Its torque ratio.
    """

    sample: int
    joint: int
    ratio: float


def find_overload(
    robot: RobotModel, samples: PlanSamples, ground: Slopes | None = None
) -> Overload | None:
    """The worst moment of a plan at which the robot could not stand still; None if it always can.

    Forces may be shared among the feet in any way within friction: that of the ground with slopes,
    or on level ground, if it is None, FRICTION.
    """
    torques = static_joint_torques(robot, samples, ground=ground)
    ratio = np.abs(torques) / robot.effort.reshape(4, 3)
    cones = cones_under(samples, ground)
    worst = ratio.reshape(-1, 12).max(axis=1)
    order = np.argsort(-worst, kind="stable")
    weight, com = GRAVITY * robot.mass, held_com(samples)
    for n in order[: int(np.sum(worst > 1.0))]:
        limits = leg_limits(robot, rotations(samples.body[n, 0]), samples.q[n])
        rows = np.zeros((4, 3, 4, 3))
        rows[range(4), :, range(4)] = limits.rows
        arms = samples.feet[n : n + 1] - com[n : n + 1, None]
        grasp = _grasps(arms, samples.standing[n : n + 1])[0]
        standing = np.repeat(samples.standing[n], 3)
        drives = (rows.reshape(12, 12) * standing, limits.lower.ravel(), limits.upper.ravel())
        pyramids = PYRAMIDS if cones is None else cones.of(int(n)).pyramids()[0]
        if _least_within(grasp, weight * UPWARD, weight, drives, pyramids=pyramids) is None:
            joint = int(np.argmax(ratio[n]))
            return Overload(int(n), joint, float(worst[n]))
    return None
