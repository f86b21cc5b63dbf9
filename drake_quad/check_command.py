"""The work of `drake-quad check`: ask, look for the nearest stairs, save, and draw."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_quad.check_ask import ask_course, ask_stairs, check_numbers
from drake_quad.check_nearest import nearest_of
from drake_quad.check_picture import check_picture, save_picture
from drake_quad.check_report import describe_check, with_nearest
from drake_quad.check_stairs import Around
from drake_quad.errors import InputError
from drake_quad.precompile import DESIGN, precompiling
from drake_quad.robot.load_robot import load_robot
from drake_quad.scenario import save_scenario
from drake_quad.stability.kinds import HULL, KINDS
from drake_quad.whole_files import write_whole

RISE, RUN, COUNT = 0.178, 0.28, 10  # a common indoor flight


@dataclass(frozen=True)
class Asked:
    """The question, as it was given.

    Attributes:
        robot: File or name.
        rise: Of the steps [m]; RISE if None, as RUN and COUNT below.
        run: Of the treads [m].
        count: Steps of the flight.
        scenario: Whose course to walk instead of a flight.
        margin: Over what the plan's margin is measured, one of `stability.kinds.KINDS`.
        width: Of the flights [m]; as the robot needs if None.
        landing: Length of the landing between the flights [m]; the same.
        turn: On the landing [deg], left positive; 90 if None.
    """

    robot: str
    rise: float | None = None
    run: float | None = None
    count: int | None = None
    scenario: str | None = None
    margin: str = HULL
    width: float | None = None
    landing: float | None = None
    turn: float | None = None


def run_check(
    asked: Asked,
    *,
    save: Path | None = None,
    picture: Path | None = None,
    nearest: bool = True,
    first: Callable[[dict[str, Any]], object] = lambda _: None,
    note: Callable[[str], object] = lambda _: None,
) -> dict[str, Any]:
    """Answers the question; what is told is as `describe_check` has it.

    Args:
        asked: The question.
        save: Where to write the designed scenario, if there is one.
        picture: Where to draw the climb, if there is one.
        nearest: Whether to look for the nearest stairs that it climbs, if not these; it takes a
            minute or two.
        first: Is told the answer, of a no the reason, before that and before anything is written.
        note: Is told what is being done.

    Raises:
        InputError: If anything given cannot be used, before any long work; or a file cannot be
            written, after `first` was told.
    """
    check_picture(picture)
    if asked.margin not in KINDS:
        remedy = "give hull, friction or feasible"
        raise InputError(source="--margin", field="margin", value=asked.margin, remedy=remedy)
    own = {name: getattr(asked, name) for name in ("width", "landing", "turn")}
    given = {"rise": asked.rise, "run": asked.run, "count": asked.count, **own}
    robot = load_robot(asked.robot)
    with precompiling(DESIGN, note) as wait:
        wait()
    if asked.scenario is not None:
        for name, value in given.items():
            if value is not None:
                remedy = "leave it out: with --scenario the stairs are the scenario's"
                raise InputError(source=f"--{name}", field=name, value=value, remedy=remedy)
        question: dict[str, Any] = {"scenario": asked.scenario}
        check = ask_course(asked.robot, asked.scenario, margin=asked.margin, nearest=nearest)
    else:
        rise = RISE if asked.rise is None else asked.rise
        run = RUN if asked.run is None else asked.run
        count = COUNT if asked.count is None else asked.count
        check_numbers(rise, run, count)
        known = {name: value for name, value in own.items() if value is not None}
        around = Around(**known)
        question = {"rise": rise, "run": run, "count": count, **known}
        check = ask_stairs(
            asked.robot, rise=rise, run=run, count=count, nearest=False, margin=asked.margin,
            around=around,
        )  # fmt: skip
    if asked.margin != HULL:
        question["margin"] = asked.margin
    told = describe_check(check, robot, source=asked.robot, asked=question)
    first(told)
    if not check.feasible and asked.scenario is None and nearest:
        near = nearest_of(
            check, robot, model=asked.robot, rise=rise, run=run, count=count,
            margin=asked.margin, around=around, note=note,
        )  # fmt: skip
        told = with_nearest(told, near)
    if check.designed is not None and save is not None:
        scenario = check.designed.scenario
        write_whole(save, lambda to: save_scenario(scenario, to), option="--save")
        told["saved"] = str(save)
    if check.designed is not None and picture is not None:
        note("drawing")
        save_picture(check.designed, robot, picture)
        told["picture"] = str(picture)
    return told
