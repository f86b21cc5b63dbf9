"""The nearest stairs that a robot climbs, if it does not climb those that were asked for."""

from collections.abc import Callable
from dataclasses import replace
from math import floor

from drake_quad.check_ask import ask_stairs
from drake_quad.check_stairs import AS_USUAL, Around, Check
from drake_quad.design.choose import highest_rise
from drake_quad.design.shape import read_shape
from drake_quad.robot.robot_model import RobotModel
from drake_quad.stability.kinds import HULL
from drake_quad.terrain_check_stairs import RUN_MAX

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


def nearest_of(
    check: Check,
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
        margin: Over what the plan's margin is measured, see `stability.kinds`.
        around: Their width, landing and turn.
        note: Is told what is being looked at.

    Returns:
        Rise and run [m]; None if nothing was found.
    """
    note("not these; looking for the nearest stairs that it can climb")
    if "slacks" in check.data and "run" in check.data and "nearest_rise" not in check.data:
        # No gait at all, not even on endless stairs: there a lower rise is soon judged.
        highest = highest_rise(robot, read_shape(robot), run, below=rise)
        check = replace(check, data={**check.data, "nearest_rise": highest})

    def judge(rise: float, run: float, count: int) -> Check:
        note(f"not these; trying {count} steps of {rise:g} m on treads of {run:g} m")
        return ask_stairs(
            model, rise=rise, run=run, count=count, nearest=False, thorough=False, margin=margin,
            around=around,
        )  # fmt: skip

    return nearest_stairs(judge, check, rise=rise, run=run, count=count)


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
        if deeper <= RUN_MAX and judge(rise, deeper, count).feasible:
            return rise, deeper
    return None


def _down(rise: float) -> float:
    """To the millimetre below [m]."""
    return floor(1000.0 * rise + 1e-6) / 1000.0
