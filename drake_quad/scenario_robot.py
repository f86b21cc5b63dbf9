"""A scenario's robot, as planner and controller are to see it."""

from drake_quad.robot.load_robot import load_robot
from drake_quad.robot.point_feet import with_point_feet
from drake_quad.robot.robot_model import RobotModel
from drake_quad.scenario_config import Scenario


def robot_of(scenario: Scenario) -> RobotModel:
    """The scenario's robot, with points for feet if it asks for that.

    Raises:
        InputError: If there is no such robot, or it is no quadruped with abduction-hip-knee legs.
    """
    robot = load_robot(scenario.robot.model)
    return with_point_feet(robot) if scenario.robot.point_feet else robot
