"""The flights that a question is about: what is around them, and what stairs there can be."""

from dataclasses import dataclass
from math import ceil

from drake_quad.errors import InputError
from drake_quad.gait_design.candidates import hip_length
from drake_quad.robot.model import RobotModel, leg_length
from drake_quad.scenario.config import RobotConfig, Scenario, StartConfig
from drake_quad.stability.margin_kinds import KINDS
from drake_quad.terrain.elements import (
    DEFAULT_THICKNESS,
    RISE_MAX,
    RUN_MAX,
    WIDTH_MIN,
    Element,
    Stairs,
)
from drake_quad.util.numbers import is_finite_real, is_integer

TURNS = (-180.0, -90.0, 0.0, 90.0, 180.0)  # [deg] turns that a landing can have
LEAST_LANDING = 1.5  # [m]
COUNT_MOST = 100
LANDING_MOST = 100.0  # [m] longest landing, and greatest width


@dataclass(frozen=True)
class Around:
    """What is around the flights up and down.

    Attributes:
        width: Width of the flights and the floors [m]; as the robot needs if None.
        landing: Length of the landing between them [m]; as the robot needs if None.
        turn: Turn on the landing [deg], left positive; one of TURNS. A half turn takes two
            landings.
    """

    width: float | None = None
    landing: float | None = None
    turn: float = 90.0


AS_USUAL = Around()


def make_stairs_scenario(
    robot: RobotModel, stairs: Stairs, around: Around = AS_USUAL, *, model: str
) -> Scenario:
    """A flight up, a landing with a turn, and the same flight down, wide enough for the robot.

    Args:
        robot: The robot.
        stairs: The flight.
        around: Width, landing and turn.
        model: Robot name or file, as the scenario has it.
    """
    run = stairs.run
    size = max(leg_length(robot), 0.5 * hip_length(robot))
    start = 0.5 * hip_length(robot) + 0.8 * size + 0.1
    before = start + 0.5 * hip_length(robot) + 1.2 * size + run
    landing = max(LEAST_LANDING, 2.0 * (0.5 * hip_length(robot) + 1.1 * size + run))
    after = hip_length(robot) + 2.5 * size + 2.0 * run
    width = max(1.2, 3.0 * size) if around.width is None else around.width
    if around.width is None and around.landing is not None and around.turn:
        width = min(width, around.landing)  # a landing on which it turns is as wide as the flights
    wide = _up(max(landing, width)) if around.landing is None else around.landing
    turns: dict[float, list[float | None]] = {
        0.0: [None],
        180.0: [90.0, 90.0],
        -180.0: [-90.0, -90.0],
    }
    landings = [
        Element(kind="landing", length=wide, width=width if turn is None else None,
                      turn_deg=turn)
        for turn in turns.get(around.turn, [around.turn])
    ]  # fmt: skip
    course = [
        Element(kind="floor", length=_up(before), width=width),
        Element(kind="stairs", going="up", width=width, **stairs.fields()),
        *landings,
        Element(kind="stairs", going="down", width=width, **stairs.fields()),
        Element(kind="floor", length=_up(after), width=width),
    ]
    return Scenario(
        description=f"{robot.name} on {stairs}, up and down",
        robot=RobotConfig(model=model),
        design="auto",
        course=course,
        start=StartConfig(distance=round(start, 3)),
    )


def _up(length: float) -> float:
    """A length [m], rounded up to decimetres."""
    return ceil(10.0 * length) / 10.0


def check_stairs_numbers(stairs: Stairs, around: Around = AS_USUAL) -> None:
    """Makes sure that there can be such stairs.

    Raises:
        InputError: The error names the option, its value and what would be right.
    """
    for name, value, most in (("rise", stairs.rise, RISE_MAX), ("run", stairs.run, RUN_MAX)):
        if not (is_finite_real(value) and 0.0 < value <= most):
            raise wrong_option(name, value, f"give metres, more than 0 and at most {most:g}")
    if not (is_integer(stairs.count) and 1 <= stairs.count <= COUNT_MOST):
        raise wrong_option(
            "count", stairs.count, f"give a whole number of steps, 1 to {COUNT_MOST}"
        )
    if not (is_finite_real(stairs.overhang) and 0.0 <= stairs.overhang <= 0.5 * stairs.run):
        remedy = f"give metres, 0 to half of the run, {0.5 * stairs.run:g}"
        raise wrong_option("overhang", stairs.overhang, remedy)
    if not isinstance(stairs.open, bool):
        raise wrong_option("open", stairs.open, "give True or False")
    if not stairs.closed and stairs.rise <= DEFAULT_THICKNESS:
        remedy = (
            f"give more than {DEFAULT_THICKNESS:g} m, for treads with an overhang or open risers "
            "are so thick"
        )
        raise wrong_option("rise", stairs.rise, remedy)
    for name, length in (("width", around.width), ("landing", around.landing)):
        if length is not None and not (
            is_finite_real(length) and WIDTH_MIN <= length <= LANDING_MOST
        ):
            raise wrong_option(name, length, f"give metres, {WIDTH_MIN:g} to {LANDING_MOST:g}")
    if around.turn not in TURNS:
        remedy = f"give degrees, one of {', '.join(f'{turn:g}' for turn in TURNS)}"
        raise wrong_option("turn", around.turn, remedy)
    if around.turn and (around.landing or LANDING_MOST) < (around.width or 0.0):
        remedy = f"give at least the width, {around.width:g} m: the robot turns on it"
        raise wrong_option("landing", around.landing, remedy)


def check_margin_kind(margin: str) -> None:
    """Makes sure that there is such a margin.

    Raises:
        InputError: If there is not.
    """
    if margin not in KINDS:
        raise wrong_option("margin", margin, f"give {', '.join(KINDS[:-1])} or {KINDS[-1]}")


def wrong_option(option: str, value: object, remedy: str) -> InputError:
    """The error that a value of an option is wrong; it names what would be right."""
    return InputError(source=f"--{option}", field=option, value=value, remedy=remedy)
