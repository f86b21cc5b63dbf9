"""The control loop's leg in plain floats is the array leg, number by number."""

from dataclasses import replace

import numpy as np
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
from pydrake.math import RollPitchYaw
from rig import paper_robot, with_raised

from drake_quad.common import FloatArray, Matrix, Vector
from drake_quad.math.rotations import (
    quaternion_rotation,
    solve_rates,
    yaw_pitch_rotation,
)
from drake_quad.robot.kinematics import (
    calc_feet,
    calc_jacobians,
    foot_and_jacobian,
    leg_constants,
    solve_leg,
    solve_legs,
)
from drake_quad.robot.model import LegGeometry

angles = arrays(np.float64, (4, 3), elements=st.floats(-2.5, 2.5))
vectors = arrays(np.float64, 3, elements=st.floats(-10.0, 10.0))
entries = st.floats(-2.0, 2.0).map(lambda x: round(x, 3))
matrices = arrays(np.float64, (3, 3), elements=entries)


# The shipped robot's legs, their hip pitch axes above and below those of abduction.
RAISED = with_raised(paper_robot(), np.array([-0.08, 0.0, 0.05, 0.02])).geometry


def vector(values: FloatArray) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def matrix(values: FloatArray) -> Matrix:
    a, b, c = (vector(row) for row in values)
    return a, b, c


def legs_with_knees(signs: list[float]) -> LegGeometry:
    """The shipped robot's legs, with knees that point as told."""
    return replace(RAISED, knee_sign=np.array(signs))


@given(angles)
def test_foot_and_jacobian_are_the_arrays(q: FloatArray) -> None:
    """At any angles all four legs agree with `calc_feet` and `calc_jacobians`."""
    legs = RAISED
    feet, jacobians = calc_feet(legs, q), calc_jacobians(legs, q)
    for k, constants in enumerate(leg_constants(legs)):
        foot, J = foot_and_jacobian(constants, *q[k].tolist())
        np.testing.assert_allclose(foot, feet[k], atol=1e-12)
        np.testing.assert_allclose(J, jacobians[k], atol=1e-12)


@given(
    arrays(np.float64, (4, 3), elements=st.floats(-2.0, 2.0)),
    st.lists(st.sampled_from([-1.0, 1.0]), min_size=4, max_size=4),
)
def test_inverse_is_the_arrays_also_out_of_reach(p_BF: FloatArray, knees: list[float]) -> None:
    """Anywhere in space, within reach or not, both give the same angles, knees either way."""
    legs = legs_with_knees(knees)
    expected, _ = solve_legs(legs, p_BF)
    for k, constants in enumerate(leg_constants(legs)):
        q = np.array(solve_leg(constants, *p_BF[k].tolist()))
        turn = (q - expected[k] + np.pi) % (2 * np.pi) - np.pi  # π and -π are one angle
        np.testing.assert_allclose(turn, 0.0, atol=1e-6)


@given(matrices, vectors)
def test_rates_solve_the_three_equations(J: FloatArray, v: FloatArray) -> None:
    """J times the rates is the velocity; a singular leg is told not to move."""
    rates = np.array(solve_rates(matrix(J), vector(v)))
    determinant = float(np.linalg.det(J))
    if abs(determinant) > 1e-3:
        np.testing.assert_allclose(J @ rates, v, atol=1e-6)
    elif abs(determinant) < 1e-12:
        assert np.all(rates == 0.0)


@given(st.floats(-1.5, 1.5), st.floats(-7.0, 7.0))
def test_rotation_of_yaw_and_pitch_is_drakes(pitch: float, yaw: float) -> None:
    """R is that of roll 0, pitch, yaw."""
    R = yaw_pitch_rotation(pitch, yaw)
    expected = RollPitchYaw(0.0, pitch, yaw).ToRotationMatrix().matrix()
    np.testing.assert_allclose(R, expected, atol=1e-12)


@given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0), st.floats(0.1, 10.0))
def test_rotation_of_a_quaternion_is_drakes_whatever_its_length(
    roll: float, pitch: float, yaw: float, length: float
) -> None:
    """A quaternion that the integrator let grow still gives a rotation."""
    turn = RollPitchYaw(roll, pitch, yaw)
    R = quaternion_rotation(*(length * turn.ToQuaternion().wxyz()).tolist())
    np.testing.assert_allclose(R, turn.ToRotationMatrix().matrix(), atol=1e-12)
