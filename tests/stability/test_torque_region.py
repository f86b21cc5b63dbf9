"""Joint torques' part in the region of balance."""

import numpy as np
from hypothesis import given, settings, strategies as st
from pydrake.multibody.tree import JacobianWrtVariable
from rig import GRAVITY, model_layout, model_plant, paper_robot, stand_plan, state_of

from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.kinematics import calc_feet, calc_holding
from drake_quad.stability.equilibrium_region import (
    com_projection,
    find_region,
    joint_limits,
    make_contacts,
)

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=20, deadline=None)


def random_pose(seed: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """A body pose (5,), its R_WB, joint angles (4, 3), and the feet in W (4, 3)."""
    rng = np.random.default_rng(seed)
    stance = stand_plan().end
    body = stance.body + rng.uniform(-0.05, 0.05, 5)
    feet = np.array(stance.feet) + rng.uniform(-0.08, 0.08, (4, 3))
    R = rotations(body)
    q = pose_robot(paper_robot(), body[None], feet[None])[0][0]
    return body, R, q, np.asarray(body[:3] + calc_feet(paper_robot().geometry, q) @ R.T)


@FEW
@given(SEEDS)
def test_holding_torques_are_drakes(seed: int) -> None:
    """What holds the links up is what Drake's gravity takes away from the joints."""
    body, R, q, feet = random_pose(seed)
    plant, layout = model_plant(), model_layout()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state_of(body, feet))
    gravity = plant.CalcGravityGeneralizedForces(context)[layout.v_joints - layout.num_positions]
    ours = calc_holding(paper_robot(), q, R[2])
    np.testing.assert_allclose(ours.ravel(), -gravity, atol=1e-9)


@FEW
@given(SEEDS, st.floats(0.1, 2.0))
def test_torque_limits_only_take_away(seed: int, strength: float) -> None:
    """The feasible region lies within the region of friction, and grows with the limits."""
    _, R, q, feet = random_pose(seed)
    robot, contacts = paper_robot(), make_contacts(feet, friction=0.6)
    all_four = np.ones(4, dtype=bool)
    free = find_region(contacts)
    small, large = (
        find_region(contacts, limits=joint_limits(robot, R, q, all_four, effort=s * robot.effort))
        for s in (0.5 * strength, strength)
    )
    assert all(large.margin(x, y) > -1e-6 for x, y in small.corners)
    assert all(free.margin(x, y) > -1e-6 for x, y in large.corners)


@FEW
@given(SEEDS)
def test_forces_of_a_corner_ask_no_more_than_the_joints_have(seed: int) -> None:
    """At the region's end the torques, by Drake's model, are within limits and hold the robot."""
    body, R, q, feet = random_pose(seed)
    robot, plant, layout = paper_robot(), model_plant(), model_layout()
    effort = 0.35 * robot.effort
    standing = np.array([True, True, True, seed % 2 == 0])
    limits = joint_limits(robot, R, q, standing, effort=effort)
    shadow = com_projection(make_contacts(feet[standing], friction=0.6), limits)
    turn = 0.1 * (seed % 63)
    forces = shadow.forces(np.cos(turn), np.sin(turn))
    if forces is None:
        return
    f = np.zeros((4, 3))
    f[standing] = forces.reshape(-1, 3) * robot.mass * GRAVITY
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state_of(body, feet))
    total = -plant.CalcGravityGeneralizedForces(context)
    for row, name in enumerate(robot.joint_names[2::3]):
        link = plant.GetJointByName(name).child_body()
        X_WL = plant.EvalBodyPoseInWorld(context, link)
        J = plant.CalcJacobianTranslationalVelocity(
            context, JacobianWrtVariable.kV, link.body_frame(), X_WL.inverse() @ feet[row],
            plant.world_frame(), plant.world_frame(),
        )  # fmt: skip
        total -= J.T @ f[row]
    torque = total[layout.v_joints - layout.num_positions]
    assert np.all(np.abs(torque) <= effort + 1e-3)
    base = layout.v_base - layout.num_positions
    np.testing.assert_allclose(total[base + 3 : base + 6], 0.0, atol=1e-3)
