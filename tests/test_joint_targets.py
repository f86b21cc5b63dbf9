"""The joints that put the feet where they are to be, in the body as desired or as measured."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RollPitchYaw
from rig import flat_walk, paper_robot

from drake_quad.control.joint_targets import joint_targets
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.leg_kinematics import calc_feet
from drake_quad.robot.leg_scalar import leg_array

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=40)
FEET = np.array(flat_walk().contacts.feet)


def turned(seed: int) -> tuple[FloatArray, FloatArray]:
    """A base's place and rotation, a little off the plan's first."""
    rng = np.random.default_rng(seed)
    p = flat_walk().sample(0.0).body[0, :3] + rng.uniform(-0.03, 0.03, 3)
    R = RollPitchYaw(rng.uniform(-0.05, 0.05, 3)).ToRotationMatrix().matrix()
    return p, np.ascontiguousarray(R)  # as the systems give it: another layout compiles anew


def feet_in_world(q: FloatArray, p: FloatArray, R: FloatArray) -> FloatArray:
    return np.asarray(p + calc_feet(paper_robot().geometry, q.reshape(4, 3)) @ R.T)


@examples
@given(seeds)
def test_targets_put_loaded_feet_in_the_desired_body_and_others_in_the_measured(seed: int) -> None:
    """By forward kinematics; half the load, half way between."""
    legs, zero = leg_array(paper_robot().geometry), np.zeros((4, 3))
    (p, R), (p_d, R_d) = turned(seed), turned(seed + 1)
    none = np.zeros(3)
    load = np.array([1.0, 0.0, 1.0, 0.5])
    q, qd = joint_targets(legs, FEET, zero, load, p, R, p_d, R_d, none, none)
    desired, measured = feet_in_world(q, p_d, R_d), feet_in_world(q, p, R)
    np.testing.assert_allclose(desired[[0, 2]], FEET[[0, 2]], atol=1e-9)
    np.testing.assert_allclose(measured[1], FEET[1], atol=1e-9)
    half = 0.5 * (R.T @ (FEET[3] - p) + R_d.T @ (FEET[3] - p_d))
    np.testing.assert_allclose((measured[3] - p) @ R, half, atol=1e-9)
    np.testing.assert_array_equal(qd, 0.0)


@examples
@given(seeds)
def test_target_speeds_move_feet_and_body_as_desired(seed: int) -> None:
    """The speeds are the derivative of the angles as body and feet move on."""
    rng, legs = np.random.default_rng(seed), leg_array(paper_robot().geometry)
    p, R = turned(seed)
    v, w = rng.uniform(-0.2, 0.2, 3), rng.uniform(-0.2, 0.2, 3)
    feet_v = rng.uniform(-0.3, 0.3, (4, 3))
    ones, h = np.ones(4), 1e-5
    _, qd = joint_targets(legs, FEET, feet_v, ones, p, R, p, R, v, w)
    angles = []
    for t in (-h, h):
        size = float(np.linalg.norm(w))
        turn = np.asarray(AngleAxis(t * size, w / size).rotation())
        at = (p + t * v, turn @ R)
        angles.append(joint_targets(legs, FEET + t * feet_v, feet_v, ones, *at, *at, v, w)[0])
    np.testing.assert_allclose(qd, (angles[1] - angles[0]) / (2 * h), atol=1e-5)
