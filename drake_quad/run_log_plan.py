"""Which plan a sample of a log was following, and what margin and torques that plan had."""

from collections.abc import Mapping, Sequence

import numpy as np

from drake_quad.control.ports import GaitPhase, Mode
from drake_quad.gait.legs import FloatArray
from drake_quad.gait.support import stability_margins
from drake_quad.planning.motion_plan import MotionPlan, PlanSamples, evaluate
from drake_quad.planning.plan_torques import Share, least_forces, torque_ratio
from drake_quad.robot.robot_model import RobotModel

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def plans_by_turn(plans: Sequence[MotionPlan]) -> Mapping[tuple[int, int], MotionPlan]:
    """The plans by task and revision.

    Args:
        plans: In the order in which they were made: of each task the first, then its revisions.
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
        phase: (N, len(GaitPhase)) samples of `gait_phase`.
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
    share: Share = least_forces,
) -> dict[str, FloatArray]:
    """What the plan had at each sample's gait time: static margin [m] and torque ratio, (N,) each.

    Args:
        robot: The robot.
        phase: (N, len(GaitPhase)) samples of `gait_phase`.
        plans: See `plans_by_turn`.
        massless_legs: See `plan_margin`.
        share: How the controller shares the weight among the feet.
    """
    margin, ratio = np.full(len(phase), np.nan), np.full(len(phase), np.nan)
    followed = turns(phase)
    for turn, plan in plans_by_turn(plans).items():
        mine = np.all(followed == turn, axis=1)
        if np.any(mine):
            samples = evaluate(robot, plan, phase[mine, GaitPhase.TIME])
            margin[mine] = plan_margin(samples, massless_legs=massless_legs)
            ratio[mine] = torque_ratio(robot, samples, share)
    return {"margin_planned": margin, "torque_ratio_planned": ratio}


def plan_margin(s: PlanSamples, *, massless_legs: bool) -> FloatArray:
    """The margin of the whole centre of mass, or (massless legs) of the body's centre."""
    if not massless_legs:
        return s.margin
    return stability_margins(s.body[:, 0, :2], s.feet[..., :2], s.standing)
