"""How much room a robot takes as it turns on the spot: before a gait is known, and as planned.

Feet are to stand on ground that is known. The trunk turns above it, and its corners may reach
farther than the feet: a head does.
"""

from math import ceil

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.math.rotations import rotations
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.lane import Lane

CENTIMETRE = 0.01  # [m] to which a figure that people are told is rounded up


def least_turning_space(robot: RobotModel) -> float:
    """Diameter of the circle that a robot turns in at the least, whatever its gait is [m].

    It is about B's z axis, and holds the trunk, and feet that stand under their hips.

    Args:
        robot: The robot.
    """
    legs = robot.geometry.p_BH[:, :2].copy()
    legs[:, 1] += robot.geometry.offset
    feet = float(np.linalg.norm(legs, axis=1).max()) + robot.foot_radius
    radius = max(feet, float(np.linalg.norm(_corners(robot)[:, :2], axis=1).max()))
    return round(ceil(2.0 * radius / CENTIMETRE) * CENTIMETRE, 2)


def _corners(robot: RobotModel) -> FloatArray:
    """Corners of the trunk's shapes in B, (8 K, 3) [m]."""
    boxes = robot.trunk_boxes
    which = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(boxes[:, which, np.arange(3)].reshape(-1, 3))


def half_width_taken(robot: RobotModel, plan: MotionPlan, lane: Lane) -> float:
    """How far from a lane's middle line trunk and feet reach in a plan [m].

    Args:
        robot: The robot.
        plan: One task's.
        lane: The lane.
    """
    times = sample_times(plan.contacts)
    body = plan.body.samples(times)[:, 0]
    feet, _ = plan.contacts.feet_at(times)
    turned = np.einsum("nij,kj->nki", rotations(body), _corners(robot))
    _, trunk = lane.coordinates(body[:, None, :3] + turned)
    _, lateral = lane.coordinates(feet)
    return max(float(np.abs(trunk).max()), float(np.abs(lateral).max()) + robot.foot_radius)


def check_turning_width(robot: RobotModel, plan: MotionPlan, lane: Lane) -> None:
    """Checks that a spin keeps within the width of the ground that it is planned on.

    Args:
        robot: The robot.
        plan: The spin's.
        lane: The lane at whose end it turns.

    Raises:
        PlanningError: With the width that it takes, and the one that there is.
    """
    width, taken = 2.0 * float(lane.half_widths[-1]), 2.0 * half_width_taken(robot, plan, lane)
    if taken > width:
        raise PlanningError(
            f"to turn, trunk and feet take {ceil(taken / CENTIMETRE) * CENTIMETRE:.2f} m of width, "
            f"and {width:.2f} m of ground are known there",
            width=width,
            taken=taken,
        )
