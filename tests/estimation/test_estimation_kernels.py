"""The filter's building blocks against what defines them: rotations, legs, tables of noise."""

import numpy as np
import pytest
from estimation_rig import DT
from hypothesis import given, strategies as st
from pydrake.math import RotationMatrix
from rig import paper_robot, with_raised
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from drake_quad.estimation.correction import feet_in_body
from drake_quad.estimation.imu_units import MTI_300
from drake_quad.estimation.sensor_models import BIAS_ROWS, WHITE_ROWS, draw_imu_errors
from drake_quad.math.rotations import (
    left_jacobian,
    multiply,
    normalize,
    rotation_exp,
    rotation_log,
    write_quaternion,
)
from drake_quad.robot.kinematics import calc_feet, calc_jacobians, leg_array

vectors = st.tuples(*[st.floats(-1.7, 1.7, allow_subnormal=False) for _ in range(3)])


@given(vectors)
def test_exponential_is_the_rotation_of_its_vector(v: tuple[float, float, float]) -> None:
    """As another library has it; the logarithm takes it back."""
    R = rotation_exp(*v)
    np.testing.assert_allclose(R, Rotation.from_rotvec(v).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(rotation_log(R), v, atol=1e-8)


@given(vectors, vectors)
def test_left_jacobian_moves_as_the_group_does(
    v: tuple[float, float, float], u: tuple[float, float, float]
) -> None:
    """Exp of the twist (v, u) in SE(3), by a general matrix exponential."""
    X = np.zeros((4, 4))
    X[:3, :3] = [[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]]
    X[:3, 3] = u
    E = expm(X)
    np.testing.assert_allclose(rotation_exp(*v), E[:3, :3], atol=1e-9)
    np.testing.assert_allclose(left_jacobian(*v) @ np.array(u), E[:3, 3], atol=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_quaternion_is_drakes(seed: int) -> None:
    """Any rotation, with w >= 0."""
    R = Rotation.random(random_state=seed).as_matrix()
    out = np.empty(4)
    write_quaternion(np.ascontiguousarray(R), out)
    wxyz = RotationMatrix(R).ToQuaternion().wxyz()
    np.testing.assert_allclose(out, wxyz * np.sign(wxyz[0]), atol=1e-12)


def test_normalizing_mends_rounding_and_no_more() -> None:
    """A rotation stays; one that is off becomes one near it."""
    R = np.ascontiguousarray(Rotation.from_rotvec([0.3, -0.2, 1.0]).as_matrix())
    off = R + 1e-6 * np.arange(9.0).reshape(3, 3)
    normalize(off)
    np.testing.assert_allclose(off.T @ off, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(off, R, atol=2e-5)
    np.testing.assert_allclose(multiply(off, R), off @ R, atol=1e-14)


def test_feet_are_where_the_robots_kinematics_have_them() -> None:
    """Places and velocities of the compiled legs are those of `leg_kinematics`."""
    generator = np.random.default_rng(1)
    for k in range(20):
        raised = np.array([-0.08, -0.08, 0.05, 0.05]) * (k % 2)
        geometry = with_raised(paper_robot(), raised).geometry
        legs = leg_array(geometry)
        q, qd = generator.uniform(-1.0, 1.0, (4, 3)), generator.uniform(-2.0, 2.0, (4, 3))
        p, v = np.empty((4, 3)), np.empty((4, 3))
        feet_in_body(legs, np.concatenate([q.ravel(), qd.ravel()]), p, v)
        np.testing.assert_allclose(p, calc_feet(geometry, q), atol=1e-12)
        expected = np.einsum("kij,kj->ki", calc_jacobians(geometry, q), qd)
        np.testing.assert_allclose(v, expected, atol=1e-12)


def test_bias_wanders_about_its_turn_on_value() -> None:
    """It begins there, moves by its instability, and without jumps."""
    errors = draw_imu_errors(MTI_300, DT, np.random.default_rng(2))
    assert errors.white.shape == (WHITE_ROWS, 6) and errors.bias.shape == (BIAS_ROWS, 6)
    np.testing.assert_array_equal(errors.calc_bias(0), errors.bias[0])
    scatter = (errors.bias - errors.bias[0])[:, :3].std()
    assert 0.5 * MTI_300.gyro_instability < scatter < 2.0 * MTI_300.gyro_instability
    steps = np.abs(np.diff([errors.calc_bias(k)[0] for k in range(5000)]))
    assert steps.max() < 0.01 * MTI_300.gyro_instability
    turn_on = [
        draw_imu_errors(MTI_300, DT, np.random.default_rng(s)).bias[0, :3] for s in range(30)
    ]
    assert 0.7 < np.std(turn_on) / MTI_300.gyro_turn_on < 1.3


def test_tables_go_round() -> None:
    """A run longer than the tables finds noise all the same."""
    errors = draw_imu_errors(MTI_300, DT, np.random.default_rng(2))
    far = WHITE_ROWS * 20 + 7
    rest = errors.apply(np.zeros(6), far) - errors.calc_bias(far)
    np.testing.assert_allclose(rest, errors.white[7], atol=1e-12)
