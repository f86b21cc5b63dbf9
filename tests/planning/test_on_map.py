"""Feet on ground that is not as high as mapped are planned with as if it were."""

import numpy as np
from hypothesis import given, strategies as st
from rig import stairs_course

from drake_quad.planning.replan import NEGLIGIBLE, project_to_map

RADIUS = 0.008
XY = np.array([[4.75, 0.3], [4.25, -0.3], [3.5, 0.3], [3.2, -0.3]])  # on treads and on the floor


@given(st.floats(-0.2, 0.2), st.lists(st.floats(-0.002, 0.002), min_size=4, max_size=4))
def test_feet_that_are_all_as_much_off_stand_on_the_map(higher: float, off: list[float]) -> None:
    """Whatever is left is what they are off from each other; places are as they were."""
    course = stairs_course()
    ground = course.height(XY[:, 0], XY[:, 1]) + RADIUS
    feet = np.column_stack([XY, ground + higher + np.array(off)])
    found = project_to_map(course, feet, RADIUS)
    np.testing.assert_array_equal(found[:, :2], XY)
    np.testing.assert_allclose(np.diff(found[:, 2]), np.diff(feet[:, 2]), atol=1e-12)
    assert np.abs(found[:, 2] - ground).max() <= max(NEGLIGIBLE + 0.002, 0.004) + 1e-9


def test_a_foot_beyond_an_edge_that_is_not_there_does_not_count() -> None:
    """One on the tread before the one that the map has there: the other three say."""
    course = stairs_course()
    feet = np.column_stack([XY, course.height(XY[:, 0], XY[:, 1]) + RADIUS + 0.05])
    feet[0, 2] -= 0.13
    np.testing.assert_allclose(
        project_to_map(course, feet, RADIUS)[1:, 2] + 0.05, feet[1:, 2], atol=1e-9
    )


def test_feet_on_the_map_are_left_alone() -> None:
    """To the bit, so that a run on the mapped course is the run that was planned."""
    course = stairs_course()
    feet = np.column_stack([XY, course.height(XY[:, 0], XY[:, 1]) + RADIUS - 0.001])
    assert project_to_map(course, feet, RADIUS) is feet
