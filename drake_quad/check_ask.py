"""What is asked of a robot and its stairs: a flight by its numbers, or a scenario's course."""

from math import isfinite
from pathlib import Path

from drake_quad.check_stairs import AS_USUAL, TURNS, Around, Check, check_stairs
from drake_quad.designer import design_scenario
from drake_quad.errors import InputError, PlanningError
from drake_quad.robot.load_robot import load_robot
from drake_quad.scenario import Scenario, load_scenario
from drake_quad.stability.kinds import HULL
from drake_quad.terrain_check_stairs import RISE_MAX, RUN_MAX
from drake_quad.terrain_elements import WIDTH_MIN
from drake_quad.user_path import user_path

COUNT_MOST = 100
LANDING_MOST = 100.0  # [m] of a landing, and of a width


def check_numbers(rise: float, run: float, count: int) -> None:
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


def ask_stairs(
    model: str,
    *,
    rise: float,
    run: float,
    count: int,
    nearest: bool = True,
    thorough: bool = True,
    margin: str = HULL,
    around: Around = AS_USUAL,
) -> Check:
    """Whether a robot climbs a flight up and down.

    Args:
        model: A robot's file or name.
        rise: Of the steps [m].
        run: Of the treads [m].
        count: Steps of the flight.
        nearest: Whether to say which rise would work if this one does not; it takes a while.
        thorough: Whether to look for a good gait, or any that a quick search finds.
        margin: Over what the plan's margin is measured, see `stability.kinds`.
        around: Width, landing and turn.

    Raises:
        InputError: If the robot cannot be used, or there are no such stairs.
    """
    check_numbers(rise, run, count)
    check_around(around)
    robot = load_robot(model)
    model = whole_path(model)
    try:
        return check_stairs(
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


def ask_course(model: str, scenario: str, *, margin: str = HULL, nearest: bool = True) -> Check:
    """Whether a robot climbs the course of a scenario, with a gait of its own.

    Args:
        model: A robot's file or name.
        scenario: A shipped scenario's name or a file; its robot and its gait do not count.
        margin: Over what the plan's margin is measured, see `stability.kinds`.
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
        return Check(asked, designed, "", {})
    except PlanningError as error:
        return Check(asked, None, error.reason, dict(error.data))


def whole_path(model: str) -> str:
    """A robot's file by its whole path, so that a scenario can be saved anywhere; names stay."""
    path = user_path(model)
    return str(path.resolve()) if "://" not in model and path.is_file() else model
