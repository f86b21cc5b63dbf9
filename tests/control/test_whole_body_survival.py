"""The whole-body controller survives a lost estimate and a leg without an inverse."""

import numpy as np
import pytest
from control_rig import phase_at, state_on
from rig import GRAVITY, model_layout, paper_robot, stand_plan
from whole_body_rig import MASS, controller_of, ground_forces, nan_state

from drake_quad.systems.tracking_controller import REUSES


def test_lost_estimate_is_survived_with_the_last_torques_and_then_a_stand() -> None:
    """For REUSES ticks nothing changes; then torques carry the weight, and the count goes on."""
    plan = stand_plan(9.0)
    state = state_on(plan, 0.0)
    state[model_layout().q_base + 4] += 0.01  # so that the last torques are not the stand's
    controller = controller_of(plan, state_on(plan, 0.0)).tick()
    controller.give(plan, state, phase_at(0.0))
    last, balance = controller.tick(3).torque, controller.out("balance_estimated")
    controller.give(plan, nan_state(), phase_at(0.0))
    for k in range(1, REUSES + 1):
        np.testing.assert_array_equal(controller.tick().torque, last)
        np.testing.assert_array_equal(controller.out("qp_state"), [k, k])
    controller.tick()
    assert np.abs(controller.torque - last).max() > 0.1
    np.testing.assert_array_equal(controller.out("qp_state"), [REUSES + 1, REUSES + 1])
    forces = ground_forces(controller.torque, state)
    assert forces[:, 2].sum() == pytest.approx(MASS * GRAVITY, rel=1e-6)
    assert np.all(forces[:, 2] > 0.0)
    np.testing.assert_array_equal(controller.out("balance_estimated"), balance)
    for name in ("joint_state_desired", "body_desired", "feet_desired"):
        assert np.all(np.isfinite(controller.out(name)))


def test_after_a_lost_estimate_it_goes_on_as_if_nothing_had_been() -> None:
    """Nothing of it is remembered but the count; the row of failures begins anew."""
    plan = stand_plan(9.0)
    state = state_on(plan, 0.0)
    controller, undisturbed = (controller_of(plan, state).tick(3) for _ in range(2))
    lost = REUSES // 2 + 1
    for count in (lost, 2 * lost):  # more than REUSES in all
        controller.give(plan, nan_state(), phase_at(0.0))
        last = controller.torque
        np.testing.assert_array_equal(controller.tick(lost).torque, last)
        np.testing.assert_array_equal(controller.out("qp_state"), [count, lost])
        controller.give(plan, state, phase_at(0.0))
        controller.tick()
        np.testing.assert_array_equal(controller.out("qp_state"), [count, 0])
    undisturbed.tick(2 * lost + 2)
    np.testing.assert_allclose(controller.torque, undisturbed.torque, atol=1e-6)
    np.testing.assert_allclose(controller.target[0], undisturbed.target[0], atol=1e-9)


def test_estimate_lost_from_the_very_beginning_is_survived() -> None:
    """Nothing is known, no torque asked for but the model's own stand; no exception, no nan."""
    controller = controller_of(stand_plan(9.0), nan_state()).tick(REUSES + 2)
    for name in ("joint_state_desired", "joint_torque_feedforward", "feet_desired"):
        assert np.all(np.isfinite(controller.out(name)))


def test_straight_leg_is_survived() -> None:
    """A leg without an inverse brings nothing down."""
    plan = stand_plan(9.0)
    state = state_on(plan, 0.0)
    state[model_layout().q_joints[2]] = 0.0
    controller = controller_of(plan, state).tick(3)
    assert np.all(np.isfinite(controller.torque))
    assert np.all(np.abs(controller.torque.ravel()) <= paper_robot().effort)
