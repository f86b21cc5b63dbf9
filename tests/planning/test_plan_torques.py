"""What a plan asks of the drives: forces that balance, torques that are Drake's."""

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from pydrake.multibody.tree import JacobianWrtVariable
from rig import GRAVITY, flat_walk, model_layout, model_plant, paper_robot, state_of

from drake_quad.common import FloatArray
from drake_quad.planning.contact_forces import (
    FRICTION,
    SHARES,
    Cones,
    ShareWeight,
    min_norm_forces,
    share_vertical_load,
    static_joint_torques,
    torque_ratio,
)
from drake_quad.planning.motion_plan import evaluate

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=30, deadline=None)


@FEW
@example(seed=5, count=3, share=min_norm_forces)  # its foot in the air was left 5e-15 N, downwards
@example(seed=593, count=4, share=min_norm_forces)  # one foot pulled by 1e-14 N
@given(SEEDS, st.sampled_from([3, 4]), st.sampled_from([share_vertical_load, min_norm_forces]))
def test_forces_hold_the_robot_where_its_feet_can(
    seed: int, count: int, share: ShareWeight
) -> None:
    """Over the support they make up weight and moments, and no foot pulls or hangs in the air."""
    rng = np.random.default_rng(seed)
    feet = np.array([[0.4, 0.3, 0.0], [0.4, -0.3, 0.1], [-0.4, 0.3, 0.0], [-0.4, -0.3, 0.0]])
    feet = feet + rng.uniform(-0.1, 0.1, (4, 3))
    who = np.arange(4) != (rng.integers(4) if count == 3 else 9)
    com = rng.dirichlet(np.full(count, 3.0)) @ feet[who] + [0.0, 0.0, 0.8]
    force = share(500.0, feet[None], com[None], who[None])[0]
    assert np.all(force[~who] == 0.0) and np.all(force[:, 2] >= 0.0)
    np.testing.assert_allclose(force.sum(axis=0), [0.0, 0.0, 500.0], atol=1e-6)
    np.testing.assert_allclose(np.cross(feet - com, force).sum(axis=0), 0.0, atol=1e-6)


def test_a_square_shares_evenly_and_moves_its_load_with_the_centre() -> None:
    """A quarter each in the middle; nearer to the front, more in front, the same left and right."""
    feet = np.array([[0.4, 0.3, 0], [0.4, -0.3, 0], [-0.4, 0.3, 0], [-0.4, -0.3, 0]])[None]
    who = np.ones((1, 4), dtype=bool)
    middle = share_vertical_load(400.0, feet, np.zeros((1, 3)), who)
    np.testing.assert_allclose(middle[..., 2], 100.0)
    ahead = share_vertical_load(400.0, feet, np.array([[0.1, 0.0, 0.0]]), who)[0]
    np.testing.assert_allclose(ahead[:, 2], [125.0, 125.0, 75.0, 75.0])


@FEW
@given(SEEDS, st.sampled_from([3, 4]))
def test_the_whole_body_controllers_forces_are_the_least(seed: int, count: int) -> None:
    """No others with that wrench are less, as the program of that controller weighs them.

    And none slips.
    """
    rng = np.random.default_rng(seed)
    feet = np.array([[0.4, 0.3, 0.3], [0.4, -0.3, 0.2], [-0.4, 0.3, 0.0], [-0.4, -0.3, 0.1]])
    feet = feet + rng.uniform(-0.1, 0.1, (4, 3))
    who = np.arange(4) != (rng.integers(4) if count == 3 else 9)
    com = rng.dirichlet(np.full(count, 8.0)) @ feet[who] + [0.0, 0.0, 0.8]
    one = feet[None], com[None], who[None]
    force, other = min_norm_forces(500.0, *one)[0], share_vertical_load(500.0, *one)[0]
    assert np.sum(force**2) <= np.sum(other**2) + 1e-6
    sideways = np.abs(force[who, :2]).max(axis=1) - FRICTION / np.sqrt(2.0) * force[who, 2]
    assert sideways.max() <= 1e-5
    if sideways.max() < -1e-3:  # nothing but the wrench holds them
        arms = np.concatenate([np.tile(np.eye(3), 4), np.hstack([_cross(p - com) for p in feet])])
        free = np.linalg.svd(arms[:, np.repeat(who, 3)])[2][6:]
        np.testing.assert_allclose(free @ force[who].ravel(), 0.0, atol=1e-5)


@pytest.mark.parametrize("share", [min_norm_forces, share_vertical_load])
@given(slope=st.floats(-FRICTION, FRICTION), yaw=st.floats(0.0, 6.28), seed=st.integers(0, 99))
@settings(max_examples=25, deadline=None)
def test_on_a_slope_forces_are_within_friction_about_its_normal(
    share: ShareWeight, slope: float, yaw: float, seed: int
) -> None:
    """They hold the robot, and none leans from the normal by more than friction lets it.

    About the vertical the same forces may lean by less on one side, and by more on the other.
    """
    rng, who = np.random.default_rng(seed), np.ones((1, 4), dtype=bool)
    feet = np.array([[0.4, 0.3, 0.0], [0.4, -0.3, 0.0], [-0.4, 0.3, 0.0], [-0.4, -0.3, 0.0]])
    feet = feet + rng.uniform(-0.05, 0.05, (4, 3)) * [1.0, 1.0, 0.0]
    ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    feet[:, 2] = slope * feet @ ahead
    normal = np.array([0.0, 0.0, 1.0]) - slope * ahead
    normal /= np.linalg.norm(normal)
    com = feet.mean(axis=0) + np.array([0.03, 0.02, 0.8])
    cones = Cones(np.tile(normal, (1, 4, 1)), FRICTION)
    # Up to the friction itself vertical forces are within the pyramids, which are edged downhill.
    vertical = np.tile([0.0, 0.0, 125.0], 4)
    assert np.all(cones.pyramids()[0] @ vertical <= 1e-9)
    force = share(500.0, feet[None], com[None], who, cones)[0]
    push = force @ normal
    along = np.linalg.norm(force - push[:, None] * normal, axis=1)
    assert np.all(along <= FRICTION * push + 1e-4)
    np.testing.assert_allclose(force.sum(axis=0), [0.0, 0.0, 500.0], atol=1e-4)
    np.testing.assert_allclose(np.cross(feet - com, force).sum(axis=0), 0.0, atol=1e-4)


def _cross(p: FloatArray) -> FloatArray:
    return np.array([[0.0, -p[2], p[1]], [p[2], 0.0, -p[0]], [-p[1], p[0], 0.0]])


def test_on_steps_feet_push_against_each_other_where_that_spares_forces() -> None:
    """On level ground there are none along it; a whole-body run is told by its own sharing."""
    feet = np.array([[0.4, 0.3, 0.3], [0.4, -0.3, 0.2], [-0.4, 0.3, 0.0], [-0.4, -0.3, 0.1]])
    who, com = np.ones((1, 4), dtype=bool), np.array([[0.05, 0.02, 0.8]])
    level = min_norm_forces(400.0, (feet * [1.0, 1.0, 0.0])[None], com, who)[0]
    np.testing.assert_allclose(level[:, :2], 0.0, atol=1e-6)
    np.testing.assert_allclose(
        level, share_vertical_load(400.0, feet[None] * [1, 1, 0], com, who)[0], atol=1e-6
    )
    assert np.abs(min_norm_forces(400.0, feet[None], com, who)[0, :, :2]).max() > 5.0


def test_torques_are_drakes_inverse_statics() -> None:
    """With these forces and torques nothing of the robot accelerates, the base neither."""
    robot, plant, layout, plan = paper_robot(), model_plant(), model_layout(), flat_walk()
    samples = evaluate(robot, plan, np.linspace(1.0, plan.duration - 1.0, 12))
    torques = static_joint_torques(robot, samples)
    force = min_norm_forces(robot.mass * GRAVITY, samples.feet, samples.com, samples.standing)
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
    torques = np.abs(static_joint_torques(robot, samples)).ravel()
    assert torque_ratio(robot, samples)[0] == pytest.approx((torques / robot.effort).max())


def test_each_controller_has_its_own_sharing() -> None:
    """As a run's log asks for it; whole-body is what plans are judged by."""
    assert {"ik": share_vertical_load, "whole_body": min_norm_forces} == SHARES
