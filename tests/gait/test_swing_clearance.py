"""Nosings and the paper's choice of the riser."""

import numpy as np
import pytest

from drake_quad.gait.swing_clearance import find_apex, nosings, riser_for_swing

UP = ([0.0, 0.25, 0.25, 0.75, 0.75, 1.0], [0.0, 0.0, 0.13, 0.13, 0.26, 0.26])
DOWN = (UP[0], UP[1][::-1])


def test_nosings_are_the_convex_corners_under_the_swing() -> None:
    """The upper end of each riser, up or down; not the ends of the profile, nor its feet."""
    assert nosings(UP, 1.0).tolist() == [[0.25, 0.13], [0.75, 0.26]]
    assert nosings(DOWN, 1.0).tolist() == [[0.25, 0.26], [0.75, 0.13]]
    assert nosings(UP, 0.75).tolist() == [[0.25, 0.13]]
    assert nosings(([0.0, 1.0], [0.0, 0.0]), 1.0).tolist() == []


def test_repeated_and_collinear_points_are_no_nosings() -> None:
    """How finely a tread or a riser is divided does not matter."""
    d = [0.0, 0.1, 0.25, 0.25, 0.25, 0.25, 0.5, 0.5, 1.0]
    z = [0.0, 0.0, 0.0, 0.0, 0.07, 0.13, 0.13, 0.13, 0.13]
    assert nosings((d, z), 1.0).tolist() == [[0.25, 0.13]]


def test_risers_are_the_papers() -> None:
    """The last riser when climbing, the first when descending; none on the flat."""
    assert riser_for_swing(UP, 1.0) == (0.75, 0.26)
    assert riser_for_swing(DOWN, 1.0) == (0.25, 0.26)
    assert riser_for_swing(([0.0, 1.0], [0.0, 0.0]), 1.0) is None


def test_between_ends_of_equal_height_the_highest_nosing_is_chosen() -> None:
    """Over a kerb the foot peaks at its higher edge; over a level one at the edge nearer by."""
    d = [0.0, 0.2, 0.2, 0.5, 0.5, 0.9, 0.9, 1.0]
    assert riser_for_swing((d, [0.0, 0.0, 0.1, 0.1, 0.15, 0.15, 0.0, 0.0]), 1.0) == (0.5, 0.15)
    d = [0.0, 0.2, 0.2, 0.7, 0.7, 1.0]
    assert riser_for_swing((d, [0.0, 0.0, 0.1, 0.1, 0.0, 0.0]), 1.0) == (0.7, 0.1)


def test_apex_rises_with_the_clearance() -> None:
    """More clearance never takes a lower swing."""
    heights = [
        find_apex(
            length=1.0, z_ends=(0.02, 0.28), profile=UP,
            clearance=clearance, foot_radius=0.02, lift=0.02,
        ).z
        for clearance in np.linspace(0.03, 0.12, 10)
    ]  # fmt: skip
    assert (np.diff(heights) >= -5e-3).all()
    assert heights[-1] > heights[0] + 0.05


def test_a_ramp_is_cleared_too() -> None:
    """On a slope the centre's height above the ground never falls below the foot's radius."""
    profile = ([0.0, 0.3, 0.7, 1.0], [0.0, 0.0, 0.3, 0.3])
    apex = find_apex(
        length=1.0, z_ends=(0.02, 0.32), profile=profile, clearance=0.04, foot_radius=0.02, lift=0.0
    )
    assert apex.shortfall == 0.0
    assert apex.z == pytest.approx(0.34, abs=0.02)
