"""Columns of a log for the margins beyond the hull's, as measured and as planned."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.control.ports import GaitPhase
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.motion_plan import MotionPlan, PlanSamples, evaluate, rotations
from drake_quad.robot.robot_model import RobotModel, contact_friction
from drake_quad.run_log_estimate import Columns
from drake_quad.run_log_plan import plans_by_turn, turns
from drake_quad.stability.contacts import make_contacts
from drake_quad.stability.level import is_hull
from drake_quad.stability.measured import Margins
from drake_quad.stability.region import find_region
from drake_quad.stability.torque import joint_limits
from drake_quad.systems.stability_monitor import NO_SUPPORT
from drake_quad.terrain import Course
from drake_quad.terrain_normals import ground_normals

PLANNED_PERIOD = 0.1  # [s] for which what is planned is held, as what is measured is
NAMES = {
    Margins.FRICTION: "margin_friction",
    Margins.CAPTURE: "margin_capture",
    Margins.BUDGET: "push_budget",
    Margins.BUDGET_DIRECTION: "push_budget_direction",
    Margins.FEASIBLE: "margin_feasible",
    Margins.DYNAMIC: "margin_dynamic",
}


@dataclass(frozen=True, eq=False)
class Ground:
    """What a plan counts on.

    Attributes:
        course: The map.
        friction: Coulomb's coefficient of the ground, see `contact_friction`.
    """

    course: Course
    friction: float


def margin_columns(
    logs: Mapping[str, FloatArray],
    times: FloatArray,
    *,
    robot: RobotModel,
    plans: Sequence[MotionPlan],
    ground: Ground | None,
) -> Columns:
    """The margins that the monitor measured, and the plan's beside them; none if it did not.

    Args:
        logs: By the name of the log: (N, size) each.
        times: (N,) of the samples [s].
        robot: The robot.
        plans: Those that were followed, see `plans_by_turn`.
        ground: What they count on; nothing planned without.
    """
    if "further_margins" not in logs:
        return {}
    measured = logs["further_margins"]
    feasible = bool(np.any(np.isfinite(measured[:, Margins.FEASIBLE])))
    columns: Columns = {
        name: measured[:, place]
        for place, name in NAMES.items()
        if feasible or place < Margins.FEASIBLE
    }
    if ground is not None:
        friction, within = _planned(robot, logs["gait_phase"], times, plans, ground, feasible)
        columns["margin_friction_planned"] = friction
        if feasible:
            columns["margin_feasible_planned"] = within
    return columns


def _planned(
    robot: RobotModel,
    phase: FloatArray,
    times: FloatArray,
    plans: Sequence[MotionPlan],
    ground: Ground,
    feasible: bool,
) -> tuple[FloatArray, FloatArray]:
    """The plans' own margins of friction, and of torque too, at the samples' gait times (N,)."""
    friction, within = np.full((2, len(phase)), np.nan)
    followed = turns(phase)
    for turn, plan in plans_by_turn(plans).items():
        mine = np.flatnonzero(np.all(followed == turn, axis=1))
        if not len(mine):
            continue
        slot = np.floor(times[mine] / PLANNED_PERIOD + 1e-6)
        first = np.concatenate([[True], slot[1:] != slot[:-1]])
        samples = evaluate(robot, plan, phase[mine[first], GaitPhase.TIME])
        found = np.maximum(
            plan_regions(robot, samples, ground, feasible=feasible), NO_SUPPORT
        )  # nan stays
        held = np.cumsum(first) - 1
        friction[mine], within[mine] = found[0][held], found[1][held]
    return friction, within


def plan_regions(
    robot: RobotModel, samples: PlanSamples, ground: Ground, *, feasible: bool
) -> tuple[FloatArray, FloatArray]:
    """Margins of the regions of friction, and of torque too (or nan), of a plan's samples (N,).

    The feet stand where the plan has them, on the ground as the map has it.
    """
    normals = ground_normals(ground.course, samples.feet[..., :2])
    places = samples.feet - robot.foot_radius * normals
    turned, mu = rotations(samples.body[:, 0]), contact_friction(robot, ground.friction)
    friction, within = np.full((2, len(samples.times)), np.nan)
    for k, standing in enumerate(samples.standing):
        contacts = make_contacts(places[k, standing], normals[k, standing], mu[standing])
        x, y = samples.com[k, :2].tolist()
        # Where the region is the hull, its margin is known.
        friction[k] = samples.margin[k] if is_hull(contacts) else find_region(contacts).margin(x, y)
        if feasible:
            limits = joint_limits(robot, turned[k], samples.q[k], standing)
            within[k] = find_region(contacts, limits=limits).margin(x, y)
    return friction, within
