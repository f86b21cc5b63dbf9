"""JointContactEstimator alone, through its ports and its own Context."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import Simulator

from drake_quad.common import GRAVITY
from drake_quad.control.settings import ControlSettings
from drake_quad.estimation.contact_from_torques import TouchMemory
from drake_quad.robot.kinematics import calc_jacobians
from drake_quad.robot.loader import AddRobot, MakeModelPlant, load_robot
from drake_quad.robot.state import make_layout
from drake_quad.systems.joint_contact_estimator import JointContactEstimator, MomentumObserver

NO_GAINS = ControlSettings(kp=0.0, kd=0.0, period=0.002)


def test_a_robot_that_hangs_still_feels_what_its_drives_hold() -> None:
    """At rest, torques of gravity and of three feet's forces give these, and the fourth's none."""
    robot = load_robot("package://drake_quad_models/paper_quadruped.urdf")
    model = MakeModelPlant(robot.url)
    layout = make_layout(model, robot)
    system = JointContactEstimator(robot=robot, layout=layout, model=model, control=NO_GAINS)
    state = np.zeros(layout.size)
    state[layout.q_base] = 1.0
    q = np.tile([0.1, 0.9, -1.6], (4, 1))
    state[layout.q_joints] = q.ravel()
    scratch = model.CreateDefaultContext()
    model.SetPositionsAndVelocities(scratch, state)
    joints = layout.v_joints - layout.num_positions
    force = np.array([[5.0, 0.0, 200.0], [0.0, 3.0, 150.0], [0.0, 0.0, 220.0], [0.0, 0.0, 0.0]])
    legs = np.einsum("kji,kj->ki", calc_jacobians(robot.geometry, q), force).ravel()
    torque = -model.CalcGravityGeneralizedForces(scratch)[joints] - legs

    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.GetInputPort("robot_state_estimated").FixValue(context, state)
    system.GetInputPort("joint_torque_measured").FixValue(context, torque)
    bearing = system.GetOutputPort("contact_state_measured")
    assert np.array_equal(bearing.Eval(context), np.ones(4))
    simulator.AdvanceTo(0.2)
    found = system.GetOutputPort("foot_force_estimated").Eval(context).reshape(4, 3)
    assert np.allclose(found, force, atol=1e-6 * robot.mass * GRAVITY)
    assert np.array_equal(bearing.Eval(context), [1.0, 1.0, 1.0, 0.0])
    # State is the Context's: another has nothing of it.
    other = Simulator(system).get_mutable_context()
    assert np.array_equal(bearing.Eval(other), np.ones(4))


def test_damping_of_the_joints_is_not_felt_as_ground() -> None:
    """A robot that falls with its legs swinging and damped feels no force on any foot."""
    robot = load_robot("package://drake_quad_models/paper_quadruped.urdf")
    falling, model = MultibodyPlant(0.0005), MultibodyPlant(0.0)
    for plant in (falling, model):
        AddRobot(plant, robot.url)
        for name in robot.joint_names:
            plant.GetJointByName(name).set_default_damping(1.0)
        plant.Finalize()
    layout = make_layout(model, robot)
    simulator = Simulator(falling)
    context = simulator.get_mutable_context()
    state = np.zeros(layout.size)
    state[layout.q_base] = 1.0
    state[layout.q_joints] = np.tile([0.1, 0.9, -1.6], 4)
    state[layout.v_joints] = np.tile([0.0, 2.0, 3.0], 4)
    falling.SetPositionsAndVelocities(context, state)
    falling.get_actuation_input_port().FixValue(context, np.zeros(12))

    observer = MomentumObserver(robot, layout, model, control=NO_GAINS)
    scratch = model.CreateDefaultContext()
    memory, period = np.zeros(TouchMemory.SIZE), 0.001
    before = np.zeros(observer.before_shape)
    largest = 0.0
    for step in range(80):
        simulator.AdvanceTo(step * period)
        state = falling.GetPositionsAndVelocities(context)
        observer.update(scratch, memory, before, state, np.zeros(12), period)
        if step >= 60:  # what was taken to stand has been forgotten by then
            largest = max(largest, np.abs(memory[TouchMemory.FORCE]).max())
    speeds = state[layout.v_joints].reshape(4, 3)[:, 2]
    assert np.abs(speeds).min() > 0.3  # the damping is still at work
    assert largest < 0.002 * robot.mass * GRAVITY


def test_legs_that_swing_by_commands_held_are_not_felt_on_the_ground() -> None:
    """A falling robot whose drives swing its legs, told anew every 2 ms, feels next to nothing."""
    robot = load_robot("package://drake_quad_models/paper_quadruped.urdf")
    falling, model = MultibodyPlant(0.001), MakeModelPlant(robot.url)
    AddRobot(falling, robot.url)
    falling.Finalize()
    control = ControlSettings(kp=1500.0, kd=40.0, period=0.002)
    for index in falling.GetJointActuatorIndices():
        drive = falling.get_joint_actuator(index)
        drive.set_controller_gains(PdControllerGains(p=control.kp, d=control.kd))
    layout = make_layout(model, robot)
    instance = falling.GetModelInstanceByName(robot.name)
    simulator = Simulator(falling)
    context = simulator.get_mutable_context()
    state, middle = np.zeros(layout.size), np.tile([0.1, 0.9, -1.6], 4)
    state[layout.q_base], state[layout.q_joints] = 1.0, middle
    falling.SetPositionsAndVelocities(context, state)
    falling.get_actuation_input_port().FixValue(context, np.zeros(12))
    order = np.argsort(layout.actuators)  # legs' rows in the actuators' order

    def command(time: float) -> None:
        rate = 2.0 * np.pi / 0.6
        swing = np.tile([0.0, 0.2, 0.35], 4)
        angles = middle + swing * (1.0 - np.cos(rate * time))
        speeds = swing * rate * np.sin(rate * time)
        wanted = np.concatenate([angles[order], speeds[order]])
        falling.get_desired_state_input_port(instance).FixValue(context, wanted)

    observer = MomentumObserver(robot, layout, model, control=control)
    memory, scratch = np.zeros(TouchMemory.SIZE), model.CreateDefaultContext()
    before = np.zeros(observer.before_shape)
    felt, fastest = 0.0, 0.0
    command(0.0)
    for step in range(1, 200):
        simulator.AdvanceTo(step * control.period)
        torque = falling.get_net_actuation_output_port(instance).Eval(context)[layout.actuators]
        state = falling.GetPositionsAndVelocities(context)
        observer.update(scratch, memory, before, state, torque, control.period)
        command(step * control.period)
        if step >= 60:  # what was taken to stand has been forgotten by then
            felt = max(felt, np.abs(memory[TouchMemory.FORCE]).max())
            fastest = max(fastest, np.abs(state[layout.v_joints]).max())
    assert fastest > 3.0
    assert felt < 0.002 * robot.mass * GRAVITY
