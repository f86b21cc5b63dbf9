"""From what was seen to a plan: the map is made of the belief, and of nothing else.

Of `course` and `world` the robot learns nothing here. What it is told is where it stands, that it
stands on a floor, how far the ground is level beyond the last step, and whether to come back.
"""

import copy
import math
from dataclasses import replace

import numpy as np

from drake_quad.gait_design.designer import design_scenario
from drake_quad.perception.growing_map import trust
from drake_quad.perception.sight import Sight
from drake_quad.perception.stair_map import (
    StairMap,
    describe_belief,
    lay_map,
    make_stair_map,
    unfinished,
)
from drake_quad.planning.clearance import check_shanks
from drake_quad.planning.known_mission import Growth
from drake_quad.planning.mission import check_mission, plan_mission
from drake_quad.planning.onward import (
    doubtful_foothold,
    plan_onward,
    round_up,
    task_to_revise_before,
    with_map_errors,
)
from drake_quad.planning.problem import Task, derive_mission
from drake_quad.planning.turning_room import check_turning_width, least_turning_space
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.build import plan_settings
from drake_quad.scenario.config import MissionElement, Scenario, WorldConfig
from drake_quad.simulation.eyes import eyes_of, reach_of, way_back
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import TURNING_SPACE, Element

FLOOR_AHEAD = 1.0  # [m] of the floor that a robot knows of before it has looked
LOOK = "stand and look"
LINGER = 0.5  # [s] that the robot would stand on: its stand ends the simulation, and the look not


def blind_scenario(scenario: Scenario) -> Scenario:
    """The scenario of a robot that has not looked yet: it stands on a floor, and knows no more."""
    blind = copy.deepcopy(scenario)
    length = scenario.start.distance + FLOOR_AHEAD
    blind.course = [Element(kind="floor", length=length)]
    duration = scenario.perception.look_time + LINGER
    blind.mission = [MissionElement(kind="stand", duration=duration)]
    blind.world = WorldConfig()
    blind.perception.map = "told"
    blind.start.heading_deg = 0.0
    return blind


def floor_underfoot(scenario: Scenario, *, foot_radius: float) -> Course:
    """The map of a robot that has not looked yet: a floor that leads where the robot heads.

    Args:
        scenario: The scenario, of which only the start is read.
        foot_radius: Radius of the robot's feet [m].
    """
    start = scenario.start
    yaw = math.radians(start.heading_deg)
    behind = start.distance * np.array([math.cos(yaw), math.sin(yaw)])
    return lay_map(
        (Element(kind="floor", length=start.distance + FLOOR_AHEAD),),
        origin=np.array([start.distance, 0.0]) - behind, yaw=yaw, floor=0.0,
        foot_radius=foot_radius, turning_space=TURNING_SPACE,
    )  # fmt: skip


def map_of_sight(scenario: Scenario, sight: Sight, blind: PreparedScenario) -> StairMap:
    """The map of what was seen: of a flight whose end was not, its first steps.

    Args:
        scenario: The scenario, of whose course the robot is told only whether it is to come back.
        sight: What was seen.
        blind: The robot as it stood and looked.

    Raises:
        PlanningError: There is nothing to climb in it.
    """
    stance, reach = blind.stance, reach_of(blind.settings)
    found = make_stair_map(
        sight.belief,
        sight.level,
        standing=stance.body[:2],
        floor=float(stance.feet[:, 2].mean()) - blind.robot.foot_radius,
        behind=scenario.start.distance,
        landing=scenario.perception.landing,
        reach=reach,
        turning_space=least_turning_space(blind.robot),
        to_its_end=False,
    )
    if found.complete:
        return replace(found, elements=(*found.elements, *way_back(scenario)))
    assert sight.belief is not None
    return trust(found, reach=reach, yaw_sigma=sight.belief.sigma("yaw"))


def imagined(scenario: Scenario, found: StairMap) -> StairMap:
    """A map as if the flight ended with the last step that is known well enough.

    A gait is designed for it. Nothing is planned on it.

    Args:
        scenario: The scenario.
        found: The map, of the first steps of a flight.
    """
    count = max(found.trusted, 1)
    floor, stairs, landing = found.elements
    assert stairs.rises is not None and stairs.runs is not None
    length = max(scenario.perception.landing - found.run, found.turning_space)
    width = max(float(landing.width or 0.0), found.turning_space)
    elements = (
        floor,
        replace(stairs, rises=stairs.rises[:count], runs=stairs.runs[:count]),
        replace(landing, length=length, width=width),
        *way_back(scenario),
    )
    return replace(found, elements=elements)


def scenario_of_map(scenario: Scenario, found: StairMap) -> Scenario:
    """The scenario as if the map had been told: what a gait is designed for.

    Args:
        scenario: The scenario, of which neither course nor world are used.
        found: The map.
    """
    told = copy.deepcopy(scenario)
    told.course = [copy.deepcopy(element) for element in found.elements]
    told.mission = []
    told.world = WorldConfig()
    told.perception.map = "told"
    gait = told.gait
    gait.map_error_place = max(gait.map_error_place, round_up(found.error_place))
    gait.map_error_height = max(gait.map_error_height, round_up(found.error_height))
    return told


def plan_on_sight(
    scenario: Scenario, blind: PreparedScenario, sight: Sight, *, source: str
) -> PreparedScenario:
    """The climb of what was seen, from the stance in which the robot stood and looked.

    Args:
        scenario: The scenario.
        blind: The robot as it stood and looked.
        sight: What it saw.
        source: What errors name.

    Raises:
        PlanningError: There is nothing to climb, or no plan for it.
        InputError: What is believed is no course.
    """
    found = map_of_sight(scenario, sight, blind)
    robot = blind.robot
    if not found.complete:
        return _plan_first_steps(scenario, blind, sight, found, source=source)
    course = found.course(foot_radius=robot.foot_radius)
    told = _designed(scenario_of_map(scenario, found), robot, found, source=source)
    settings = with_map_errors(plan_settings(told), found)
    first, *others = derive_mission(course, settings)
    look = replace(first, name=LOOK, duration=scenario.perception.look_time)
    tasks = (look, *others)
    plan = plan_mission(robot, course, settings, tasks, blind.stance)
    samples = check_mission(robot, plan, uniform_body=settings.uniform_body)
    for task, motion, sampled in zip(tasks, plan.plans, samples, strict=True):
        check_shanks(robot, course, task, sampled)
        if task.kind == "spin":
            check_turning_width(robot, motion, course.lanes[task.lane])
    doubt = doubtful_foothold(found, course, plan.plans)
    back = task_to_revise_before(tasks)
    growth = None if back is None else _growth(scenario, robot, told, revise_before=back)
    if doubt:
        assert sight.belief is not None
        first_steps = trust(
            unfinished(found, doubt), reach=reach_of(blind.settings),
            yaw_sigma=sight.belief.sigma("yaw"),
        )  # fmt: skip
        return _plan_first_steps(scenario, blind, sight, first_steps, source=source)
    return replace(
        blind,
        scenario=with_gait(scenario, told),
        course=course,
        settings=settings,
        tasks=tasks,
        plan=plan,
        sight=replace(sight, map=found),
        growth=growth,
    )


def _growth(
    scenario: Scenario, robot: RobotModel, told: Scenario, *, revise_before: int | None = None
) -> Growth:
    """How to plan on with the gait of `told`; the errors of maps come to those of the scenario."""
    own = scenario.gait
    settings = replace(
        plan_settings(told),
        map_error_place=own.map_error_place,
        map_error_height=own.map_error_height,
    )
    return Growth(
        settings, eyes_of(scenario, robot), scenario.controller.lift_off_margin,
        back_down=scenario.perception.no_way_on == "back_down", revise_before=revise_before,
    )  # fmt: skip


def _designed(told: Scenario, robot: RobotModel, found: StairMap, *, source: str) -> Scenario:
    """The scenario of a map with a gait for it, if it asks for one."""
    if told.design != "auto":
        return told
    return design_scenario(
        told, source=source, nearest=False, robot=robot, turning_space=found.turning_space
    ).scenario


def _plan_first_steps(
    scenario: Scenario, blind: PreparedScenario, sight: Sight, found: StairMap, *, source: str
) -> PreparedScenario:
    """The climb of the first steps of a flight, to a tread on which the robot is to look again."""
    robot = blind.robot
    shape = imagined(scenario, found)
    told = _designed(scenario_of_map(scenario, shape), robot, shape, source=source)
    growth = _growth(scenario, robot, told)
    onward = plan_onward(
        robot,
        growth.settings,
        found,
        blind.stance,
        growth.eyes,
        lift_off_margin=growth.lift_off_margin,
    )
    look = Task(kind="stand", name=LOOK, lane=0, duration=scenario.perception.look_time)
    tasks = (look, *onward.tasks)
    plan = plan_mission(robot, onward.course, onward.settings, tasks, blind.stance)
    return replace(
        blind,
        scenario=with_gait(scenario, told),
        course=onward.course,
        settings=onward.settings,
        tasks=tasks,
        plan=plan,
        sight=replace(sight, map=found),
        growth=growth,
    )


def stay(
    scenario: Scenario, blind: PreparedScenario, sight: Sight, reason: str
) -> PreparedScenario:
    """The robot stays on its four feet: it stands a little longer than it looked, and that is all.

    Args:
        scenario: The scenario.
        blind: The robot as it stood and looked.
        sight: What it saw.
        reason: Why it does not climb that.
    """
    told = f"stands still; what is seen is: {describe_belief(sight.belief)}"
    if sight.belief is not None:
        told = f"{told}; {reason}"
    return replace(
        blind, scenario=with_gait(scenario, blind.scenario), sight=replace(sight, refused=told)
    )


def with_gait(scenario: Scenario, designed: Scenario) -> Scenario:
    """The scenario with another's gait; loaded again, it looks and designs anew, to the same end.

    Args:
        scenario: The scenario.
        designed: Whose gait is to stand in it.
    """
    filled = copy.deepcopy(scenario)
    for name in ("gait", "spin", "transition", "body", "controller"):
        setattr(filled, name, copy.deepcopy(getattr(designed, name)))
    filled.gait.map_error_place = scenario.gait.map_error_place
    filled.gait.map_error_height = scenario.gait.map_error_height
    return filled
