"""The centre of mass in closed form is Drake's, and moves as masses do."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings, strategies as st
from rig import model_layout, model_plant, paper_robot, state_from_joints

from drake_quad.common import FloatArray
from drake_quad.robot.kinematics import calc_com, calc_feet

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=20)


def random_angles(seed: int, count: int = 20) -> FloatArray:
    """Joint angles (count, 4, 3) anywhere within the limits."""
    robot = paper_robot()
    q = np.random.default_rng(seed).uniform(robot.q_lower, robot.q_upper, (count, 12))
    return q.reshape(count, 4, 3)


@examples
@given(seeds)
def test_centre_of_mass_is_the_plants(seed: int) -> None:
    """In any posture it is where Drake's plant of the same file has it, to 1e-12 m."""
    plant, robot = model_plant(), paper_robot()
    context = plant.CreateDefaultContext()
    q = random_angles(seed)
    for angles, com in zip(q, calc_com(robot, q), strict=True):
        state = state_from_joints(np.zeros(5), angles)
        plant.SetPositions(context, state[: model_layout().num_positions])
        expected = plant.CalcCenterOfMassPositionInWorld(context)
        np.testing.assert_allclose(com, expected, atol=1e-12)


@examples
@given(seeds)
def test_feet_are_where_the_plant_has_the_collision_spheres(seed: int) -> None:
    """Forward kinematics ends at the shank's end in Drake's own kinematics, leg by leg."""
    plant, robot = model_plant(), paper_robot()
    context = plant.CreateDefaultContext()
    for angles in random_angles(seed, 5):
        state = state_from_joints(np.zeros(5), angles)
        plant.SetPositions(context, state[: model_layout().num_positions])
        for row, p_BF in enumerate(calc_feet(robot.geometry, angles)):
            shank = plant.GetJointByName(robot.joint_names[3 * row + 2]).child_body()
            X_WS = plant.EvalBodyPoseInWorld(context, shank)
            np.testing.assert_allclose(
                p_BF, X_WS @ np.array([0, 0, -robot.geometry.shank[row]]), atol=1e-12
            )


@examples
@given(seeds)
def test_mirrored_posture_has_a_mirrored_centre_of_mass(seed: int) -> None:
    """The shipped robot is symmetric left and right: so is its centre of mass."""
    robot, q = paper_robot(), random_angles(seed)
    mirrored = q[:, [1, 0, 3, 2]] * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(
        calc_com(robot, mirrored), calc_com(robot, q) * [1.0, -1.0, 1.0], atol=1e-12
    )


@examples
@given(seeds, st.floats(0.0, 50.0))
def test_load_on_the_trunk_draws_the_centre_of_mass_to_it(seed: int, load: float) -> None:
    """Mass added to the trunk moves the centre of mass in proportion, towards the trunk's own."""
    robot, q = paper_robot(), random_angles(seed)
    heavier = replace(robot, trunk_mass=robot.trunk_mass + load, mass=robot.mass + load)
    kept = robot.mass / heavier.mass
    expected = kept * calc_com(robot, q) + (1.0 - kept) * robot.trunk_com
    np.testing.assert_allclose(calc_com(heavier, q), expected, atol=1e-12)


@given(seeds)
@examples
def test_many_postures_at_once_are_each_alone(seed: int) -> None:
    """Leading axes are batches."""
    robot, q = paper_robot(), random_angles(seed, 6).reshape(2, 3, 4, 3)
    com = calc_com(robot, q)
    assert com.shape == (2, 3, 3)
    for i, j in np.ndindex(2, 3):
        np.testing.assert_allclose(com[i, j], calc_com(robot, q[i, j]), atol=1e-15)


def test_masses_of_the_parts_are_the_whole() -> None:
    """Trunk and links make up the robot's mass, as the plant has it."""
    plant, robot = model_plant(), paper_robot()
    assert np.isclose(robot.trunk_mass + robot.link_mass.sum(), robot.mass, rtol=1e-12)
    assert np.isclose(plant.CalcTotalMass(plant.CreateDefaultContext()), robot.mass, rtol=1e-12)
