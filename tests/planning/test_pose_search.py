"""Poses one by one: within the limits wherever a path is, and short where no path could be."""

from dataclasses import replace

import numpy as np
import pytest
from rig import paper_robot, stairs_course, stance_at

from drake_quad.planning.pose_search import PoseSearch, Shortage
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.walk_footsteps import plan_walk_footsteps
from drake_quad.robot.model import RobotModel

KEPT = 0.02  # [m] of margin


def short_of(robot: RobotModel, settings: PlanSettings, rise: float = 0.13) -> Shortage:
    """What is short at the worst moment of a walk up three steps."""
    course = stairs_course(rise=rise)
    task = Task(kind="walk", name="walk", lane=0, goal=6.25)
    contacts, route, _ = plan_walk_footsteps(
        robot, course, settings, task, stance_at(course, settings)
    )
    return PoseSearch(robot, contacts, route, settings, None, np.zeros((4, 2))).shortage(KEPT)


def narrow(most: float) -> RobotModel:
    """The paper's robot with abduction within so much to either side [rad]."""
    robot = paper_robot()
    lower, upper = (np.array(q).reshape(4, 3) for q in (robot.q_lower, robot.q_upper))
    lower[:, 0], upper[:, 0] = -most, most
    return replace(robot, q_lower=lower.ravel(), q_upper=upper.ravel())


def test_where_there_is_a_plan_no_pose_is_short() -> None:
    """The usual walk has a plan; so it has with abduction so narrow that its path has to be bent.

    `test_leg_limits.py` plans the second: a path within the limits has poses within them.
    """
    for robot in (paper_robot(), narrow(0.13)):
        short = short_of(robot, PlanSettings())
        assert 0.0 <= short.legs < 1e-4 and short.shanks < 1e-3


def test_legs_that_no_pose_helps_are_short_and_the_more_so_the_less_they_can() -> None:
    """Three feet that bear the robot with a margin ask for some abduction, wherever the body is."""
    settings = PlanSettings()
    short = [short_of(narrow(most), settings).legs for most in (0.05, 0.02, 0.005)]
    assert 0.0 < short[0] < short[1] < short[2]


def test_shanks_that_are_to_keep_more_room_than_there_is_are_short_of_it() -> None:
    """By no more than was asked for in addition: another pose may make up for some of it."""
    robot = paper_robot()
    near, far = (short_of(robot, PlanSettings(shank_room=room)).shanks for room in (0.1, 0.14))
    assert 0.0 < near < far
    assert far - near == pytest.approx(0.04, abs=0.03)
