"""Robots that differ from a given one in one respect: what changes, and what stays."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import paper_robot

from drake_quad.robot.model import leg_lengths
from drake_quad.robot.variants import (
    FOLDED,
    STRAIGHT,
    with_foot_radius,
    with_longer_legs,
    with_torque,
    with_trunk_mass,
    with_wider_hips,
    with_wider_knees,
)


@given(factor=st.floats(0.5, 2.0))
def test_longer_legs_reach_farther_by_the_factor_and_weigh_the_same(factor: float) -> None:
    """Lengths, and places along the links, are in proportion; masses and what is across stay."""
    robot = paper_robot()
    longer = with_longer_legs(robot, factor)
    np.testing.assert_allclose(leg_lengths(longer), factor * leg_lengths(robot), rtol=1e-12)
    assert longer.mass == robot.mass and (longer.link_mass == robot.link_mass).all()
    for name in ("link_com", "thigh_points"):
        old, new = getattr(robot, name), getattr(longer, name)
        np.testing.assert_array_equal(new[..., :2], old[..., :2])
    np.testing.assert_allclose(longer.link_com[:, 1:, 2], factor * robot.link_com[:, 1:, 2])
    np.testing.assert_array_equal(longer.link_com[:, 0], robot.link_com[:, 0])
    np.testing.assert_allclose(longer.thigh_points[..., 2], factor * robot.thigh_points[..., 2])
    old, new = robot.thigh_stops.paths, longer.thigh_stops.paths
    assert old.size > 0
    np.testing.assert_array_equal(new[..., :2], old[..., :2])
    np.testing.assert_allclose(new[..., 2], factor * old[..., 2])


@given(angle=st.floats(0.0, 3.0))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_wider_knees_bend_to_the_same_side_and_hold_the_old_range(
    sign: float, angle: float
) -> None:
    """A knee never stretches beyond straight nor folds into its thigh by being widened."""
    robot = paper_robot()
    bent = np.sort(sign * np.array([0.3, 2.0]))
    geometry = type(robot.geometry)(**vars(robot.geometry) | {"knee_sign": np.full(4, sign)})
    lower, upper = robot.q_lower.copy(), robot.q_upper.copy()
    lower[2::3], upper[2::3] = bent
    robot = type(robot)(
        **vars(robot) | {"geometry": geometry, "q_lower": lower, "q_upper": upper}
    )  # fmt: skip
    wide = with_wider_knees(robot, angle)
    ends = np.sort(np.abs([wide.q_lower[2::3], wide.q_upper[2::3]]), axis=0)
    assert (np.sign(wide.q_lower[2::3]) == sign).all() and (wide.q_lower < wide.q_upper).all()
    np.testing.assert_allclose(ends[0], max(0.3 - angle, STRAIGHT))
    np.testing.assert_allclose(ends[1], min(2.0 + angle, FOLDED))
    np.testing.assert_array_equal(wide.q_lower[:2], robot.q_lower[:2])


def test_knees_that_pass_beyond_the_bounds_already_stay_as_they_are() -> None:
    """What a file allows is never taken away."""
    robot = paper_robot()
    lower, upper = robot.q_lower.copy(), robot.q_upper.copy()
    lower[2::3], upper[2::3] = -3.0, 0.4
    robot = type(robot)(**vars(robot) | {"q_lower": lower, "q_upper": upper})
    wide = with_wider_knees(robot, 0.5)
    np.testing.assert_array_equal([wide.q_lower, wide.q_upper], [lower, upper])


def test_hips_torques_and_masses_change_alone() -> None:
    """Each leaves all else as it is; masses add up."""
    robot = paper_robot()
    wide = with_wider_hips(robot, 0.2)
    np.testing.assert_allclose(wide.q_lower - robot.q_lower, np.tile([0.0, -0.2, 0.0], 4))
    np.testing.assert_allclose(wide.q_upper - robot.q_upper, np.tile([0.0, 0.2, 0.0], 4))
    np.testing.assert_allclose(with_torque(robot, 1.5).effort, 1.5 * robot.effort)
    light = with_trunk_mass(robot, 0.5 * robot.trunk_mass)
    assert light.mass == pytest.approx(light.trunk_mass + light.link_mass.sum())


@given(radius=st.floats(0.0, 0.06))
def test_other_feet_leave_the_legs_as_long_as_they_are(radius: float) -> None:
    """The lowest point of a straight leg stays where it is, whatever the radius."""
    robot = paper_robot()
    other = with_foot_radius(robot, radius)
    assert other.foot_radius == radius
    np.testing.assert_allclose(
        other.geometry.reach + radius, robot.geometry.reach + robot.foot_radius, rtol=1e-12
    )
    old, new = robot.shank_profile, other.shank_profile
    assert old is not None and new is not None  # the shank's shapes stay where they are
    np.testing.assert_allclose(
        new.along * other.geometry.shank[0], old.along * robot.geometry.shank[0], rtol=1e-12
    )
    np.testing.assert_array_equal(new.radii, old.radii)
    same = with_foot_radius(robot, robot.foot_radius)
    np.testing.assert_allclose(same.shank_radii, robot.shank_radii)
