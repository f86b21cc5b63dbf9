"""The way back from where there is no way on: the walks that led there, backwards.

A walk that is carried out backwards in time puts body and feet through the same poses. It is at
rest at both ends, its forces are the same, and so are its margins, reach and joint torques. Its
swings are other ones, for a foot leaves the ground and comes down as it always does; they are
planned anew between the same places, and all is checked as any other plan is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.math.curves import BodySpline
from drake_quad.planning.clearance import check_shanks
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.mission import check_lift_offs, check_plan, check_slopes, check_torques
from drake_quad.planning.motion_plan import MotionPlan, Segment, Stance, evaluate, roll_along
from drake_quad.planning.plan_job import TaskJob
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.remaining_plan import find_lane
from drake_quad.planning.stance_margin import slopes_of
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course

BACK_DOWN = "back down"


@dataclass(frozen=True, eq=False)
class RetreatJob(TaskJob):
    """A walk to be carried out backwards, from its end or nearly.

    Attributes:
        walk: The plan of the walk.
    """

    walk: MotionPlan

    def make(self) -> MotionPlan:
        """The plan; see `plan_backwards`."""
        return plan_backwards(
            self.robot, self.course, self.settings, self.walk, self.stance, index=self.index
        )


def plan_backwards(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    walk: MotionPlan,
    stance: Stance,
    *,
    index: int,
) -> MotionPlan:
    """The plan of a walk's way back.

    Args:
        robot: The robot.
        course: The ground, as the map has it now.
        settings: The planner's settings, for the swings.
        walk: The plan of the walk there.
        stance: Where the robot stands: where the walk ended, but for millimetres.
        index: Place of the way back in the mission.

    Raises:
        PlanningError: A swing does not clear the ground.
    """
    lane = find_lane(course, walk, robot.foot_radius)
    control, knot = walk.body.control, walk.body.knot
    duration = (len(control) - 3) * knot  # the path may be at rest for a moment at its end
    builder = StepBuilder.of_settings(lane, stance.feet, robot.foot_radius, settings)
    for step in reversed(walk.contacts.steps):
        # A foot goes to where it had rolled to when it left, so that it rolls back to where it
        # was set down then.
        feet, _ = walk.contacts.feet_at(np.array([step.lift_off]))
        builder.step(
            step.leg, feet[0, step.leg.row, :2], step.touchdown - step.lift_off,
            lift_off=duration - step.touchdown, pivot=step.swing.pivot,
        )  # fmt: skip
    builder.time = duration
    contacts, body = builder.finish(), BodySpline(knot, control[::-1])
    contacts = roll_along(robot, contacts, body, sample_times(contacts), stance.roll)
    segments = tuple(
        Segment(
            f"{BACK_DOWN}, {s.name}", s.kind, duration - s.end, duration - s.start, dict(s.details)
        )
        for s in reversed(walk.segments)
    )
    first = replace(segments[0], start=0.0)
    plan = MotionPlan(
        index, contacts, body, (first, *segments[1:]), np.nan, margin_kind=walk.margin_kind
    )
    samples = evaluate(robot, plan, sample_times(contacts))
    return replace(plan, margin=float(samples.margin.min()))


def plan_retreat(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    walks: Sequence[MotionPlan],
    stance: Stance,
    *,
    first_index: int,
    lift_off_margin: float,
) -> tuple[Task, ...]:
    """The tasks that lead back the way that the robot came, after a look at their plans.

    Args:
        robot: The robot.
        course: The map.
        settings: The planner's settings on it.
        walks: The plans of the walks so far, in their order.
        stance: Where the robot stands.
        first_index: Place of the first of these tasks in the mission.
        lift_off_margin: Least margin with which the gait clock lets a foot lift off [m].

    Raises:
        PlanningError: There is no such way, with the reason.
    """
    if any(walk.revision for walk in walks):
        raise PlanningError("a walk was planned anew on the way, and cannot be gone back")
    tasks = []
    for k, walk in enumerate(reversed(walks)):
        index = first_index + k
        plan = plan_backwards(robot, course, settings, walk, stance, index=index)
        own = find_lane(course, walk, robot.foot_radius)
        lane = next(k for k, other in enumerate(course.lanes) if other is own)
        goal = float(own.coordinates(plan.end.body[:2])[0])
        task = Task(kind="walk", name=BACK_DOWN, lane=lane, goal=goal)
        samples = check_plan(robot, plan, dynamic=settings.dynamic)
        check_lift_offs(plan, samples, lift_off_margin)
        check_slopes(course, plan, settings.friction)
        check_torques(robot, plan, samples, slopes_of(course, settings.friction))
        check_shanks(robot, course, task, samples)
        tasks.append(task)
        stance = plan.end
    return tuple(tasks)
