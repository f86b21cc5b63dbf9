"""What is known of a mission on a map that grows, or that feet make better; and how it goes on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_quad.errors import DrakeQuadError, PlanningError
from drake_quad.perception.sight import MapRevision
from drake_quad.planning.motion_plan import MotionPlan, Stance
from drake_quad.planning.onward import Eyes, plan_onward, plan_way_back, why_not
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.retreat import plan_retreat
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course


@dataclass(frozen=True, eq=False)
class Growth:
    """How to plan on where the map grows, or is revised.

    Attributes:
        settings: The planner's settings, with the errors that are allowed for on any map.
        eyes: The camera.
        lift_off_margin: Least margin with which the gait clock lets a foot lift off [m].
        back_down: Whether the robot goes back the way it came where there is no way on.
        revise_before: Index of the task before which the map is revised by what feet have found, if
            all of the mission is known from the start; None if the map is to grow.
    """

    settings: PlanSettings
    eyes: Eyes
    lift_off_margin: float
    back_down: bool = False
    revise_before: int | None = None

    @property
    def looks_again(self) -> bool:
        """Whether the mission is not known to its end, so that the robot looks again on its way."""
        return self.revise_before is None


@dataclass(frozen=True, eq=False)
class KnownMission:
    """What is known of a mission.

    Attributes:
        course: The map.
        settings: The planner's settings on it.
        mission: The tasks.
        revision: Number of the map's revision.
        goes_on: Whether there will be more tasks.
        revise_before: Index of the task before which the map is revised by what feet have found;
            None if it is not, or no longer.
        on_paper: How many of the first tasks plans that were made beforehand are of.
        planned_on: Number of the revision that was planned on last.
        refused: Why nothing was planned on a later one that feet have made; empty if none.
        retreat: The plans of the walks that the last tasks lead back over, the last walk first.
        reason: Why the robot goes back; empty if it does not.
    """

    course: Course
    settings: PlanSettings
    mission: tuple[Task, ...]
    revision: int
    goes_on: bool
    revise_before: int | None = None
    on_paper: int = 0
    planned_on: int = 0
    refused: str = ""
    retreat: tuple[MotionPlan, ...] = ()
    reason: str = ""

    def __deepcopy__(self, memo: object) -> "KnownMission":
        """It never changes, so that Drake may copy a Context without copying it."""
        return self


def on_other_map(stance: Stance, before: Course, after: Course) -> Stance:
    """A stance on another map, each foot as high over the ground there as it was before.

    The body stays where it is.

    Args:
        stance: The stance on the map of before.
        before: The map of before.
        after: The other map.
    """
    if after is before:
        return stance
    x, y = stance.feet[:, 0], stance.feet[:, 1]
    change = after.height(x, y) - before.height(x, y)
    if not np.isfinite(change).any():
        return stance
    change = np.where(np.isfinite(change), change, np.nanmedian(change))
    feet = stance.feet + change[:, None] * np.array([0.0, 0.0, 1.0])
    return replace(stance, feet=feet)


def mission_on(
    robot: RobotModel, growth: Growth, known: KnownMission, revision: MapRevision, stance: Stance
) -> KnownMission:
    """The mission with its next stretch on a map that has grown; or its rest, on one made better.

    Args:
        robot: The robot.
        growth: How to plan on.
        known: What is known of the mission, which has come to where the map is revised.
        revision: The map.
        stance: Where the robot stands, on the map of before.

    Raises:
        DrakeQuadError: There is no way on.
    """
    course = revision.map.course(foot_radius=robot.foot_radius)
    stance = on_other_map(stance, known.course, course)
    if known.revise_before is not None:
        return _with_better_map(robot, growth, known, revision, stance)
    onward = plan_onward(
        robot, growth.settings, revision.map, stance, growth.eyes,
        lift_off_margin=growth.lift_off_margin,
    )  # fmt: skip
    before = onward.revise_before
    return KnownMission(
        onward.course, onward.settings, (*known.mission, *onward.tasks), revision.number,
        goes_on=onward.goes_on, planned_on=revision.number, on_paper=len(known.mission),
        revise_before=None if before is None else len(known.mission) + before,
    )  # fmt: skip


def _with_better_map(
    robot: RobotModel, growth: Growth, known: KnownMission, revision: MapRevision, stance: Stance
) -> KnownMission:
    """The mission with its rest on a map that feet have made better.

    If it has no plan there, and the map of before is not disproved, it goes on with that.

    Raises:
        DrakeQuadError: It has no plan there, and heights are farther off than the plan allows for.
    """
    assert known.revise_before is not None
    answered = replace(known, revision=revision.number, revise_before=None)
    try:
        onward = plan_way_back(
            robot, growth.settings, revision.map, known.mission[known.revise_before :], stance,
            lift_off_margin=growth.lift_off_margin,
        )  # fmt: skip
    except DrakeQuadError as problem:
        course = revision.map.course(foot_radius=robot.foot_radius)
        if farthest_apart(known.course, course) > known.settings.map_error_height:
            raise
        return replace(answered, refused=why_not(problem))
    return replace(
        answered, course=onward.course, settings=onward.settings, planned_on=revision.number,
        on_paper=known.revise_before,
    )  # fmt: skip


def farthest_apart(one: Course, other: Course) -> float:
    """How far the heights of two maps of the same flight are apart at most [m]."""
    heights = (course.nosings()[:, 0, 2] for course in (one, other))
    return float(np.abs(np.subtract(*heights)).max(initial=0.0))


def mission_back(
    robot: RobotModel,
    growth: Growth,
    known: KnownMission,
    plans: Sequence[MotionPlan],
    stance: Stance,
    *,
    reason: str,
) -> KnownMission:
    """The mission with the way back to where the robot started.

    Args:
        robot: The robot.
        growth: How to plan on.
        known: What is known of the mission; tasks that are left are given up.
        plans: The plans that were followed, and their revisions.
        stance: Where the robot stands.
        reason: Why it goes back.

    Raises:
        DrakeQuadError: There is no way back.
    """
    done = known.mission[: known.revise_before]
    walks = [plan for plan in plans if done[plan.index].kind == "walk"]
    tasks = plan_retreat(
        robot, known.course, known.settings, walks, stance,
        first_index=len(done), lift_off_margin=growth.lift_off_margin,
    )  # fmt: skip
    if not tasks:
        raise PlanningError("the robot has not gone anywhere")
    return replace(
        known, mission=(*done, *tasks), goes_on=True, revise_before=None, on_paper=len(done),
        retreat=tuple(walks[::-1]), reason=reason,
    )  # fmt: skip
