"""From a scenario's fields to the frozen values that the floors below take."""

import dataclasses
import math

from drake_quad.control.settings import ControlSettings
from drake_quad.errors import InputError
from drake_quad.gait.legs import Leg
from drake_quad.gait.workspace import Workspace
from drake_quad.planning.mission import Task, derive_mission
from drake_quad.planning.pattern import Pattern
from drake_quad.planning.settings import PlanSettings
from drake_quad.scenario_config import Scenario
from drake_quad.terrain import Course, Element, build_course

AT_PIVOT = 1e-6  # [m] a walk that ends this near to a lane's end ends there


def course_of(
    scenario: Scenario, *, source: str = "scenario", foot_radius: float = 0.035
) -> Course:
    """The scenario's course, laid out.

    Args:
        scenario: Of which only `course` is read.
        source: What an error names as the holder of the field, the file.
        foot_radius: Of the robot [m], for the shortest tread that can bear it.

    Raises:
        InputError: A field that no course can have, or a course that runs into itself.
    """
    elements = [Element(**dataclasses.asdict(element)) for element in scenario.course]
    return build_course(elements, source=source, foot_radius=foot_radius)


def plan_settings(scenario: Scenario) -> PlanSettings:
    """The planner's settings, of a checked scenario."""
    gait, spin, transition, body = (
        scenario.gait,
        scenario.spin,
        scenario.transition,
        scenario.body,
    )
    return PlanSettings(
        duty_factor=gait.duty_factor,
        cycle_time=gait.cycle_time,
        switch_wait=gait.switch_wait,
        stride=gait.stride,
        pattern=Pattern(treads=gait.treads, lag=gait.lag, per_tread=gait.places_per_tread),
        deep_tread=gait.deep_tread,
        body_ahead=gait.body_ahead,
        tread_phase_up=gait.tread_phase_up,
        tread_phase_down=gait.tread_phase_down,
        body_shift_up=gait.body_shift_up,
        body_shift_down=gait.body_shift_down,
        lift_down=gait.lift_down,
        max_ahead=gait.max_ahead,
        shank_room=gait.shank_room,
        workspace=Workspace(
            R_x=gait.workspace_length,
            R_y=gait.workspace_width,
            P_x=gait.stance_length,
            P_y=gait.stance_width,
        ),
        stance_stagger=gait.stance_stagger,
        on_centre=gait.on_centre,
        swing_clearance=gait.swing_clearance,
        map_error_place=gait.map_error_place,
        map_error_height=gait.map_error_height,
        body_height=gait.body_height,
        pitch_along_slope=gait.pitch_share if gait.pitch == "slope" else 0.0,
        spin_workspace=_spin_workspace(scenario),
        spin_arcs=spin.swing_path == "arc",
        spin_duty_factor=spin.duty_factor,
        spin_cycle_time=spin.cycle_time,
        body_still=transition.mode == "still",
        max_shift=transition.max_shift,
        swing_time=transition.swing_time,
        shift_time=transition.shift_time,
        via_centres=transition.via_centres,
        wave_order=tuple(Leg(number) for number in transition.wave_order),
        spin_order=tuple(Leg(number) for number in transition.spin_order),
        uniform_body=body.path == "uniform",
        dynamic=body.balance == "dynamic",
        margin_desired=body.margin_desired,
        zmp_margin=body.zmp_margin,
        margin=gait.margin,
        friction=scenario.controller.friction,
    )


def _spin_workspace(scenario: Scenario) -> Workspace | None:
    """The spinning gait's own boxes, if it has any."""
    gait, spin = scenario.gait, scenario.spin
    if not (spin.workspace_length or spin.workspace_width):
        return None
    return Workspace(
        R_x=spin.workspace_length or gait.workspace_length,
        R_y=spin.workspace_width or gait.workspace_width,
        P_x=gait.stance_length,
        P_y=gait.stance_width,
    )


def control_settings(scenario: Scenario) -> ControlSettings:
    """The controllers' settings, of a checked scenario."""
    return ControlSettings(**dataclasses.asdict(scenario.controller))


def mission_of(scenario: Scenario, course: Course, *, source: str = "scenario") -> tuple[Task, ...]:
    """The tasks of a scenario: its own mission, or what the course asks for.

    A spin on a lane's end, by the turn there, leads onto the next lane. A walk needs the robot to
    head along its lane.

    Args:
        scenario: Checked, but for where its mission leads.
        course: The scenario's course.
        source: What an error names as the holder of the field, the file.

    Raises:
        InputError: A walk across the lane, or beyond its ends.
    """
    if not scenario.mission:
        return derive_mission(course, plan_settings(scenario))
    tasks: list[Task] = []
    lane, s, heading = 0, scenario.start.distance, 0.0  # [m] along, [rad] from the lane's
    for i, element in enumerate(scenario.mission):
        name = f"{element.kind} {i + 1}"
        if element.kind == "stand":
            duration = element.duration or 0.0
            tasks.append(Task(kind="stand", name=name, lane=lane, duration=duration))
        elif element.kind == "spin":
            angle = math.radians(element.angle_deg or 0.0)
            tasks.append(Task(kind="spin", name=name, lane=lane, angle=angle))
            heading += angle
            at_end = lane < len(course.turns) and abs(s - course.lanes[lane].length) < AT_PIVOT
            if at_end and _same_heading(heading, course.turns[lane]):
                lane, s, heading = lane + 1, 0.0, 0.0
        else:
            distance = element.distance or 0.0
            remedy = ""
            if not _same_heading(heading, 0.0):
                remedy = "the robot does not head along the course here: spin first"
            elif not -AT_PIVOT <= s + distance <= course.lanes[lane].length + AT_PIVOT:
                length = course.lanes[lane].length
                remedy = f"leads off the lane, which is {length:g} m long; it starts at {s:g} m"
            if remedy:
                field = f"mission[{i}].distance"
                raise InputError(source=source, field=field, value=distance, remedy=remedy)
            s += distance
            tasks.append(Task(kind="walk", name=name, lane=lane, goal=s))
    return tuple(tasks)


def _same_heading(a: float, b: float) -> bool:
    """Whether two headings [rad] are the same direction."""
    return abs(math.remainder(a - b, math.tau)) < 1e-6
