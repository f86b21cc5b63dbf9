"""What the plan that was followed had at each sample of the log."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.control.ports import GaitPhase, Mode
from drake_quad.math.rotations import rotations
from drake_quad.planning.contact_forces import ShareWeight, min_norm_forces, torque_ratio
from drake_quad.planning.motion_plan import MotionPlan, PlanSamples, evaluate
from drake_quad.planning.stance_margin import Slopes
from drake_quad.robot.model import RobotModel, contact_friction
from drake_quad.stability.equilibrium_region import (
    find_region,
    is_hull,
    joint_limits,
    make_contacts,
)
from drake_quad.stability.support_polygon import stability_margins
from drake_quad.systems.stability_monitor import NO_SUPPORT
from drake_quad.terrain.course import Course, ground_normals

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def plans_by_turn(plans: Sequence[MotionPlan]) -> Mapping[tuple[int, int], MotionPlan]:
    """The plans by task and revision.

    Args:
        plans: Plans in the order in which they were made: of each task the first, then its
            revisions.
    """
    found: dict[tuple[int, int], MotionPlan] = {}
    task = -1
    for plan in plans:
        task += plan.revision == 0
        found[task, plan.revision] = plan
    return found


def turns(phase: FloatArray) -> IntArray:
    """Task and revision of the plan that each sample follows, (N, 2).

    While a revision is being made the gait time is still that of the plan before.

    Args:
        phase: (N, len(GaitPhase)) samples of the port `gait_phase`.
    """
    being_made = phase[:, GaitPhase.MODE] == Mode.REPLAN
    return np.column_stack(
        [phase[:, GaitPhase.TASK], phase[:, GaitPhase.REVISION] - being_made]
    ).astype(np.int64)


def planned_figures(
    robot: RobotModel,
    phase: FloatArray,
    plans: Sequence[MotionPlan],
    *,
    massless_legs: bool = False,
    share: ShareWeight = min_norm_forces,
    ground: Slopes | None = None,
) -> dict[str, FloatArray]:
    """What the plan had at each sample's gait time: static margin [m] and torque ratio, (N,) each.

    Args:
        robot: The robot.
        phase: (N, len(GaitPhase)) samples of the port `gait_phase`.
        plans: Plans as `plans_by_turn` takes them.
        massless_legs: Whether legs count as massless, as in `plan_margin`.
        share: Function by which the controller shares the weight among the feet.
        ground: Ground with slopes; None where all is level.
    """
    margin, ratio = np.full(len(phase), np.nan), np.full(len(phase), np.nan)
    followed = turns(phase)
    for turn, plan in plans_by_turn(plans).items():
        mine = np.all(followed == turn, axis=1)
        if np.any(mine):
            samples = evaluate(robot, plan, phase[mine, GaitPhase.TIME])
            margin[mine] = plan_margin(samples, massless_legs=massless_legs)
            ratio[mine] = torque_ratio(robot, samples, share, ground)
    return {"margin_planned": margin, "torque_ratio_planned": ratio}


def plan_margin(s: PlanSamples, *, massless_legs: bool) -> FloatArray:
    """The margin of the whole centre of mass, or (massless legs) of the body's centre."""
    if not massless_legs:
        return s.margin
    return stability_margins(s.body[:, 0, :2], s.feet[..., :2], s.standing)


PLANNED_PERIOD = 0.1  # [s] for which what is planned is held, as what is measured is


@dataclass(frozen=True, eq=False)
class Ground:
    """What a plan counts on.

    Attributes:
        course: The map.
        friction: Coulomb's coefficient of the ground, see `contact_friction`.
    """

    course: Course
    friction: float


def planned_regions(
    robot: RobotModel,
    phase: FloatArray,
    times: FloatArray,
    plans: Sequence[MotionPlan],
    ground: Ground,
    *,
    feasible: bool,
) -> dict[str, FloatArray]:
    """The plans' own margins of the region that friction leaves, and of that within torques too.

    Args:
        robot: The robot.
        phase: (N, len(GaitPhase)) samples of the port `gait_phase`.
        times: (N,) times of the samples [s].
        plans: Plans as `plans_by_turn` takes them.
        ground: Ground that the plans count on.
        feasible: Whether the region within torques is wanted too; else its margins are nan.

    Returns:
        `margin_friction_planned` and `margin_feasible_planned`, (N,) each [m].
    """
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
    return {"margin_friction_planned": friction, "margin_feasible_planned": within}


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
