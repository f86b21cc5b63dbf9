"""The forces that the whole-body controller asks for: within friction, with loads, in a push."""

from dataclasses import replace

import numpy as np
import pytest
from control_rig import state_on
from rig import GRAVITY, flat_walk, model_layout, stand_plan, state_of
from whole_body_rig import CONTROL, MASS, controller_of, ground_forces, wrench_of

from drake_quad.common import FloatArray


def pushed_aside() -> FloatArray:
    """The base 4 cm left of its place, at rest: it is drawn back by friction."""
    sample = stand_plan(9.0).sample(0.0)
    return state_of(sample.body[0] + [0.0, 0.04, 0.0, 0.0, 0.0], sample.feet)


@pytest.mark.parametrize("friction", [0.05, 0.1])
def test_forces_stay_within_the_friction_that_is_assumed(friction: float) -> None:
    """However much is wanted, and each foot takes all that there is.

    That is all of a pyramid within the cone: in the middle of its sides 1/√2 of it.
    """
    control = replace(CONTROL, friction=friction)
    state = pushed_aside()
    forces = ground_forces(
        controller_of(stand_plan(9.0), state, control=control).tick().torque, state
    )
    used = np.hypot(forces[:, 0], forces[:, 1]) / forces[:, 2]
    np.testing.assert_allclose(used, friction / np.sqrt(2.0), rtol=0.03)


def test_a_foot_that_slides_is_asked_for_less_friction() -> None:
    """Of what is sensed of it alone: the others keep theirs, and make up for it."""
    state, layout = pushed_aside(), model_layout()
    controller = controller_of(stand_plan(9.0), state).tick()
    before = ground_forces(controller.torque, state)
    sliding = state.copy()
    sliding[layout.v_joints[3]] = 0.3  # front right, abduction: the foot goes aside by 0.25 m/s
    controller.also(robot_state_estimated=sliding)
    friction = controller.tick(100).out("friction_estimated")
    assert friction[1] < 0.35 * CONTROL.friction
    assert np.all(np.delete(friction, 1) == CONTROL.friction)
    controller.also(robot_state_estimated=state)
    after = ground_forces(controller.tick().torque, state)
    used = [np.hypot(*forces[1, :2]) / forces[1, 2] for forces in (before, after)]
    assert used[0] > 0.3 and used[1] < friction[1]
    assert after[:, 1].sum() == pytest.approx(before[:, 1].sum(), rel=0.1)


def test_a_load_is_learned_from_what_it_does() -> None:
    """A base that stays low carries something, which is held up besides."""
    body = np.array(stand_plan(9.0).sample(0.0).body[0])
    body[2] -= 0.005
    state = state_of(body, stand_plan(9.0).sample(0.0).feet)
    controller = controller_of(stand_plan(9.0), state).tick()
    first, _ = wrench_of(controller.torque, state)
    force, _ = wrench_of(controller.tick(200).torque, state)
    carried = controller.out("carried_estimated")
    assert carried[0] > 10.0 and np.all(carried[1:] == 0.0)
    assert force[2] - first[2] == pytest.approx(carried[0], rel=0.1)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_body_stands_aside_for_a_load(sign: float) -> None:
    """One that tilts it forwards is in front: the body moves backwards, and not to a side."""
    plan = stand_plan(9.0)
    body = np.array(plan.sample(0.0).body[0])
    body[3] += sign * 0.01  # its nose down
    controller = controller_of(plan, state_of(body, plan.sample(0.0).feet)).tick(400)
    moved = controller.out("body_desired") - plan.sample(0.0).body[0]
    assert -sign * moved[0] > 0.02
    np.testing.assert_allclose(moved[1:], 0.0, atol=1e-9)


def test_light_feet_are_let_go_of_in_a_push() -> None:
    """If the capture point nearly leaves the feet; pushed less, each is held down as in calm."""
    plan = stand_plan(9.0)
    lightest = []
    for kicked in (0.0, 0.4, 1.3):
        state = state_on(plan, 0.0)
        state[model_layout().v_base + 4] += kicked
        forces = ground_forces(controller_of(plan, state).tick().torque, state)
        lightest.append(float(forces[:, 2].min()))
    assert min(lightest[:2]) > CONTROL.least_force - 1e-3
    assert 0.0 < lightest[2] < CONTROL.least_force - 1.0


def test_a_foot_bears_while_the_clock_waits_to_lift_it_and_the_others_cannot() -> None:
    """It gives its load away over the feet that hold the robot, and else keeps it till then."""
    plan = flat_walk()
    step = plan.contacts.steps[0]
    t, row = step.lift_off - 1e-3, step.leg.row
    sample = plan.sample(t)
    towards = 0.6 * (sample.feet[row, :2] - sample.body[0, :2])
    borne = {}
    for off in (0.0, 1.0):
        state = state_of(sample.body[0] + [*(off * towards), 0.0, 0.0, 0.0], sample.feet)
        for rate in (1.0, 0.0):
            torque = controller_of(plan, state, t=t, rate=rate).tick().torque
            borne[off, rate] = ground_forces(torque, state)[row, 2] / (MASS * GRAVITY)
    assert borne[1.0, 0.0] > 0.1
    assert max(borne[0.0, 0.0], borne[0.0, 1.0], borne[1.0, 1.0]) < 0.03
