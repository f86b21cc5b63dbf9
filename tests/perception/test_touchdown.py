"""A foot's height in a belief: laws of the update, and when there is none."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_tracker import felt
from drake_quad.perception.touchdown import FootContact, refine_by_touchdown, tread_under

N = 3
SHARED = 0.004  # [m] by which all heights err alike


def belief() -> StairBelief:
    heights, places = np.array([0.15 * i for i in range(N + 1)]), np.array([0.8, 1.1, 1.4])
    # Every height errs by what all share and by 2 mm of its own; rise is their mean difference.
    M = np.zeros((2 * N + 5, 2 * N + 5))
    M[:N, :N] = 0.008**2 * np.eye(N)
    M[N : 2 * N + 1, N : 2 * N + 1] = SHARED**2 + 0.002**2 * np.eye(N + 1)
    to = np.eye(2 * N + 5)
    to[2 * N + 3] = 0.0
    to[2 * N + 3, 2 * N], to[2 * N + 3, N] = 1.0 / N, -1.0 / N
    M[2 * N + 1, 2 * N + 1] = M[2 * N + 2, 2 * N + 2] = M[2 * N + 4, 2 * N + 4] = 1e-4
    return StairBelief(
        stamp=0.0, origin=np.zeros(2), passed=0, places=places, heights=heights,
        yaw=0.1, overhang=0.01, rise=0.15, run=0.3, covariance=to @ M @ to.T, count_least=N,
        count_most=None, is_open=False, right=-0.5, left=0.5,
    )  # fmt: skip


def test_feet_on_treads_refine_and_feet_before_them_do_not() -> None:
    """Of feet in W, one on the first tread counts; one on the floor, and one far off, do not."""
    before = belief()
    ahead = np.array([np.cos(before.yaw), np.sin(before.yaw), 0.0])
    on_tread = 0.95 * ahead + np.array([0.0, 0.0, 0.153])
    others = np.array([0.3 * ahead + [0.0, 0.0, 0.01], 0.95 * ahead + [0.0, 0.0, 0.30]])
    assert np.array_equal(felt(before, others).heights, before.heights)
    assert felt(before, None) is before
    after = felt(before, np.array([on_tread]))
    assert 0.15 < after.heights[1] < 0.153 and after.height_sigmas[1] < before.height_sigmas[1]


def foot(along: float, height: float, sigma: float = 0.001) -> FootContact:
    return FootContact(along=along, height=height, place_sigma=0.005, height_sigma=sigma)


@given(st.floats(-0.02, 0.02), st.floats(0.0005, 0.02))
def test_a_foot_makes_no_height_less_certain(off: float, sigma: float) -> None:
    """No deviation grows; that of its own tread becomes less than the foot's; rise stays a mean."""
    before = belief()
    refined = refine_by_touchdown(before, foot(0.95, 0.15 + off, sigma))
    assert refined is not None
    after, _ = refined
    assert np.all(np.diag(after.covariance) <= np.diag(before.covariance) + 1e-15)
    assert after.height_sigmas[1] < sigma
    assert np.linalg.eigvalsh(after.covariance).min() > -1e-12
    assert after.rise == pytest.approx((after.heights[N] - after.heights[0]) / N, abs=1e-9)


def test_what_all_treads_share_moves_with_the_one_that_is_felt() -> None:
    """A tread found 5 mm higher lifts the others too, but not places, which know nothing of it."""
    refined = refine_by_touchdown(belief(), foot(0.95, 0.155))
    assert refined is not None
    after, off = refined
    lifted = after.heights - belief().heights
    assert lifted[1] == pytest.approx(0.005, abs=0.0005) and np.all(lifted > 0.003)
    assert np.allclose(after.places, belief().places)
    assert off == pytest.approx(0.005 / np.hypot(np.hypot(SHARED, 0.002), 0.001))


@pytest.mark.parametrize(
    ("along", "tread"), [(0.3, 0), (0.95, 1), (1.25, 2), (1.55, 3), (0.81, None), (1.9, None)]
)
def test_a_foot_near_a_nosing_or_beyond_the_last_tread_tells_nothing(
    along: float, tread: int | None
) -> None:
    """Which tread it stands on has to be certain."""
    assert tread_under(belief(), foot(along, 0.0)) == tread
    assert (refine_by_touchdown(belief(), foot(along, 0.0)) is None) == (tread is None)
