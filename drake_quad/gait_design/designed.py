"""A gait with its plan on the real course, and how good it is."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from drake_quad.certificate.certify import Certificate
from drake_quad.errors import PlanningError
from drake_quad.gait_design.choose_gait import Design
from drake_quad.planning.clearance import (
    Clearance,
    check_self_collision,
    check_thighs,
    find_clearance,
)
from drake_quad.planning.contact_forces import torque_ratio
from drake_quad.planning.contact_plan import swing_times
from drake_quad.planning.mission import (
    MissionPlan,
    check_plan,
    check_slopes,
    check_torques,
    initial_stance,
    join_plans,
    plan_tasks,
)
from drake_quad.planning.motion_plan import MotionPlan, Stance, evaluate
from drake_quad.planning.stance_margin import slopes_of
from drake_quad.planning.task import plan_task
from drake_quad.robot.model import LinkOutline, RobotModel
from drake_quad.scenario.build import mission_of, plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.terrain.course import Course

GOOD_MARGIN = 0.6  # of the margin desired: with that, and with
GOOD_CLEARANCE = 0.8  # of the clearance wanted, a gait is as good as any
GOOD_TORQUE = 0.8  # of the torque to spare that is wanted, the same
FAIR_MARGIN = 0.8  # of the margin wanted on endless stairs: with less, lower bodies are tried, too
POOR = 0.5  # quality below which the next lower body is tried, too, and a more thorough search
THIGHS_EVERY = 2  # every second sample of a plan is looked at for thighs
TORQUE_EVERY = 4  # every fourth sample of a plan is looked at for torques
PER_SWING = 24  # moments of every swing that are looked at: shanks pass nosings in a tenth of one
LEFT_OVER = 1.1  # of the margin that the gait clock demands: what a plan keeps is kept nearly


@dataclass(frozen=True, eq=False)
class Designed:
    """A scenario with its gait filled in.

    Attributes:
        scenario: The scenario in full.
        design: The gait and its slacks on endless stairs.
        plan: The plan of the whole mission on paper.
        margin: The plan's least margin [m].
        clearance: The plan's least clearance between robot and course.
        torque: Smallest remaining fraction of any joint's torque limit when standing still;
            negative if the controllers' default load sharing exceeds a limit. They may share the
            load otherwise: what no sharing allows `check_torques` refuses.
        certificate: What is proven of the plan, if that was asked already.
    """

    scenario: Scenario
    design: Design
    plan: MissionPlan
    margin: float
    clearance: Clearance
    torque: float
    certificate: Certificate | None = None

    @property
    def has_margin(self) -> bool:
        """Whether the plan's margin is no less than what is wanted of a gait on endless stairs."""
        return self.margin >= self.design.wanted["margin"]

    @property
    def is_fair(self) -> bool:
        """Whether it is good enough that no gait is tried with a lower body."""
        return self.quality >= POOR and self.margin >= FAIR_MARGIN * self.design.wanted["margin"]

    @property
    def quality(self) -> float:
        """The least share of what is wanted of margin, clearance and torque, at most 1."""
        return _quality(self.scenario, self.design, self.margin, self.clearance, self.torque)


Walks = tuple[tuple[int, Stance], ...]  # places in the mission, and the stances they begin in


def plan_design(
    scenario: Scenario,
    *,
    design: Design,
    robot: RobotModel,
    shape: LinkOutline,
    course: Course,
    source: str,
    beat: Designed | None,
    walks: Walks | None = None,
    enough: Callable[[MotionPlan], bool] = lambda _: True,
    warm_starts: dict[int, MotionPlan] | None = None,
) -> Designed | None:
    """Plans a scenario in full; None as soon as it is no better than another.

    Args:
        scenario: With the design's fields filled in.
        design: The gait, and the slacks wanted of it.
        robot: The scenario's.
        shape: The robot's outline.
        course: The scenario's course.
        source: What an error names.
        beat: The other, if there is one.
        walks: The tasks that are planned, in this order; all if None.
        enough: Whether a task's plan leaves enough; after one that does not, no other is planned.
        warm_starts: Plans of the same tasks with other times, see `plan_tasks`.

    Raises:
        PlanningError: If there is no plan, or one that touches the stairs with more than feet.
    """
    settings = plan_settings(scenario)
    stance = initial_stance(robot, course, settings, start=scenario.start.distance)
    tasks = mission_of(scenario, course, source=source)
    begun, plans, ground = time.perf_counter(), [], slopes_of(course, settings.friction)
    clearance, margin, torque = Clearance(inf, inf, "", "", 0.0), inf, 1.0
    warm_starts = {} if warm_starts is None else warm_starts

    def alone(k: int, stance: Stance) -> MotionPlan:
        warm_starts[k] = plan_task(
            robot, course, settings, tasks[k], stance, index=k, warm_start=warm_starts.get(k)
        )
        return warm_starts[k]

    if walks is None:
        planned = plan_tasks(robot, course, settings, tasks, stance, warm_starts)
    else:
        planned = (alone(k, begin) for k, begin in walks)
    for plan in planned:
        task = tasks[plan.index]
        samples = check_plan(robot, plan, dynamic=settings.dynamic)
        check_slopes(course, plan, settings.friction)
        swings = evaluate(robot, plan, swing_times(plan.contacts, PER_SWING))
        here = find_clearance(robot, shape, course, [task, task], [samples, swings])
        if here.distance <= 0.0:
            raise PlanningError(
                f"{here.part} would be {-here.distance:.3f} m inside the stairs at "
                f"{here.time:.1f} s of '{here.task}'",
                room=here.distance,
            )
        clearance = min(clearance, here, key=lambda r: r.weighted)
        if plan.margin == plan.margin:  # standing still has none
            _refuse_waiting(scenario, task.name, plan.margin)
            margin = min(margin, plan.margin)
        check_thighs(robot, course, task, samples.every(THIGHS_EVERY))
        check_self_collision(robot, task, samples)
        check_self_collision(robot, task, swings)
        seen = samples.every(TORQUE_EVERY)
        here_left = 1.0 - float(torque_ratio(robot, seen, ground=ground).max())
        if here_left < 0.0:
            check_torques(robot, plan, samples, ground)
        torque = min(torque, here_left)
        plans.append(plan)
        if (
            beat is not None
            and _quality(scenario, design, margin, clearance, torque) <= beat.quality
        ):
            return None
        if not enough(plan):
            break
    mission = join_plans(plans, time.perf_counter() - begun, dynamic=settings.dynamic)
    return Designed(scenario, design, mission, margin if margin < inf else 0.0, clearance, torque)


def _refuse_waiting(scenario: Scenario, task: str, margin: float) -> None:
    """Refuses a plan by which the gait clock would wait at a lift-off, and then stop.

    Raises:
        PlanningError: With the margin that there is, and the one that there has to be.
    """
    least = scenario.controller.lift_off_margin
    if margin < LEFT_OVER * least:
        raise PlanningError(
            f"the static margin would be {margin:.3f} m in '{task}', and no foot is lifted with "
            f"less than {least:.3f} m",
            margin=margin,
        )


def _quality(
    scenario: Scenario, design: Design, margin: float, clearance: Clearance, torque: float
) -> float:
    """See Designed; of the tasks that are planned, more can only make it less."""
    wanted = design.wanted
    return min(
        1.0,
        margin / (GOOD_MARGIN * scenario.body.margin_desired),
        clearance.weighted / (GOOD_CLEARANCE * wanted["legs"]),
        torque / (GOOD_TORQUE * wanted["torque"]),
    )
