"""The controller alone: targets on the plan, the base fed back the right way, weight carried."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RollPitchYaw, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context
from rig import (
    GRAVITY,
    feet_of,
    fix_inputs,
    flat_walk,
    model_layout,
    model_plant,
    paper_robot,
    read,
    rotations,
    stand_plan,
    state_of,
)

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.contact_plan import ContactPlan, Step
from drake_quad.planning.motion_plan import MotionPlan, pose_robot
from drake_quad.robot.leg_kinematics import calc_feet, calc_jacobians
from drake_quad.robot.robot_state import StateLayout
from drake_quad.systems.control_settings import ControlSettings
from drake_quad.systems.gait_phase import SIZE, GaitPhase
from drake_quad.systems.ik_controller import (
    IkController,
    foot_load,
    rotation_error,
    smooth,
    velocity_of,
)

CONTROL = ControlSettings()
TICK = CONTROL.period


def phase_at(t: float, *, rate: float = 1.0, task: int = 0) -> FloatArray:
    phase = np.zeros(SIZE)
    phase[GaitPhase.TIME], phase[GaitPhase.RATE], phase[GaitPhase.TASK] = t, rate, task
    return phase


def state_on(plan: MotionPlan, t: float) -> FloatArray:
    """The robot where the plan has it at `t`, at rest."""
    sample = plan.sample(t)
    return state_of(sample.body[0], sample.feet)


class Controller:
    """A controller in a simulator of its own; targets in the order of legs."""

    def __init__(
        self,
        plan: MotionPlan,
        state: FloatArray,
        *,
        t: float = 0.0,
        rate: float = 1.0,
        layout: StateLayout | None = None,
        control: ControlSettings = CONTROL,
    ) -> None:
        self.layout = layout or model_layout()
        self.system = IkController(
            robot=paper_robot(), layout=self.layout, model=model_plant(), control=control
        )
        self.simulator = Simulator(self.system)
        self.context: Context = self.simulator.get_mutable_context()
        self.give(plan, state, phase_at(t, rate=rate))

    def give(self, plan: MotionPlan, state: FloatArray, phase: FloatArray) -> None:
        """Sets the inputs from now on."""
        fix_inputs(
            self.system,
            self.context,
            motion_plan=plan,
            gait_phase=phase,
            robot_state_estimated=state,
        )

    def tick(self, count: int = 1) -> "Controller":
        """Runs for so many control periods."""
        for _ in range(count):
            self.simulator.AdvanceTo(self.context.get_time() + TICK)
        return self

    @property
    def target(self) -> tuple[FloatArray, FloatArray]:
        """Joint angles (4, 3) and speeds (4, 3) desired."""
        both = read(self.system, self.context, "joint_state_desired")
        rank = np.argsort(np.argsort(self.layout.actuators))
        return both[:12][rank].reshape(4, 3), both[12:][rank].reshape(4, 3)

    @property
    def torque(self) -> FloatArray:
        """Feed-forward torques (4, 3)."""
        rank = np.argsort(np.argsort(self.layout.actuators))
        return read(self.system, self.context, "joint_torque_feedforward")[rank].reshape(4, 3)


def forces_of(torque: FloatArray, state: FloatArray) -> FloatArray:
    """The forces on the feet (4, 3) in W that these torques balance, the robot being at rest."""
    plant, layout = model_plant(), model_layout()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    gravity = plant.CalcGravityGeneralizedForces(context)[layout.v_joints - layout.num_positions]
    measured = layout.read(state)
    J = calc_jacobians(paper_robot().geometry, measured.q)
    held = -(torque + gravity.reshape(4, 3))
    f_B = np.stack([np.linalg.solve(J[k].T, held[k]) for k in range(4)])
    return np.asarray(f_B @ measured.R_WB.T)


def com_of(state: FloatArray) -> FloatArray:
    plant = model_plant()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    return np.array(plant.CalcCenterOfMassPositionInWorld(context))


def middle_of(leg_in_air: bool, number: int = 2) -> float:
    """A gait time in the middle of a swing, or between two, of the level walk."""
    phases = [p for p in flat_walk().contacts.phases if (p.step is not None) == leg_in_air]
    return 0.5 * (phases[number].start + phases[number].end)


@pytest.mark.parametrize("in_air", [True, False])
def test_on_its_plan_the_targets_are_the_plans_own_angles(in_air: bool) -> None:
    """With base and feet where they are to be, the targets are the plan's inverse kinematics."""
    t = middle_of(in_air)
    plan, state = flat_walk(), state_on(flat_walk(), t)
    sample = plan.sample(t)
    q, _, _ = pose_robot(paper_robot(), sample.body[:1], sample.feet[None])
    found, _ = Controller(plan, state, t=t).tick().target
    # A foot that swings aims lower as it lands; at mid-swing it does not yet.
    np.testing.assert_allclose(found, q[0], atol=1e-6)


@pytest.mark.parametrize("in_air", [True, False])
def test_target_speeds_are_the_derivative_of_the_plans_angles(in_air: bool) -> None:
    """Base and feet both move: the joint speeds carry them along."""
    t, h = middle_of(in_air), 1e-4
    plan = flat_walk()

    def angles(t: float) -> FloatArray:
        sample = plan.sample(t)
        return pose_robot(paper_robot(), sample.body[:1], sample.feet[None])[0][0]

    _, speeds = Controller(plan, state_on(plan, t), t=t).tick().target
    np.testing.assert_allclose(speeds, (angles(t + h) - angles(t - h)) / (2 * h), atol=1e-3)


def test_while_the_clock_waits_nothing_is_to_move() -> None:
    """At rate 0 all desired joint speeds are 0."""
    t = middle_of(False)
    _, speeds = Controller(flat_walk(), state_on(flat_walk(), t), t=t, rate=0.0).tick().target
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
    found, _ = Controller(plan, state).tick().target
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
    control = Controller(plan, state).tick()
    total = forces_of(control.torque, state).sum(axis=0)
    total[2] -= paper_robot().mass * GRAVITY
    expected = np.zeros(3)
    expected[axis] = -sign * 0.01 * CONTROL.base_stiffness
    np.testing.assert_allclose(total, expected, atol=1e-3)


@pytest.mark.parametrize(("place", "sign"), [(3, 1.0), (3, -1.0), (4, 1.0), (4, -1.0)])
def test_base_turned_off_its_heading_or_pitch_is_turned_back(place: int, sign: float) -> None:
    """The moment about the centre of mass is against the error, of the stiffness set."""
    plan = stand_plan()
    sample = plan.sample(0.0)
    body = np.array(sample.body[0])
    body[place] += sign * 0.01
    state = state_of(body, sample.feet)
    forces = forces_of(Controller(plan, state).tick().torque, state)
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
    total = forces_of(Controller(plan, state).tick().torque, state).sum(axis=0)
    weight = [0.0, 0.0, paper_robot().mass * GRAVITY]
    expected = weight - CONTROL.base_damping * np.array([0.1, -0.05, 0.02])
    np.testing.assert_allclose(total, expected, atol=1e-3)


def test_base_that_turns_is_slowed_down() -> None:
    """An angular velocity that the plan has not is braked by the damping set."""
    plan = stand_plan()
    state, w = state_on(plan, 0.0), np.array([0.05, -0.1, 0.2])
    state[model_layout().v_base : model_layout().v_base + 3] = w
    forces = forces_of(Controller(plan, state).tick().torque, state)
    moment = np.cross(feet_of(state) - com_of(state), forces).sum(axis=0)
    np.testing.assert_allclose(moment, -CONTROL.base_rotation_damping * w, atol=0.05)


@pytest.mark.parametrize("in_air", [True, False])
def test_torques_fed_forward_carry_the_robot(in_air: bool) -> None:
    """On its plan the forces on the feet hold the weight at the centre of mass, and only push."""
    t = middle_of(in_air)
    plan, state = flat_walk(), state_on(flat_walk(), t)
    controller = Controller(plan, state, t=t, rate=0.0).tick()
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
    t = float(times[np.argmax(np.abs(acceleration[:, 1]))])
    state = state_on(plan, t)
    layout, sample = model_layout(), plan.sample(t)
    state[layout.v_base + 3 : layout.v_base + 6] = sample.body[1, :3]  # no damping then
    total = forces_of(Controller(plan, state, t=t).tick().torque, state).sum(axis=0)
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
    found, _ = Controller(plan, state, t=t).tick().target
    R = rotations(body)
    in_world = body[:3] + R @ calc_feet(paper_robot().geometry, found)[row]
    np.testing.assert_allclose(in_world, sample.feet[row], atol=2e-3)


def test_standing_foots_target_follows_where_it_really_stands() -> None:
    """A foot that landed 1 cm off is not dragged back: its target comes to it in a second."""
    plan = stand_plan(9.0)
    sample = plan.sample(0.0)
    controller = Controller(plan, state_on(plan, 0.0)).tick()
    feet = np.array(sample.feet)
    feet[0] += [0.01, -0.005, 0.0]
    state = state_of(sample.body[0], feet)
    controller.give(plan, state, phase_at(0.1))
    q_there, _, _ = pose_robot(paper_robot(), sample.body[:1], feet[None])
    gaps = [float(np.abs(controller.tick(40).target[0] - q_there[0]).max()) for _ in range(5)]
    assert gaps[0] > gaps[2] > gaps[4] and gaps[4] < 0.05 * 0.02


def foot_target(controller: Controller, plan: MotionPlan, t: float, row: int) -> FloatArray:
    """Where in W the targets put a foot of a robot whose base is on its plan."""
    body = plan.sample(t).body[0]
    p_BF = calc_feet(paper_robot().geometry, controller.target[0])[row]
    return np.asarray(body[:3] + rotations(body) @ p_BF)


def test_swing_foot_lands_with_a_little_pressure() -> None:
    """It aims below the ground as it lands, by what is set, and not at mid-swing."""
    plan = flat_walk()
    step = plan.contacts.steps[0]
    for s, press in ((0.5, 0.0), (0.999, CONTROL.touchdown_press)):
        t = step.lift_off + s * (step.touchdown - step.lift_off)
        controller = Controller(plan, state_on(plan, t), t=t).tick()
        below = plan.sample(t).feet[step.leg.row] - foot_target(controller, plan, t, step.leg.row)
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
    controller = Controller(plan, state_of(sample.body[0], feet), t=t).tick(400)
    for s, part in ((0.001, 1.0), (0.8, 0.0)):
        t = step.lift_off + s * (step.touchdown - step.lift_off)
        controller.give(plan, state_on(plan, t), phase_at(t))
        found = foot_target(controller.tick(), plan, t, row) - plan.sample(t).feet[row]
        np.testing.assert_allclose(found, part * off, atol=2e-4)


def test_foot_that_finds_no_ground_is_searched_down_for_it() -> None:
    """While the clock waits for a touchdown, the foot goes on down at the speed set."""
    plan = flat_walk()
    step = plan.contacts.steps[0]
    t = step.touchdown - TICK
    state = state_on(plan, t)
    controller = Controller(plan, state, t=t).tick()
    controller.give(plan, state, phase_at(t, rate=0.0))
    depths = []
    for _ in range(3):
        target, _ = controller.tick(20).target
        sample = plan.sample(t)
        foot = sample.body[0, :3] + calc_feet(paper_robot().geometry, target)[step.leg.row]
        depths.append(sample.feet[step.leg.row, 2] - foot[2])
    np.testing.assert_allclose(np.diff(depths), 20 * TICK * CONTROL.search_speed, rtol=0.05)


def test_commands_stay_within_the_robots_limits() -> None:
    """Even with the base a metre away no angle, speed or torque beyond the limits is asked for."""
    robot, plan = paper_robot(), stand_plan()
    state = state_on(plan, 0.0)
    state[model_layout().q_base + 4] += 1.0
    state[model_layout().v_base :] = 50.0
    controller = Controller(plan, state).tick(3)
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
    a, b = Controller(plan, state).tick(), Controller(plan, state, layout=reverse).tick()
    for port, parts in (("joint_state_desired", 2), ("joint_torque_feedforward", 1)):
        one = read(a.system, a.context, port).reshape(parts, 12)
        other = read(b.system, b.context, port).reshape(parts, 12)
        np.testing.assert_array_equal(one, other[:, ::-1])
        assert not np.array_equal(one, other)


def test_what_the_plan_has_now_is_put_out_for_the_log() -> None:
    """`body_desired` and `feet_desired` are the plan's at the gait time."""
    t = middle_of(True)
    controller = Controller(flat_walk(), state_on(flat_walk(), t), t=t).tick()
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
    controller = Controller(plan, state_on(plan, 0.0)).tick()
    before = controller.target[0]
    controller.give(plan, state_on(plan, 0.0), phase_at(0.0, task=1, rate=0.0))
    np.testing.assert_allclose(controller.tick().target[0], before, atol=1e-9)


def test_two_contexts_of_one_controller_are_two_controllers() -> None:
    """Footholds remembered in one run are not seen in another."""
    plan = stand_plan()
    a = Controller(plan, state_on(plan, 0.0)).tick()
    before = a.target[0].copy()
    other = Simulator(a.system)
    context = other.get_mutable_context()
    sample = plan.sample(0.0)
    far = state_of(sample.body[0] + [0.0, 0.0, -0.1, 0.0, 0.0], sample.feet)
    fix_inputs(a.system, context, motion_plan=plan, gait_phase=phase_at(0.0),
               robot_state_estimated=far)  # fmt: skip
    other.AdvanceTo(0.1)
    np.testing.assert_array_equal(a.target[0], before)
    np.testing.assert_allclose(a.tick().target[0], before, atol=1e-9)


def test_outputs_are_held_state() -> None:
    """No input reaches a command but by a tick."""
    assert not Controller(
        stand_plan(), state_on(stand_plan(), 0.0)
    ).system.HasAnyDirectFeedthrough()


def load_history(contacts: ContactPlan, count: int = 6000) -> tuple[FloatArray, FloatArray]:
    times = np.linspace(0.0, contacts.duration, count)
    return times, np.array([foot_load(contacts, float(t), 0.25) for t in times])


def test_foot_load_is_full_in_stance_none_in_the_air_and_ramps_between() -> None:
    """A foot gives its load away before lift-off and takes it up after touchdown, smoothly."""
    contacts = flat_walk().contacts
    times, load = load_history(contacts)
    _, standing = contacts.feet_at(times)
    assert np.all(load[~standing] == 0.0)
    assert np.all(load[standing] > 0.0) and np.all(load <= 1.0)
    for step in contacts.steps:
        row = step.leg.row
        before = times[(times > step.lift_off - 0.25) & (times < step.lift_off)]
        after = times[(times >= step.touchdown) & (times < step.touchdown + 0.25)]
        down = load[np.isin(times, before), row]
        up = load[np.isin(times, after), row]
        assert np.all(np.diff(down) <= 0.0) and down[-1] < 0.01
        assert np.all(np.diff(up) >= 0.0) and up[0] < 0.01
    jumps = np.abs(np.diff(load, axis=0)).max()
    assert jumps <= 1.5 / 0.2 * (times[1] - times[0]) + 2e-4


@given(st.floats(0.02, 0.4), st.floats(0.05, 1.0))
def test_ramps_share_the_time_that_there_is_on_four_feet(gap: float, unload: float) -> None:
    """With little time between a touchdown and a lift-off both ramps take just that time."""
    plan = flat_walk().contacts
    first, second = plan.steps[0], plan.steps[1]
    close = Step(second.leg, first.touchdown + gap, second.touchdown, second.swing)
    contacts = ContactPlan(plan.feet, (first, close), second.touchdown + 1.0)
    middle = foot_load(contacts, first.touchdown + 0.5 * gap, unload)
    if unload >= gap:
        assert middle[first.leg.row] == pytest.approx(0.5)
        assert middle[second.leg.row] == pytest.approx(0.5)
    start = foot_load(contacts, first.touchdown + 1e-9, unload)
    end = foot_load(contacts, first.touchdown + gap - 1e-9, unload)
    assert start[first.leg.row] < 1e-3 and end[second.leg.row] < 1e-3


@given(st.floats(-2.0, 3.0), st.floats(1e-6, 0.5))
def test_smooth_is_a_step_that_rises_and_is_symmetric(x: float, dx: float) -> None:
    """0 until 0, 1 from 1 on, never falling, and turned about its middle onto itself."""
    assert smooth(x + dx) >= smooth(x)
    assert smooth(x) + smooth(1.0 - x) == pytest.approx(1.0)
    assert smooth(min(x, 0.0)) == 0.0 and smooth(max(x, 1.0)) == 1.0


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_velocity_of_the_plans_angles_is_the_bodys(seed: int) -> None:
    """Rates of yaw and pitch make the angular velocity that the rotation really has."""
    rng = np.random.default_rng(seed)
    body, rates = rng.uniform(-1.0, 1.0, 5), rng.uniform(-1.0, 1.0, 5)
    h = 1e-6
    before, after = (rotations(body + sign * h * rates) for sign in (-1.0, 1.0))
    W = (after - before) / (2 * h) @ rotations(body).T
    v, w = velocity_of(body.tolist(), rates.tolist(), 1.0)
    np.testing.assert_allclose(w, [W[2, 1], W[0, 2], W[1, 0]], atol=1e-8)
    np.testing.assert_allclose(v, rates[:3])
    assert velocity_of(body.tolist(), rates.tolist(), 0.0) == ((0, 0, 0), (0, 0, 0))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_rotation_error_is_the_small_turn_that_is_missing(seed: int) -> None:
    """Turning by it, in W, takes the one rotation to the other, to first order."""
    rng = np.random.default_rng(seed)
    R = RollPitchYaw(rng.uniform(-1.0, 1.0, 3)).ToRotationMatrix()
    turn = rng.uniform(-0.01, 0.01, 3)
    desired = RotationMatrix(RollPitchYaw(turn)).multiply(R)

    def rows(matrix: RotationMatrix) -> tuple[tuple[float, float, float], ...]:
        return tuple((a, b, c) for a, b, c in matrix.matrix().tolist())

    error = rotation_error(rows(desired), rows(R))  # type: ignore[arg-type]
    np.testing.assert_allclose(error, turn, atol=1e-4)
