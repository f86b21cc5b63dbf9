"""Boxes that are grown by how far they may be elsewhere."""

import numpy as np
from hypothesis import given, settings, strategies as st

from drake_quad.certificate.obstacles import Obstacles, find_box_obstacles
from drake_quad.common import FloatArray
from drake_quad.terrain.boxes import Box


@settings(max_examples=100, deadline=None)
@given(
    yaw=st.floats(-3.0, 3.0), pitch=st.sampled_from([0.0, 0.0, 0.2]), run=st.floats(0.0, 0.05),
    rise=st.floats(0.0, 0.05), angle=st.floats(-3.2, 3.2), share=st.floats(0.0, 1.0),
    up=st.floats(-1.0, 1.0), seed=st.integers(0, 1000),
)  # fmt: skip
def test_a_grown_box_is_nowhere_farther_than_one_that_is_elsewhere(
    yaw: float, pitch: float, run: float, rise: float, angle: float, share: float, up: float,
    seed: int,
) -> None:  # fmt: skip
    """Of any point, for any move along the ground by at most `run`, and by `rise` up or down."""
    size, centre = np.array([0.6, 1.0, 0.4]), np.array([0.3, -0.2, 0.5])

    def obstacles(at: FloatArray) -> Obstacles:
        return find_box_obstacles([Box("step", at, size, yaw, 0, pitch)])

    move = np.array([share * run * np.cos(angle), share * run * np.sin(angle), up * rise])
    points = np.random.default_rng(seed).uniform(-1.0, 1.5, (40, 3))
    which = np.zeros(len(points), dtype=int)
    planned, moved = obstacles(centre), obstacles(centre + move)
    grown, _ = planned.off_by(run, rise).distance(points, which)
    true, _ = moved.distance(points, which)
    assert np.all(grown <= true + 1e-9)
