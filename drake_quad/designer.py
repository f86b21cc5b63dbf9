"""Fills in the gait of a scenario that names a robot and a course, and leaves the rest to us."""

import copy
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf

from drake_quad.design.candidate import hip_length, leg_length
from drake_quad.design.choose import NEARLY, Design, choose_gaits, highest_rise
from drake_quad.design.course import flights_of
from drake_quad.design.fields import scenario_fields
from drake_quad.design.room import Room, find_room, refuse_thighs, refuse_touching
from drake_quad.design.search import WAYS
from drake_quad.design.shape import Shape, read_shape
from drake_quad.design.staircase import Staircase
from drake_quad.design.words import what_is_short
from drake_quad.errors import PlanningError
from drake_quad.planning.contact_plan import swing_times
from drake_quad.planning.motion_plan import evaluate
from drake_quad.planning.plan_mission import (
    MissionPlan,
    check_plan,
    initial_stance,
    join_plans,
    plan_tasks,
)
from drake_quad.planning.plan_torques import torque_ratio
from drake_quad.robot.load_robot import load_robot
from drake_quad.robot.robot_model import RobotModel
from drake_quad.scenario import Scenario, course_of, mission_of, plan_settings

DEEP = 1.0  # of a leg: depth of treads that may be walked as floors with curbs between them
LOWER = (0.0, 0.0075, 0.015, 0.03, 0.06, 0.1)  # of a leg: by which a body is lowered for a plan
# Heights at which a gait's plan may touch what it must not, before it is given up. A body that is
# lower on stairs is also elsewhere; over a curb it makes no room.
TOUCHES = 6
SLOWER, SLOWEST = 1.1, 3.0  # times as slow as joints' speeds ask for, and at most do
GOOD_MARGIN = 0.6  # of the margin desired: with that, and with
GOOD_ROOM = 0.8  # of the room wanted, a gait is as good as any
POOR = 0.5  # quality below which the next lower body is tried, too, and a more thorough search
GOOD_TORQUE = 0.8  # of the torque to spare that is wanted, the same
THIGHS_EVERY = 2  # so many are looked at for thighs
TORQUE_EVERY = 4  # so many samples of a plan are looked at for torques
PER_SWING = 24  # moments of every swing that are looked at: shanks pass nosings in a tenth of one
LEFT_OVER = 1.1  # of the margin that the gait clock asks for: what a plan keeps is kept nearly
TAKEN = 0.7  # quality with which a gait is taken, and no other tried


@dataclass(frozen=True, eq=False)
class Designed:
    """A scenario with its gait filled in.

    Attributes:
        scenario: In full.
        design: The gait and the room that it leaves on endless stairs.
        plan: Of the whole mission on paper.
        margin: Its least margin [m].
        room: Its least room between robot and course.
        torque: Of joints' limits, the least share that standing still in it leaves; negative where
            it takes more than there is, shared among the feet as controllers share it. They share
            it otherwise where they must, so that this alone forbids nothing.
    """

    scenario: Scenario
    design: Design
    plan: MissionPlan
    margin: float
    room: Room
    torque: float

    @property
    def quality(self) -> float:
        """The least share of what is wanted of margin, room and torque, at most 1."""
        return _quality(self.scenario, self.design, self.margin, self.room, self.torque)


def design_scenario(
    scenario: Scenario,
    *,
    source: str = "scenario",
    nearest: bool = True,
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
        return _design(scenario, robot, source=source, nearest=nearest)
    best: Designed | None = None
    try:
        best = _design(scenario, robot, source=source, nearest=False)
        if best.quality >= POOR:
            return best
        other = _design(stepped, robot, source=source, nearest=False)
    except PlanningError:
        if best is not None:
            return best
        try:
            return _design(stepped, robot, source=source, nearest=nearest)
        except PlanningError as error:
            raise PlanningError(error.reason, **error.data, deep=True) from None
    return max(best, other, key=lambda d: d.quality)


def _design(scenario: Scenario, robot: RobotModel, *, source: str, nearest: bool) -> Designed:
    """See `design_scenario`; which flights are walked as such is the scenario's to say.

    Raises:
        PlanningError: As there.
    """
    shape = read_shape(robot)
    course = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    flights = flights_of(course, scenario.gait.deep_tread)
    best: Designed | None = None
    refused: PlanningError | None = None
    nearest_gait: Design | None = None
    for way in WAYS:
        for design in choose_gaits(robot, shape, flights, way):
            if nearest_gait is None or design.score > nearest_gait.score:
                nearest_gait = design
            good = best is not None and best.quality >= max(POOR, design.score)
            if not design.feasible or good:
                continue  # what leaves less room on endless stairs is mostly not the better gait
            filled = fill_in(scenario, robot, design, [s.run for s in flights])
            plan = partial(_plan, design=design, robot=robot, shape=shape, source=source)
            touches = TOUCHES if flights else 1
            best, error = _lower(filled, plan, leg_length(robot), best, touches)
            refused = refused or error
            if best is not None and best.quality >= TAKEN:
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


def _lower(
    scenario: Scenario,
    plan: Callable[..., Designed | None],
    leg: float,
    best: Designed | None,
    touches: int = TOUCHES,
) -> tuple[Designed | None, PlanningError | None]:
    """The best of what there was and of a design whose body is as high as it can be, or lower.

    At a flight's ends, and as it sways, the body is not quite where it is on endless stairs: legs
    that are then too short are long enough for a body that is lower. Of a poor plan the next lower
    one is tried, too; below one that is refused then there is none. Nor is there after so many
    plans by which parts touch. Also returns why the first was refused that was.
    """
    refused: PlanningError | None = None
    planned, touched, tried = 0, 0, scenario
    for share in LOWER:
        tried = copy.deepcopy(tried)  # with it how slow a higher body had to be: so will this
        tried.gait.body_height = scenario.gait.body_height - share * leg
        try:
            best = _or_slower(tried, partial(plan, beat=best)) or best
        except PlanningError as error:
            refused = refused or error
            touched += "room" in error.data or "apart" in error.data
            if planned or touched == touches:
                break
            continue
        planned += 1
        if planned == 2 or (best is not None and best.quality >= POOR):
            break
    return best, refused


def _or_slower(scenario: Scenario, plan: Callable[[Scenario], Designed | None]) -> Designed | None:
    """What `plan` makes of a scenario; of it slower, if joints would turn faster than they can.

    Raises:
        PlanningError: As `plan`.
    """
    try:
        return plan(scenario)
    except PlanningError as error:
        too_fast = error.data.get("too_fast")
        if too_fast is None or too_fast > SLOWEST:
            raise
        for section in (scenario.gait, scenario.spin):
            section.cycle_time *= SLOWER * too_fast
        for name in ("swing_time", "shift_time"):
            setattr(
                scenario.transition, name, SLOWER * too_fast * getattr(scenario.transition, name)
            )
        return plan(scenario)


def _plan(
    scenario: Scenario,
    *,
    design: Design,
    robot: RobotModel,
    shape: Shape,
    source: str,
    beat: Designed | None,
) -> Designed | None:
    """Plans a scenario in full; None as soon as it is no better than another, `beat`.

    Raises:
        PlanningError: If there is no plan, or one that touches the stairs with more than feet.
    """
    course = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    settings = plan_settings(scenario)
    stance = initial_stance(robot, course, settings, start=scenario.start.distance)
    tasks = mission_of(scenario, course, source=source)
    begun, plans = time.perf_counter(), []
    room, margin, torque = Room(inf, inf, "", "", 0.0), inf, 1.0
    for plan in plan_tasks(robot, course, settings, tasks, stance):
        task = tasks[plan.index]
        samples = check_plan(robot, plan, dynamic=settings.dynamic)
        swings = evaluate(robot, plan, swing_times(plan.contacts, PER_SWING))
        here = find_room(robot, shape, course, [task, task], [samples, swings])
        if here.distance <= 0.0:
            raise PlanningError(
                f"{here.part} would be {-here.distance:.3f} m inside the stairs at "
                f"{here.time:.1f} s of '{here.task}'",
                room=here.distance,
            )
        room = min(room, here, key=lambda r: r.worth)
        if plan.margin == plan.margin:  # standing still has none
            _refuse_waiting(scenario, task.name, plan.margin)
            margin = min(margin, plan.margin)
        refuse_thighs(robot, course, task, samples.every(THIGHS_EVERY))
        refuse_touching(robot, task, samples)
        refuse_touching(robot, task, swings)
        torque = min(torque, 1.0 - float(torque_ratio(robot, samples.every(TORQUE_EVERY)).max()))
        plans.append(plan)
        if beat is not None and _quality(scenario, design, margin, room, torque) <= beat.quality:
            return None
    mission = join_plans(plans, time.perf_counter() - begun, dynamic=settings.dynamic)
    return Designed(scenario, design, mission, margin if margin < inf else 0.0, room, torque)


def _refuse_waiting(scenario: Scenario, task: str, margin: float) -> None:
    """Refuses a plan by which the gait clock would wait at a lift-off, and then stop.

    Raises:
        PlanningError: With the margin that there is, and the one that there has to be.
    """
    least = scenario.controller.lift_off_margin
    if margin < LEFT_OVER * least:
        raise PlanningError(
            f"the static margin would be {margin:.3f} m in '{task}', and no foot is lifted with "
            f"less than {least:.3f} m",
            margin=margin,
        )


def _quality(scenario: Scenario, design: Design, margin: float, room: Room, torque: float) -> float:
    """See Designed; of the tasks that are planned, more can only make it less."""
    wanted = design.wanted
    return min(
        1.0,
        margin / (GOOD_MARGIN * scenario.body.margin_desired),
        room.worth / (GOOD_ROOM * wanted["legs"]),
        torque / (GOOD_TORQUE * wanted["torque"]),
    )


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
        f"no more than {highest:.3g} m could work"
        if highest is not None
        else f"no rise works on a run of {steepest.run:g} m"
    )
    return PlanningError(
        f"{here}; {works}",
        slacks=design.slacks,
        nearest_rise=highest,
        run=steepest.run,
    )
