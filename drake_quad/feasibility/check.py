"""Can this robot climb these stairs? The search for a gait, and the nearest stairs that work."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, floor
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError, PlanningError
from drake_quad.gait_design.candidates import hip_length
from drake_quad.gait_design.designer import design_longer, design_scenario
from drake_quad.gait_design.pace import NearestLimit, PlanPace, measure_pace, nearest_limit
from drake_quad.gait_design.plan_candidates import Designed
from drake_quad.gait_design.search import highest_rise
from drake_quad.gait_design.speed_curve import SpeedCurve, trace_curve
from drake_quad.gait_design.tempo_search import ENOUGH, Wish, quicken
from drake_quad.infeasibility.boxes import ClimbClass
from drake_quad.infeasibility.proof import InfeasibilityProof, prove_infeasible
from drake_quad.planning.mission import MissionPlan
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import RobotModel, leg_length, link_outline_of
from drake_quad.scenario.build import course_of, mission_of
from drake_quad.scenario.config import RobotConfig, Scenario, StartConfig
from drake_quad.scenario.load import load_scenario
from drake_quad.stability.equilibrium_region import HULL, KINDS
from drake_quad.terrain.elements import (
    DEFAULT_THICKNESS,
    RISE_MAX,
    RUN_MAX,
    WIDTH_MIN,
    Element,
    Stairs,
)
from drake_quad.util.files import user_path
from drake_quad.util.html import html_table
from drake_quad.util.numbers import is_finite_real, is_integer

TURNS = (-180.0, -90.0, 0.0, 90.0, 180.0)  # [deg] turns that a landing can have
LEAST_LANDING = 1.5  # [m]
COUNT_MOST = 100
LANDING_MOST = 100.0  # [m] longest landing, and greatest width

SEARCH_COUNT = 4  # steps of the flights that are tried in search of the nearest
LEAST_RISE = 0.02  # [m] below which nothing is called stairs
FINE = 0.01  # [m] to which the nearest rise is sought
SHRINK = 0.85  # ratio of the next rise to the last as long as nothing works
# Ratio and tries on treads like floors, which take long to plan; deeper ones are no easier.
SHRINK_DEEP = 0.6
TRIES, TRIES_DEEP = 30, 2
DEEPER = (1.15, 1.3, 1.5, 1.75, 2.0)  # ratios of deeper treads, tried if no rise works
VERIFY = 3  # rises that are tried on the flight's real number of steps


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
MOST_MARGIN = Wish()


@dataclass(frozen=True, eq=False)
class Feasibility:
    """Whether a robot climbs stairs or a course, and how.

    Attributes:
        scenario: Robot and course; with the gait, ready to be run, if there is one.
        designed: The gait with its plan; None if there is none.
        reason: Why there is none.
        data: The figures behind the reason.
        robot: The robot; None if the answer is made up, as in a test.
        stairs: The flight of the question; None if the question was about a course.
        around: What is around the flight.
        wish: What the gait was to be good at.
        slow: The gait that was found for margin, of which the designed one has other times.
    """

    scenario: Scenario
    designed: Designed | None
    reason: str
    data: dict[str, Any]
    robot: RobotModel | None = None
    stairs: Stairs | None = None
    around: Around = AS_USUAL
    wish: Wish = MOST_MARGIN
    slow: Designed | None = None

    @property
    def feasible(self) -> bool:
        """Whether there is a gait."""
        return self.designed is not None

    @cached_property
    def proof(self) -> InfeasibilityProof | None:
        """A proof that the flight cannot be climbed by any statically stable gait of its class.

        None if there is a plan, if the question was about a course or stairs with open risers or
        an overhang, where feet have places that a proof leaves out, or if no proof is found: then
        nothing is known.
        """
        flight = self.stairs
        if self.feasible or flight is None or not flight.closed or self.robot is None:
            return None
        return prove_infeasible(self.robot, ClimbClass(flight.rise, flight.run, flight.count))

    @property
    def plan(self) -> MissionPlan | None:
        """The plan of the whole course; None if there is none."""
        return None if self.designed is None else self.designed.plan

    @property
    def margin(self) -> float | None:
        """Smallest static margin of the plan [m]; None if there is no plan."""
        return None if self.designed is None else self.designed.margin

    @cached_property
    def pace(self) -> PlanPace | None:
        """How fast the plan is on each flight, and what it asks of the joints; None without one."""
        return self._pace_of(self.designed)

    @cached_property
    def slow_pace(self) -> PlanPace | None:
        """The same of the gait that was found for margin; None if its times were not chosen."""
        return self._pace_of(self.slow) if self.wish.quick else None

    def _pace_of(self, designed: Designed | None) -> PlanPace | None:
        if designed is None or self.robot is None:
            return None
        course = course_of(designed.scenario, foot_radius=self.robot.foot_radius)
        tasks = mission_of(designed.scenario, course, source="check")
        return measure_pace(self.robot, course, tasks, designed.plan)

    @property
    def speed(self) -> float | None:
        """Speed of the body along the slowest flight [m/s]; None if there is none, or no plan."""
        slowest = None if self.pace is None else self.pace.slowest
        return None if slowest is None else slowest.speed

    @property
    def flight_time(self) -> float | None:
        """Time for the slowest flight [s]; None if there is none, or no plan."""
        slowest = None if self.pace is None else self.pace.slowest
        return None if slowest is None else slowest.time

    @property
    def fulfilled(self) -> bool:
        """Whether the plan is as quick, and keeps as much margin, as was asked for in figures."""
        wish, quick, margin = self.wish, self.speed, self.margin
        if wish.speed is not None and (quick is None or quick < ENOUGH * wish.speed):
            return False
        return wish.min_margin is None or (margin is not None and margin >= wish.min_margin)

    @property
    def bound(self) -> NearestLimit | None:
        """The limit that the plan comes nearest to; None without a plan."""
        if self.designed is None or self.pace is None:
            return None
        return nearest_limit(
            self.pace,
            margin=self.designed.margin,
            torque=self.designed.torque,
            room=self.designed.room.weighted,
            part=self.designed.room.part,
            wanted=self.designed.design.wanted,
        )

    def curve(self, note: Callable[[str], object] = lambda _: None) -> SpeedCurve | None:
        """Speed against margin, for this robot and these stairs; None if there is no gait.

        Args:
            note: Receives a line before each plan.
        """
        slow = self.slow or self.designed
        if slow is None or self.robot is None:
            return None
        others = design_longer(slow, self.robot, source="check")
        return trace_curve(slow, self.robot, others=others, source="check", note=note)

    def nearest(self, note: Callable[[str], object] = lambda _: None) -> Stairs | None:
        """The nearest stairs that a quick search finds a gait for: lower steps, or deeper treads.

        Args:
            note: Receives a line about each kind of stairs before it is tried.

        They are sought for margin, whatever the gait was to be good at.

        Returns:
            The stairs of the question if the robot climbs these; None if nothing was found, or if
            the question was about a course.
        """
        if self.feasible or self.stairs is None or self.robot is None:
            return self.stairs if self.feasible else None
        note("not these; looking for the nearest stairs that it can climb")
        check = self
        if "slacks" in self.data and "run" in self.data and "nearest_rise" not in self.data:
            # There is no gait at all, not even on endless stairs, where a lower rise takes less
            # time to judge.
            highest = highest_rise(
                self.robot, link_outline_of(self.robot), self.stairs.run, below=self.stairs.rise
            )
            check = replace(self, data={**self.data, "nearest_rise": highest})

        def judge(stairs: Stairs) -> Feasibility:
            note(f"not these; trying {stairs}")
            return check_flight(
                self.scenario.robot.model, stairs, around=self.around,
                margin=self.scenario.gait.margin, nearest=False, thorough=False, robot=self.robot,
            )  # fmt: skip

        return nearest_stairs(judge, check.data, self.stairs)

    def _repr_html_(self) -> str:
        """The answer, where a notebook shows it."""
        rows = [("answer", "yes" if self.feasible else f"no plan was found: {self.reason}")]
        if self.stairs is not None:
            rows.insert(0, ("stairs", str(self.stairs)))
        if self.robot is not None:
            rows.insert(0, ("robot", self.robot.name))
        if self.designed is not None:
            rows += [
                ("static margin of the plan", f"{1e3 * self.designed.margin:.0f} mm"),
                *(
                    []
                    if self.speed is None or self.flight_time is None
                    else [
                        (
                            "speed on the flight",
                            f"{self.speed:.3f} m/s, {self.flight_time:.0f} s for all of it",
                        )
                    ]
                ),
                ("torque that it leaves", f"{100.0 * self.designed.torque:.0f} % of the limit"),
                ("the whole course takes", f"{self.designed.plan.duration:.0f} s"),
            ]
        return html_table(rows)


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
            raise _wrong(name, value, f"give metres, more than 0 and at most {most:g}")
    if not (is_integer(stairs.count) and 1 <= stairs.count <= COUNT_MOST):
        raise _wrong("count", stairs.count, f"give a whole number of steps, 1 to {COUNT_MOST}")
    if not (is_finite_real(stairs.overhang) and 0.0 <= stairs.overhang <= 0.5 * stairs.run):
        remedy = f"give metres, 0 to half of the run, {0.5 * stairs.run:g}"
        raise _wrong("overhang", stairs.overhang, remedy)
    if not isinstance(stairs.open, bool):
        raise _wrong("open", stairs.open, "give True or False")
    if not stairs.closed and stairs.rise <= DEFAULT_THICKNESS:
        remedy = (
            f"give more than {DEFAULT_THICKNESS:g} m, for treads with an overhang or open risers "
            "are so thick"
        )
        raise _wrong("rise", stairs.rise, remedy)
    for name, length in (("width", around.width), ("landing", around.landing)):
        if length is not None and not (
            is_finite_real(length) and WIDTH_MIN <= length <= LANDING_MOST
        ):
            raise _wrong(name, length, f"give metres, {WIDTH_MIN:g} to {LANDING_MOST:g}")
    if around.turn not in TURNS:
        remedy = f"give degrees, one of {', '.join(f'{turn:g}' for turn in TURNS)}"
        raise _wrong("turn", around.turn, remedy)
    if around.turn and (around.landing or LANDING_MOST) < (around.width or 0.0):
        remedy = f"give at least the width, {around.width:g} m: the robot turns on it"
        raise _wrong("landing", around.landing, remedy)


def check_margin_kind(margin: str) -> None:
    """Makes sure that there is such a margin.

    Raises:
        InputError: If there is not.
    """
    if margin not in KINDS:
        raise _wrong("margin", margin, f"give {', '.join(KINDS[:-1])} or {KINDS[-1]}")


def _wrong(option: str, value: object, remedy: str) -> InputError:
    return InputError(source=f"--{option}", field=option, value=value, remedy=remedy)


def check_flight(
    model: str,
    stairs: Stairs,
    *,
    around: Around = AS_USUAL,
    margin: str = HULL,
    wish: Wish = MOST_MARGIN,
    nearest: bool = True,
    thorough: bool = True,
    robot: RobotModel | None = None,
) -> Feasibility:
    """Whether a robot climbs a flight up and down.

    Args:
        model: Robot name or file.
        stairs: The flight.
        around: Width, landing and turn.
        margin: Region that the plan's margin is measured in, one of `KINDS`.
        wish: Whether the gait is to be quick, and how much margin it is to keep.
        nearest: Whether a reason says which rise would work; that takes a while.
        thorough: Whether to look for a good gait, or any that a quick search finds.
        robot: The robot of that name, if it is loaded already.

    Raises:
        InputError: If the robot cannot be used, or there are no such stairs.
    """
    check_stairs_numbers(stairs, around)
    check_margin_kind(margin)
    wish.check()
    robot = robot or load_robot(model)
    scenario = make_stairs_scenario(robot, stairs, around, model=_whole_path(model))
    scenario.gait.margin = margin
    try:
        found = _design(
            scenario, robot, source="check", wish=wish, nearest=nearest, thorough=thorough
        )
    except InputError as error:
        # The course's fields are the options' here.
        name = error.field.rpartition(".")[2] if error.field.startswith("course") else ""
        name = "landing" if name == "length" and around.landing is not None else name
        if name not in ("rise", "run", "count", "overhang", "width", "landing"):
            raise
        raise _wrong(name, error.value, error.remedy) from None
    return replace(found, stairs=stairs, around=around)


def design_for_course(
    model: str,
    scenario: str,
    *,
    margin: str = HULL,
    wish: Wish = MOST_MARGIN,
    nearest: bool = True,
) -> Feasibility:
    """Whether a robot climbs the course of a scenario, with a gait of its own.

    Args:
        model: Robot name or file.
        scenario: A shipped scenario's name or a file; its robot and its gait do not count.
        margin: Region that the plan's margin is measured in, one of `KINDS`.
        wish: Whether the gait is to be quick, and how much margin it is to keep.
        nearest: Whether a reason says which rise would work; that takes a while.

    Raises:
        InputError: If robot or scenario cannot be used.
    """
    check_margin_kind(margin)
    wish.check()
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
    asked.robot.model = _whole_path(model)
    asked.gait.margin = margin
    return _design(asked, robot, source=scenario, wish=wish, nearest=nearest)


def _design(
    scenario: Scenario,
    robot: RobotModel,
    *,
    source: str,
    wish: Wish,
    nearest: bool,
    thorough: bool = True,
) -> Feasibility:
    """Designs a gait for a scenario, and its times as is wished for, or says why there is none.

    Raises:
        InputError: If robot or scenario cannot be used; it names `source`.
    """
    try:
        designed = design_scenario(
            scenario, source=source, nearest=nearest, thorough=thorough, robot=robot
        )
    except PlanningError as error:
        return Feasibility(scenario, None, error.reason, dict(error.data), robot, wish=wish)
    others = design_longer(designed, robot, source=source)
    slow, designed = designed, quicken(designed, robot, wish, others=others, source=source)
    return Feasibility(designed.scenario, designed, "", {}, robot, wish=wish, slow=slow)


def _whole_path(model: str) -> str:
    """A robot's file by its whole path, so that a scenario can be saved anywhere; names stay."""
    path = user_path(model)
    return str(path.resolve()) if "://" not in model and path.is_file() else model


def nearest_stairs(
    judge: Callable[[Stairs], Feasibility], data: dict[str, Any], stairs: Stairs
) -> Stairs | None:
    """The nearest stairs that a robot climbs: a lower rise, or if none a deeper run.

    Args:
        judge: Says whether stairs can be climbed.
        data: Figures behind the reason why `stairs` cannot be climbed.
        stairs: The stairs that cannot be climbed.

    Returns:
        Stairs of as many steps that `judge` found feasible; None if nothing was found.
    """
    rise, run, count = stairs.rise, stairs.run, stairs.count
    few = min(count, SEARCH_COUNT)

    def works(rise: float) -> bool:
        return judge(replace(stairs, rise=rise, count=few)).feasible

    hint, deep = data.get("nearest_rise"), "deep" in data
    if "nearest_rise" not in data or hint is not None:
        # Above a hint no rise works, not even on endless stairs, as far as it was sought.
        low = _down(SHRINK * rise if hint is None else hint)
        high = rise if hint is None else min(rise, low + FINE)
        tries = TRIES_DEEP if deep else TRIES
        while low >= LEAST_RISE and tries > 0 and not works(low):
            low, high, tries = _down((SHRINK_DEEP if deep else SHRINK) * low), low, tries - 1
        if tries == 0:
            low = 0.0
        while low >= LEAST_RISE and high - low > FINE + 1e-9:
            middle = _down(0.5 * (low + high))
            low, high = (middle, high) if works(middle) else (low, middle)
        for lower in range(VERIFY):
            found = replace(stairs, rise=round(low - lower * FINE, 3))
            if found.rise >= LEAST_RISE and (few == count or judge(found).feasible):
                return found
    for times in () if deep else DEEPER:
        deeper = replace(stairs, run=round(times * run, 2))
        if deeper.run <= RUN_MAX and judge(deeper).feasible:
            return deeper
    return None


def _down(rise: float) -> float:
    """A rise [m], rounded down to millimetres."""
    return floor(1000.0 * rise + 1e-6) / 1000.0
