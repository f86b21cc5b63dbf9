"""Walking on a slope in physics: the forces stay in the cones about the ground's normal."""

import numpy as np
from pydrake.systems.analysis import Simulator
from rig import course_of, paper_robot

from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.problem import Task
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.diagram import MakeStairClimb
from drake_quad.simulation.prepare import prepare
from drake_quad.terrain.elements import Element

SLOPE, FRICTION = 0.4, 0.6
TIME = 7.0  # [s]


def test_feet_do_not_slip_on_a_slope() -> None:
    """At a slope of 0.4 and a friction of 0.6, told 0.5: by less than 2 mm in all.

    With cones about W's vertical it was 104 mm.
    """
    course = course_of(
        Element("floor", length=1.0),
        Element("slope", going="up", length=4.0, height=4.0 * SLOPE),
        Element("floor", length=2.0),
    )
    p = prepare(load_scenario("flat_walk", ["controller.kind=whole_body"]))
    radius, up = paper_robot().foot_radius, np.array([-SLOPE, 0.0, 1.0]) / np.hypot(1.0, SLOPE)
    body, feet = p.stance.body.copy(), p.stance.feet.copy()
    move = 3.0 - body[0]
    feet[:, 0] += move
    body[0] += move
    feet[:, 2] = course.height(feet[:, 0], feet[:, 1]) + radius / up[2]
    body[2] += float(course.height(body[0], 0.0))
    mission = (
        Task(kind="stand", name="stand", lane=0, duration=0.3),
        Task(kind="walk", name="walk", lane=0, goal=float(body[0]) + 0.8),
    )
    made = MakeStairClimb(
        robot=p.robot, course=course, settings=p.settings, mission=mission,
        control=p.scenario.controller, stance=Stance(body, feet),
        plant_config=p.scenario.simulation.plant, friction=FRICTION, log_period=0.005,
    )  # fmt: skip
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(TIME)
    logs = {n: s.FindLog(simulator.get_context()).data().T for n, s in made.loggers.items()}
    stands = (logs["standing"] > 0.5) & (logs["bearing"] > 0.5)
    assert np.count_nonzero(np.diff(logs["standing"], axis=0)) > 4  # it has made steps
    slid = np.sum(logs["slip_speed"] * stands, axis=0) * 0.005
    assert slid.max() < 0.002
