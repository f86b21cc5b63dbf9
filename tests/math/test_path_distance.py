"""Distances of paths from boxes and cylinders: the places that are left out change nothing."""

import numpy as np
from hypothesis import given, strategies as st

from drake_quad.math.distance import (
    PLACES,
    box_distance_of_path,
    points_to_boxes,
    rod_distance_of_path,
)

SEEDS = st.integers(0, 2**32 - 1)


def _path(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A path whose lines are of very different lengths, some of them none, and these lengths."""
    steps = rng.normal(size=(9, 3)) * rng.choice([0.0, 0.01, 0.1, 0.4], (9, 1))
    path = rng.uniform(-0.5, 0.5, 3) + np.cumsum(steps, axis=0)
    return path, np.linalg.norm(np.diff(path, axis=0), axis=-1)


@given(SEEDS)
def test_a_path_is_as_far_from_a_cylinder_as_its_nearest_place(seed: int) -> None:
    """Of every line's places, all of them looked at; or the bound, if none is as near as that."""
    rng = np.random.default_rng(seed)
    path, lengths = _path(rng)
    ends, radius = rng.uniform(-0.4, 0.4, (2, 3)), rng.uniform(0.02, 0.2)
    middle, along = ends.mean(axis=0), ends[1] - ends[0]
    half = 0.5 * np.linalg.norm(along)
    axis, bound = along / (2.0 * half), rng.uniform(-0.1, 0.4)
    shares = np.linspace(0.0, 1.0, PLACES)[:, None]
    p = (path[:-1, None] + shares * np.diff(path, axis=0)[:, None]).reshape(-1, 3) - middle
    beside = np.linalg.norm(np.cross(p, axis), axis=-1) - radius
    beyond = np.abs(p @ axis) - half
    outside = np.hypot(np.maximum(beyond, 0.0), np.maximum(beside, 0.0))
    expected = (outside + np.minimum(np.maximum(beyond, beside), 0.0)).min()
    rod = np.array([*middle, *axis, half, radius])
    found = rod_distance_of_path(path, lengths, rod, bound)
    np.testing.assert_allclose(found, min(expected, bound), atol=1e-9)


def test_no_line_is_left_out_that_comes_near_at_its_end() -> None:
    """A path towards a box and a cylinder: what is skipped is nowhere nearer than the bound."""
    for share in np.linspace(0.0, 1.0, 11):
        path = np.array([[x, 0.0, 0.0] for x in (0.0, 0.1 + 0.8 * share, 1.0, 2.0)])
        lengths = np.diff(path[:, 0])
        lower, upper = np.array([2.1, -1.0, -1.0]), np.array([3.0, 1.0, 1.0])
        for bound in (0.05, 0.15, 0.95, 1.05, 1.5):
            found = box_distance_of_path(path, lengths, lower, upper, bound)
            np.testing.assert_allclose(found, min(bound, 0.1), atol=1e-9)
            rod = np.array([2.3, 0.0, 0.0, 0.0, 0.0, 1.0, 0.5, 0.2])
            found = rod_distance_of_path(path, lengths, rod, bound)
            np.testing.assert_allclose(found, min(bound, 0.1), atol=1e-9)


@given(SEEDS)
def test_a_path_is_as_far_from_a_box_as_its_nearest_line(seed: int) -> None:
    """Of all of its lines, looked at one by one; or the bound, if none is as near as that."""
    rng = np.random.default_rng(seed)
    path, lengths = _path(rng)
    corners = np.sort(rng.uniform(-0.4, 0.4, (2, 3)), axis=0)
    bound = rng.uniform(-0.1, 0.4)
    expected = points_to_boxes(path[None], corners[None], 10.0).min()
    found = box_distance_of_path(path, lengths, corners[0], corners[1], bound)
    # Golden sections end within a hundredth of a line.
    np.testing.assert_allclose(found, min(expected, bound), atol=2e-3)
