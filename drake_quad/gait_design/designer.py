"""Fills in a scenario's gait: the design that its robot and course ask for.

The feedback's numbers were found on the paper's robot (60 kg, legs of 1.22 m). Robots of like build
move alike when lengths scale with the leg l, masses with m and times with sqrt(l / g) (dynamic
similarity; Alexander and Jayes 1983): forces scale with m, stiffness with m / l, damping with
m / sqrt(l), moments with m l.
"""

import copy
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from math import sqrt

from drake_quad.control.settings import ControlSettings
from drake_quad.errors import PlanningError
from drake_quad.gait_design.candidates import EDGE, Staircase, flights_of, hip_length
from drake_quad.gait_design.choose_gait import (
    NEARLY,
    Design,
    choose_gaits,
    choose_longer_gaits,
    describe_shortage,
    highest_rise,
)
from drake_quad.gait_design.designed import POOR, Designed, plan_design
from drake_quad.gait_design.plan_candidates import TOUCHES, Gait, doubt_gait, plan_any, plan_gaits
from drake_quad.gait_design.search import QUICK, SEARCH_SETTINGS, SearchSettings, swing_clearance
from drake_quad.gait_design.short_course import ShortFirst
from drake_quad.gait_design.tempo_planner import GaitChoice
from drake_quad.planning.mission import HELD_BY_FRICTION
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import LinkOutline, RobotModel, leg_length, link_outline_of
from drake_quad.scenario.build import course_of
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.motion_config import PREFER
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import TURNING_SPACE

Fields = dict[str, dict[str, float | int | str]]

MASS, LEG = 60.0, 1.22  # of the robot that the numbers below are of [kg], [m]
CYCLE_TIME = 8.0  # [s]
TREADS_TIME = {1: 0.9, 2: 1.1, 3: 1.35}  # of it: a shorter step takes less time
FOUND_RADIUS = 0.008  # [m] of the feet with which `foothold_time` was found
MOST_AHEAD = 0.15  # of a leg: that the body may be ahead of its place, or behind
SWING_TIME, SHIFT_TIME = 1.2, 1.3  # [s]
WIDEST = {1: 0.25, 2: 0.36}  # of a leg: that they sway, by places a tread
SWITCH_WAIT = 0.75  # [s] where treads have several places: small robots sway far for their margin


def scenario_fields(robot: RobotModel, design: Design, runs: Sequence[float]) -> Fields:
    """The fields, by section, of a scenario with that gait.

    Args:
        robot: The robot.
        design: The gait.
        runs: Depths of the course's treads [m]; feet fit whole on the shallowest.
    """
    c, leg = design.gait, leg_length(robot)
    run = min(runs, default=1.0)
    # Off the places [treads].
    most = max(0.5 / c.pattern.per_tread - (robot.foot_radius + EDGE) / run, 0.0)
    share = float(c.share[0])
    size, mass = leg / LEG, robot.mass / MASS
    tempo = sqrt(size)
    cycle_time = CYCLE_TIME * tempo * TREADS_TIME[c.pattern.treads]
    gait: dict[str, float | int | str] = {
        "duty_factor": c.duty_factor,
        "cycle_time": cycle_time,
        # As short as on the stairs: front feet are on treads while rear feet are not yet.
        "switch_wait": SWITCH_WAIT * tempo if c.pattern.per_tread > 1 else 0.0,
        "stride": min(design.stride, c.pattern.treads * run / c.pattern.per_tread),
        "treads": c.pattern.treads,
        "lag": c.pattern.lag,
        "places_per_tread": c.pattern.per_tread,
        "body_ahead": c.pattern.ahead(c.duty_factor),
        "tread_phase_up": most * float(c.phase_up[0]),
        "tread_phase_down": most * float(c.phase_down[0]),
        "body_shift_up": float(c.shift_up[0]),
        "body_shift_down": float(c.shift_down[0]),
        "lift_down": float(c.lift_down[0]),
        "shank_room": design.wanted["legs"],
        "max_ahead": MOST_AHEAD * leg + float(c.surge[0]),
        "stance_length": hip_length(robot),
        "stance_width": float(c.width[0]),
        "stance_stagger": c.stagger,
        # The joints' own limits are checked: boxes as large as a leg are none.
        "workspace_length": 4.0 * leg,
        "workspace_width": 4.0 * leg,
        "swing_clearance": swing_clearance(robot),
        "body_height": float(c.height[0]),
        "pitch": "slope" if share > 0.0 else "level",
        "pitch_share": share,
    }
    return {
        "gait": {key: _short(value) for key, value in gait.items()},
        "spin": {
            "cycle_time": _short(CYCLE_TIME * tempo),
            "workspace_length": _short(0.65 * leg),
            "workspace_width": _short(0.41 * leg),
        },
        "transition": {
            "max_shift": _short(WIDEST[c.pattern.per_tread] * leg),
            "swing_time": _short(SWING_TIME * tempo),
            "shift_time": _short(SHIFT_TIME * tempo),
        },
        "body": {
            "margin_desired": _short(0.10 * size),
            "zmp_margin": _short(0.08 * size),
        },
        "controller": control_fields(mass, size, robot.foot_radius),
    }


def control_fields(mass: float, size: float, foot_radius: float) -> dict[str, float | int | str]:
    """The controller's, for a robot of so many times the mass and leg length.

    A foot rolls on as far as it is thick [m], and what it is held at lags behind by what it rolls
    in `foothold_time`: thick feet were pulled at by their joints, which tipped light robots.
    """
    tempo = sqrt(size)
    foothold_time = 0.3 * tempo * min(1.0, FOUND_RADIUS * size / foot_radius)
    return {
        "kind": "whole_body",
        "period": 0.002,
        "kp": _short(2000.0 * mass * size),
        "kd": _short(80.0 * mass * size * tempo),
        "base_stiffness": _short(3000.0 * mass / size),
        "base_damping": _short(900.0 * mass / tempo),
        "base_rotation_stiffness": _short(1000.0 * mass * size),
        "base_rotation_damping": _short(100.0 * mass * size * tempo),
        "least_force": _short(20.0 * mass),
        "unload_time": _short(0.25 * tempo),
        "foothold_time": _short(foothold_time),
        "touchdown_press": _short(max(0.003 * size, 0.001)),
        "landing_speed": _short(0.15 * tempo),
        "lift_off_margin": _short(0.02 * size),
        "pressure_margin": _short(0.01 * size),
        "push_speed": _short(0.12 * tempo),
    }


def _short(value: float | int | str) -> float | int | str:
    """Four digits are enough, and pleasant to read."""
    return float(f"{value:.4g}") if isinstance(value, float) else value


DEEP = 1.0  # of a leg: depth of treads that may be walked as floors with curbs between them
ASSUMED = ControlSettings().friction
# Of the friction that standing on a slope takes, and at most of what its ground has, a designed
# gait's controller counts on so much.
SPARE_FRICTION, MOST_FRICTION = 1.1, 0.95
TAKEN = 0.7  # quality with which a gait of the margin wanted is taken, and no other tried


def design_scenario(
    scenario: Scenario,
    *,
    source: str = "scenario",
    nearest: bool = True,
    thorough: bool = True,
    robot: RobotModel | None = None,
    turning_space: float = TURNING_SPACE,
    note: Callable[[str], object] = lambda _: None,
) -> Designed:
    """Designs the gait for a scenario's robot and course.

    The candidates are judged on endless staircases like the course's; the best are then planned on
    the course itself, until one keeps good margin and clearance. Where none does they are sought
    more thoroughly, unless that is hopeless. Flights with deep treads, on which no good gait has a
    footprint of its own for each tread, are walked in the stride of level ground.

    Args:
        scenario: Robot and course.
        source: What an error names.
        nearest: Whether to say which rise would work if this one does not; it takes a while.
        thorough: Whether to look for a good gait. If not, any that a quick search finds will do.
        robot: The scenario's, if it is at hand: to read it takes a while, too.
        turning_space: Length and width of the smallest landing that it may turn on [m].
        note: Receives a line before a gait is planned on the course.

    Raises:
        InputError: If robot or course cannot be used.
        PlanningError: If no gait climbs it: what is short by how much, and what would work.
    """
    robot = robot or load_robot(scenario.robot.model)
    build = partial(
        course_of, source=source, foot_radius=robot.foot_radius, turning_space=turning_space
    )
    course = build(scenario)
    scenario = count_on_slopes(scenario, course)
    stepped = copy.deepcopy(scenario)
    stepped.gait.deep_tread = round(DEEP * leg_length(robot), 3)
    design = partial(_design, robot=robot, course=course, build=build, source=source, note=note)
    if len(flights_of(course, stepped.gait.deep_tread)) == len(flights_of(course)):
        return design(scenario, nearest=nearest, thorough=thorough)
    best: Designed | None = None
    try:
        best = design(scenario, nearest=False, thorough=thorough)
        if best.quality >= POOR or not thorough:
            return best
        other = design(stepped, nearest=False, thorough=True)
    except PlanningError:
        if best is not None:
            return best
        try:
            return design(stepped, nearest=nearest, thorough=thorough)
        except PlanningError as error:
            raise PlanningError(error.reason, **error.data, deep=True) from None
    return max(best, other, key=lambda d: d.quality)


def count_on_slopes(scenario: Scenario, course: Course) -> Scenario:
    """The scenario, its controller counting on the friction that the course's slopes take.

    It counts on ASSUMED unless a person says otherwise, and never on more than the ground has.
    """
    steepest = max((abs(box.gradient) for box in course.boxes), default=0.0)
    takes = steepest / HELD_BY_FRICTION
    more = min(SPARE_FRICTION * takes, MOST_FRICTION * scenario.simulation.friction)
    if scenario.controller.friction != ASSUMED or takes <= ASSUMED or more < takes:
        return scenario
    changed = copy.deepcopy(scenario)
    changed.controller.friction = round(more, 3)
    return changed


def _design(
    scenario: Scenario,
    robot: RobotModel,
    course: Course,
    *,
    build: Callable[[Scenario], Course],
    source: str,
    nearest: bool,
    thorough: bool,
    note: Callable[[str], object],
) -> Designed:
    """See `design_scenario`; which flights are walked as such is the scenario's to say.

    Where the map may be wrong, shanks keep more clearance; if no gait does, as little as otherwise.

    Raises:
        PlanningError: As there.
    """
    design = partial(
        _design_for, scenario, robot, course, build=build, source=source, thorough=thorough,
        note=note,
    )  # fmt: skip
    if scenario.gait.map_error_place > 0.0:
        with suppress(PlanningError):
            return design(scenario.gait.map_error_place, nearest=False)
    return design(0.0, nearest=nearest)


def _design_for(
    scenario: Scenario,
    robot: RobotModel,
    course: Course,
    map_error: float,
    *,
    build: Callable[[Scenario], Course],
    source: str,
    nearest: bool,
    thorough: bool,
    note: Callable[[str], object],
) -> Designed:
    """See `_design`, for risers that may be off by `map_error` [m]."""
    shape = link_outline_of(robot)
    flights = flights_of(course, scenario.gait.deep_tread)
    plan = partial(plan_design, robot=robot, shape=shape, source=source)
    on_course = ShortFirst(course, build, plan, note)
    best: Designed | None = None
    refused: PlanningError | None = None
    nearest_gait: Design | None = None

    def gaits(way: SearchSettings) -> Iterator[Gait]:
        nonlocal nearest_gait
        for design in choose_gaits(robot, shape, flights, way, map_error=map_error):
            if nearest_gait is None or design.score > nearest_gait.score:
                nearest_gait = design
            if design.feasible:
                filled = fill_in(scenario, robot, design, [s.run for s in flights])
                yield Gait(
                    design.score, filled, partial(on_course.plan, design=design),
                    partial(doubt, design=design),
                )  # fmt: skip

    def doubt(filled: Scenario, design: Design) -> PlanningError | None:
        short, its_course = on_course.shorten(filled)
        return doubt_gait(short, design=design, robot=robot, course=its_course, source=source)

    leg = leg_length(robot)
    if not thorough:
        best, refused = plan_any(gaits(QUICK), leg)
    for way in SEARCH_SETTINGS if thorough else ():
        best, error = plan_gaits(
            gaits(way), leg, best, touches=TOUCHES if flights else 1,
            taken=lambda found: found.quality >= TAKEN and found.has_margin,
        )  # fmt: skip
        refused = refused or error
        good = best is not None and best.quality >= POOR
        if good or not flights or nearest_gait is None or nearest_gait.score <= NEARLY:
            break
    if best is not None:
        return best
    if nearest_gait is None:
        hips, runs = hip_length(robot), sorted({f"{s.run:g} m" for s in flights})
        raise PlanningError(
            f"on treads of {', '.join(runs)} no gait sets front and rear feet about as far apart "
            f"as the hips, which are {hips:.2f} m apart",
            pattern=hips,
            nearest_rise=None,
        )
    if refused is not None:
        raise PlanningError(
            f"there is a gait for stairs like these, but no plan on this course: {refused.reason}",
            **refused.data,
        )
    raise _hopeless(robot, shape, flights, nearest_gait, nearest=nearest)


def design_longer(
    designed: Designed,
    robot: RobotModel,
    *,
    as_long: bool = False,
    worth: Callable[[float], bool] = lambda _: True,
    source: str = "scenario",
) -> Iterator[GaitChoice]:
    """Gaits for a scenario's course that go farther in a cycle than the one found, or as far.

    Args:
        designed: The gait that was found, with its scenario.
        robot: The scenario's.
        as_long: Whether others that go as far are among them: they may be quicker with less margin.
        worth: Whether gaits that go so many times as far in a cycle are of interest.
        source: What an error names.
    """
    scenario, pattern = designed.scenario, designed.design.gait.pattern
    course = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    flights = flights_of(course, scenario.gait.deep_tread)
    shape = link_outline_of(robot)
    if not flights:
        return
    longer = choose_longer_gaits(robot, shape, flights, pattern, as_long=as_long, worth=worth)
    for design in longer:
        yield GaitChoice(fill_in(scenario, robot, design, [s.run for s in flights]), design)


def fill_in(
    scenario: Scenario, robot: RobotModel, design: Design, runs: Sequence[float]
) -> Scenario:
    """The scenario with a design's fields; what the scenario says besides stays."""
    filled = copy.deepcopy(scenario)
    for section, fields in scenario_fields(robot, design, runs).items():
        for name, value in fields.items():
            setattr(getattr(filled, section), name, value)
    filled.design, filled.prefer = "given", PREFER[0]
    return filled


def _hopeless(
    robot: RobotModel,
    shape: LinkOutline,
    flights: list[Staircase],
    design: Design,
    *,
    nearest: bool,
) -> PlanningError:
    """Says what is short, and which stairs would work."""
    reason = describe_shortage(design)
    if not flights:
        return PlanningError(f"not even on level ground: {reason}", slacks=design.slacks)
    steepest = max(flights, key=lambda s: abs(s.slope))
    here = f"rise {abs(steepest.rise):g} m on a run of {steepest.run:g} m: {reason}"
    if not nearest:
        return PlanningError(here, slacks=design.slacks, run=steepest.run)
    going = sorted({1 if stairs.rise > 0.0 else -1 for stairs in flights}, reverse=True)
    highest = highest_rise(robot, shape, steepest.run, below=abs(steepest.rise), going=going)
    works = (
        f"; a quick search finds gaits for up to {highest:.3g} m"
        if highest is not None
        else f"; a quick search finds none on a run of {steepest.run:g} m"
    )
    return PlanningError(
        here + works,
        slacks=design.slacks,
        nearest_rise=highest,
        run=steepest.run,
    )
