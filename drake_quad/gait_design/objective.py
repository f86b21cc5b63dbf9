"""Slacks of candidate gaits on a staircase: reach, joints, torques, margin, clearances."""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait_design.candidates import CandidateBatch, Staircase, make_cycle
from drake_quad.gait_design.kernels import objectives_of_slacks, slacks
from drake_quad.gait_design.pose_kernels import RobotTables
from drake_quad.robot.kinematics import leg_array
from drake_quad.robot.model import LinkOutline, RobotModel, leg_length
from drake_quad.stability.safety import planned_margin

WIDEST_SWAY = 0.25  # of a stretched leg
LEANING = 0.7  # sin 45°
FEW = 8  # candidates: fewer are evaluated by one thread
CORES = os.cpu_count() or 1

NAMES = ("reach", "joints", "torque", "margin", "legs", "apart", "trunk")


@dataclass(frozen=True)
class Targets:
    """Slacks that are enough, in the order of NAMES.

    Attributes:
        reach: Length left of a leg at its most stretched, or most folded [m].
        joints: Distance of any joint from its limits [rad].
        torque: Share of a joint's torque limit that is left, 0 to 1.
        margin: Static margin of the whole robot's centre of mass [m].
        legs: Clearance between knees and shanks and the stairs [m].
        apart: Clearance between the front and the rear leg of a side, and between shanks and trunk
            [m].
        trunk: Clearance between the trunk and the stairs [m].
    """

    reach: float
    joints: float
    torque: float
    margin: float
    legs: float
    apart: float
    trunk: float


def targets_for(robot: RobotModel, map_error: float = 0.0) -> Targets:
    """What is enough for a robot of its size.

    Args:
        robot: The robot.
        map_error: Position error of the map's risers [m]: nosings come so much nearer along the
            way, and LEANING of it nearer to a shank that leans by 45°.
    """
    leg = leg_length(robot)
    return Targets(
        reach=0.05 * leg, joints=0.2, torque=0.15, margin=planned_margin(robot),
        legs=0.02 * leg + LEANING * map_error, apart=0.02 * leg, trunk=0.03 * leg,
    )  # fmt: skip


def evaluate_candidates(
    robot: RobotModel,
    shape: LinkOutline,
    grid: CandidateBatch,
    stairs: Staircase,
    *,
    clearance: float,
    stance_length: float | None = None,
    found: FloatArray | None = None,
    enough: FloatArray | None = None,
    wanted: FloatArray | None = None,
) -> FloatArray:
    """Least slacks (C, 7) of every candidate of a grid on a staircase, by NAMES, as in Targets.

    They are negative where a limit is exceeded.

    Args:
        robot: The robot.
        shape: How thick its parts are.
        grid: The candidates.
        stairs: The staircase, up or down, or level ground.
        clearance: Clearance of swing feet [m].
        stance_length: Stance length on level ground, see `make_cycle` [m].
        found: (C, 7) slacks on other stairs, which count too.
        enough: (C,) objective beyond which a candidate is of no interest: it is not evaluated to
            the end, and its slacks are upper bounds.
        wanted: (7,) by NAMES; `wanted_with_tolerance` of the robot unless given.
    """
    cycle = make_cycle(
        grid, stairs, foot_radius=robot.foot_radius, clearance=clearance,
        stance_length=stance_length,
    )  # fmt: skip
    wanted = wanted_with_tolerance(robot) if wanted is None else wanted
    rows = np.full((len(grid), len(NAMES)), np.inf) if found is None else np.array(found)
    enough = np.full(len(grid), np.inf) if enough is None else enough
    tables = robot_tables(robot, shape)

    def evaluate(mine: slice) -> None:
        """Candidates have nothing to do with one another: in parts they come out the same."""
        some = cycle._replace(body=cycle.body[mine], feet=cycle.feet[mine])
        slacks(some, stairs, tables, wanted, rows[mine], enough[mine])

    if len(grid) < FEW or CORES < 2:
        evaluate(slice(None))
    else:
        half = len(grid) // 2
        other = _second_thread().submit(evaluate, slice(half, None))
        evaluate(slice(half))
        other.result()
    return rows


@lru_cache(maxsize=1)
def _second_thread() -> ThreadPoolExecutor:
    """A thread beside this one: the kernel needs no Python while it runs."""
    return ThreadPoolExecutor(max_workers=1)


@lru_cache(maxsize=8)  # a search asks a thousand times
def robot_tables(robot: RobotModel, shape: LinkOutline) -> RobotTables:
    """A robot and its outline as the kernels take them."""
    return RobotTables(
        foot_radius=robot.foot_radius,
        legs=leg_array(robot.geometry),
        limits=np.stack([robot.q_lower, robot.q_upper, robot.effort]),
        masses=np.concatenate([[robot.trunk_mass], robot.link_mass.ravel()]),
        coms=np.concatenate([robot.trunk_com[None], robot.link_com.reshape(12, 3)]),
        trunk=np.stack([[shape.trunk_lower, shape.trunk_upper], *shape.trunk_parts]),
        shanks=np.stack([shape.shank_offsets, shape.shank_radii]),
        widest=WIDEST_SWAY * leg_length(robot),
    )


def wanted_with_tolerance(robot: RobotModel, map_error: float = 0.0) -> FloatArray:
    """The slacks that are enough, (7,) by NAMES; see `targets_for`."""
    wanted = targets_for(robot, map_error)
    return np.array([getattr(wanted, name) for name in NAMES])


def objective(rows: FloatArray, wanted: FloatArray) -> FloatArray:
    """Objectives (C,) of slacks (C, 7) against their targets (7,): less is better, -1 is best."""
    return objectives_of_slacks(rows, wanted)
