"""The feet of a state are Drake's: places, velocities, Jacobians, accelerations of no change."""

import numpy as np
from feet_rig import any_state, case_of, drakes_drift, drakes_jacobian
from hypothesis import given, settings, strategies as st
from rig import feet_of, model_layout, paper_robot

from drake_quad.common import FloatArray
from drake_quad.control.kernel_state import FEET, MEASURED, fields_of, new_record
from drake_quad.control.measurement import ground_table, measure, measure_feet
from drake_quad.robot.kinematics import leg_array, leg_constants, leg_row

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=60)


def joint_columns(row: int) -> FloatArray:
    layout = model_layout()
    return np.asarray(layout.v_joints[3 * row : 3 * row + 3] - layout.num_positions)


@examples
@given(seeds)
def test_places_are_drakes(seed: int) -> None:
    """Wherever the base is and however it is turned."""
    case = case_of(seed)
    np.testing.assert_allclose(case.feet.place, feet_of(case.state), atol=1e-12)


@examples
@given(seeds)
def test_velocities_are_drakes(seed: int) -> None:
    """Base and joints both move."""
    case = case_of(seed)
    v = case.state[model_layout().num_positions :]
    for row in range(4):
        expected = drakes_jacobian(case.context, row) @ v
        np.testing.assert_allclose(case.feet.velocity[row], expected, atol=1e-11)


@examples
@given(seeds)
def test_jacobians_are_drakes(seed: int) -> None:
    """Those of the centres, and those of the material points on which the ground pushes."""
    case, radius = case_of(seed), paper_robot().foot_radius
    for row in range(4):
        columns = joint_columns(row)
        centre = drakes_jacobian(case.context, row)[:, columns]
        np.testing.assert_allclose(case.feet.jacobian[row], centre, atol=1e-12)
        under = drakes_jacobian(case.context, row, under=radius)[:, columns]
        np.testing.assert_allclose(case.feet.contact_jacobian[row], under, atol=1e-12)
        assert np.abs(under - centre).max() > 1e-4


@examples
@given(seeds)
def test_drift_is_drakes_bias_acceleration(seed: int) -> None:
    """The acceleration of the centres that velocities alone make, centrifugal and Coriolis."""
    case = case_of(seed)
    for row in range(4):
        expected = drakes_drift(case.context, row)
        np.testing.assert_allclose(case.feet.drift[row], expected, atol=1e-7)


@examples
@given(seeds, st.floats(0.2, 5.0))
def test_drift_grows_with_the_square_of_the_speed(seed: int, times: float) -> None:
    """Twice as fast, four times the drift; at rest none."""
    case, layout, robot = case_of(seed), model_layout(), paper_robot()
    legs = leg_array(robot.geometry)

    def drift(factor: float) -> FloatArray:
        state = case.state.copy()
        state[layout.num_positions :] *= factor
        return measure(layout, legs, robot.foot_radius, state, state).feet.drift

    np.testing.assert_allclose(drift(times), times**2 * case.feet.drift, atol=1e-6, rtol=1e-6)
    np.testing.assert_array_equal(drift(0.0), np.zeros((4, 3)))


def test_compiled_and_plain_are_the_same() -> None:
    """What runs compiled is the Python that is read: both give the same feet."""
    robot, layout = paper_robot(), model_layout()
    legs = leg_array(robot.geometry)
    for seed in range(5):
        state = any_state(seed)
        compiled = measure(layout, legs, robot.foot_radius, state, state)
        one = fields_of(new_record(MEASURED))
        for name in ("p", "R", "w", "v", "q", "qd"):
            getattr(one, name)[...] = getattr(compiled, name)
        plain = measure_feet.py_func  # type: ignore[attr-defined]
        plain(one, legs, robot.foot_radius, ground_table(None), np.zeros(12))
        for name in FEET.names or ():
            np.testing.assert_allclose(compiled.feet[name], one.feet[name], atol=1e-9)
            assert np.any(one.feet[name])


def test_leg_rows_are_the_legs_constants() -> None:
    """The array that kernels take holds each leg's lengths in the order of LegConstants."""
    geometry = paper_robot().geometry
    legs = leg_array(geometry)
    for k, constants in enumerate(leg_constants(geometry)):
        assert tuple(leg_row(legs, k)) == tuple(constants)


@examples
@given(seeds, st.integers(0, 36), st.sampled_from([np.nan, np.inf, -np.inf]))
def test_a_state_without_numbers_is_not_known(seed: int, place: int, wrong: float) -> None:
    """One entry that is none, and the last state known serves; it says so."""
    robot, layout = paper_robot(), model_layout()
    legs, last, lost = leg_array(robot.geometry), any_state(seed), any_state(seed + 1)
    lost[place] = wrong
    found = measure(layout, legs, robot.foot_radius, lost, last)
    np.testing.assert_array_equal(found.state, last)
    assert not found.known and np.all(np.isfinite(found.feet.place))
    again = measure(layout, legs, robot.foot_radius, last, lost)
    assert again.known
    np.testing.assert_array_equal(again.feet.place, found.feet.place)
