"""The whole-body controller alone: it carries, corrects, keeps to limits, and survives."""

from dataclasses import replace

import numpy as np
import pytest
from control_rig import (
    TICK,
    Controller,
    catch_with,
    com_of,
    middle_of,
    phase_at,
    state_on,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator
from rig import (
    GRAVITY,
    feet_of,
    fix_inputs,
    flat_walk,
    model_layout,
    model_plant,
    paper_robot,
    read,
    stand_plan,
    state_of,
)

from drake_quad.control.measured import measure
from drake_quad.control.ports import CATCH_SIZE, Mode
from drake_quad.control.settings import ControlSettings
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.leg_scalar import leg_array
from drake_quad.robot.robot_state import StateLayout
from drake_quad.systems.whole_body_controller import REUSES, WholeBodyController

CONTROL = ControlSettings(kind="whole_body")
MASS = paper_robot().mass
MIRROR = np.array([-1.0, 1.0, 1.0])  # of a leg's abduction, hip and knee, left against right
SIDES = [1, 0, 3, 2]  # rows of the legs on the other side


def controller_of(
    plan: MotionPlan,
    state: FloatArray,
    *,
    t: float = 0.0,
    rate: float = 1.0,
    layout: StateLayout | None = None,
    control: ControlSettings = CONTROL,
) -> Controller:
    kind = WholeBodyController
    return Controller(kind, plan, state, control=control, t=t, rate=rate, layout=layout)


def ground_forces(torque: FloatArray, state: FloatArray) -> FloatArray:
    """The forces on the feet (4, 3) in W that these torques hold, the robot being at rest.

    They act where the spheres touch the ground, a radius under their centres.
    """
    plant, layout, robot = model_plant(), model_layout(), paper_robot()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    gravity = plant.CalcGravityGeneralizedForces(context)[layout.v_joints - layout.num_positions]
    feet = measure(layout, leg_array(robot.geometry), robot.foot_radius, state, state).feet
    held = -(torque + gravity.reshape(4, 3))
    return np.stack([np.linalg.solve(feet.contact_jacobian[k].T, held[k]) for k in range(4)])


def wrench_of(torque: FloatArray, state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force [N], and moment about the centre of mass [Nm], that the ground makes."""
    forces = ground_forces(torque, state)
    arms = feet_of(state) - [0.0, 0.0, paper_robot().foot_radius] - com_of(state)
    return forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)


@pytest.mark.parametrize("in_air", [True, False])
def test_standing_robot_is_carried_by_statics(in_air: bool) -> None:
    """On its plan with the clock at rest the ground carries the weight at the centre of mass.

    To two newtons in a thousand: forces have a small price. Feet only push, a foot in the air
    not at all.
    """
    t = middle_of(in_air)
    state = state_on(flat_walk(), t)
    controller = controller_of(flat_walk(), state, t=t, rate=0.0).tick()
    force, moment = wrench_of(controller.torque, state)
    np.testing.assert_allclose(force, [0.0, 0.0, MASS * GRAVITY], atol=0.002 * MASS * GRAVITY)
    np.testing.assert_allclose(moment, 0.0, atol=0.5)
    forces, standing = ground_forces(controller.torque, state), flat_walk().sample(t).standing
    assert np.all(forces[standing, 2] > CONTROL.least_force - 1e-3)
    np.testing.assert_allclose(forces[~standing], 0.0, atol=0.1)
    assert np.all(controller.out("qp_state") == 0.0)


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


def nan_state() -> FloatArray:
    return np.full(model_layout().size, np.nan)


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
    np.testing.assert_allclose(np.diff(heights), -20 * TICK * CONTROL.search_speed, rtol=1e-6)


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
    """Calm, every foot is pressed down with `least_force`; pushed aside, the light ones are not."""
    plan = stand_plan(9.0)
    calm, pushed = state_on(plan, 0.0), state_on(plan, 0.0)
    pushed[model_layout().v_base + 4] += 0.4
    forces = [ground_forces(controller_of(plan, s).tick().torque, s) for s in (calm, pushed)]
    assert np.all(forces[0][:, 2] > CONTROL.least_force - 1e-3)
    assert 0.0 < forces[1][:, 2].min() < CONTROL.least_force - 1.0


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_commands_stay_within_the_robots_limits(seed: int) -> None:
    """Wherever the base is thrown: angles, speeds and torques are finite and within the limits."""
    rng, robot, layout = np.random.default_rng(seed), paper_robot(), model_layout()
    state = state_on(stand_plan(), 0.0)
    state[layout.q_base + 4 : layout.q_base + 7] += rng.uniform(-1.0, 1.0, 3)
    state[layout.v_base :] = rng.uniform(-20.0, 20.0, layout.size - layout.v_base)
    controller = controller_of(stand_plan(), state).tick(3)
    q, qd = controller.target
    assert np.all(q.ravel() >= robot.q_lower) and np.all(q.ravel() <= robot.q_upper)
    assert np.all(np.abs(qd.ravel()) <= robot.speed)
    assert np.all(np.abs(controller.torque.ravel()) <= robot.effort)
    assert np.all(np.isfinite(controller.torque))


def test_commands_are_in_the_plants_order_of_actuators() -> None:
    """Where a plant has its actuators the other way round, so are the commands."""
    plan = stand_plan()
    state = state_on(plan, 0.0)
    state[model_layout().q_base + 5] += 0.02
    reverse = replace(model_layout(), actuators=model_layout().actuators[::-1].copy())
    a, b = controller_of(plan, state).tick(), controller_of(plan, state, layout=reverse).tick()
    for port, parts in (("joint_state_desired", 2), ("joint_torque_feedforward", 1)):
        one, other = a.out(port).reshape(parts, 12), b.out(port).reshape(parts, 12)
        np.testing.assert_array_equal(one, other[:, ::-1])
        assert not np.array_equal(one, other)


def test_same_inputs_give_the_same_commands_to_the_bit() -> None:
    """Two controllers that see the same do the same: no solver's history, no clock."""
    found = []
    for _ in range(2):
        controller = controller_of(flat_walk(), state_on(flat_walk(), 1.0), t=1.0)
        for t in (1.0, 1.4, 1.8, 2.2):
            controller.give(flat_walk(), state_on(flat_walk(), t), phase_at(t))
            controller.tick(2)
        found.append(np.concatenate([controller.torque, *controller.target]))
    np.testing.assert_array_equal(found[0], found[1])


def test_two_contexts_of_one_controller_are_two_controllers() -> None:
    """Neither footholds, nor torques, nor what went wrong in one run are seen in another."""
    plan = stand_plan()
    a = controller_of(plan, state_on(plan, 0.0)).tick()
    before = a.torque.copy()
    other = Simulator(a.system)
    context = other.get_mutable_context()
    fix_inputs(a.system, context, motion_plan=plan, gait_phase=phase_at(0.0),
               robot_state_estimated=nan_state(), catch=np.zeros(CATCH_SIZE),
               contact_state_measured=np.ones(4))  # fmt: skip
    other.AdvanceTo(0.1)
    assert read(a.system, context, "qp_state")[0] > 0.0
    np.testing.assert_array_equal(a.torque, before)
    np.testing.assert_array_equal(a.tick().out("qp_state"), [0.0, 0.0])
    np.testing.assert_allclose(a.torque, before, atol=1e-9)


def test_outputs_are_held_state() -> None:
    """No input reaches a command but by a tick."""
    plan = stand_plan()
    assert not controller_of(plan, state_on(plan, 0.0)).system.HasAnyDirectFeedthrough()
