"""The ground under the feet, for the control loop: the map's normals, and axes for forces."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import course_of, flat_course, model_layout, paper_robot, state_of

from drake_quad.common import FloatArray
from drake_quad.control.inverse_dynamics import contact_axes
from drake_quad.control.measurement import UPRIGHT, ground_table, measure, normal_at, normal_under
from drake_quad.math.rotations import yaw_pitch_rotation
from drake_quad.robot.kinematics import leg_array
from drake_quad.terrain.course import Course, ground_normals
from drake_quad.terrain.elements import Element

seeds = st.integers(0, 2**32 - 1)


def ramp() -> Course:
    """Up a slope of 0.4, round a corner, and down one of 0.3."""
    return course_of(
        Element("floor", length=3.0),
        Element("slope", going="up", height=0.8, length=2.0),
        Element("landing", length=2.5, turn_deg=60.0),
        Element("slope", going="down", height=0.45, length=1.5),
        Element("floor", length=2.0),
    )


@given(seeds)
def test_normals_are_the_maps(seed: int) -> None:
    """One place at a time, compiled, they are those of `ground_normals`; beside it, too."""
    course, rng = ramp(), np.random.default_rng(seed)
    low, high = course.bounds()[:, :2]
    places = rng.uniform(low - 0.3, high + 0.3, (50, 2))
    found = np.array([normal_at(ground_table(course), *place) for place in places.tolist()])
    np.testing.assert_allclose(found, ground_normals(course, places), atol=1e-12)


def test_level_ground_has_no_table() -> None:
    """Nothing is searched where nothing is tilted, and up is up to the bit."""
    assert len(ground_table(flat_course())) == len(ground_table(None)) == 0
    assert normal_at(ground_table(None), 0.3, 0.2) == (0.0, 0.0, 1.0)


@given(st.lists(st.tuples(st.floats(-0.7, 0.7), st.floats(-0.7, 0.7)), min_size=4, max_size=4))
def test_axes_are_right_angled_and_lead_down_the_slope(
    gradients: list[tuple[float, float]],
) -> None:
    """Right-handed; the third is the normal, the second level; W's own on level ground."""
    normals = np.array([[-a, -b, 1.0] for a, b in gradients])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    for axes, normal in zip(contact_axes(normals), normals, strict=True):
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-9)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        np.testing.assert_allclose(axes[:, 2], normal, atol=1e-7)
        assert axes[2, 1] == 0.0 and (axes[2, 0] < 0.0) == (axes[2, 2] < 1.0)
    np.testing.assert_array_equal(
        contact_axes(np.tile([0.0, 0.0, 1.0], (4, 1))), np.tile(np.eye(3), (4, 1, 1))
    )


def feet_on(course: Course | None, step: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Contact Jacobians, normals, and the foot's centres, with joints turned by `step` (4, 3)."""
    robot, layout = paper_robot(), model_layout()
    feet = np.array([[4.4, 0.25, 0.55], [4.4, -0.25, 0.55], [3.4, 0.25, 0.15], [3.4, -0.25, 0.15]])
    state = state_of(np.array([3.9, 0.0, 1.15, 0.1, 0.05]), feet)
    state[layout.q_joints] += step.ravel()
    found = measure(
        layout, leg_array(robot.geometry), robot.foot_radius, state, state, ground_table(course)
    ).feet
    return found.contact_jacobian, found.normal, found.place


def test_ground_pushes_where_the_sphere_touches_it() -> None:
    """The point a radius off the centre against the normal moves by the Jacobian's columns.

    It is fixed to the shank, so it moves by J_contact - J_centre = ω × (-r n) more than the centre;
    as the centre's own part is the same on level ground, the two differ by ω × r (z - n).
    """
    still, radius = np.zeros((4, 3)), paper_robot().foot_radius
    J, normal, _ = feet_on(ramp(), still)
    level, upright, _ = feet_on(None, still)
    np.testing.assert_allclose(normal[:, 2], 1.0 / np.hypot(1.0, 0.4))
    np.testing.assert_array_equal(upright, np.tile([0.0, 0.0, 1.0], (4, 1)))
    for k in range(4):
        off = radius * (upright[k] - normal[k])
        for j in range(3):
            more = J[k, :, j] - level[k, :, j]
            # ω × off for some unit ω: at right angles to it, and no longer.
            assert abs(more @ off) < 1e-12
            assert np.linalg.norm(more) <= np.linalg.norm(off) + 1e-12
    assert np.abs(J - level).max() > 1e-4


@given(seeds)
def test_what_a_foot_feels_goes_before_the_map(seed: int) -> None:
    """A felt normal is turned into W; the map's serves where nothing, or no ground, is felt."""
    rng, table = np.random.default_rng(seed), ground_table(ramp())
    R = np.array(yaw_pitch_rotation(*rng.uniform(-0.4, 0.4, 2)))
    x, y = rng.uniform([2.0, -0.5], [5.0, 0.5])
    tilted = np.array([*rng.uniform(-1.0, 1.0, 2), 1.0])
    tilted /= np.linalg.norm(tilted)
    by_map = normal_at(table, x, y)
    felt = normal_under(R.T @ tilted, R, table, x, y)
    np.testing.assert_allclose(felt, tilted if tilted[2] > UPRIGHT else by_map, atol=1e-12)
    assert normal_under(np.zeros(3), R, table, x, y) == by_map
