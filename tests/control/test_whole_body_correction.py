"""The whole-body controller draws the base to its place: by the right force, and only so hard."""

import numpy as np
import pytest
from control_rig import phase_at, state_on
from hypothesis import given, settings, strategies as st
from rig import GRAVITY, model_layout, paper_robot, stand_plan, state_of
from whole_body_rig import CONTROL, MASS, controller_of, wrench_of

from drake_quad.common import FloatArray
from drake_quad.control.measurement import measure
from drake_quad.robot.kinematics import leg_array

MIRROR = np.array([-1.0, 1.0, 1.0])  # of a leg's abduction, hip and knee, left against right
SIDES = [1, 0, 3, 2]  # rows of the legs on the other side


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_base_off_its_place_is_pushed_back(axis: int, sign: float) -> None:
    """The ground's force has a term towards the plan, against the error alone."""
    plan = stand_plan()
    body = np.array(plan.sample(0.0).body[0])
    body[axis] += sign * 0.01
    state = state_of(body, plan.sample(0.0).feet)
    force, _ = wrench_of(controller_of(plan, state).tick().torque, state)
    force[2] -= MASS * GRAVITY
    expected = np.zeros(3)
    expected[axis] = -sign * 0.01 * CONTROL.base_stiffness
    # The legs are accelerated with the base, so the force is not just stiffness times error.
    assert 0.6 < force[axis] / expected[axis] < 1.2
    assert np.abs(np.delete(force - expected, axis)).max() < 0.15 * np.abs(expected).max()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_base_far_off_its_place_is_pushed_no_harder(axis: int) -> None:
    """Beyond an error of some centimetres the force grows no more: no jerk after a push."""
    plan = stand_plan()
    forces = []
    for away in (0.06, 0.18):
        body = np.array(plan.sample(0.0).body[0])
        body[axis] -= away
        state = state_of(body, plan.sample(0.0).feet)
        forces.append(wrench_of(controller_of(plan, state).tick().torque, state)[0])
        forces[-1][2] -= MASS * GRAVITY
    assert forces[0][axis] > 50.0
    assert forces[1][axis] < 1.5 * forces[0][axis]


@pytest.mark.parametrize(("place", "sign"), [(3, 1.0), (3, -1.0), (4, 1.0), (4, -1.0)])
def test_base_turned_off_its_heading_or_pitch_is_turned_back(place: int, sign: float) -> None:
    """The ground's moment about the centre of mass is against the error."""
    plan = stand_plan()
    body = np.array(plan.sample(0.0).body[0])
    body[place] += sign * 0.02
    state = state_of(body, plan.sample(0.0).feet)
    _, moment = wrench_of(controller_of(plan, state).tick().torque, state)
    axis = 1 if place == 3 else 2
    assert -sign * moment[axis] > 0.3 * 0.02 * CONTROL.base_rotation_stiffness
    assert np.argmax(np.abs(moment)) == axis


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_base_that_moves_is_slowed_down(axis: int) -> None:
    """A velocity that the plan has not gives a force against it."""
    plan, layout = stand_plan(), model_layout()
    state = state_on(plan, 0.0)
    still = wrench_of(controller_of(plan, state).tick().torque, state)[0]
    state[layout.v_base + 3 + axis] = 0.1
    feet = measure(layout, leg_array(paper_robot().geometry), 0.0, state, state).feet
    # Joints that go with the base, so that the feet stand still.
    speeds = [np.linalg.solve(feet.jacobian[k], -feet.velocity[k]) for k in range(4)]
    state[layout.v_joints] = np.ravel(speeds)
    force = wrench_of(controller_of(plan, state).tick().torque, state)[0] - still
    assert 0.5 < -force[axis] / (0.1 * CONTROL.base_damping) < 1.3


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_base_that_turns_is_slowed_down(axis: int) -> None:
    """An angular velocity that the plan has not gives a moment against it."""
    plan, layout = stand_plan(), model_layout()
    state = state_on(plan, 0.0)
    still = wrench_of(controller_of(plan, state).tick().torque, state)[1]
    state[layout.v_base + axis] = 0.1
    feet = measure(layout, leg_array(paper_robot().geometry), 0.0, state, state).feet
    speeds = [np.linalg.solve(feet.jacobian[k], -feet.velocity[k]) for k in range(4)]
    state[layout.v_joints] = np.ravel(speeds)
    moment = wrench_of(controller_of(plan, state).tick().torque, state)[1] - still
    # The damping set is that of a body with the mean of the three moments of inertia.
    assert 0.1 < -moment[axis] / (0.1 * CONTROL.base_rotation_damping) < 2.0


def mirrored(state: FloatArray) -> FloatArray:
    """The same state seen in a mirror along the lane (y = 0)."""
    layout = model_layout()
    new = state.copy()
    i, j = layout.q_base, layout.v_base
    new[i + 1], new[i + 3], new[i + 5] = -state[i + 1], -state[i + 3], -state[i + 5]
    new[j], new[j + 2], new[j + 4] = -state[j], -state[j + 2], -state[j + 4]
    for joints in (layout.q_joints, layout.v_joints):
        new[joints] = (state[joints].reshape(4, 3)[SIDES] * MIRROR).ravel()
    return new


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_left_and_right_are_mirror_images(seed: int) -> None:
    """A robot off its plan to the left gets the mirrored torques of one as far off to the right."""
    rng, plan, layout = np.random.default_rng(seed), stand_plan(), model_layout()
    body = plan.sample(0.0).body[0] + rng.uniform(-0.02, 0.02, 5)
    speeds = rng.uniform(-0.05, 0.05, layout.size - layout.num_positions)
    state = state_of(body, plan.sample(0.0).feet, velocity=speeds)
    one = controller_of(plan, state).tick()
    other = controller_of(plan, mirrored(state)).tick()
    np.testing.assert_allclose(other.torque, one.torque[SIDES] * MIRROR, atol=1e-3)
    for a, b in zip(one.target, other.target, strict=True):
        np.testing.assert_allclose(b, a[SIDES] * MIRROR, atol=1e-9)


def test_body_follows_the_ground_as_found() -> None:
    """On ground 2 cm higher than planned the body is to be 2 cm higher, by and by."""
    plan = stand_plan(9.0)
    sample = plan.sample(0.0)
    up = np.array([0.0, 0.0, 0.02])
    state = state_of(sample.body[0] + [*up, 0.0, 0.0], sample.feet + up)
    # Begun on the plan: a controller that starts on the ground takes it as it finds it.
    controller = controller_of(plan, state_on(plan, 0.0)).tick()
    controller.give(plan, state, phase_at(0.0))
    rises = []
    for _ in range(10):
        rises.append(float(controller.tick(100).out("body_desired")[2] - sample.body[0][2]))
    assert np.all(np.diff(rises) > 0.0) and rises[0] < 0.015
    assert rises[-1] == pytest.approx(0.02, abs=1e-3)
