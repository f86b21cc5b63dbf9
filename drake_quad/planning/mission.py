"""Plans a whole mission on paper, each task from where the one before ends, and checks it."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import inf, isfinite, isnan, nan

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.planning.body_reference import level_pose, robot_stance
from drake_quad.planning.contact_forces import find_overload
from drake_quad.planning.motion_plan import MotionPlan, PlanSamples, Stance, evaluate
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.stance_margin import Slopes, check_stance
from drake_quad.planning.step_builder import peak_speed
from drake_quad.planning.task import plan_task
from drake_quad.planning.zmp import ZMP_CHECK_PERIOD, sample_zmp
from drake_quad.robot.legs import LEGS
from drake_quad.robot.model import RobotModel
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.course import Course, ground_normals
from drake_quad.terrain.lane import Lane
from drake_quad.util.display import one_line

# Of the controller's friction, that standing on a slope may take: moving takes some, too.
HELD_BY_FRICTION = 0.9
CHECK_PERIOD = 0.05  # [s] between the samples that a plan is checked at
MOST_OFF_LINE = 0.5  # of a foot's radius, in the mean over a swing of two feet
SLOWER, SLOWEST = 1.1, 3.0  # times as slow as joints' speeds ask for, and at most do
TORQUE_EVERY = 4  # so many samples are looked at for torques, which change slowly


@dataclass(frozen=True, eq=False)
class MissionPlan:
    """The plans of all tasks.

    Attributes:
        plans: One a task.
        starts: When each begins, if the clock never waits [s].
        planning_time: What it took to plan them [s]; nan if that is not known.
        dynamic: Whether they keep the zero-moment point over the feet, not the centre of mass.
    """

    plans: tuple[MotionPlan, ...]
    starts: tuple[float, ...]
    planning_time: float
    dynamic: bool = False

    def __repr__(self) -> str:
        kind = "moves balanced by motion" if self.dynamic else ""
        tasks = "1 task" if len(self.plans) == 1 else f"{len(self.plans)} tasks"
        margin = "" if isnan(self.margin) else f"smallest margin {self.margin:.3f} m"
        return one_line(self, f"{tasks} in {self.duration:.1f} s", margin, kind)

    @property
    def margin(self) -> float:
        """Smallest margin of the plans in which something moves [m]; nan if nothing does."""
        margins = [plan.margin for plan in self.plans if not isnan(plan.margin)]
        return min(margins, default=nan)

    @property
    def duration(self) -> float:
        """When the last task ends [s]."""
        return self.starts[-1] + self.plans[-1].duration


def initial_stance(
    robot: RobotModel, course: Course, settings: PlanSettings, *, start: float
) -> Stance:
    """The stance at `start` [m] along the first lane: feet at their workspaces' centres.

    Raises:
        PlanningError: If a foot would stand beyond the ground, or in a riser or on its nosing.
    """
    lane = course.lanes[0]
    stance = robot_stance(settings)
    at = start + stance[:, 0]
    places = lane.point(at, stance[:, 1])
    heights = lane.height(at)
    _check_start(lane, at, heights, robot.foot_radius, start)
    feet = np.column_stack([places, heights + robot.foot_radius])
    ground = float(np.mean(heights))
    return Stance(level_pose(lane.point(start), lane.yaw, ground, settings), feet)


def _check_start(
    lane: Lane, at: FloatArray, heights: FloatArray, radius: float, start: float
) -> None:
    """Refuses a start with a foot at `at` (4,) that has no ground, or is in a riser, or on it."""
    risers = lane.risers()[0]
    for leg in LEGS:
        s = float(at[leg.row])
        if not isfinite(float(heights[leg.row])):
            raise PlanningError(
                f"start.distance = {start:g}: foot {leg.short} would stand at {s:.3f} m, where "
                "there is no ground; give another distance",
                place=s,
            )
        near = float(np.abs(risers - s).min(initial=inf))
        if near < radius:
            raise PlanningError(
                f"start.distance = {start:g}: foot {leg.short} would stand {near:.3f} m from a "
                f"riser, and its radius is {radius:.3f} m; give another distance",
                place=s,
            )


def plan_mission(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    mission: Sequence[Task],
    stance: Stance,
) -> MissionPlan:
    """Plans every task of `mission`.

    Raises:
        PlanningError: If the robot cannot stand so, or a task has no plan.
    """
    begun = time.perf_counter()
    plans = tuple(plan_tasks(robot, course, settings, mission, stance))
    taken = time.perf_counter() - begun
    return join_plans(plans, taken, dynamic=settings.dynamic)


def plan_tasks(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    mission: Sequence[Task],
    stance: Stance,
    warm_starts: dict[int, MotionPlan] | None = None,
) -> Iterator[MotionPlan]:
    """Plans task by task, each when it is requested, so that a caller may stop at any.

    Args:
        robot: The robot.
        course: The ground.
        settings: Gait and body parameters.
        mission: The tasks.
        stance: Where body and feet are, at rest.
        warm_starts: Plans of the same tasks with other times, by place in the mission, whose paths
            are begun with (see `plan_task`). New ones take their places.

    Raises:
        PlanningError: If the robot cannot stand so, or a task has no plan.
    """
    check_stance(robot, stance)
    warm_starts = {} if warm_starts is None else warm_starts
    for index, task in enumerate(mission):
        warm_start = warm_starts.get(index)
        plan = plan_task(robot, course, settings, task, stance, index=index, warm_start=warm_start)
        warm_starts[index] = plan
        yield plan
        stance = plan.end


def join_plans(
    plans: Sequence[MotionPlan], planning_time: float, *, dynamic: bool = False
) -> MissionPlan:
    """The mission whose tasks' plans these are; the arguments are MissionPlan's."""
    ends = accumulate((plan.duration for plan in plans), initial=0.0)
    return MissionPlan(tuple(plans), tuple(ends)[:-1], planning_time, dynamic=dynamic)


def check_mission(
    robot: RobotModel, mission: MissionPlan, *, uniform_body: bool = False
) -> list[PlanSamples]:
    """Checks that the robot can follow the plans: reach, joint limits and speeds, and margin.

    The margin is the static one, or if the mission is `dynamic` the zero-moment point's.

    Args:
        robot: The robot.
        mission: The plans.
        uniform_body: Whether the body's path is the paper's, whose margin touches zero: then the
            margin is not checked.

    Returns:
        The samples of every plan.

    Raises:
        PlanningError: With the leg, the time and by how much.
    """
    return [
        check_plan(robot, plan, dynamic=mission.dynamic, uniform_body=uniform_body)
        for plan in mission.plans
    ]


def check_plan(
    robot: RobotModel, plan: MotionPlan, *, dynamic: bool, uniform_body: bool = False
) -> PlanSamples:
    """Checks one task's plan, as `check_mission` does a mission's, and returns its samples.

    Raises:
        PlanningError: With the leg, the time and by how much.
    """
    period = ZMP_CHECK_PERIOD if dynamic else CHECK_PERIOD
    count = int(np.ceil(plan.duration / period)) + 1
    s = evaluate(robot, plan, np.linspace(0.0, plan.duration, count))
    _check_reach(robot, plan, s)
    _check_joints(robot, plan, s)
    if dynamic:
        _check_zmp(robot, plan)
    elif not uniform_body and plan.margin_kind == HULL:  # of others `plan_task` sees to it
        _check_margin(plan, s)
    return s


def _check_reach(robot: RobotModel, plan: MotionPlan, s: PlanSamples) -> None:
    k, row = np.unravel_index(int(np.argmax(s.reach_excess)), s.reach_excess.shape)
    excess = float(s.reach_excess[k, row])
    if excess > 1e-6:
        t = float(s.times[k])
        raise PlanningError(
            f"leg {LEGS[row].short} is {excess:.3f} m too short for "
            f"'{plan.segment_name(t)}' at {t:.1f} s of the task",
            excess=excess,
            leg=int(row) + 1,
            body=s.body[k, 0].tolist(),
            foot=s.feet[k, row].tolist(),
        )


def _check_margin(plan: MotionPlan, s: PlanSamples) -> None:
    k = int(np.argmin(s.margin))
    if s.margin[k] <= 0.0:
        name = plan.segment_name(float(s.times[k]))
        raise PlanningError(
            f"the static margin would be {s.margin[k]:.3f} m in '{name}'; a larger duty factor, "
            "gait.switch_wait or transition.shift_time, or longer level ground, may help",
            margin=float(s.margin[k]),
        )


def check_lift_offs(
    plan: MotionPlan, s: PlanSamples, least: float, *, demanded: float = 0.0
) -> None:
    """Checks that no foot lifts with less margin than the gait clock demands: it would stop.

    Args:
        plan: One task's.
        s: The plan's samples.
        least: `controller.lift_off_margin` [m].
        demanded: `controller.margin_demanded` [m], below which the clock stops at any time.

    Raises:
        PlanningError: With the margin that there is, and the one that there has to be.
    """
    if not plan.contacts.steps:
        return
    k = int(np.argmin(s.margin))
    for asked, words in (
        (least, "no foot is lifted with less than controller.lift_off_margin"),
        (demanded, "the gait clock stops below controller.margin_demanded"),
    ):
        if s.margin[k] < asked:
            name = plan.segment_name(float(s.times[k]))
            raise PlanningError(
                f"the static margin would be {s.margin[k]:.3f} m in '{name}', and {words} = "
                f"{asked:.3f} m",
                margin=float(s.margin[k]),
            )


def check_slopes(course: Course, plan: MotionPlan, friction: float) -> None:
    """Checks that no foot stands on ground steeper than the controller's friction allows.

    Static margins are those of vertical forces, which have to be within every foot's friction cone.

    Args:
        course: The ground.
        plan: One task's.
        friction: `controller.friction`, which the controller's forces stay within.

    Raises:
        PlanningError: With the foot, its place, and the friction that it takes.
    """
    steps = plan.contacts.steps
    feet = np.stack([*plan.contacts.feet, *(step.swing.p_end for step in steps)])
    legs = [*LEGS, *(step.leg for step in steps)]
    normals = ground_normals(course, feet[:, :2])
    steep = np.hypot(normals[:, 0], normals[:, 1]) / normals[:, 2]
    k = int(np.argmax(steep))
    if steep[k] > HELD_BY_FRICTION * friction:
        takes = float(np.ceil(100.0 * steep[k] / HELD_BY_FRICTION) / 100.0)
        raise PlanningError(
            f"foot {legs[k].short} would stand on a slope of {steep[k]:.2f} at "
            f"{feet[k, 0]:.2f}, {feet[k, 1]:.2f} m, and the controller counts on no more than "
            f"controller.friction = {friction:g}; set that to {takes:g} or more if the ground has "
            "it, or take a gentler slope",
            slope=float(steep[k]),
        )


def check_torques(
    robot: RobotModel, plan: MotionPlan, s: PlanSamples, ground: Slopes | None = None
) -> None:
    """Checks that the robot can stand still wherever a plan has it, within what its joints can.

    Args:
        robot: The robot.
        plan: One task's.
        s: The plan's samples.
        ground: Ground with slopes; None where all is level.

    Raises:
        PlanningError: With the joint, the time, and what it would take of its torque.
    """
    seen = s.every(TORQUE_EVERY)
    found = find_overload(robot, seen, ground)
    if found is not None:
        t = float(seen.times[found.sample])
        raise PlanningError(
            f"joint {robot.joint_names[found.joint]} would need {found.ratio:.0%} of its torque to "
            f"stand still at {t:.1f} s of '{plan.segment_name(t)}', and feet "
            "that share the weight otherwise ask for more than there is, too",
            torque=found.ratio,
        )


def _check_zmp(robot: RobotModel, plan: MotionPlan) -> None:
    """The zero-moment point stays inside the support polygons: else the robot would tip."""
    zmp = sample_zmp(robot, plan.contacts, plan.body, ZMP_CHECK_PERIOD)
    k = int(np.argmin(zmp.margin))
    if zmp.margin[k] <= 0.0:
        name = plan.segment_name(float(zmp.times[k]))
        raise PlanningError(
            f"the zero-moment point would be {-zmp.margin[k]:.3f} m outside of the feet at "
            f"{zmp.times[k]:.2f} s of '{name}'; a longer cycle or gait.switch_wait may help",
            margin=float(zmp.margin[k]),
        )
    for phase in plan.contacts.phases:
        mine = (zmp.times > phase.start) & (zmp.times < phase.end)
        if len(phase.steps) < 2 or not np.any(mine):
            continue
        beside = float(zmp.off_line[mine].mean())
        if beside > MOST_OFF_LINE * robot.foot_radius:
            raise PlanningError(
                f"the zero-moment point would be {beside:.3f} m beside the line of the two feet "
                f"that stand, in the mean over the swing at {phase.start:.2f} s of "
                f"'{plan.segment_name(phase.start)}', and {MOST_OFF_LINE:g} of a foot's radius, "
                f"{MOST_OFF_LINE * robot.foot_radius:.3f} m, is too much; another "
                "gait.cycle_time, a larger gait.duty_factor, or lower steps may help",
                margin=-beside,
            )


def how_much_slower(error: PlanningError) -> float | None:
    """By which factor times are to be longer for a plan that was refused.

    Args:
        error: Why there is no plan.

    Returns:
        The factor; None if no joint was too fast, or by so much that another gait is wanted.
    """
    too_fast: float | None = error.data.get("too_fast")
    return None if too_fast is None or too_fast > SLOWEST else SLOWER * too_fast


def _check_joints(robot: RobotModel, plan: MotionPlan, s: PlanSamples) -> None:
    q = s.q.reshape(-1, 12)
    over = np.maximum(robot.q_lower - q, q - robot.q_upper)
    k, j = np.unravel_index(int(np.argmax(over)), over.shape)
    if over[k, j] > 0.0:
        raise PlanningError(
            f"joint {robot.joint_names[j]} would be {over[k, j]:.3f} rad beyond its limits at "
            f"{s.times[k]:.1f} s of '{plan.segment_name(float(s.times[k]))}'",
            joint=robot.joint_names[j],
            excess=float(over[k, j]),
            body=s.body[k, 0].tolist(),
            foot=s.feet[k, j // 3].tolist(),
        )
    if len(q) > 1:
        speed = np.abs(np.diff(q, axis=0)) / np.diff(s.times)[:, None]
        k, j = np.unravel_index(int(np.argmax(speed / robot.speed)), speed.shape)
        if speed[k, j] > robot.speed[j]:
            raise PlanningError(
                f"joint {robot.joint_names[j]} would have to turn at {speed[k, j]:.1f} rad/s, "
                f"{robot.speed[j]:.1f} rad/s is its limit",
                joint=robot.joint_names[j],
                speed=float(speed[k, j]),
                too_fast=float(speed[k, j] / robot.speed[j]),
                foot_speed=max(
                    (peak_speed(t.swing) for t in plan.contacts.steps if t.leg.row == j // 3),
                    default=0.0,
                ),
            )
