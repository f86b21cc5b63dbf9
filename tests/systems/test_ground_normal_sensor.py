"""Sensors in the feet show which way the ground under them is tilted, seen from the trunk."""

import numpy as np
from feet_rig import any_state
from hypothesis import given, settings, strategies as st
from pydrake.systems.analysis import Simulator
from rig import feet_of, fix_inputs, model_layout, paper_robot, read

from drake_quad.common import FloatArray
from drake_quad.math.rotations import quaternion_matrix
from drake_quad.systems.sensors import GroundNormalSensor

DT = 0.002


def shown(state: FloatArray, bearing: FloatArray, normals: FloatArray) -> FloatArray:
    """What the sensor shows (4, 3) at its first sample on ground with these normals in W (4, 3)."""
    sensor = GroundNormalSensor(robot=paper_robot(), layout=model_layout(), period=DT)
    simulator = Simulator(sensor)
    context = simulator.get_mutable_context()
    places = feet_of(state) - paper_robot().foot_radius * normals
    fix_inputs(sensor, context, robot_state=state, contact_state=bearing,
               foot_contact_position=places.ravel())  # fmt: skip
    assert not np.any(read(sensor, context, "ground_normal_measured"))
    simulator.AdvanceTo(0.5 * DT)
    assert not sensor.HasAnyDirectFeedthrough()
    return read(sensor, context, "ground_normal_measured").reshape(4, 3)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_normals_are_the_grounds_as_the_trunk_sees_them(seed: int) -> None:
    """Turned by the trunk's attitude they are the ground's; a foot that does not bear has none."""
    rng, state, base = np.random.default_rng(seed), any_state(seed), int(model_layout().q_base)
    normals = np.stack([*rng.uniform(-0.7, 0.7, (2, 4)), np.ones(4)], axis=-1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    bearing = rng.integers(0, 2, 4).astype(float)
    found = shown(state, bearing, normals) @ quaternion_matrix(state[base : base + 4]).T
    np.testing.assert_allclose(found, normals * bearing[:, None], atol=1e-9)
