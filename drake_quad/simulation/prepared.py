"""A scenario made ready: the values that planning and simulation take."""

from dataclasses import dataclass

from drake_quad.perception.sight import MapRevision, Sight
from drake_quad.planning.known_mission import Growth
from drake_quad.planning.mission import MissionPlan
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.config import Scenario
from drake_quad.systems.disturbances import Disturbances
from drake_quad.terrain.course import Course
from drake_quad.util.display import one_line


@dataclass(frozen=True, eq=False)
class PreparedScenario:
    """A scenario made into the values that planning and simulation take.

    Attributes:
        scenario: The scenario, its gait designed if it asked for that.
        robot: The robot as its controller knows it.
        course: The map that is planned on.
        settings: Settings of the planner.
        tasks: Tasks of the mission.
        stance: Stance in which the robot stands at first.
        plan: Plan of the whole mission, on paper.
        world: The course as it really is.
        disturbances: What the controller is not told.
        sight: What the map was made of; None if it was told.
        growth: How to plan on where the robot looks again on its way, or where its feet make the
            map better; None if neither.
        revisions: The maps that it had on its way, once it has been simulated.
        robot_digest: Digest of the robot's file as it was read.
    """

    scenario: Scenario
    robot: RobotModel
    course: Course
    settings: PlanSettings
    tasks: tuple[Task, ...]
    stance: Stance
    plan: MissionPlan
    world: Course
    disturbances: Disturbances
    sight: Sight | None = None
    growth: Growth | None = None
    revisions: tuple[MapRevision, ...] = ()
    robot_digest: str = ""

    def __repr__(self) -> str:
        return one_line(self, self.scenario.description, repr(self.robot), repr(self.plan))
