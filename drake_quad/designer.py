"""Fills in the gait of a scenario that names a robot and a course, and leaves the rest to us."""

import copy
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial

from drake_quad.design.candidate import hip_length
from drake_quad.design.choose import NEARLY, Design, choose_gaits, highest_rise
from drake_quad.design.course import flights_of
from drake_quad.design.fields import scenario_fields
from drake_quad.design.search import QUICK, WAYS, Way
from drake_quad.design.shape import Shape, read_shape
from drake_quad.design.staircase import Staircase
from drake_quad.design.words import what_is_short
from drake_quad.designer_lower import TOUCHES, Gait, plan_any, plan_lower
from drake_quad.designer_plan import POOR, Designed, plan_design
from drake_quad.errors import PlanningError
from drake_quad.robot.load_robot import load_robot
from drake_quad.robot.robot_model import RobotModel, leg_length
from drake_quad.scenario import Scenario, course_of

DEEP = 1.0  # of a leg: depth of treads that may be walked as floors with curbs between them
TAKEN = 0.7  # quality with which a gait of the margin wanted is taken, and no other tried


def design_scenario(
    scenario: Scenario,
    *,
    source: str = "scenario",
    nearest: bool = True,
    thorough: bool = True,
    robot: RobotModel | None = None,
) -> Designed:
    """Designs the gait for a scenario's robot and course.

    The candidates are judged on endless staircases like the course's; the best are then planned on
    the course itself, until one keeps good margin and room. Where none does they are sought more
    thoroughly, unless that is hopeless. Flights with deep treads, on which no good gait has a
    footprint of its own for each tread, are walked in the stride of level ground.

    Args:
        scenario: Robot and course.
        source: What an error names.
        nearest: Whether to say which rise would work if this one does not; it takes a while.
        thorough: Whether to look for a good gait. If not, any that a quick search finds will do.
        robot: The scenario's, if it is at hand: to read it takes a while, too.

    Raises:
        InputError: If robot or course cannot be used.
        PlanningError: If no gait climbs it: what is short by how much, and what would work.
    """
    robot = robot or load_robot(scenario.robot.model)
    course = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    stepped = copy.deepcopy(scenario)
    stepped.gait.deep_tread = round(DEEP * leg_length(robot), 3)
    if len(flights_of(course, stepped.gait.deep_tread)) == len(flights_of(course)):
        return _design(scenario, robot, source=source, nearest=nearest, thorough=thorough)
    best: Designed | None = None
    try:
        best = _design(scenario, robot, source=source, nearest=False, thorough=thorough)
        if best.quality >= POOR or not thorough:
            return best
        other = _design(stepped, robot, source=source, nearest=False)
    except PlanningError:
        if best is not None:
            return best
        try:
            return _design(stepped, robot, source=source, nearest=nearest, thorough=thorough)
        except PlanningError as error:
            raise PlanningError(error.reason, **error.data, deep=True) from None
    return max(best, other, key=lambda d: d.quality)


def _design(
    scenario: Scenario, robot: RobotModel, *, source: str, nearest: bool, thorough: bool = True
) -> Designed:
    """See `design_scenario`; which flights are walked as such is the scenario's to say.

    Where the map may be wrong, shanks keep more room; if no gait does, as little as otherwise.

    Raises:
        PlanningError: As there.
    """
    if scenario.gait.map_error_place > 0.0:
        with suppress(PlanningError):
            return _design_for(
                scenario, robot, scenario.gait.map_error_place,
                source=source, nearest=False, thorough=thorough,
            )  # fmt: skip
    return _design_for(scenario, robot, 0.0, source=source, nearest=nearest, thorough=thorough)


def _design_for(
    scenario: Scenario,
    robot: RobotModel,
    map_error: float,
    *,
    source: str,
    nearest: bool,
    thorough: bool,
) -> Designed:
    """See `_design`, for risers that may be off by `map_error` [m]."""
    shape = read_shape(robot)
    course = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    flights = flights_of(course, scenario.gait.deep_tread)
    best: Designed | None = None
    refused: PlanningError | None = None
    nearest_gait: Design | None = None

    def gaits(way: Way) -> Iterator[Gait]:
        nonlocal nearest_gait
        for design in choose_gaits(robot, shape, flights, way, map_error=map_error):
            if nearest_gait is None or design.score > nearest_gait.score:
                nearest_gait = design
            if design.feasible:
                filled = fill_in(scenario, robot, design, [s.run for s in flights])
                plan = partial(plan_design, design=design, robot=robot, shape=shape, source=source)
                yield Gait(design.score, filled, plan)

    leg = leg_length(robot)
    if not thorough:
        best, refused = plan_any(gaits(QUICK), leg)
    for way in WAYS if thorough else ():
        for gait in gaits(way):
            if best is not None and best.quality >= max(POOR, gait.score):
                continue  # what leaves less room on endless stairs is mostly not the better gait
            touches = TOUCHES if flights else 1
            best, error = plan_lower(gait, leg, best, touches)
            refused = refused or error
            if best is not None and best.quality >= TAKEN and best.has_margin:
                break
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


def fill_in(
    scenario: Scenario, robot: RobotModel, design: Design, runs: Sequence[float]
) -> Scenario:
    """The scenario with a design's fields; what the scenario says besides stays."""
    filled = copy.deepcopy(scenario)
    for section, fields in scenario_fields(robot, design, runs).items():
        for name, value in fields.items():
            setattr(getattr(filled, section), name, value)
    filled.design = "given"
    return filled


def _hopeless(
    robot: RobotModel, shape: Shape, flights: list[Staircase], design: Design, *, nearest: bool
) -> PlanningError:
    """Says what is short, and which stairs would work."""
    reason = what_is_short(design)
    if not flights:
        return PlanningError(f"not even on level ground: {reason}", slacks=design.slacks)
    steepest = max(flights, key=lambda s: abs(s.slope))
    here = f"rise {abs(steepest.rise):g} m on a run of {steepest.run:g} m: {reason}"
    if not nearest:
        return PlanningError(here, slacks=design.slacks, run=steepest.run)
    highest = highest_rise(robot, shape, steepest.run, below=abs(steepest.rise))
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
