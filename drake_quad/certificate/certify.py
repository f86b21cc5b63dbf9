"""Certifies a mission's plan: bounds that hold at every time, or the first time that they fail."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drake_quad.certificate.cell_bounds import pose_problem
from drake_quad.certificate.chain import Shank
from drake_quad.certificate.failure import Failure, first_failure
from drake_quad.certificate.joins import Joins, check_joins
from drake_quad.certificate.obstacles import find_obstacles
from drake_quad.certificate.pieces import cut_pieces
from drake_quad.certificate.prove import Proof, make_demand, prove
from drake_quad.certificate.record import make_record
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain_box import Box


@dataclass(frozen=True, eq=False)
class Certificate:
    """What is proven of a plan.

    Attributes:
        proof: The bounds.
        failure: The first time at which the plan is not as asked for; None if it is throughout.
        record: What certificate.json holds; None where there is a failure.
        joins: Where its tasks meet, and how continuous it is there.
    """

    proof: Proof
    failure: Failure | None
    record: dict[str, Any] | None
    joins: Joins


def certify(
    robot: RobotModel,
    shank: Shank,
    plans: Sequence[MotionPlan],
    boxes: Sequence[Box],
    *,
    margin: float = 0.0,
    clearance: float = 0.0,
) -> Certificate:
    """Proves what holds of a plan at every time.

    Args:
        robot: The robot.
        shank: How thick its shanks are.
        plans: The mission's tasks, each beginning where the one before ends.
        boxes: The course.
        margin: Static margin that is asked for [m].
        clearance: Room of feet and shanks that is asked for [m].
    """
    pieces = cut_pieces(plans)
    problem = pose_problem(robot, shank, pieces, find_obstacles(boxes))
    proof = prove(problem, make_demand(margin=margin, foot=clearance, shank=clearance))
    joins = check_joins(plans)
    found = [f for f in (joins.failure, first_failure(problem, proof)) if f is not None]
    failure = min(found, key=lambda f: (f.task, f.time), default=None)
    record = None if failure else make_record(robot, shank, plans, boxes, pieces, proof)
    return Certificate(proof, failure, record, joins)
