"""From what was seen to a plan: the map is made of the belief, and of nothing else.

Of `course` and `world` the robot learns nothing here. What it is told is where it stands, that it
stands on a floor, how far the ground is level beyond the last step, and whether to come back.
"""

import copy
from dataclasses import replace
from math import ceil

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait_design.designer import design_scenario
from drake_quad.perception.sight import Sight
from drake_quad.perception.stair_map import StairMap, describe_belief, make_stair_map
from drake_quad.planning.body_reference import robot_stance
from drake_quad.planning.mission import check_mission, plan_mission
from drake_quad.planning.problem import derive_mission
from drake_quad.planning.turning_room import check_turning_width, least_turning_space
from drake_quad.scenario.build import plan_settings
from drake_quad.scenario.config import MissionElement, Scenario, WorldConfig
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.terrain.elements import Element

FLOOR_AHEAD = 1.0  # [m] of the floor that a robot knows of before it has looked
LOOK = "stand and look"
LINGER = 0.5  # [s] that the robot would stand on: its stand ends the simulation, and the look not
MAP_STEP = 1e-4  # [m] to which what is designed for is rounded up


def blind_scenario(scenario: Scenario) -> Scenario:
    """The scenario of a robot that has not looked yet: it stands on a floor, and knows no more."""
    blind = copy.deepcopy(scenario)
    length = scenario.start.distance + FLOOR_AHEAD
    blind.course = [Element(kind="floor", length=length)]
    duration = scenario.perception.look_time + LINGER
    blind.mission = [MissionElement(kind="stand", duration=duration)]
    blind.world = WorldConfig()
    blind.perception.map = "told"
    return blind


def map_of_sight(scenario: Scenario, sight: Sight, blind: PreparedScenario) -> StairMap:
    """The map of what was seen.

    Args:
        scenario: The scenario, of whose course the robot is told only whether it is to come back.
        sight: What was seen.
        blind: The robot as it stood and looked.

    Raises:
        PlanningError: There is nothing to climb in it.
    """
    stance = blind.stance
    found = make_stair_map(
        sight.belief,
        sight.level,
        standing=stance.body[:2],
        floor=float(stance.feet[:, 2].mean()) - blind.robot.foot_radius,
        behind=scenario.start.distance,
        landing=scenario.perception.landing,
        reach=_reach(robot_stance(blind.settings)),
        turning_space=least_turning_space(blind.robot),
    )
    back = [element for element in scenario.course if element.kind == "return"]
    return replace(found, elements=(*found.elements, *back))


def _reach(stance: FloatArray) -> float:
    """How far from the middle line feet are, of a stance (4, 2) in B [m]."""
    return float(np.abs(stance[:, 1]).max())


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
    gait.map_error_place = max(gait.map_error_place, _up(found.error_place))
    gait.map_error_height = max(gait.map_error_height, _up(found.error_height))
    return told


def _up(value: float) -> float:
    return ceil(value / MAP_STEP) * MAP_STEP


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
    course = found.course(foot_radius=robot.foot_radius)
    told = scenario_of_map(scenario, found)
    if told.design == "auto":
        told = design_scenario(
            told, source=source, nearest=False, robot=robot, turning_space=found.turning_space
        ).scenario
    settings = plan_settings(told)
    first, *others = derive_mission(course, settings)
    look = replace(first, name=LOOK, duration=scenario.perception.look_time)
    tasks = (look, *others)
    plan = plan_mission(robot, course, settings, tasks, blind.stance)
    check_mission(robot, plan, uniform_body=settings.uniform_body)
    for task, motion in zip(tasks, plan.plans, strict=True):
        if task.kind == "spin":
            check_turning_width(robot, motion, course.lanes[task.lane])
    return replace(
        blind,
        scenario=with_gait(scenario, told),
        course=course,
        settings=settings,
        tasks=tasks,
        plan=plan,
        sight=replace(sight, map=found),
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
