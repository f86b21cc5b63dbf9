"""What is asked of a robot and its stairs, and, if they cannot be climbed, the nearest that can."""

from collections.abc import Callable
from math import floor, isfinite
from pathlib import Path

from drake_quad.check_stairs import Check, check_stairs
from drake_quad.designer import design_scenario
from drake_quad.errors import InputError, PlanningError
from drake_quad.robot.load_robot import load_robot
from drake_quad.scenario import Scenario, load_scenario
from drake_quad.stability.kinds import HULL

RISE_MOST, RUN_MOST, COUNT_MOST = 2.0, 5.0, 100
SEARCH_COUNT = 4  # steps of the flights that are tried in search of the nearest
LEAST_RISE = 0.02  # [m] below which nothing is called stairs
FINE = 0.01  # [m] to which the nearest rise is sought
SHRINK = 0.85  # of a rise: what is tried next as long as nothing works
# The same on treads like floors, which take long to plan, and of which deeper ones are no easier.
SHRINK_DEEP = 0.6
TRIES, TRIES_DEEP = 30, 2
DEEPER = (1.15, 1.3, 1.5, 1.75, 2.0)  # times the run: what is tried if no rise works on it
VERIFY = 3  # rises that are tried on the flight's real number of steps

Judge = Callable[[float, float, int], Check]  # of rise, run and count


def check_numbers(rise: float, run: float, count: int) -> None:
    """Makes sure that there can be such stairs.

    Raises:
        InputError: Naming the option, its value and what would be right.
    """
    for name, value, most in (("rise", rise, RISE_MOST), ("run", run, RUN_MOST)):
        if not (isfinite(value) and 0.0 < value <= most):
            remedy = f"give metres, more than 0 and at most {most:g}"
            raise InputError(source=f"--{name}", field=name, value=value, remedy=remedy)
    if not 1 <= count <= COUNT_MOST:
        remedy = f"give a whole number of steps, 1 to {COUNT_MOST}"
        raise InputError(source="--count", field="count", value=count, remedy=remedy)


def ask_stairs(
    model: str,
    *,
    rise: float,
    run: float,
    count: int,
    nearest: bool = True,
    thorough: bool = True,
    margin: str = HULL,
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

    Raises:
        InputError: If the robot cannot be used, or there are no such stairs.
    """
    check_numbers(rise, run, count)
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
        )
    except InputError as error:
        # The course's fields are the options' here.
        name = error.field.rpartition(".")[2] if error.field.startswith("course") else ""
        if name not in ("rise", "run", "count"):
            raise
        raise InputError(
            source=f"--{name}", field=name, value=error.value, remedy=error.remedy
        ) from None


def ask_course(model: str, scenario: str, *, margin: str = HULL) -> Check:
    """Whether a robot climbs the course of a scenario, with a gait of its own.

    Args:
        model: A robot's file or name.
        scenario: A shipped scenario's name or a file; its robot and its gait do not count.
        margin: Over what the plan's margin is measured, see `stability.kinds`.

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
        return Check(asked, design_scenario(asked, source=scenario, robot=robot), "", {})
    except PlanningError as error:
        return Check(asked, None, error.reason, dict(error.data))


def nearest_stairs(
    judge: Judge, check: Check, *, rise: float, run: float, count: int
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
        if deeper <= RUN_MOST and judge(rise, deeper, count).feasible:
            return rise, deeper
    return None


def whole_path(model: str) -> str:
    """A robot's file by its whole path, so that a scenario can be saved anywhere; names stay."""
    path = Path(model).expanduser()
    return str(path.resolve()) if "://" not in model and path.is_file() else model


def _down(rise: float) -> float:
    """To the millimetre below [m]."""
    return floor(1000.0 * rise + 1e-6) / 1000.0
