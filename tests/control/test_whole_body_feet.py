"""The whole-body controller's feet: landed early, searching, catching, soft under load."""

from dataclasses import replace

import numpy as np
import pytest
from control_rig import TICK, catch_with, middle_of, phase_at, state_on
from rig import flat_walk, model_layout, paper_robot, rotations, stand_plan, state_of
from whole_body_rig import CONTROL, controller_of, ground_forces

from drake_quad.control.ports import Mode
from drake_quad.robot.kinematics import calc_feet
from drake_quad.robot.legs import Leg


def test_swing_foot_that_lands_early_is_held_there_and_pressed_on() -> None:
    """It stays where it found the ground, and the torques press: it takes a part of the load."""
    plan = flat_walk()
    step = plan.contacts.steps[0]
    row, span = step.leg.row, step.touchdown - step.lift_off
    t = step.lift_off + 0.7 * span
    controller = controller_of(plan, state_on(plan, t), t=t).tick()
    before = ground_forces(controller.torque, state_on(plan, t))[row, 2]
    found = plan.sample(t).feet[row]
    controller.also(contact_state_measured=np.ones(4))
    controller.tick()
    aim = found - [0.0, 0.0, CONTROL.touchdown_press]
    np.testing.assert_allclose(controller.feet[row], aim, atol=1e-9)
    after = step.lift_off + 0.9 * span
    sample = plan.sample(after)
    feet = sample.feet.copy()
    feet[row] = found
    state = state_of(sample.body[0], feet)
    controller.give(plan, state, phase_at(after, rate=0.0))
    controller.also(contact_state_measured=np.ones(4))
    controller.tick()
    np.testing.assert_allclose(controller.feet[row], aim, atol=1e-9)
    assert np.linalg.norm(sample.feet[row] - found) > 0.02
    pushing = ground_forces(controller.torque, state)[row, 2]
    assert pushing > 1.0 and abs(before) < pushing


def test_foot_that_finds_no_ground_is_searched_down_for_it() -> None:
    """While the clock waits for a touchdown, the foot goes on down at the speed set."""
    plan = flat_walk()
    step = plan.contacts.steps[0]
    t = step.touchdown - TICK
    controller = controller_of(plan, state_on(plan, t), t=t).tick()
    controller.give(plan, state_on(plan, t), phase_at(t, rate=0.0))
    heights = [float(controller.tick(20).feet[step.leg.row, 2]) for _ in range(3)]
    np.testing.assert_allclose(np.diff(heights), -20 * TICK * CONTROL.landing_speed, rtol=1e-6)


@pytest.mark.parametrize("leg", [Leg.REAR_LEFT, Leg.REAR_RIGHT])
def test_leg_at_its_end_is_not_driven_against_its_stop(leg: Leg) -> None:
    """A rear foot lifts off late, its knee straight, the body going on: no drive pulls it back."""
    plan, robot = flat_walk(), paper_robot()
    step = [s for s in plan.contacts.steps if s.leg is leg][1]  # the first is of the transition
    before, after = step.lift_off - 0.5 * TICK, step.lift_off + 0.5 * TICK
    sample = plan.sample(before)
    straight = robot.q_upper.reshape(4, 3)[leg.row, 2]
    q = np.tile([0.0, 0.9, straight], (4, 1))
    body, feet = sample.body[0], sample.feet.copy()
    feet[leg.row] = body[:3] + rotations(body) @ calc_feet(robot.geometry, q)[leg.row]
    state = state_of(body, feet)
    state[model_layout().v_base + 3] = 0.3  # forwards
    controller = controller_of(plan, state, t=before).tick(200)  # it learns where the feet stand
    controller.give(plan, state, phase_at(after))
    angles, speeds = controller.tick().target
    assert angles[leg.row, 2] == pytest.approx(straight, abs=0.02)
    assert speeds[leg.row, 2] < 0.05 and abs(speeds[leg.row, 1]) < 0.2


@pytest.mark.parametrize("row", range(4))
def test_catching_foot_goes_where_it_is_told(row: int) -> None:
    """From where it is to the place in the catch, whatever the plan says; it carries nothing."""
    plan = stand_plan(9.0)
    state = state_on(plan, 0.0)
    begin = plan.sample(0.0).feet[row]
    to = begin + np.array([0.08, -0.05, 0.0])
    controller = controller_of(plan, state).tick(2)
    controller.give(plan, state, phase_at(0.0, rate=0.0, mode=Mode.CATCH))
    contact = np.ones(4)
    contact[row] = 0.0
    ways = []
    for elapsed in np.arange(TICK, 0.2 + TICK, TICK):
        catch = catch_with(row + 1, to, duration=0.2, elapsed=float(elapsed))
        controller.also(catch=catch, contact_state_measured=contact)
        controller.tick()
        ways.append(controller.feet[row])
        forces = ground_forces(controller.torque, state)
        assert np.all(np.delete(forces, row, axis=0)[:, 2] > 0.0)
    press = [0.0, 0.0, CONTROL.touchdown_press]
    np.testing.assert_allclose(ways[0], begin, atol=0.002)
    np.testing.assert_allclose(ways[-1], to - press, atol=1e-6)
    assert max(float(way[2]) for way in ways) == pytest.approx(begin[2] + 0.05, abs=1e-3)
    others = np.arange(4) != row
    np.testing.assert_allclose(controller.feet[others], plan.sample(0.0).feet[others], atol=1e-9)


def test_loaded_legs_are_soft_and_legs_in_the_air_stiff() -> None:
    """Under load only a share of the error is left to joint stiffness; in the air all of it."""
    plan, t = flat_walk(), middle_of(True)
    sample = plan.sample(t)
    state = state_of(sample.body[0] + [0.01, 0.0, 0.01, 0.0, 0.0], sample.feet)
    measured = model_layout().read(state).q
    soft = controller_of(plan, state, t=t).tick().target[0] - measured
    stiff_control = replace(CONTROL, stance_stiffness=1.0)
    stiff = controller_of(plan, state, t=t, control=stiff_control).tick().target[0] - measured
    standing = sample.standing
    np.testing.assert_allclose(
        soft[standing], CONTROL.stance_stiffness * stiff[standing], atol=1e-9
    )
    np.testing.assert_allclose(soft[~standing], stiff[~standing], atol=1e-12)
    assert np.abs(stiff[standing]).max() > 1e-3


@pytest.mark.parametrize("mode", [Mode.RUN, Mode.CATCH, Mode.SETTLE])
def test_foot_that_lost_the_ground_in_a_push_is_soft(mode: Mode) -> None:
    """Off its place it is drawn there by a share of the stiffness: it is not to thrust off."""
    plan, row = stand_plan(9.0), 1
    feet = plan.sample(0.0).feet.copy()
    feet[row, 2] += 0.02
    state = state_of(plan.sample(0.0).body[0], feet)
    state[model_layout().v_base + 4] += 0.15  # pushed aside
    measured = model_layout().read(state).q
    contact = (np.arange(4) != row).astype(float)
    pulls = []
    for share in (CONTROL.stance_stiffness, 1.0):
        control = replace(CONTROL, stance_stiffness=share)
        controller = controller_of(plan, state_on(plan, 0.0), control=control).tick()
        controller.give(plan, state, phase_at(0.0, rate=0.0, mode=mode))
        controller.also(contact_state_measured=contact)
        pulls.append((controller.tick().target[0] - measured)[row])
    assert np.abs(pulls[1]).max() > 5e-3
    assert np.abs(pulls[0]).max() < 1.2 * CONTROL.stance_stiffness * np.abs(pulls[1]).max()
