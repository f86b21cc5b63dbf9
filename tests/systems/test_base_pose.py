"""The base's pose and the feet's places alone, through the system's ports and its own Context."""

import numpy as np
import pytest
from rig import flat_course, model_layout, paper_robot

from drake_quad.planning.mission import initial_stance
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.planning.problem import PlanSettings
from drake_quad.systems.base_pose import BasePose


def test_feet_of_a_standing_robot_are_on_the_ground() -> None:
    """Base and feet come out where the stance has them, the feet's points at height 0."""
    robot, layout = paper_robot(), model_layout()
    stance = initial_stance(robot, flat_course(), PlanSettings(), start=2.0)
    q, _, _ = pose_robot(robot, stance.body[None], stance.feet[None])
    state = np.zeros(layout.size)
    state[layout.q_base] = 1.0
    state[layout.q_base + 4 : layout.q_base + 7] = stance.body[:3]
    state[layout.q_joints] = q.reshape(12)
    system = BasePose(robot=robot, layout=layout)
    context = system.CreateDefaultContext()
    system.GetInputPort("robot_state_estimated").FixValue(context, state)
    pose = system.GetOutputPort("base_pose_estimated").Eval(context)
    assert pose == pytest.approx([1.0, 0.0, 0.0, 0.0, *stance.body[:3]])
    feet = system.GetOutputPort("feet_estimated").Eval(context).reshape(4, 3)
    assert feet[:, :2] == pytest.approx(stance.feet[:, :2])
    assert feet[:, 2] == pytest.approx(np.zeros(4), abs=1e-9)
