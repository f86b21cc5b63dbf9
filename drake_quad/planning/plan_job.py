"""Plans to be made, as values: here and now, or by a process of its own while the robot stands."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.planning.motion_plan import MotionPlan, Stance
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.replan import replan_task
from drake_quad.planning.task import plan_task
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course


@dataclass(frozen=True, eq=False)
class PlanJob(ABC):
    """A plan to be made.

    Attributes:
        robot: The robot.
        course: The map.
        settings: The planner's settings.
    """

    robot: RobotModel
    course: Course
    settings: PlanSettings

    @property
    @abstractmethod
    def key(self) -> tuple[int, int]:
        """Task and revision of the plan."""

    @abstractmethod
    def make(self) -> MotionPlan:
        """The plan.

        Raises:
            PlanningError: There is none.
        """


@dataclass(frozen=True, eq=False)
class TaskJob(PlanJob):
    """A task to be planned.

    Attributes:
        task: Task to be carried out.
        stance: Stance that it begins in.
        index: Its place in the mission.
    """

    task: Task
    stance: Stance
    index: int

    @property
    def key(self) -> tuple[int, int]:
        """Task and revision of the plan."""
        return self.index, 0

    def make(self) -> MotionPlan:
        """The plan; see `plan_task`."""
        return plan_task(
            self.robot, self.course, self.settings, self.task, self.stance, index=self.index
        )


@dataclass(frozen=True, eq=False)
class RestJob(PlanJob):
    """The rest of a plan to be planned anew, after a push.

    Attributes:
        plan: Plan that was followed.
        time: Gait time from which on [s].
        feet: Where the feet stand (4, 3) in W [m].
    """

    plan: MotionPlan
    time: float
    feet: FloatArray

    @property
    def key(self) -> tuple[int, int]:
        """Task and revision of the plan."""
        return self.plan.index, self.plan.revision + 1

    def make(self) -> MotionPlan:
        """The plan; see `replan_task`."""
        desired = self.plan.sample(self.time).body[0]
        amidst = np.array([*self.feet[:, :2].mean(axis=0), *desired[2:]])
        first: PlanningError | None = None
        # Where the body is desired to be may be no place to set out from with the feet elsewhere.
        for body in (desired, amidst):
            stance = Stance(body, self.feet)
            try:
                return replan_task(
                    self.robot, self.course, self.settings, self.plan, self.time, stance
                )
            except PlanningError as problem:
                first = first or problem
        assert first is not None
        raise first


class PlanMaker(Protocol):
    """Makes plans while others wait."""

    def ask(self, job: PlanJob) -> MotionPlan | None:
        """The plan of the job, or None while it is being made; the first to ask begins it.

        Raises:
            PlanningError: There is none.
        """
