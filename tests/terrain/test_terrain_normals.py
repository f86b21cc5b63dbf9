"""Which way the ground faces."""

import numpy as np
from hypothesis import given, settings, strategies as st
from rig import course_of, stairs_course

from drake_quad.terrain.course import Course, ground_normals
from drake_quad.terrain.elements import Element


def sloped() -> Course:
    """A slope of 0.3 in the second lane, which heads to the left."""
    return course_of(
        Element("floor", length=2.0),
        Element("landing", length=2.5, turn_deg=90.0),
        Element("floor", length=1.0),
        Element("slope", going="up", length=2.0, height=0.6),
        Element("floor", length=1.0),
    )


@settings(max_examples=60)
@given(st.floats(2.0, 4.4), st.floats(-1.0, 5.0))
def test_normals_are_across_the_ground(x: float, y: float) -> None:
    """Where the ground is whole around a place, its normal is across every way along it."""
    course, near = sloped(), 1e-4
    assert abs(ground_normals(course, np.array([3.25, 3.0]))[1] + 0.3 / np.hypot(1.0, 0.3)) < 1e-9
    here = course.height(x, y)
    steps = near * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    rises = course.height(x + steps[:, 0], y + steps[:, 1]) - here
    normal = ground_normals(course, np.array([x, y]))
    assert abs(np.linalg.norm(normal) - 1.0) < 1e-12
    if np.all(np.abs(rises[::2] + rises[1::2]) < 1e-9):
        across = np.column_stack([steps, rises]) @ normal
        np.testing.assert_allclose(across, 0.0, atol=1e-9)


def test_treads_are_level_and_so_is_nothing_at_all() -> None:
    """On stairs, and off the course, normals point straight up."""
    places = np.random.default_rng(0).uniform([-5, -5], [12, 5], (200, 2)).reshape(20, 10, 2)
    normals = ground_normals(stairs_course(), places)
    assert normals.shape == (20, 10, 3)
    assert np.all(normals == [0.0, 0.0, 1.0])
