"""What is read from a state vector is what the plant says of it, in any plant."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from rig import URL, model_plant, paper_robot

from drake_quad.common import FloatArray
from drake_quad.robot.loader import AddRobot
from drake_quad.robot.state import StateLayout, make_layout

PENDULUM = """
<robot name="pendulum">
  <link name="bob"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
  <joint name="swing" type="continuous">
    <parent link="world"/><child link="bob"/><axis xyz="0 1 0"/>
  </joint>
</robot>
"""


@cache
def crowded_plant() -> MultibodyPlant:
    """The robot in a plant where others move, that come before and after it."""
    plant = MultibodyPlant(0.001)
    Parser(plant).AddModelsFromString(PENDULUM, "urdf")
    AddRobot(plant, URL)
    inertia = SpatialInertia.SolidSphereWithMass(mass=1.0, radius=0.1)
    plant.AddRigidBody("balloon", plant.AddModelInstance("other"), inertia)
    plant.Finalize()
    return plant


def plants() -> dict[str, MultibodyPlant]:
    return {"alone": model_plant(), "crowded": crowded_plant()}


def random_state(plant: MultibodyPlant, seed: int) -> FloatArray:
    """Any state, quaternions of any length included."""
    rng = np.random.default_rng(seed)
    return np.asarray(rng.normal(size=plant.num_positions() + plant.num_velocities()))


@pytest.mark.parametrize("which", ["alone", "crowded"])
@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_every_part_of_the_state_is_the_plants(which: str, seed: int) -> None:
    """Pose, velocity, joint angles and speeds agree with Drake's, leg by leg."""
    plant, robot = plants()[which], paper_robot()
    layout = make_layout(plant, robot)
    x = random_state(plant, seed)
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, x)
    state = layout.read(x)
    trunk = plant.GetBodyByName(robot.trunk)
    X_WB, V_WB = trunk.EvalPoseInWorld(context), trunk.EvalSpatialVelocityInWorld(context)
    np.testing.assert_allclose(state.p_WB, X_WB.translation(), atol=1e-12)
    np.testing.assert_allclose(state.R_WB, X_WB.rotation().matrix(), atol=1e-12)
    np.testing.assert_allclose(state.w_WB, V_WB.rotational(), atol=1e-12)
    np.testing.assert_allclose(state.v_WB, V_WB.translational(), atol=1e-12)
    joints = [plant.GetJointByName(name) for name in robot.joint_names]
    angles = [joint.get_angle(context) for joint in joints]
    speeds = [joint.get_angular_rate(context) for joint in joints]
    np.testing.assert_array_equal(state.q.ravel(), angles)
    np.testing.assert_array_equal(state.qd.ravel(), speeds)
    assert state.q.shape == state.qd.shape == (4, 3)


@pytest.mark.parametrize("which", ["alone", "crowded"])
def test_each_actuator_drives_the_joint_in_its_place(which: str) -> None:
    """`actuators[k]` is the actuator of the joint `joint_names[k]`."""
    plant, robot = plants()[which], paper_robot()
    layout = make_layout(plant, robot)
    driven = {
        int(i): plant.get_joint_actuator(i).joint().name() for i in plant.GetJointActuatorIndices()
    }
    assert [driven[int(k)] for k in layout.actuators] == list(robot.joint_names)


def test_layouts_of_two_plants_differ_where_the_plants_do() -> None:
    """Nothing of a layout is assumed: beside other bodies all places are others."""
    alone, crowded = (make_layout(plant, paper_robot()) for plant in plants().values())
    assert crowded.size == alone.size + 2 + 13
    assert crowded.q_base != alone.q_base
    assert not np.array_equal(crowded.q_joints, alone.q_joints)


def test_places_never_overlap() -> None:
    """Base and joints take up the whole state of the robot alone, each place once."""
    layout: StateLayout = make_layout(model_plant(), paper_robot())
    base = [*range(layout.q_base, layout.q_base + 7), *range(layout.v_base, layout.v_base + 6)]
    places = [*base, *layout.q_joints.tolist(), *layout.v_joints.tolist()]
    assert sorted(places) == list(range(layout.size))
