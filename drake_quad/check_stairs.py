"""Can this robot climb these stairs? Up, a turn, and down again, on paper."""

from dataclasses import dataclass
from math import ceil
from typing import Any

from drake_quad.design.candidate import hip_length
from drake_quad.designer import design_scenario
from drake_quad.designer_plan import Designed
from drake_quad.errors import PlanningError
from drake_quad.robot.load_robot import load_robot
from drake_quad.robot.robot_model import RobotModel, leg_length
from drake_quad.scenario import Scenario
from drake_quad.scenario_config import CourseElement, RobotConfig, StartConfig
from drake_quad.stability.kinds import HULL

TURNS = (-180.0, -90.0, 0.0, 90.0, 180.0)  # [deg] that can be asked for
LEAST_LANDING = 1.5  # [m]


@dataclass(frozen=True)
class Around:
    """What is around the flights up and down.

    Attributes:
        width: Of the flights and the floors [m]; as the robot needs if None.
        landing: Length of the landing between them [m]; as the robot needs if None.
        turn: On it [deg], left positive; one of TURNS. A half turn takes two landings.
    """

    width: float | None = None
    landing: float | None = None
    turn: float = 90.0


AS_USUAL = Around()


@dataclass(frozen=True, eq=False)
class Check:
    """What was found.

    Attributes:
        scenario: Robot and course, to be run.
        designed: The gait with its plan; None if there is none.
        reason: Why there is none.
        data: The figures behind the reason.
    """

    scenario: Scenario
    designed: Designed | None
    reason: str
    data: dict[str, Any]

    @property
    def feasible(self) -> bool:
        """Whether there is a gait."""
        return self.designed is not None


def stairs_scenario(
    robot: RobotModel,
    *,
    model: str,
    rise: float,
    run: float,
    count: int,
    around: Around = AS_USUAL,
) -> Scenario:
    """A flight up, a landing with a turn, and the same flight down, with room for the robot.

    Args:
        robot: The robot.
        model: What its scenario calls it.
        rise: Of the steps [m].
        run: Of the treads [m].
        count: Steps of a flight.
        around: Width, landing and turn.
    """
    size = max(leg_length(robot), 0.5 * hip_length(robot))
    start = 0.5 * hip_length(robot) + 0.8 * size + 0.1
    before = start + 0.5 * hip_length(robot) + 1.2 * size + run
    landing = max(LEAST_LANDING, 2.0 * (0.5 * hip_length(robot) + 1.1 * size + run))
    after = hip_length(robot) + 2.5 * size + 2.0 * run
    width = max(1.2, 3.0 * size) if around.width is None else around.width
    wide = _up(max(landing, width)) if around.landing is None else around.landing
    turns: dict[float, list[float | None]] = {
        0.0: [None],
        180.0: [90.0, 90.0],
        -180.0: [-90.0, -90.0],
    }
    landings = [
        CourseElement(kind="landing", length=wide, width=width if turn is None else None,
                      turn_deg=turn)
        for turn in turns.get(around.turn, [around.turn])
    ]  # fmt: skip
    course = [
        CourseElement(kind="floor", length=_up(before), width=width),
        CourseElement(kind="stairs", going="up", rise=rise, run=run, count=count, width=width),
        *landings,
        CourseElement(kind="stairs", going="down", rise=rise, run=run, count=count, width=width),
        CourseElement(kind="floor", length=_up(after), width=width),
    ]
    return Scenario(
        description=f"{robot.name} on {count} steps of {rise:g} m by {run:g} m, up and down",
        robot=RobotConfig(model=model),
        design="auto",
        course=course,
        start=StartConfig(distance=round(start, 3)),
    )


def check_stairs(
    model: str,
    *,
    rise: float,
    run: float,
    count: int = 10,
    source: str = "check",
    nearest: bool = True,
    thorough: bool = True,
    robot: RobotModel | None = None,
    margin: str = HULL,
    around: Around = AS_USUAL,
) -> Check:
    """Designs a gait for a flight up and down.

    Args:
        model: The robot, as in a scenario.
        rise: Of the steps [m].
        run: Of the treads [m].
        count: Steps of a flight.
        source: What an error names.
        nearest: Whether to say which rise would work if this one does not; it takes a while.
        thorough: Whether to look for a good gait, or any that a quick search finds.
        robot: The same robot, if it is at hand: to read it takes a while, too.
        margin: Over what the plan's margin is measured, see `stability.kinds`.
        around: Width, landing and turn.

    Raises:
        InputError: If the robot cannot be used, or there are no such stairs.
    """
    robot = robot or load_robot(model)
    scenario = stairs_scenario(robot, model=model, rise=rise, run=run, count=count, around=around)
    scenario.gait.margin = margin
    try:
        designed = design_scenario(
            scenario, source=source, nearest=nearest, thorough=thorough, robot=robot
        )
    except PlanningError as error:
        return Check(scenario, None, error.reason, dict(error.data))
    return Check(scenario, designed, "", {})


def _up(length: float) -> float:
    """To the next decimetre [m]."""
    return ceil(10.0 * length) / 10.0
