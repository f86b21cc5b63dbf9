"""What room candidate gaits leave on a staircase: reach, joints, torques, margin, clearances."""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait_design.candidates import CandidateBatch, Staircase, make_cycle
from drake_quad.gait_design.kernels import objectives_of_slacks, slacks
from drake_quad.robot.kinematics import leg_array
from drake_quad.robot.model import LinkOutline, RobotModel, leg_length
from drake_quad.stability.safety import planned_margin

WIDEST_SWAY = 0.25  # of a stretched leg
LEANING = 0.7  # sin 45°

# What a gait is to leave, beyond nothing: with that much room a slack counts as full.
NAMES = ("reach", "joints", "torque", "margin", "legs", "apart", "trunk")


@dataclass(frozen=True)
class Targets:
    """How much room is enough, in the order of NAMES.

    Attributes:
        reach: Of a leg's length that is left at its most stretched, or most folded [m].
        joints: From any joint to its limits [rad].
        torque: Of a joint's limit that is left, 0 to 1.
        margin: Static, of the whole robot's centre of mass [m].
        legs: Between knees and shanks and the stairs [m].
        apart: Between the front and the rear leg of a side, and between shanks and trunk [m].
        trunk: Between the trunk and the stairs [m].
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
        map_error: By how much the map's risers may be off [m]: nosings come so much nearer along
            the way, and to a shank that leans by 45° by LEANING of it.
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
    """The least room that every candidate of a grid leaves on a staircase, (C, 7) by NAMES.

    Of everything but a torque it is a length or an angle as Targets has it; of torques, the share
    of the limit that is left. Negative where it is not to be had.

    Args:
        robot: The robot.
        shape: How thick its parts are.
        grid: The candidates.
        stairs: The staircase, up or down, or level ground.
        clearance: Of swing feet [m].
        stance_length: On level ground, see `make_cycle`.
        found: (C, 7) the room on other stairs, which counts too.
        enough: (C,) what candidates may lack (see `objective`): the room of one that lacks more
            is not looked at to the end, and lacks more than that.
        wanted: (7,) by NAMES; `wanted_with_tolerance` of the robot unless given.
    """
    cycle = make_cycle(
        grid, stairs, foot_radius=robot.foot_radius, clearance=clearance,
        stance_length=stance_length,
    )  # fmt: skip
    wanted = wanted_with_tolerance(robot) if wanted is None else wanted
    room = np.full((len(grid), len(NAMES)), np.inf) if found is None else np.array(found)
    slacks(
        cycle.body,
        cycle.feet,
        cycle.swing,
        cycle.landed,
        stairs.rise,
        stairs.run,
        robot.foot_radius,
        leg_array(robot.geometry),
        np.stack([robot.q_lower, robot.q_upper, robot.effort]),
        np.concatenate([[robot.trunk_mass], robot.link_mass.ravel()]),
        np.concatenate([robot.trunk_com[None], robot.link_com.reshape(12, 3)]),
        np.stack([[shape.trunk_lower, shape.trunk_upper], *shape.trunk_parts]),
        np.stack([shape.shank_offsets, shape.shank_radii]),
        WIDEST_SWAY * leg_length(robot),
        wanted,
        room,
        np.full(len(grid), np.inf) if enough is None else enough,
    )
    return room


def wanted_with_tolerance(robot: RobotModel, map_error: float = 0.0) -> FloatArray:
    """The room that is enough, (7,) by NAMES; see `targets_for`."""
    wanted = targets_for(robot, map_error)
    return np.array([getattr(wanted, name) for name in NAMES])


def objective(room: FloatArray, wanted: FloatArray) -> FloatArray:
    """What room (C, 7) lacks of the room wanted (7,): (C,), less is better, -1 if nothing does."""
    return objectives_of_slacks(room, wanted)
