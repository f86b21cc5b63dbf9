"""Heights of treads as feet find them: laws of the update, its intervals, when there is none."""

from dataclasses import replace

import numpy as np
import pytest
from growing_rig import FIRST, RISE, RUN, first_map
from hypothesis import given, strategies as st

from drake_quad.common import FloatArray
from drake_quad.perception.growing_map import FEET_APART
from drake_quad.perception.stair_belief import NORMAL_95
from drake_quad.perception.stair_map import StairMap
from drake_quad.perception.touchdown_heights import (
    FOOT_SIGMA,
    TouchdownHeights,
    add_touchdown,
    heights_as_seen,
    heights_on_grown_map,
    map_with_touchdowns,
    treads_under,
)

STEPS = 5
WALK = (  # treads under two feet that stand, then under the one that lands
    (0, 0, 1), (0, 1, 2), (1, 2, 1), (1, 2, 3), (2, 3, 2), (2, 3, 4), (3, 4, 3), (3, 4, 5),
    (4, 5, 4), (4, 5, 5),
)  # fmt: skip


def middle(tread: int) -> float:
    """Where a foot stands on a tread, along the lane, 0 being the floor [m]."""
    return FIRST + (tread - 0.5) * RUN


def points(treads: tuple[int, ...], heights: FloatArray) -> FloatArray:
    """Feet in the middles of treads, at the heights of floor and treads [m]."""
    return np.array([[middle(k), 0.3 * (-1.0) ** i, heights[k]] for i, k in enumerate(treads)])


def seen_alike(alike: float) -> StairMap:
    """The map of a flight whose heights err together: that much is the correlation of any two."""
    known = first_map(STEPS)
    return replace(known, height_correlation=alike + (1.0 - alike) * np.eye(STEPS))


def walked(
    known: StairMap, heights: FloatArray, *, tilt_sigma: float = 0.0, tilt: float = 0.0,
    noise: np.random.Generator | None = None,
) -> TouchdownHeights:  # fmt: skip
    """What feet tell that walk up a flight.

    Args:
        known: The map.
        heights: True heights of floor and treads [m].
        tilt_sigma: What the filter says of its tilt [rad].
        tilt: Its error [rad].
        noise: Of the feet's heights, and of the base's.
    """
    found = heights_as_seen(known, tilt_sigma=tilt_sigma)
    for treads in WALK:
        feet = points(treads, heights)
        feet[:, 2] += tilt * feet[:, 0]
        if noise is not None:
            feet[:, 2] += noise.normal(0.0, FOOT_SIGMA, 3) + noise.normal(0.0, 0.05)
        found = add_touchdown(found, known, feet, 2)
    return found


def true_heights(errors: FloatArray | float) -> FloatArray:
    """Heights of floor and treads of which the treads are so much higher than the map has them."""
    return np.append(0.0, RISE * np.arange(1.0, STEPS + 1.0) + errors)


def test_feet_find_how_high_the_treads_are() -> None:
    """Treads that differ from the map by up to 8 mm are known to within a millimetre or two."""
    errors = np.array([0.008, -0.005, 0.006, -0.008, 0.007])
    known = first_map(STEPS)
    known = replace(known, height_errors=np.full(STEPS, 0.016))
    found = map_with_touchdowns(known, walked(known, true_heights(errors)))
    assert np.abs(found.heights - true_heights(errors)[1:]).max() < 0.0015
    assert found.height_errors.max() < 0.005 and found.error_height == found.height_errors.max()
    assert found.touched_treads.all() and not known.touched_treads.any()


@given(st.floats(-0.5, 0.5), st.lists(st.floats(-0.01, 0.01), min_size=STEPS, max_size=STEPS))
def test_how_high_the_base_is_believed_to_be_does_not_matter(up: float, off: list[float]) -> None:
    """Feet that all stand higher by the same tell the same."""
    known, heights = first_map(STEPS), true_heights(np.array(off))
    one, other = (heights_as_seen(known, tilt_sigma=0.002) for _ in range(2))
    for treads in WALK:
        feet = points(treads, heights)
        one = add_touchdown(one, known, feet, 2)
        other = add_touchdown(other, known, feet + np.array([0.0, 0.0, up]), 2)
    np.testing.assert_allclose(one.state, other.state, atol=1e-9)
    np.testing.assert_array_equal(one.covariance, other.covariance)


@given(st.floats(-0.02, 0.02), st.floats(0.0, 0.01), st.sampled_from(WALK))
def test_a_touchdown_makes_no_height_less_certain(
    off: float, tilt_sigma: float, treads: tuple[int, int, int]
) -> None:
    """No deviation grows, the covariance stays one, and a foot's own tread is known better."""
    known = first_map(STEPS)
    before = heights_as_seen(known, tilt_sigma=tilt_sigma)
    after = add_touchdown(before, known, points(treads, true_heights(off)), 2)
    then, now = np.diag(before.covariance), np.diag(after.covariance)
    assert np.all(now <= then + 1e-15) and now[treads[2] - 1] < then[treads[2] - 1]
    assert np.linalg.eigvalsh(after.covariance).min() > -1e-15
    assert after.touchdowns.sum() == 1 and after.touchdowns[treads[2] - 1] == 1


@pytest.mark.parametrize("alike", [0.0, 0.95])
@pytest.mark.parametrize("tilt_sigma", [0.0, 0.003])
def test_intervals_hold_as_often_as_they_say(tilt_sigma: float, alike: float) -> None:
    """Of 600 walks with errors as they are told, 93 to 97 % of the heights are inside, at 95 %."""
    random = np.random.default_rng(7)
    known, inside = seen_alike(alike), []
    sigmas = known.height_errors / NORMAL_95
    for _ in range(600):
        errors = random.multivariate_normal(np.zeros(STEPS), known.height_correlation)
        heights = true_heights(sigmas * errors)
        told = walked(
            known, heights, tilt_sigma=tilt_sigma, tilt=random.normal(0.0, tilt_sigma), noise=random
        )
        found = map_with_touchdowns(known, told)
        inside.append(np.abs(found.heights - heights[1:]) <= found.height_errors)
    assert 0.93 <= np.mean(inside) <= 0.97


def test_a_tilt_that_nobody_told_of_would_be_taken_for_height() -> None:
    """With the tilt's deviation told, the last tread's interval is wider, and has the truth."""
    known, heights, tilt = first_map(STEPS), true_heights(0.0), 0.004
    known = replace(known, height_errors=np.full(STEPS, 0.03))
    told, not_told = (
        map_with_touchdowns(known, walked(known, heights, tilt_sigma=s, tilt=tilt))
        for s in (tilt, 0.0)
    )
    off = [abs(found.heights[-1] - heights[-1]) for found in (told, not_told)]
    assert off[1] > not_told.height_errors[-1] and off[0] < told.height_errors[-1]


@pytest.mark.parametrize(
    ("along", "tread"), [(middle(2), 2), (FIRST + 0.002, -1), (middle(STEPS) + RUN, -1)]
)
def test_a_foot_that_may_be_on_either_side_of_a_nosing_tells_nothing(
    along: float, tread: int
) -> None:
    """Nor one behind the last nosing of a flight whose end is not known."""
    known = first_map(STEPS)
    feet = points((0, 1, 2), true_heights(0.0))
    feet[2, 0] = along
    assert treads_under(known, feet).tolist() == [0, 1, tread]
    before = heights_as_seen(known, tilt_sigma=0.0)
    assert (add_touchdown(before, known, feet, 2) is before) is (tread < 0)
    assert add_touchdown(before, known, feet[2:], 0) is before  # there is none to compare with


def test_a_tread_far_off_contradicts_the_map() -> None:
    """One that is 50 mm lower does; one that is 30 mm lower makes the map better."""
    known = first_map(STEPS)
    for off, contradicts in ((-0.03, False), (-0.05, True)):
        heights = true_heights(np.array([0.0, 0.0, off, 0.0, 0.0]))
        assert abs(off) < FEET_APART or contradicts
        assert walked(known, heights).contradicts is contradicts


def test_only_treads_that_feet_stood_on_are_told_anew() -> None:
    """Where heights err apart, others are as they were seen; the course has the new rises."""
    known = first_map(STEPS)
    told = heights_as_seen(known, tilt_sigma=0.0)
    told = add_touchdown(told, known, points((0, 0, 1), true_heights(0.004)), 2)
    found = map_with_touchdowns(known, told)
    assert found.touched_treads.tolist() == [True, *[False] * (STEPS - 1)]
    np.testing.assert_array_equal(found.heights[1:], known.heights[1:])
    np.testing.assert_allclose(found.height_errors[1:], known.height_errors[1:], rtol=1e-12)
    assert known.heights[0] < found.heights[0] < known.heights[0] + 0.004
    before, after = (m.course(foot_radius=0.02) for m in (known, found))
    np.testing.assert_allclose(before.nosings()[..., :2], after.nosings()[..., :2], atol=1e-12)
    np.testing.assert_allclose(after.nosings()[:, 0, 2], found.heights, atol=1e-12)


def test_where_heights_err_together_a_foot_tells_of_the_treads_ahead() -> None:
    """All of a flight that was seen 4 mm too low rises with its first tread."""
    known = seen_alike(0.95)
    told = heights_as_seen(known, tilt_sigma=0.0)
    for _ in range(4):
        told = add_touchdown(told, known, points((0, 0, 1), true_heights(0.004)), 2)
    found = map_with_touchdowns(known, told)
    assert np.all(found.heights - known.heights > 0.002)
    assert np.all(found.height_errors < known.height_errors)
    assert found.touched_treads.sum() == 1
    np.testing.assert_allclose(np.diag(found.height_correlation), 1.0)


def test_what_was_felt_is_kept_where_the_map_grows() -> None:
    """Heights, tilt and how they err together are those of before; new steps are as seen."""
    known, grown = first_map(STEPS), first_map(STEPS + 2)
    told = walked(known, true_heights(0.003), tilt_sigma=0.002)
    kept = heights_on_grown_map(told, grown)
    at = np.append(np.arange(STEPS), STEPS + 2)
    np.testing.assert_array_equal(kept.state[at], told.state)
    np.testing.assert_array_equal(kept.covariance[np.ix_(at, at)], told.covariance)
    np.testing.assert_array_equal(kept.state[STEPS : STEPS + 2], grown.heights[STEPS:])
    sigmas = np.sqrt(np.diag(kept.covariance))[STEPS : STEPS + 2]
    np.testing.assert_allclose(NORMAL_95 * sigmas, grown.height_errors[STEPS:])
    assert kept.touchdowns.tolist() == [*told.touchdowns, 0, 0]
