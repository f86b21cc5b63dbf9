"""What a plan asks of the drives: forces that balance, torques that are Drake's."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.multibody.tree import JacobianWrtVariable
from rig import GRAVITY, flat_walk, model_layout, model_plant, paper_robot, state_of

from drake_quad.planning.motion_plan import evaluate
from drake_quad.planning.plan_torques import share_weight, standing_torques, torque_ratio

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=30, deadline=None)


@FEW
@given(SEEDS, st.sampled_from([3, 4]))
def test_forces_hold_the_robot_where_its_feet_can(seed: int, count: int) -> None:
    """Over the support they make up weight and moments, and no foot pulls or hangs in the air."""
    rng = np.random.default_rng(seed)
    feet = np.array([[0.4, 0.3, 0.0], [0.4, -0.3, 0.1], [-0.4, 0.3, 0.0], [-0.4, -0.3, 0.0]])
    feet = feet + rng.uniform(-0.1, 0.1, (4, 3))
    who = np.arange(4) != (rng.integers(4) if count == 3 else 9)
    com = rng.dirichlet(np.full(count, 3.0)) @ feet[who] + [0.0, 0.0, 0.8]
    force = share_weight(500.0, feet[None], com[None], who[None])[0]
    assert np.all(force[~who] == 0.0) and np.all(force[:, 2] >= 0.0)
    np.testing.assert_allclose(force.sum(axis=0), [0.0, 0.0, 500.0], atol=1e-6)
    np.testing.assert_allclose(np.cross(feet - com, force).sum(axis=0), 0.0, atol=1e-6)


def test_a_square_shares_evenly_and_moves_its_load_with_the_centre() -> None:
    """A quarter each in the middle; nearer to the front, more in front, the same left and right."""
    feet = np.array([[0.4, 0.3, 0], [0.4, -0.3, 0], [-0.4, 0.3, 0], [-0.4, -0.3, 0]])[None]
    who = np.ones((1, 4), dtype=bool)
    middle = share_weight(400.0, feet, np.zeros((1, 3)), who)
    np.testing.assert_allclose(middle[..., 2], 100.0)
    ahead = share_weight(400.0, feet, np.array([[0.1, 0.0, 0.0]]), who)[0]
    np.testing.assert_allclose(ahead[:, 2], [125.0, 125.0, 75.0, 75.0])


def test_torques_are_drakes_inverse_statics() -> None:
    """With these forces and torques nothing of the robot accelerates, the base neither."""
    robot, plant, layout, plan = paper_robot(), model_plant(), model_layout(), flat_walk()
    samples = evaluate(robot, plan, np.linspace(1.0, plan.duration - 1.0, 12))
    torques = standing_torques(robot, samples)
    force = share_weight(robot.mass * GRAVITY, samples.feet, samples.com, samples.standing)
    context = plant.CreateDefaultContext()
    for n in range(len(samples.times)):
        plant.SetPositionsAndVelocities(context, state_of(samples.body[n, 0], samples.feet[n]))
        left = plant.CalcGravityGeneralizedForces(context)
        for row, name in enumerate(robot.joint_names[2::3]):
            link = plant.GetJointByName(name).child_body()
            J = plant.CalcJacobianTranslationalVelocity(
                context, JacobianWrtVariable.kV, link.body_frame(),
                [0.0, 0.0, -robot.geometry.shank[row]],
                plant.world_frame(), plant.world_frame(),
            )  # fmt: skip
            left = left + J.T @ force[n, row]
        left[layout.v_joints - layout.num_positions] += torques[n].ravel()
        np.testing.assert_allclose(left, 0.0, atol=1e-6)


def test_ratio_is_of_the_weakest_joint() -> None:
    """A joint with half the limit has twice the ratio."""
    robot = paper_robot()
    samples = evaluate(robot, flat_walk(), np.array([3.0]))
    torques = np.abs(standing_torques(robot, samples)).ravel()
    assert torque_ratio(robot, samples)[0] == pytest.approx((torques / robot.effort).max())
