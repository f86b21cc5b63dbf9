"""The compiled pose of many robots is that of the leg's and the robot's own definitions."""

import numpy as np
import pytest
from rig import paper_robot, with_raised

from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.kinematics import calc_com, solve_legs


@pytest.mark.parametrize("raised", [np.zeros(4), np.array([-0.08, -0.08, 0.05, 0.05])])
def test_pose_is_that_of_leg_kinematics_and_robot_model(raised: FloatArray) -> None:
    """Of poses all over, within reach and out of it: angles, excess of reach, centre of mass."""
    robot, rng, count = with_raised(paper_robot(), raised), np.random.default_rng(5), 400
    body = np.column_stack(
        [
            rng.uniform(-3.0, 3.0, (count, 3)),
            rng.uniform(-0.6, 0.6, count),
            rng.uniform(-7.0, 7.0, count),
        ]
    )
    R = rotations(body)
    p_BF = robot.geometry.p_BH + rng.uniform(-0.5, 0.5, (count, 4, 3)) - [0.0, 0.0, 0.8]
    feet = body[:, None, :3] + np.einsum("nij,nlj->nli", R, p_BF)
    q, excess, com = pose_robot(robot, body, feet)
    q_there, excess_there = solve_legs(robot.geometry, p_BF)
    com_there = body[:, :3] + np.einsum("nij,nj->ni", R, calc_com(robot, q_there))
    assert 0.05 < np.mean(excess_there > 0.0) < 0.95
    np.testing.assert_allclose(excess, excess_there, atol=1e-12)
    np.testing.assert_allclose(com, com_there, atol=1e-6)
    # Angles of legs that are all but stretched hang on the last digit of their length.
    inside = excess_there == 0.0
    np.testing.assert_allclose(q[inside], q_there[inside], atol=1e-6)
