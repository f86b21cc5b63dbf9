"""Can this robot climb these stairs? The search for a gait, and the nearest stairs that work."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, floor, isfinite
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError, PlanningError
from drake_quad.gait_design.candidates import hip_length
from drake_quad.gait_design.designer import design_scenario
from drake_quad.gait_design.plan_candidates import Designed
from drake_quad.gait_design.search import highest_rise
from drake_quad.planning.mission import MissionPlan
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import RobotModel, leg_length, link_outline_of
from drake_quad.scenario.config import CourseElement, RobotConfig, Scenario, StartConfig
from drake_quad.scenario.load import load_scenario
from drake_quad.stability.equilibrium_region import HULL
from drake_quad.terrain.elements import RISE_MAX, RUN_MAX, WIDTH_MIN, Stairs
from drake_quad.util.files import html_table, user_path

# ------------------------------------------------------------------------------------------------
# Can this robot climb these stairs? Up, a turn, and down again, on paper.
# ------------------------------------------------------------------------------------------------


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
class Feasibility:
    """Whether a robot climbs stairs or a course, and how.

    Attributes:
        scenario: Robot and course; with the gait, ready to be run, if there is one.
        designed: The gait with its plan; None if there is none.
        reason: Why there is none.
        data: The figures behind the reason.
        robot: The robot; None of an answer that was made up.
        stairs: The flight that was asked about; None if it was a course.
        around: What is around the flight.
    """

    scenario: Scenario
    designed: Designed | None
    reason: str
    data: dict[str, Any]
    robot: RobotModel | None = None
    stairs: Stairs | None = None
    around: Around = AS_USUAL

    @property
    def feasible(self) -> bool:
        """Whether there is a gait."""
        return self.designed is not None

    @property
    def plan(self) -> MissionPlan | None:
        """The plan of the whole course; None if there is none."""
        return None if self.designed is None else self.designed.plan

    @property
    def margin(self) -> float | None:
        """Smallest static margin of the plan [m]; None if there is no plan."""
        return None if self.designed is None else self.designed.margin

    def nearest(self) -> Stairs | None:
        """The nearest stairs that a quick search finds a gait for: lower steps, or deeper treads.

        Returns:
            The stairs asked about if the robot climbs these; None if nothing was found, or if the
            question was about a course.
        """
        if self.feasible or self.stairs is None or self.robot is None:
            return self.stairs if self.feasible else None
        asked = self.stairs
        found = nearest_of(
            self,
            self.robot,
            model=self.scenario.robot.model,
            rise=asked.rise,
            run=asked.run,
            count=asked.count,
            margin=self.scenario.gait.margin,
            around=self.around,
        )
        return None if found is None else Stairs(*found, asked.count)

    def _repr_html_(self) -> str:
        """The answer, where a notebook shows it."""
        rows = [("answer", "yes" if self.feasible else f"no: {self.reason}")]
        if self.designed is not None:
            rows += [
                ("static margin of the plan", f"{1e3 * self.designed.margin:.0f} mm"),
                ("the whole course takes", f"{self.designed.plan.duration:.0f} s"),
            ]
        return html_table(rows)


def make_stairs_scenario(
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


def design_for_flight(
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
) -> Feasibility:
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
        margin: Over what the plan's margin is measured, one of `KINDS`.
        around: Width, landing and turn.

    Raises:
        InputError: If the robot cannot be used, or there are no such stairs.
    """
    robot = robot or load_robot(model)
    scenario = make_stairs_scenario(
        robot, model=model, rise=rise, run=run, count=count, around=around
    )
    scenario.gait.margin = margin
    try:
        designed = design_scenario(
            scenario, source=source, nearest=nearest, thorough=thorough, robot=robot
        )
    except PlanningError as error:
        return Feasibility(
            scenario, None, error.reason, dict(error.data), robot, Stairs(rise, run, count), around
        )
    return Feasibility(designed.scenario, designed, "", {}, robot, Stairs(rise, run, count), around)


def _up(length: float) -> float:
    """To the next decimetre [m]."""
    return ceil(10.0 * length) / 10.0


# ------------------------------------------------------------------------------------------------
# What is asked of a robot and its stairs: a flight by its numbers, or a scenario's course.
# ------------------------------------------------------------------------------------------------


COUNT_MOST = 100
LANDING_MOST = 100.0  # [m] of a landing, and of a width


def check_flight_numbers(rise: float, run: float, count: int) -> None:
    """Makes sure that there can be such stairs.

    Raises:
        InputError: Naming the option, its value and what would be right.
    """
    for name, value, most in (("rise", rise, RISE_MAX), ("run", run, RUN_MAX)):
        if not (isfinite(value) and 0.0 < value <= most):
            remedy = f"give metres, more than 0 and at most {most:g}"
            raise InputError(source=f"--{name}", field=name, value=value, remedy=remedy)
    if not 1 <= count <= COUNT_MOST:
        remedy = f"give a whole number of steps, 1 to {COUNT_MOST}"
        raise InputError(source="--count", field="count", value=count, remedy=remedy)


def check_around(around: Around) -> None:
    """The same of what is around them.

    Raises:
        InputError: Naming the option, its value and what would be right.
    """
    for name, value in (("width", around.width), ("landing", around.landing)):
        if value is not None and not (isfinite(value) and WIDTH_MIN <= value <= LANDING_MOST):
            remedy = f"give metres, {WIDTH_MIN:g} to {LANDING_MOST:g}"
            raise InputError(source=f"--{name}", field=name, value=value, remedy=remedy)
    if around.turn not in TURNS:
        remedy = f"give degrees, one of {', '.join(f'{turn:g}' for turn in TURNS)}"
        raise InputError(source="--turn", field="turn", value=around.turn, remedy=remedy)
    if around.turn and (around.landing or LANDING_MOST) < (around.width or 0.0):
        remedy = f"give at least the width, {around.width:g} m: the robot turns on it"
        raise InputError(source="--landing", field="landing", value=around.landing, remedy=remedy)


def check_flight(
    model: str,
    *,
    rise: float,
    run: float,
    count: int,
    nearest: bool = True,
    thorough: bool = True,
    margin: str = HULL,
    around: Around = AS_USUAL,
) -> Feasibility:
    """Whether a robot climbs a flight up and down.

    Args:
        model: A robot's file or name.
        rise: Of the steps [m].
        run: Of the treads [m].
        count: Steps of the flight.
        nearest: Whether to say which rise would work if this one does not; it takes a while.
        thorough: Whether to look for a good gait, or any that a quick search finds.
        margin: Over what the plan's margin is measured, one of `KINDS`.
        around: Width, landing and turn.

    Raises:
        InputError: If the robot cannot be used, or there are no such stairs.
    """
    check_flight_numbers(rise, run, count)
    check_around(around)
    robot = load_robot(model)
    model = whole_path(model)
    try:
        return design_for_flight(
            model,
            rise=rise,
            run=run,
            count=count,
            nearest=nearest,
            thorough=thorough,
            robot=robot,
            margin=margin,
            around=around,
        )
    except InputError as error:
        # The course's fields are the options' here.
        name = error.field.rpartition(".")[2] if error.field.startswith("course") else ""
        name = "landing" if name == "length" and around.landing is not None else name
        if name not in ("rise", "run", "count", "width", "landing"):
            raise
        raise InputError(
            source=f"--{name}", field=name, value=error.value, remedy=error.remedy
        ) from None


def design_for_course(
    model: str, scenario: str, *, margin: str = HULL, nearest: bool = True
) -> Feasibility:
    """Whether a robot climbs the course of a scenario, with a gait of its own.

    Args:
        model: A robot's file or name.
        scenario: A shipped scenario's name or a file; its robot and its gait do not count.
        margin: Over what the plan's margin is measured, one of `KINDS`.
        nearest: Whether a reason is to say which rise would work; it takes a while.

    Raises:
        InputError: If robot or scenario cannot be used.
    """
    robot = load_robot(model)
    given = load_scenario(scenario)
    asked = Scenario(
        description=f"{robot.name} on the course of {Path(scenario).name}",
        course=given.course,
        mission=given.mission,
        start=given.start,
        world=given.world,
        simulation=given.simulation,
        design="auto",
    )
    asked.robot.model = whole_path(model)
    asked.gait.margin = margin
    try:
        designed = design_scenario(asked, source=scenario, nearest=nearest, robot=robot)
        return Feasibility(designed.scenario, designed, "", {}, robot)
    except PlanningError as error:
        return Feasibility(asked, None, error.reason, dict(error.data), robot)


def whole_path(model: str) -> str:
    """A robot's file by its whole path, so that a scenario can be saved anywhere; names stay."""
    path = user_path(model)
    return str(path.resolve()) if "://" not in model and path.is_file() else model


# ------------------------------------------------------------------------------------------------
# The nearest stairs that a robot climbs, if it does not climb those that were asked for.
# ------------------------------------------------------------------------------------------------


SEARCH_COUNT = 4  # steps of the flights that are tried in search of the nearest
LEAST_RISE = 0.02  # [m] below which nothing is called stairs
FINE = 0.01  # [m] to which the nearest rise is sought
SHRINK = 0.85  # of a rise: what is tried next as long as nothing works
# The same on treads like floors, which take long to plan, and of which deeper ones are no easier.
SHRINK_DEEP = 0.6
TRIES, TRIES_DEEP = 30, 2
DEEPER = (1.15, 1.3, 1.5, 1.75, 2.0)  # times the run: what is tried if no rise works on it
VERIFY = 3  # rises that are tried on the flight's real number of steps

Judge = Callable[[float, float, int], Feasibility]  # of rise, run and count


def nearest_of(
    check: Feasibility,
    robot: RobotModel,
    *,
    model: str,
    rise: float,
    run: float,
    count: int,
    margin: str = HULL,
    around: Around = AS_USUAL,
    note: Callable[[str], object] = lambda _: None,
) -> tuple[float, float] | None:
    """The nearest stairs for which a quick search finds a gait and its plan.

    Args:
        check: What was found of the stairs that cannot be climbed.
        robot: The robot.
        model: Its file or name.
        rise: Of those stairs [m].
        run: Theirs [m].
        count: Theirs.
        margin: Over what the plan's margin is measured, one of `KINDS`.
        around: Their width, landing and turn.
        note: Is told what is being looked at.

    Returns:
        Rise and run [m]; None if nothing was found.
    """
    note("not these; looking for the nearest stairs that it can climb")
    if "slacks" in check.data and "run" in check.data and "nearest_rise" not in check.data:
        # No gait at all, not even on endless stairs: there a lower rise is soon judged.
        highest = highest_rise(robot, link_outline_of(robot), run, below=rise)
        check = replace(check, data={**check.data, "nearest_rise": highest})

    def judge(rise: float, run: float, count: int) -> Feasibility:
        note(f"not these; trying {count} steps of {rise:g} m on treads of {run:g} m")
        return check_flight(
            model, rise=rise, run=run, count=count, nearest=False, thorough=False, margin=margin,
            around=around,
        )  # fmt: skip

    return nearest_stairs(judge, check, rise=rise, run=run, count=count)


def nearest_stairs(
    judge: Judge, check: Feasibility, *, rise: float, run: float, count: int
) -> tuple[float, float] | None:
    """The nearest stairs that a robot climbs: a lower rise, or if none a deeper run.

    Args:
        judge: Says whether stairs of rise, run and count can be climbed.
        check: What was found of the stairs that cannot be climbed.
        rise: Theirs [m].
        run: Theirs [m].
        count: Theirs.

    Returns:
        Rise and run [m], judged feasible with `count` steps; None if nothing was found.
    """
    few = min(count, SEARCH_COUNT)
    hint, deep = check.data.get("nearest_rise"), "deep" in check.data
    if "nearest_rise" not in check.data or hint is not None:
        # Above a hint no rise works, not even on endless stairs, as far as it was sought.
        low = _down(SHRINK * rise if hint is None else hint)
        high = rise if hint is None else min(rise, low + FINE)
        tries = TRIES_DEEP if deep else TRIES
        while low >= LEAST_RISE and tries > 0 and not judge(low, run, few).feasible:
            low, high, tries = _down((SHRINK_DEEP if deep else SHRINK) * low), low, tries - 1
        if tries == 0:
            low = 0.0
        while low >= LEAST_RISE and high - low > FINE + 1e-9:
            middle = _down(0.5 * (low + high))
            low, high = (middle, high) if judge(middle, run, few).feasible else (low, middle)
        for lower in range(VERIFY):
            found = round(low - lower * FINE, 3)
            if found >= LEAST_RISE and (few == count or judge(found, run, count).feasible):
                return found, run
    for times in () if deep else DEEPER:
        deeper = round(times * run, 2)
        if deeper <= RUN_MAX and judge(rise, deeper, count).feasible:
            return rise, deeper
    return None


def _down(rise: float) -> float:
    """To the millimetre below [m]."""
    return floor(1000.0 * rise + 1e-6) / 1000.0
