"""The controller alone: targets on the plan, the base fed back the right way, weight carried."""

from dataclasses import replace

import numpy as np
import pytest
from control_rig import (
    TICK,
    Controller,
    com_of,
    feet_ahead,
    foot_target,
    forces_of,
    middle_of,
    phase_at,
    state_on,
)
from hypothesis import given, settings, strategies as st
from pydrake.systems.analysis import Simulator
from rig import (
    GRAVITY,
    feet_of,
    fix_inputs,
    flat_walk,
    model_layout,
    paper_robot,
    read,
    rotations,
    stand_plan,
    state_of,
)

from drake_quad.common import FloatArray
from drake_quad.control.ports import CATCH_SIZE
from drake_quad.control.settings import ControlSettings
from drake_quad.planning.motion_plan import MotionPlan, pose_robot
from drake_quad.robot.kinematics import calc_feet
from drake_quad.robot.state import StateLayout
from drake_quad.systems.tracking_controller import IkController

CONTROL = ControlSettings()


def controller_of(
    plan: MotionPlan,
    state: FloatArray,
    *,
    t: float = 0.0,
    rate: float = 1.0,
    layout: StateLayout | None = None,
) -> Controller:
    return Controller(IkController, plan, state, control=CONTROL, t=t, rate=rate, layout=layout)


@pytest.mark.parametrize("in_air", [True, False])
def test_on_its_plan_the_targets_are_the_plans_own_angles(in_air: bool) -> None:
    """With base and feet where they are to be, the targets are the plan's inverse kinematics.

    A foot in the air is aimed at where it is to be in the middle of the time that a target is held.
    """
    t = middle_of(in_air)
    plan, state = flat_walk(), state_on(flat_walk(), t)
    sample = plan.sample(t)
    q, _, _ = pose_robot(paper_robot(), sample.body[:1], feet_ahead(sample)[None])
    found, _ = controller_of(plan, state, t=t).tick().target
    # A foot that swings aims lower as it lands; at mid-swing it does not yet.
    np.testing.assert_allclose(found, q[0], atol=1e-6)


@pytest.mark.parametrize("in_air", [True, False])
def test_target_speeds_are_the_derivative_of_the_plans_angles(in_air: bool) -> None:
    """Base and feet both move: the joint speeds carry them along."""
    t, h = middle_of(in_air), 1e-4
    plan = flat_walk()

    feet, velocity = feet_ahead(plan.sample(t)), plan.sample(t).feet_velocity

    def angles(dt: float) -> FloatArray:
        body = plan.sample(t + dt).body[:1]
        return pose_robot(paper_robot(), body, (feet + dt * velocity)[None])[0][0]

    _, speeds = controller_of(plan, state_on(plan, t), t=t).tick().target
    np.testing.assert_allclose(speeds, (angles(h) - angles(-h)) / (2 * h), atol=1e-3)


def test_while_the_clock_waits_nothing_is_to_move() -> None:
    """At rate 0 all desired joint speeds are 0."""
    t = middle_of(False)
    _, speeds = controller_of(flat_walk(), state_on(flat_walk(), t), t=t, rate=0.0).tick().target
    np.testing.assert_allclose(speeds, 0.0, atol=1e-12)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_feet_under_load_are_placed_in_the_body_as_desired(seed: int) -> None:
    """With the base off its plan, the targets keep the feet where they stand and move the base.

    They are the angles at which the base would be on its plan over the feet as they are: so the
    joints' stiffness pulls it there.
    """
    rng = np.random.default_rng(seed)
    plan = stand_plan()
    sample = plan.sample(0.0)
    body = sample.body[0] + rng.uniform(-0.03, 0.03, 5)
    state = state_of(body, sample.feet)
    found, _ = controller_of(plan, state).tick().target
    wanted, _, _ = pose_robot(paper_robot(), sample.body[:1], sample.feet[None])
    np.testing.assert_allclose(found, wanted[0], atol=1e-6)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_base_off_its_place_is_pushed_back(axis: int, sign: float) -> None:
    """The forces asked of the feet hold a term towards the plan, of the stiffness set."""
    plan = stand_plan()
    sample = plan.sample(0.0)
    body = np.array(sample.body[0])
    body[axis] += sign * 0.01
    state = state_of(body, sample.feet)
    control = controller_of(plan, state).tick()
    total = forces_of(control.torque, state).sum(axis=0)
    total[2] -= paper_robot().mass * GRAVITY
    expected = np.zeros(3)
    expected[axis] = -sign * 0.01 * CONTROL.base_stiffness
    np.testing.assert_allclose(total, expected, atol=1e-3)


@pytest.mark.parametrize("friction", [0.1, 0.2])
def test_feet_push_aside_no_more_than_the_friction_that_is_counted_on(friction: float) -> None:
    """Far off its place the base asks for more: feet are at the edges of their cones, or within."""
    sample = stand_plan().sample(0.0)
    body = np.array(sample.body[0])
    body[0] -= 0.1
    state = state_of(body, sample.feet)
    control = replace(CONTROL, friction=friction)
    tick = Controller(IkController, stand_plan(), state, control=control).tick()
    forces = forces_of(tick.torque, state)
    loaded = forces[forces[:, 2] > 1.0]
    share = np.hypot(loaded[:, 0], loaded[:, 1]) / loaded[:, 2]
    assert len(loaded) >= 2 and share.max() == pytest.approx(friction, abs=1e-3)


@pytest.mark.parametrize(("place", "sign"), [(3, 1.0), (3, -1.0), (4, 1.0), (4, -1.0)])
def test_base_turned_off_its_heading_or_pitch_is_turned_back(place: int, sign: float) -> None:
    """The moment about the centre of mass is against the error, of the stiffness set."""
    plan = stand_plan()
    sample = plan.sample(0.0)
    body = np.array(sample.body[0])
    body[place] += sign * 0.01
    state = state_of(body, sample.feet)
    forces = forces_of(controller_of(plan, state).tick().torque, state)
    moment = np.cross(feet_of(state) - com_of(state), forces).sum(axis=0)
    expected = np.zeros(3)
    expected[1 if place == 3 else 2] = -sign * 0.01 * CONTROL.base_rotation_stiffness
    np.testing.assert_allclose(moment, expected, atol=0.05)


def test_base_that_moves_is_slowed_down() -> None:
    """A velocity that the plan has not is braked by the damping set."""
    plan = stand_plan()
    state = state_on(plan, 0.0)
    layout = model_layout()
    state[layout.v_base + 3 : layout.v_base + 6] = [0.1, -0.05, 0.02]
    total = forces_of(controller_of(plan, state).tick().torque, state).sum(axis=0)
    weight = [0.0, 0.0, paper_robot().mass * GRAVITY]
    expected = weight - CONTROL.base_damping * np.array([0.1, -0.05, 0.02])
    np.testing.assert_allclose(total, expected, atol=1e-3)


def test_base_that_turns_is_slowed_down() -> None:
    """An angular velocity that the plan has not is braked by the damping set."""
    plan = stand_plan()
    state, w = state_on(plan, 0.0), np.array([0.05, -0.1, 0.2])
    state[model_layout().v_base : model_layout().v_base + 3] = w
    forces = forces_of(controller_of(plan, state).tick().torque, state)
    moment = np.cross(feet_of(state) - com_of(state), forces).sum(axis=0)
    np.testing.assert_allclose(moment, -CONTROL.base_rotation_damping * w, atol=0.05)


@pytest.mark.parametrize("in_air", [True, False])
def test_torques_fed_forward_carry_the_robot(in_air: bool) -> None:
    """On its plan the forces on the feet hold the weight at the centre of mass, and only push."""
    t = middle_of(in_air)
    plan, state = flat_walk(), state_on(flat_walk(), t)
    controller = controller_of(plan, state, t=t, rate=0.0).tick()
    forces = forces_of(controller.torque, state)
    np.testing.assert_allclose(forces.sum(axis=0), [0.0, 0.0, paper_robot().mass * GRAVITY],
                               atol=1e-3)  # fmt: skip
    arms = feet_of(state) - com_of(state)
    np.testing.assert_allclose(np.cross(arms, forces).sum(axis=0), 0.0, atol=0.05)
    standing = plan.sample(t).standing
    assert np.all(forces[standing, 2] > 0.0)
    np.testing.assert_allclose(forces[~standing], 0.0, atol=1e-6)


def test_acceleration_of_the_plan_is_fed_forward() -> None:
    """At rate 1 the forces asked for also accelerate the robot as the plan's body does."""
    plan = flat_walk()
    times = np.linspace(0.0, plan.duration, 400)
    acceleration = plan.body.samples(times)[:, 2, :3]
    sideways = np.abs(acceleration[:, 1])
    # Half of the most: at the most a foot that bears little is at its friction cone's side.
    t = float(times[np.argmin(np.abs(sideways - 0.5 * sideways.max()))])
    state = state_on(plan, t)
    layout, sample = model_layout(), plan.sample(t)
    state[layout.v_base + 3 : layout.v_base + 6] = sample.body[1, :3]  # no damping then
    total = forces_of(controller_of(plan, state, t=t).tick().torque, state).sum(axis=0)
    total[2] -= paper_robot().mass * GRAVITY
    np.testing.assert_allclose(total, paper_robot().mass * sample.body[2, :3], atol=0.5)
    assert np.abs(total[1]) > 1.0


def test_swing_foot_is_placed_in_the_body_as_measured() -> None:
    """However far the base is off, the foot in the air goes where it should in the world."""
    t = middle_of(True)
    plan = flat_walk()
    sample = plan.sample(t)
    row = int(np.flatnonzero(~sample.standing)[0])
    body = sample.body[0] + [0.02, -0.01, 0.01, 0.02, -0.03]
    state = state_of(body, sample.feet)
    found, _ = controller_of(plan, state, t=t).tick().target
    R = rotations(body)
    in_world = body[:3] + R @ calc_feet(paper_robot().geometry, found)[row]
    np.testing.assert_allclose(in_world, feet_ahead(sample)[row], atol=2e-3)


def test_standing_foots_target_follows_where_it_really_stands() -> None:
    """A foot that landed 1 cm off is not dragged back: its target comes to it in a second."""
    plan = stand_plan(9.0)
    sample = plan.sample(0.0)
    controller = controller_of(plan, state_on(plan, 0.0)).tick()
    feet = np.array(sample.feet)
    feet[0] += [0.01, -0.005, 0.0]
    state = state_of(sample.body[0], feet)
    controller.give(plan, state, phase_at(0.1))
    q_there, _, _ = pose_robot(paper_robot(), sample.body[:1], feet[None])
    gaps = [float(np.abs(controller.tick(40).target[0] - q_there[0]).max()) for _ in range(5)]
    assert gaps[0] > gaps[2] > gaps[4] and gaps[4] < 0.05 * 0.02


def test_swing_foot_lands_with_a_little_pressure() -> None:
    """It aims below the ground as it lands, by what is set, and not at mid-swing."""
    plan = flat_walk()
    step = plan.contacts.steps[0]
    for s, press in ((0.5, 0.0), (0.88, 0.0), (0.999, CONTROL.touchdown_press)):
        t = step.lift_off + s * (step.touchdown - step.lift_off)
        controller = controller_of(plan, state_on(plan, t), t=t).tick()
        wanted = feet_ahead(plan.sample(t))[step.leg.row]
        below = wanted - foot_target(controller, plan, t, step.leg.row)
        np.testing.assert_allclose(below, [0.0, 0.0, press], atol=1e-4)


def test_swing_begins_where_the_foot_really_stood_and_ends_where_it_was_planned_to() -> None:
    """A foot 1 cm off its plan is not jerked at lift-off, and is on its plan again at the end."""
    plan = flat_walk()
    step = plan.contacts.steps[0]
    row, off = step.leg.row, np.array([0.01, -0.006, 0.0])
    t = step.lift_off - 0.5
    sample = plan.sample(t)
    feet = np.array(sample.feet)
    feet[row] += off
    controller = controller_of(plan, state_of(sample.body[0], feet), t=t).tick(400)
    for s, part in ((0.001, 1.0), (0.8, 0.0)):
        t = step.lift_off + s * (step.touchdown - step.lift_off)
        controller.give(plan, state_on(plan, t), phase_at(t))
        found = foot_target(controller.tick(), plan, t, row) - feet_ahead(plan.sample(t))[row]
        np.testing.assert_allclose(found, part * off, atol=2e-4)


def test_foot_that_finds_no_ground_is_searched_down_for_it() -> None:
    """While the clock waits for a touchdown, the foot goes on down at the speed set."""
    plan = flat_walk()
    step = plan.contacts.steps[0]
    t = step.touchdown - TICK
    state = state_on(plan, t)
    controller = controller_of(plan, state, t=t).tick()
    controller.give(plan, state, phase_at(t, rate=0.0))
    depths = []
    for _ in range(3):
        target, _ = controller.tick(20).target
        sample = plan.sample(t)
        foot = sample.body[0, :3] + calc_feet(paper_robot().geometry, target)[step.leg.row]
        depths.append(sample.feet[step.leg.row, 2] - foot[2])
    np.testing.assert_allclose(np.diff(depths), 20 * TICK * CONTROL.landing_speed, rtol=0.05)


def test_commands_stay_within_the_robots_limits() -> None:
    """Even with the base a metre away no angle, speed or torque beyond the limits is asked for."""
    robot, plan = paper_robot(), stand_plan()
    state = state_on(plan, 0.0)
    state[model_layout().q_base + 4] += 1.0
    state[model_layout().v_base :] = 50.0
    controller = controller_of(plan, state).tick(3)
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
        one = read(a.system, a.context, port).reshape(parts, 12)
        other = read(b.system, b.context, port).reshape(parts, 12)
        np.testing.assert_array_equal(one, other[:, ::-1])
        assert not np.array_equal(one, other)


def test_what_the_plan_has_now_is_put_out_for_the_log() -> None:
    """`body_desired` and `feet_desired` are the plan's at the gait time."""
    t = middle_of(True)
    controller = controller_of(flat_walk(), state_on(flat_walk(), t), t=t).tick()
    sample = flat_walk().sample(t)
    np.testing.assert_allclose(
        read(controller.system, controller.context, "body_desired"), sample.body[0]
    )
    np.testing.assert_allclose(
        read(controller.system, controller.context, "feet_desired"), sample.feet.ravel()
    )


def test_plan_of_another_task_is_held_at_its_end() -> None:
    """Between two tasks, until the next plan is there, the last one's end is kept."""
    plan = stand_plan(1.0)
    controller = controller_of(plan, state_on(plan, 0.0)).tick()
    before = controller.target[0]
    controller.give(plan, state_on(plan, 0.0), phase_at(0.0, task=1, rate=0.0))
    np.testing.assert_allclose(controller.tick().target[0], before, atol=1e-9)


def test_two_contexts_of_one_controller_are_two_controllers() -> None:
    """Footholds remembered in one run are not seen in another."""
    plan = stand_plan()
    a = controller_of(plan, state_on(plan, 0.0)).tick()
    before = a.target[0].copy()
    other = Simulator(a.system)
    context = other.get_mutable_context()
    sample = plan.sample(0.0)
    far = state_of(sample.body[0] + [0.0, 0.0, -0.1, 0.0, 0.0], sample.feet)
    fix_inputs(a.system, context, motion_plan=plan, gait_phase=phase_at(0.0),
               robot_state_estimated=far, catch=np.zeros(CATCH_SIZE),
               contact_state_measured=np.ones(4))  # fmt: skip
    other.AdvanceTo(0.1)
    np.testing.assert_array_equal(a.target[0], before)
    np.testing.assert_allclose(a.tick().target[0], before, atol=1e-9)


def test_outputs_are_held_state() -> None:
    """No input reaches a command but by a tick."""
    assert not controller_of(
        stand_plan(), state_on(stand_plan(), 0.0)
    ).system.HasAnyDirectFeedthrough()


@pytest.mark.parametrize(
    ("before", "rate", "searched"), [(0.005, 1.0, False), (0.005, 0.0, True), (0.1, 1.0, True)]
)
def test_a_foot_that_has_given_its_load_away_is_not_searched_for(
    before: float, rate: float, searched: bool
) -> None:
    """Just before its lift-off it is held; earlier, or where it waits to lift off, it is missed."""
    plan, control = flat_walk(), ControlSettings(unload_time=0.15)
    step = next(
        s for s in plan.contacts.steps if plan.contacts.phase(s.lift_off - 0.16).step is None
    )
    t, row = step.lift_off - before, step.leg.row
    controller = Controller(IkController, plan, state_on(plan, t), control=control, t=t, rate=rate)
    standing = plan.sample(t).standing.astype(float)
    standing[row] = 0.0
    controller.also(contact_state_measured=standing)
    down = plan.sample(t).feet[row, 2] - controller.tick(4).feet[row, 2]
    assert (down > 1e-4) == searched
