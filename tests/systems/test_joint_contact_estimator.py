"""JointContactEstimator alone, through its ports and its own Context."""

import numpy as np
from pydrake.systems.analysis import Simulator

from drake_quad.common import GRAVITY
from drake_quad.robot.kinematics import calc_jacobians
from drake_quad.robot.loader import MakeModelPlant, load_robot
from drake_quad.robot.state import make_layout
from drake_quad.systems.joint_contact_estimator import JointContactEstimator


def test_a_robot_that_hangs_still_feels_what_its_drives_hold() -> None:
    """At rest, torques of gravity and of three feet's forces give these, and the fourth's none."""
    robot = load_robot("package://drake_quad_models/paper_quadruped.urdf")
    model = MakeModelPlant(robot.url)
    layout = make_layout(model, robot)
    system = JointContactEstimator(robot=robot, layout=layout, model=model)
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
