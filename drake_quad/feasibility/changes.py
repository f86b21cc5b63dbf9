"""The least change of a robot, or of its stairs, by which a flight without a plan gets one."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from drake_quad.robot.model import RobotModel
from drake_quad.robot.variants import (
    with_foot_radius,
    with_longer_legs,
    with_torque,
    with_trunk_mass,
    with_wider_hips,
    with_wider_knees,
)
from drake_quad.terrain.elements import RUN_MAX, Stairs

FEW = 4  # steps of the flights that are tried before the whole one
MORE = 2  # finest steps that are added if the whole flight wants more than a short one


@dataclass(frozen=True, eq=False)
class Case:
    """A robot, stairs, and the landing between the two flights.

    Attributes:
        robot: The robot.
        stairs: The flight.
        landing: Length of the landing [m]; as the robot needs if None.
    """

    robot: RobotModel
    stairs: Stairs
    landing: float | None = None


@dataclass(frozen=True)
class ChangeKind:
    """One thing that can be changed.

    Attributes:
        words: What it is.
        unit: Unit of its figure.
        amounts: How much it is changed, from little to the most that is tried.
        fine: How finely the least amount is sought.
        relaxes: Whether more of it can only make more plans possible. Then the most is tried
            first, and if that is not enough nothing is.
        figure: The figure that is changed.
        apply: Changes it by an amount.
        applies: Whether there is anything to change.
    """

    words: str
    unit: str
    amounts: tuple[float, ...]
    fine: float
    relaxes: bool
    figure: Callable[[Case], float]
    apply: Callable[[Case, float], Case]
    applies: Callable[[Case], bool] = lambda _: True


@dataclass(frozen=True)
class Change:
    """What came of a search for the least change of one kind.

    Attributes:
        kind: Its name, one of `KINDS_OF_CHANGE`.
        words: What is changed.
        unit: Unit of the figures.
        before: The figure as it is.
        after: The figure with which there is a plan; None if none was found.
        tried: The farthest figure that was tried.
        margin: Smallest static margin of that plan [m]; None if there is none.
    """

    kind: str
    words: str
    unit: str
    before: float
    after: float | None
    tried: float
    margin: float | None

    @property
    def share(self) -> float | None:
        """The change over the figure as it is [1]; None if none was found."""
        return None if self.after is None else self.after / self.before - 1.0


def _widest(robot: RobotModel, first: int) -> float:
    """The least range among joints of one kind [deg]."""
    ranges = robot.q_upper[first::3] - robot.q_lower[first::3]
    return float(np.degrees(ranges.min()))


def _on_robot(change: Callable[[RobotModel, float], RobotModel]) -> Callable[[Case, float], Case]:
    return lambda case, amount: replace(case, robot=change(case.robot, amount))


def _deeper(case: Case, amount: float) -> Case:
    run = min(round((1.0 + amount) * case.stairs.run, 3), RUN_MAX)
    return replace(case, stairs=replace(case.stairs, run=run))


def _lower(case: Case, amount: float) -> Case:
    rise = round((1.0 - amount) * case.stairs.rise, 3)
    return replace(case, stairs=replace(case.stairs, rise=rise))


KINDS_OF_CHANGE = {
    "legs": ChangeKind(
        "length of the legs (thigh and shank)", "m", (0.05, 0.1, 0.2, 0.4), 0.01, False,
        lambda case: float(case.robot.geometry.reach.min()),
        _on_robot(lambda robot, amount: with_longer_legs(robot, 1.0 + amount)),
    ),
    "knees": ChangeKind(
        "range of the knees", "deg", (0.1, 0.2, 0.4, 0.8), 0.05, True,
        lambda case: _widest(case.robot, 2), _on_robot(with_wider_knees),
    ),
    "hips": ChangeKind(
        "range of the hips' pitch", "deg", (0.1, 0.2, 0.4, 0.8), 0.05, True,
        lambda case: _widest(case.robot, 1), _on_robot(with_wider_hips),
    ),
    "torque": ChangeKind(
        "torque of all joints (here the knees')", "Nm", (0.1, 0.25, 0.5, 1.0, 2.0), 0.05, True,
        lambda case: float(case.robot.effort[2::3].min()),
        _on_robot(lambda robot, amount: with_torque(robot, 1.0 + amount)),
    ),
    "mass": ChangeKind(
        "mass, by a lighter trunk or less payload", "kg", (0.1, 0.2, 0.4), 0.05, True,
        lambda case: case.robot.mass,
        _on_robot(lambda robot, less: with_trunk_mass(robot, (1.0 - less) * robot.trunk_mass)),
    ),
    "feet": ChangeKind(
        "radius of the feet", "m", (0.25, 0.5, 0.75), 0.125, False,
        lambda case: case.robot.foot_radius,
        _on_robot(lambda robot, less: with_foot_radius(robot, (1.0 - less) * robot.foot_radius)),
        lambda case: case.robot.foot_radius > 0.0,
    ),
    "rise": ChangeKind(
        "rise", "m", (0.05, 0.1, 0.2, 0.4, 0.6), 0.02, False,
        lambda case: case.stairs.rise, _lower,
    ),
    "run": ChangeKind(
        "run", "m", (0.05, 0.1, 0.2, 0.4, 0.8), 0.02, False,
        lambda case: case.stairs.run, _deeper,
        lambda case: case.stairs.run < RUN_MAX,
    ),
    "landing": ChangeKind(
        "length of the landing", "m", (0.25, 0.5, 1.0, 2.0), 0.1, True,
        lambda case: case.landing or 0.0,
        lambda case, amount: replace(case, landing=(1.0 + amount) * (case.landing or 0.0)),
        lambda case: case.landing is not None,
    ),
}  # fmt: skip

Climbs = Callable[[Case], float | None]


def least_amount(works: Callable[[float], bool], kind: ChangeKind) -> float | None:
    """The least amount of a change that was found to work, to `kind.fine`; None if none was.

    Args:
        works: Whether an amount is enough.
        kind: What is changed.
    """
    low, high = 0.0, None
    if kind.relaxes and not works(kind.amounts[-1]):
        return None
    for amount in kind.amounts:
        if (kind.relaxes and amount == kind.amounts[-1]) or works(amount):
            high = amount
            break
        low = amount
    if high is None:
        return None
    while high - low > kind.fine + 1e-9:
        # Whole multiples of the finest step, so that figures are round ones.
        middle = kind.fine * round(0.5 * (low + high) / kind.fine)
        if not low < middle < high:
            break
        low, high = (low, middle) if works(middle) else (middle, high)
    return high


def find_change(climbs: Climbs, case: Case, name: str) -> Change:
    """The least change of one kind by which a robot climbs the whole flight.

    Args:
        climbs: The static margin of a plan [m]; None if no plan is found.
        case: The robot and stairs without a plan.
        name: Name of the kind of change, one of `KINDS_OF_CHANGE`.
    """
    kind, few = KINDS_OF_CHANGE[name], min(case.stairs.count, FEW)

    def on_flight(amount: float, count: int) -> float | None:
        changed = kind.apply(case, amount)
        return climbs(replace(changed, stairs=replace(changed.stairs, count=count)))

    before, tried = kind.figure(case), kind.figure(kind.apply(case, kind.amounts[-1]))
    least = least_amount(lambda amount: on_flight(amount, few) is not None, kind)
    for more in range(MORE + 1) if least is not None else ():
        assert least is not None
        amount = min(least + more * kind.fine, kind.amounts[-1])
        margin = on_flight(amount, case.stairs.count)
        if margin is not None:
            after = kind.figure(kind.apply(case, amount))
            return Change(name, kind.words, kind.unit, before, after, tried, margin)
    return Change(name, kind.words, kind.unit, before, None, tried, None)


def kinds_for(case: Case) -> list[str]:
    """Names of the kinds of change that there are for a robot and stairs."""
    return [name for name, kind in KINDS_OF_CHANGE.items() if kind.applies(case)]
