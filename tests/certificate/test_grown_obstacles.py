"""Boxes that are grown by how far they may be elsewhere."""

import numpy as np
from hypothesis import given, settings, strategies as st

from drake_quad.certificate.ground import TiedHeights
from drake_quad.certificate.kinematics import Points
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


@settings(max_examples=200, deadline=None)
@given(
    share=st.floats(0.0, 1.0), lean=st.floats(-0.9, 0.9), up=st.floats(-1.0, 1.0),
    off=st.floats(0.001, 0.03), above=st.floats(0.0, 0.04), rise=st.floats(0.001, 0.02),
    u=st.floats(-1.0, 1.0), r=st.floats(-1.0, 1.0),
)  # fmt: skip
def test_a_box_below_a_foot_takes_no_more_than_the_correction_says(
    share: float, lean: float, up: float, off: float, above: float, rise: float, u: float, r: float
) -> None:
    """Of any foot and box that may be as they are: the foot is not in the box."""
    rise = min(rise, off)
    u, r = u * off, r * rise
    if u + above < r:
        return
    zeros = np.zeros((1, 3, 3))
    spread = np.zeros((1, 3, 3, 9))
    spread[0, 1, 2, -1], spread[0, 0, 2, -1] = off, lean * off  # foot and knee go up with u
    points = Points(centre=zeros, time=zeros, spread=spread, error=zeros, rest=zeros)
    end, normal = np.array([[1.0 - share, share, 0.0]]), np.array([[0.0, 0.0, up]])
    tied = TiedHeights(np.array([above]), np.array([off]), np.array([rise]))
    taken = points.moves(end, normal) + tied.correction(points, end, normal)
    moved = up * ((1.0 - share) * lean + share) * u - up * r  # what the distance becomes more by
    assert moved >= -float(taken[0]) - 1e-12
    free = tied.only(np.array([False])).correction(points, end, normal)
    assert float(free[0]) == 0.0
