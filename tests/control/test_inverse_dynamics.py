"""Forces on the feet make accelerations and torques: Drake's equations of motion hold."""

from typing import NamedTuple

import numpy as np
from feet_rig import Case, any_state, case_of, drakes_drift, drakes_jacobian
from hypothesis import given, settings, strategies as st
from pydrake.multibody.tree import MultibodyForces
from rig import flat_walk, model_layout, model_plant, paper_robot, state_of

from drake_quad.common import FloatArray
from drake_quad.control.inverse_dynamics import Dynamics, reduce_dynamics
from drake_quad.control.measurement import measure
from drake_quad.robot.kinematics import leg_array

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=60)


class Motion(NamedTuple):
    """What forces make of a state: accelerations as Drake orders them, and torques."""

    acceleration: FloatArray
    torque: FloatArray


def columns() -> FloatArray:
    return np.asarray(model_layout().v_joints - model_layout().num_positions)


def dynamics_of(case: Case, acceleration: FloatArray) -> Dynamics:
    """The maps of a state whose feet are told to accelerate (4, 3) [m/s^2]."""
    plant, context = model_plant(), case.context
    return reduce_dynamics(
        plant.CalcMassMatrix(context),
        plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context),
        columns().astype(np.int64),
        case.feet,
        acceleration,
        case.state[4:7],
        paper_robot().foot_radius,
    )


def motion_of(dynamics: Dynamics, forces: FloatArray) -> Motion:
    a = np.zeros(18)
    a[:6] = dynamics.base @ forces + dynamics.base_offset
    a[columns()] = dynamics.joint @ forces + dynamics.joint_offset
    return Motion(a, dynamics.torque @ forces + dynamics.torque_offset)


def random_forces(seed: int) -> tuple[FloatArray, FloatArray]:
    """Forces (12,) [N] and the feet's accelerations (4, 3) [m/s^2]."""
    rng = np.random.default_rng(seed + 1)
    return rng.uniform(-300.0, 300.0, 12), rng.uniform(-5.0, 5.0, (4, 3))


def well_bent(case: Case) -> bool:
    """Whether no leg is near its straight or folded posture, where it has no inverse."""
    return bool(np.all(np.abs(np.linalg.det(case.feet.jacobian)) > 0.01))


def bent_case(seed: int) -> Case:
    while not well_bent(case := case_of(seed)):
        seed += 1
    return case


@examples
@given(seeds)
def test_equations_of_motion_hold(seed: int) -> None:
    """M a + h = J' f + S tau, to a billionth of its terms, by Drake's own inverse dynamics.

    Without the joints' own damping: what slows a joint down is left to do so.
    """
    case, plant = bent_case(seed), model_plant()
    forces, told = random_forces(seed)
    motion = motion_of(dynamics_of(case, told), forces)
    needed = plant.CalcInverseDynamics(case.context, motion.acceleration, MultibodyForces(plant))
    needed -= plant.CalcGravityGeneralizedForces(case.context)
    given_ = np.zeros(18)
    given_[columns()] = motion.torque
    for row in range(4):
        J = drakes_jacobian(case.context, row, under=paper_robot().foot_radius)
        given_ += J.T @ forces[3 * row : 3 * row + 3]
    size = max(np.abs(needed).max(), np.abs(forces).max())
    np.testing.assert_allclose(given_ / size, needed / size, atol=1e-9)


@examples
@given(seeds)
def test_feet_accelerate_as_told(seed: int) -> None:
    """Whatever the forces: those on the ground not at all, if so told."""
    case = bent_case(seed)
    forces, told = random_forces(seed)
    told[seed % 4] = 0.0
    a = motion_of(dynamics_of(case, told), forces).acceleration
    for row in range(4):
        found = drakes_jacobian(case.context, row) @ a + drakes_drift(case.context, row)
        np.testing.assert_allclose(found, told[row], atol=1e-6 * max(1.0, np.abs(a).max()))


@examples
@given(seeds)
def test_maps_are_of_the_forces_alone(seed: int) -> None:
    """What the feet are told moves the offsets, not what a force does."""
    case = bent_case(seed)
    _, told = random_forces(seed)
    one, other = dynamics_of(case, told), dynamics_of(case, np.zeros((4, 3)))
    for a, b in ((one.base, other.base), (one.joint, other.joint), (one.torque, other.torque)):
        np.testing.assert_array_equal(a, b)
    assert np.abs(one.base_offset - other.base_offset).max() > 1e-6


def test_without_forces_the_robot_falls() -> None:
    """In the air, legs held as they are, the base falls with g, turned by nothing.

    The feet are told to fall as well, so that the joints need not move.
    """
    sample = flat_walk().sample(0.0)
    state = state_of(sample.body[0], sample.feet)
    plant = model_plant()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    robot = paper_robot()
    feet = measure(model_layout(), leg_array(robot.geometry), robot.foot_radius, state, state).feet
    falling = np.tile([0.0, 0.0, -9.81], (4, 1))
    motion = motion_of(dynamics_of(Case(state, context, feet), falling), np.zeros(12))
    np.testing.assert_allclose(motion.acceleration[:6], [0, 0, 0, 0, 0, -9.81], atol=1e-9)
    np.testing.assert_allclose(motion.acceleration[6:], 0.0, atol=1e-9)
    np.testing.assert_allclose(motion.torque, 0.0, atol=1e-7)


def posed_case(seed: int, knee: float) -> Case:
    """A state at rest with the first leg's knee at that angle [rad]."""
    layout, robot, plant = model_layout(), paper_robot(), model_plant()
    state = any_state(seed)
    state[layout.q_joints] = np.tile([0.1, 0.7, -1.2], 4)
    state[layout.q_joints[2]] = knee
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    legs = leg_array(robot.geometry)
    feet = measure(layout, legs, robot.foot_radius, state, state).feet
    return Case(state, context, feet)


@examples
@given(seeds, st.sampled_from([0.0, 1e-12, -1e-9, 1e-6]))
def test_straight_leg_has_finite_maps(seed: int, knee: float) -> None:
    """A leg without an inverse must not bring the controller down."""
    for part in dynamics_of(posed_case(seed, knee), np.zeros((4, 3))):
        assert np.all(np.isfinite(part))


def test_no_numbers_give_no_numbers() -> None:
    """A mass matrix of nan raises nothing; what comes of it says so."""
    case = posed_case(0, -1.2)
    dynamics = reduce_dynamics(
        np.full((18, 18), np.nan, order="F"), np.zeros(18), columns().astype(np.int64), case.feet,
        np.zeros((4, 3)), case.state[4:7], 0.02,
    )  # fmt: skip
    assert np.all(np.isnan(dynamics.base)) and np.any(np.isnan(dynamics.torque))
