"""The whole-body controller alone: it carries, keeps to limits, and repeats itself to the bit."""

from dataclasses import replace

import numpy as np
import pytest
from control_rig import middle_of, phase_at, state_on
from hypothesis import given, settings, strategies as st
from pydrake.systems.analysis import Simulator
from rig import (
    GRAVITY,
    course_of,
    feet_of,
    fix_inputs,
    flat_walk,
    model_layout,
    model_plant,
    paper_robot,
    read,
    stand_plan,
)
from whole_body_rig import CONTROL, MASS, controller_of, ground_forces, nan_state, wrench_of

from drake_quad.control.ports import CATCH_SIZE
from drake_quad.math.rotations import quaternion_matrix
from drake_quad.robot.from_plant import joint_damping
from drake_quad.systems import tracking_controller
from drake_quad.terrain.course import ground_normals
from drake_quad.terrain.elements import Element


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


def test_what_the_joints_damping_takes_is_fed_forward(monkeypatch: pytest.MonkeyPatch) -> None:
    """With 0.5 Nm s/rad more in every joint, each drive gives so much more, times its speed."""
    plan, layout, t = flat_walk(), model_layout(), middle_of(True)
    state, speeds = state_on(plan, t), np.random.default_rng(3).uniform(-0.3, 0.3, 12)
    state[layout.v_joints] = speeds
    torques = [controller_of(plan, state, t=t).tick().torque.ravel()]
    more = joint_damping(model_plant(), paper_robot()) + 0.5
    monkeypatch.setattr(tracking_controller, "joint_damping", lambda *_: more)
    torques.append(controller_of(plan, state, t=t).tick().torque.ravel())
    np.testing.assert_allclose(torques[1] - torques[0], 0.5 * speeds, atol=1e-3)


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


@pytest.mark.parametrize("tilt", [0.2, -0.3])
def test_feet_that_feel_a_slope_make_forces_as_a_map_of_it_does(tilt: float) -> None:
    """On ground that the map has level and feet feel tilted, torques are those of a true map."""
    plan = stand_plan()
    state = state_on(plan, 0.0)
    going, height = ("up", tilt) if tilt > 0.0 else ("down", -tilt)
    slope = Element("slope", going=going, height=6.0 * height, length=6.0)
    course = course_of(Element("floor", length=0.4), slope, Element("floor", length=2.0))
    told = controller_of(plan, state, course=course).tick(3).torque
    feels = controller_of(plan, state)
    base = int(model_layout().q_base)
    normals = ground_normals(course, feet_of(state)[:, :2])
    in_body = normals @ quaternion_matrix(state[base : base + 4])
    feels.also(ground_normal_measured=in_body.ravel())
    np.testing.assert_allclose(feels.tick(3).torque, told, atol=1e-6)
    assert np.max(np.abs(told - controller_of(plan, state).tick(3).torque)) > 0.5
