"""The next stretch of a mission on a map that may grow: to the goal, or to a tread to look from.

Of a flight whose end is not known the robot climbs the steps that are known well enough, and stops
on a tread from which steps that the map has are in view again: from one of them on it looks for
more. Of the treads with such a view it takes the one farthest up that its gait ends on.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, hypot

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import DrakeQuadError, InputError, PlanningError
from drake_quad.math.rotations import rotations
from drake_quad.perception.camera_model import CameraModel
from drake_quad.perception.growing_map import trust
from drake_quad.perception.look_again import nosings_in_view
from drake_quad.perception.stair_map import StairMap, unfinished
from drake_quad.perception.stair_tracker import CameraPose
from drake_quad.planning.clearance import check_shanks
from drake_quad.planning.mission import (
    check_lift_offs,
    check_plan,
    check_slopes,
    check_torques,
    how_much_slower,
    plan_tasks,
)
from drake_quad.planning.motion_plan import MotionPlan, Stance
from drake_quad.planning.problem import END_CLEARANCE, PlanSettings, Task, derive_mission
from drake_quad.planning.settled_places import flight_places
from drake_quad.planning.stance_margin import slopes_of
from drake_quad.planning.turning_room import check_turning_width
from drake_quad.planning.walk_footsteps import walk_start
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane

# Nosings of the map that are to be in view where the robot looks again: two tell a flight by
# themselves. With one the next step has to be in view as well, or the ground behind that nosing.
GOOD_VIEW, LEAST_VIEW = 2, 1
PROGRESS = 0.3  # [m] that a walk on the floor is to come nearer
MAP_STEP = 1e-4  # [m] to which errors of the map that are allowed for are rounded up
SHANK_ROOM = 0.004  # [m] between shanks and stairs that are as far off as they may be
SEARCHES = 3  # for a body path, where the first finds none that legs can follow
BY_THE_PATH = {"excess", "too_fast", "room"}  # figures of errors that another path may not have
PATIENCE = 1.25  # by which all times are longer, waits too, where the margin would be too small
ATTEMPTS = 3  # that may be refused: for want of searches, for being too quick, and for the margin
WALK_ON, LOOK_AGAIN = "walk to the next look", "stand and look again"


@dataclass(frozen=True, eq=False)
class Eyes:
    """A camera on the trunk, as planners know it.

    Attributes:
        model: Intrinsics of its images.
        R_BC: Attitude on the base, (3, 3).
        p_BC: Place on the base, (3,) [m].
        look_time: How long the robot stands and looks [s].
    """

    model: CameraModel
    R_BC: FloatArray
    p_BC: FloatArray
    look_time: float

    def pose(self, body: FloatArray) -> CameraPose:
        """Where the camera is, of a body's pose (5,) in W."""
        R_WB = rotations(body[None])[0]
        return CameraPose(R_WB @ self.R_BC, body[:3] + R_WB @ self.p_BC)


@dataclass(frozen=True, eq=False)
class Onward:
    """The next stretch.

    Attributes:
        course: The map that it is planned on.
        settings: The planner's settings, with the errors of that map.
        tasks: What to do.
        goes_on: Whether the robot is to look again at its end.
        revise_before: Index in `tasks` of the one before which the map is revised by what feet have
            found; None if it is not.
    """

    course: Course
    settings: PlanSettings
    tasks: tuple[Task, ...]
    goes_on: bool
    revise_before: int | None = None


def task_to_revise_before(tasks: Sequence[Task]) -> int | None:
    """Before which task the map of a flight is revised by what feet have found on the way up.

    Args:
        tasks: The tasks; the first walk leads over the flight.

    Returns:
        The first task after that walk, if the robot comes back; else None.
    """
    walks = [k for k, task in enumerate(tasks) if task.kind == "walk"]
    return walks[0] + 1 if len(walks) > 1 else None


def why_not(error: DrakeQuadError) -> str:
    """Why what was seen is not climbed; of a field of the map that cannot be, with its value."""
    if not isinstance(error, InputError):
        return str(error)
    told = f"{error.value:.2f}" if isinstance(error.value, float) else f"{error.value}"
    return f"{error.field} of the map is {told}: {error.remedy}"


def round_up(error: float) -> float:
    """An error of the map [m], rounded up to a tenth of a millimetre."""
    return ceil(error / MAP_STEP) * MAP_STEP


def with_map_errors(settings: PlanSettings, found: StairMap) -> PlanSettings:
    """The settings that allow for the errors of a map, and for what they did allow for already.

    Shanks keep farther from the stairs than these may be off, where they can.
    """
    return replace(
        settings,
        shank_room=max(
            settings.shank_room, hypot(found.error_place, found.error_height) + SHANK_ROOM
        ),
        map_error_place=max(settings.map_error_place, round_up(found.error_place)),
        map_error_height=max(settings.map_error_height, round_up(found.error_height)),
    )


def plan_onward(
    robot: RobotModel,
    settings: PlanSettings,
    found: StairMap,
    stance: Stance,
    eyes: Eyes,
    *,
    lift_off_margin: float,
) -> Onward:
    """The next stretch, planned on paper and checked.

    Args:
        robot: The robot.
        settings: The planner's settings, with the errors that are allowed for on any map.
        found: The map.
        stance: Where the robot stands.
        eyes: Its camera.
        lift_off_margin: Least margin with which the gait clock lets a foot lift off [m].

    Raises:
        PlanningError: There is no way on, with the reason.
        InputError: What is believed is no course.
    """
    course = found.course(foot_radius=robot.foot_radius)
    settings = with_map_errors(settings, found)
    if found.complete:
        tasks = derive_mission(course, settings)[1:]
        plans, pace = _plan(robot, course, settings, tasks, stance, lift_off_margin=lift_off_margin)
        doubt = doubtful_foothold(found, course, plans)
        if not doubt:
            return Onward(
                course, pace, tasks, goes_on=False, revise_before=task_to_revise_before(tasks)
            )
        found = trust(unfinished(found, doubt), reach=0.0, yaw_sigma=0.0)
        course = found.course(foot_radius=robot.foot_radius)
    return _to_a_look(robot, course, settings, found, stance, eyes, lift_off_margin=lift_off_margin)


def plan_way_back(
    robot: RobotModel,
    settings: PlanSettings,
    found: StairMap,
    tasks: tuple[Task, ...],
    stance: Stance,
    *,
    lift_off_margin: float,
) -> Onward:
    """The rest of a mission on a map that feet have made better, planned on paper and checked.

    `tasks` are those that are left; the other arguments are `plan_onward`'s.

    Raises:
        PlanningError: There is no such plan, with the reason.
        InputError: The map is no course.
    """
    course = found.course(foot_radius=robot.foot_radius)
    plans, pace = _plan(
        robot, course, with_map_errors(settings, found), tasks, stance,
        lift_off_margin=lift_off_margin,
    )  # fmt: skip
    doubt = doubtful_foothold(found, course, plans)
    if doubt:
        raise PlanningError(doubt)
    return Onward(course, pace, tasks, goes_on=False)


def doubtful_foothold(found: StairMap, course: Course, plans: Sequence[MotionPlan]) -> str:
    """Which foothold may be over the edge of its step, as well as that is known; empty if none.

    Args:
        found: The map.
        course: The same as a course.
        plans: Plans on it.
    """
    turned = np.sqrt(max(found.error_place**2 - float(found.place_errors.max()) ** 2, 0.0))
    errors = np.hypot(found.place_errors, turned)
    steps = [step for plan in plans for step in plan.contacts.steps]
    if not steps:
        return ""
    s = course.lanes[0].coordinates(np.array([step.swing.p_end for step in steps]))[0]
    on = np.searchsorted(found.places, s) - 1  # the step that each foot is on, -1 for the floor
    room = np.where(on >= 0, s - found.places[on] - errors[on], np.inf)
    k = int(np.argmin(room))
    if room[k] >= 0.0:
        return ""
    return (
        f"the nosing of step {int(on[k]) + 1} is known to {1e3 * errors[on[k]]:.0f} mm, and foot "
        f"{steps[k].leg.short} would be put down {1e3 * (s[k] - found.places[on[k]]):.0f} mm "
        "behind it"
    )


def _to_a_look(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    found: StairMap,
    stance: Stance,
    eyes: Eyes,
    *,
    lift_off_margin: float,
) -> Onward:
    """The stretch to where the robot looks again; the arguments are `plan_onward`'s.

    Raises:
        PlanningError: There is no such place.
    """
    lane = course.lanes[0]
    known = float(found.places[found.trusted - 1]) if found.trusted else float(found.places[0])
    reason = ""
    fair: Onward | None = None
    poor: Onward | None = None
    for goal, on_tread in stop_places(lane, settings, stance, known):
        if fair is not None and not on_tread:
            break
        tasks = (
            Task(kind="walk", name=WALK_ON, lane=0, goal=goal),
            Task(kind="stand", name=LOOK_AGAIN, lane=0, duration=eyes.look_time),
        )
        try:
            plans, pace = _plan(
                robot, course, settings, tasks, stance, lift_off_margin=lift_off_margin
            )
        except PlanningError as problem:
            reason = reason or f"; {problem.reason}"
            continue
        pose = eyes.pose(plans[-1].end.body)
        in_view = len(nosings_in_view(found, eyes.model, pose))
        # Behind the last nosing of a flight there is no further step that would be seen.
        least = GOOD_VIEW if found.doubt else LEAST_VIEW
        if _farthest(lane, plans[0]) >= known:
            continue
        stretch = Onward(course, pace, tasks, goes_on=True)
        if in_view < least:
            if (
                on_tread
                and not found.doubt
                and nosings_in_view(found, eyes.model, pose, further=1).size
            ):
                poor = poor or stretch
            continue
        if in_view >= GOOD_VIEW:
            return stretch
        fair = fair or (stretch if on_tread else None)
    fair = fair or poor
    if fair is not None:
        return fair
    raise PlanningError(
        f"{found.doubt or 'how many steps there are is not known'}, and of the "
        f"{found.trusted} that are known well enough there is none to stop on from which more "
        f"would be seen{reason}"
    )


def stop_places(
    lane: Lane, settings: PlanSettings, stance: Stance, known: float
) -> tuple[tuple[float, bool], ...]:
    """Where a body may stop to look again [m], and whether over a tread; the farthest first.

    Args:
        lane: The lane.
        settings: The gait's.
        stance: Where the robot stands.
        known: The last nosing that is known well enough, along the lane [m].
    """
    start = walk_start(lane, settings, stance)
    on_treads = [
        float(s)
        for flight in lane.flights
        for s in flight_places(lane, flight, settings.pattern.per_tread)
    ]
    first = float(lane.nosings()[0, 0])
    before = first - 0.5 * settings.workspace.P_x - 0.25 * settings.stride - END_CLEARANCE
    found = [(s, True) for s in on_treads[::-1] if start + 1e-6 < s < known]
    if before > start + PROGRESS:
        found.append((before, False))
    return tuple(found)


def _farthest(lane: Lane, plan: MotionPlan) -> float:
    """How far along the lane a plan puts a foot down [m]."""
    places = [lane.coordinates(step.swing.p_end)[0] for step in plan.contacts.steps]
    return float(np.max(places, initial=-np.inf))


def slower(settings: PlanSettings, factor: float) -> PlanSettings:
    """The settings with all times of steps so many times as long."""
    return replace(
        settings,
        cycle_time=factor * settings.cycle_time,
        spin_cycle_time=factor * settings.spin_cycle_time,
        swing_time=factor * settings.swing_time,
        shift_time=factor * settings.shift_time,
    )


def _plan(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    tasks: tuple[Task, ...],
    stance: Stance,
    *,
    lift_off_margin: float,
) -> tuple[list[MotionPlan], PlanSettings]:
    """The plans of some tasks, checked as those of a mission are before a run, and their settings.

    The gait was found for a walk from somewhere else. If legs would be beyond their limits, or in
    the stairs, paths are looked for by further searches. If joints would still have to turn faster
    than they can, all is planned again as much slower. If the static margin is too small, the
    body gets more time to shift.

    Raises:
        PlanningError: There is none, or it cannot be carried out.
    """
    for _ in range(ATTEMPTS):
        try:
            return _checked(robot, course, settings, tasks, stance, lift_off_margin), settings
        except PlanningError as problem:
            if settings.searches < SEARCHES and not problem.data.keys().isdisjoint(BY_THE_PATH):
                settings = replace(settings, searches=SEARCHES)
                continue
            factor = how_much_slower(problem)
            if factor is not None:
                settings = slower(settings, factor)
            elif "margin" in problem.data:
                waits = PATIENCE * settings.switch_wait
                settings = replace(slower(settings, PATIENCE), switch_wait=waits)
            else:
                raise
    return _checked(robot, course, settings, tasks, stance, lift_off_margin), settings


def _checked(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    tasks: tuple[Task, ...],
    stance: Stance,
    lift_off_margin: float,
) -> list[MotionPlan]:
    """The plans of some tasks, checked as those of a mission are before a run.

    Raises:
        PlanningError: There is none, or it cannot be carried out.
    """
    plans = []
    for task, plan in zip(tasks, plan_tasks(robot, course, settings, tasks, stance), strict=True):
        samples = check_plan(robot, plan, dynamic=settings.dynamic)
        if not settings.dynamic:
            check_lift_offs(plan, samples, lift_off_margin)
        check_slopes(course, plan, settings.friction)
        check_torques(robot, plan, samples, slopes_of(course, settings.friction))
        check_shanks(robot, course, task, samples)
        if task.kind == "spin":
            check_turning_width(robot, plan, course.lanes[task.lane])
        plans.append(plan)
    return plans
