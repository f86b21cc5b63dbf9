"""Fills in the gait of a scenario that names a robot and a course, and leaves the rest to us."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

from drake_quad.design.candidate import leg_length
from drake_quad.design.choose import Design, choose_gaits, highest_rise
from drake_quad.design.course import flights_of
from drake_quad.design.fields import scenario_fields
from drake_quad.design.room import Room, find_room
from drake_quad.design.shape import Shape, read_shape
from drake_quad.design.staircase import Staircase
from drake_quad.design.words import what_is_short
from drake_quad.errors import PlanningError
from drake_quad.planning.plan_mission import (
    MissionPlan,
    check_mission,
    initial_stance,
    plan_mission,
)
from drake_quad.robot.load_robot import load_robot
from drake_quad.robot.robot_model import RobotModel
from drake_quad.scenario import Scenario, course_of, mission_of, plan_settings

LOWER = (0.0, 0.0075, 0.015, 0.03, 0.06, 0.1)  # of a leg: by which a body is lowered for a plan
GOOD_MARGIN = 0.6  # of the margin desired: with that, and with
GOOD_ROOM = 0.8  # of the room wanted, a gait is taken, and no other tried


@dataclass(frozen=True, eq=False)
class Designed:
    """A scenario with its gait filled in.

    Attributes:
        scenario: In full.
        design: The gait and the room that it leaves on endless stairs.
        plan: Of the whole mission on paper.
        margin: Its least margin [m].
        room: Its least room between robot and course.
    """

    scenario: Scenario
    design: Design
    plan: MissionPlan
    margin: float
    room: Room

    @property
    def quality(self) -> float:
        """The least share of what is wanted of margin and room, at most 1."""
        share = self.margin / (GOOD_MARGIN * self.scenario.body.margin_desired)
        return min(1.0, share, self.room.distance / (GOOD_ROOM * self.design.wanted["legs"]))


def design_scenario(scenario: Scenario, *, source: str = "scenario") -> Designed:
    """Designs the gait for a scenario's robot and course.

    The candidates are judged on endless staircases like the course's; the best are then planned on
    the course itself, until one keeps good margin and room.

    Raises:
        InputError: If robot or course cannot be used.
        PlanningError: If no gait climbs it: what is short by how much, and what would work.
    """
    robot = load_robot(scenario.robot.model)
    shape = read_shape(robot)
    course = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    flights = flights_of(course)
    designs = choose_gaits(robot, shape, flights)
    if not designs:
        runs = ", ".join(f"{s.run:g}" for s in flights)
        raise PlanningError(
            f"no pattern of footprints on runs of {runs} m fits between its hips: for 1, 2 or 3 "
            "treads a cycle front and rear feet would be too near or too far apart",
            runs=[s.run for s in flights],
        )
    if not designs[0].feasible:
        raise _hopeless(robot, shape, flights, designs[0])
    best: Designed | None = None
    refused: PlanningError | None = None
    for design in designs:
        if not design.feasible:
            continue
        filled = fill_in(scenario, robot, design, [s.run for s in flights])
        for lower in LOWER:
            # At a flight's ends, and as it sways, the body is not quite where it is on endless
            # stairs: legs that are then too short are long enough for a body that is lower.
            tried = copy.deepcopy(filled)
            tried.gait.body_height -= lower * leg_length(robot)
            try:
                found = _plan(tried, design, robot, shape, source=source)
            except PlanningError as error:
                refused = refused or error
                continue
            if best is None or found.quality > best.quality:
                best = found
            break
        if best is not None and best.quality >= 1.0:
            break
    if best is None:
        assert refused is not None
        raise PlanningError(
            f"there is a gait for stairs like these, but no plan on this course: {refused.reason}",
            **refused.data,
        )
    return best


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


def _plan(
    scenario: Scenario, design: Design, robot: RobotModel, shape: Shape, *, source: str
) -> Designed:
    """Plans a scenario in full.

    Raises:
        PlanningError: If there is no plan, or one that touches the stairs with more than feet.
    """
    course = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    settings = plan_settings(scenario)
    stance = initial_stance(robot, course, settings, start=scenario.start.distance)
    tasks = mission_of(scenario, course, source=source)
    plan = plan_mission(robot, course, settings, tasks, stance)
    samples = check_mission(robot, plan)
    room = find_room(robot, shape, course, tasks, samples)
    if room.distance <= 0.0:
        raise PlanningError(
            f"{room.part} would be {-room.distance:.3f} m inside the stairs at {room.time:.1f} s "
            f"of '{room.task}'",
            room=room.distance,
        )
    margin = min((p.margin for p in plan.plans if p.margin == p.margin), default=0.0)
    return Designed(scenario, design, plan, margin, room)


def _hopeless(
    robot: RobotModel, shape: Shape, flights: list[Staircase], design: Design
) -> PlanningError:
    """Says what is short, and which stairs would work."""
    reason = what_is_short(design)
    if not flights:
        return PlanningError(f"not even on level ground: {reason}", slacks=design.slacks)
    steepest = max(flights, key=lambda s: abs(s.slope))
    nearest = highest_rise(robot, shape, steepest.run, below=abs(steepest.rise))
    works = (
        f"no more than {nearest:.3g} m could work"
        if nearest is not None
        else f"no rise works on a run of {steepest.run:g} m"
    )
    return PlanningError(
        f"rise {abs(steepest.rise):g} m on a run of {steepest.run:g} m: {reason}; {works}",
        slacks=design.slacks,
        nearest_rise=nearest,
        run=steepest.run,
    )
