"""Heights of treads as feet find them: laws of the update, its intervals, when there is none."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from growing_rig import FIRST, RISE, RUN, first_map
from hypothesis import given, strategies as st

from drake_quad.common import BoolArray, FloatArray
from drake_quad.perception.growing_map import FEET_APART
from drake_quad.perception.stair_belief import NORMAL_95
from drake_quad.perception.stair_map import StairMap
from drake_quad.perception.touchdown_heights import (
    LEG_SIGMA,
    NOISE,
    STANCE_SIGMA,
    TouchdownHeights,
    add_touchdowns,
    heights_as_seen,
    heights_on_grown_map,
    map_with_touchdowns,
    treads_under,
)

STEPS, FLOOR = 5, 0.4
LEFT = np.array([0.3, -0.3, 0.3, -0.3])
ALL = np.ones(4, dtype=bool)
FORE = 2  # treads that the fore feet are ahead of the rear ones


def seen(*, alike: float = 0.0, half: float | None = None) -> StairMap:
    """A map on a floor that is not at 0; so much is the correlation of any two heights.

    Args:
        alike: The correlation.
        half: Half of each height's 95 % interval [m].
    """
    known = first_map(STEPS)
    floor, stairs, landing = known.elements
    return replace(
        known, elements=(floor, stairs, landing), floor=FLOOR, heights=known.heights + FLOOR,
        height_errors=known.height_errors if half is None else np.full(STEPS, half),
        height_correlation=alike + (1.0 - alike) * np.eye(STEPS),
    )  # fmt: skip


def true_heights(errors: FloatArray | float) -> FloatArray:
    """Heights of floor and treads of which the treads are so much higher than the map has them."""
    return FLOOR + np.append(0.0, RISE * np.arange(1.0, STEPS + 1.0) + errors)


def points(treads: FloatArray, heights: FloatArray) -> FloatArray:
    """Feet in the middles of treads (FL, FR, RL, RR), at the heights of floor and treads [m]."""
    on = np.asarray(treads, dtype=int)
    return np.column_stack([FIRST + (on - 0.5) * RUN, LEFT, heights[on]])


def one_of(row: int) -> BoolArray:
    """The mask of one foot."""
    return np.arange(4) == row


def crawl() -> Iterator[tuple[int, FloatArray]]:
    """Each step up a flight, a tread a step: which foot, and on which treads all are then."""
    on = np.zeros(4)
    for k in range(1, STEPS + FORE + 1):
        for row in (2, 0, 3, 1):
            goal = min(k, STEPS) if row < 2 else min(max(k - FORE, 0), STEPS)
            if goal != on[row]:
                on = on.copy()
                on[row] = goal
                yield row, on


def walked(
    known: StairMap, heights: FloatArray, *, tilt_sigma: float = 0.0, tilt: float = 0.0,
    roll: float = 0.0, noise: np.random.Generator | None = None, touches: int = 1,
) -> TouchdownHeights:  # fmt: skip
    """What feet tell that walk up a flight.

    Args:
        known: The map.
        heights: True heights of floor and treads [m].
        tilt_sigma: What the filter says of its tilt [rad].
        tilt: Its error along the flight [rad].
        roll: The same across it [rad].
        noise: Of the legs, of each stance, and of the base's height.
        touches: How often each foot touches where it lands.
    """
    found = heights_as_seen(known, tilt_sigma=tilt_sigma)
    legs, stances, base = np.zeros(4), np.zeros(4), 0.0
    if noise is not None:
        legs, stances = noise.normal(0.0, LEG_SIGMA, 4), noise.normal(0.0, STANCE_SIGMA, 4)
    for row, on in crawl():
        if noise is not None:
            stances[row], base = noise.normal(0.0, STANCE_SIGMA), noise.normal(0.0, 0.05)
        feet = points(on, heights)
        feet[:, 2] += tilt * feet[:, 0] + roll * feet[:, 1] + legs + stances + base
        for _ in range(touches):
            shaken = np.zeros(4) if noise is None else noise.normal(0.0, NOISE, 4)
            touching = feet + shaken[:, None] * [0.0, 0.0, 1.0]
            found = add_touchdowns(found, known, touching, ALL, one_of(row))
    return found


def test_feet_find_how_high_the_treads_are() -> None:
    """Treads that differ from the map by up to 8 mm are known to within a millimetre or two."""
    errors = np.array([0.008, -0.005, 0.006, -0.008, 0.007])
    known = seen(half=0.016)
    found = map_with_touchdowns(known, walked(known, true_heights(errors)))
    assert np.abs(found.heights - true_heights(errors)[1:]).max() < 0.001
    assert found.height_errors.max() < 0.005
    assert found.touched_treads.all() and not known.touched_treads.any()


@given(st.floats(-0.5, 0.5), st.lists(st.floats(-0.01, 0.01), min_size=STEPS, max_size=STEPS))
def test_how_high_the_base_is_believed_to_be_does_not_matter(up: float, off: list[float]) -> None:
    """Feet that all stand higher by the same tell the same."""
    known, heights = seen(), true_heights(np.array(off))
    one, other = (heights_as_seen(known, tilt_sigma=0.002) for _ in range(2))
    for row, on in crawl():
        feet = points(on, heights)
        one = add_touchdowns(one, known, feet, ALL, one_of(row))
        other = add_touchdowns(other, known, feet + np.array([0, 0, up]), ALL, one_of(row))
    np.testing.assert_allclose(one.state, other.state, atol=1e-9)
    np.testing.assert_allclose(one.covariance, other.covariance, atol=1e-15)


@given(st.floats(-0.008, 0.008), st.floats(0.0, 0.01), st.integers(0, 15))
def test_a_touchdown_makes_no_height_less_certain(off: float, tilt_sigma: float, k: int) -> None:
    """No deviation grows, the covariance stays one, and a foot's own tread is known better."""
    known = seen()
    row, on = list(crawl())[k]
    before = heights_as_seen(known, tilt_sigma=tilt_sigma)
    after = add_touchdowns(before, known, points(on, true_heights(off)), ALL, one_of(row))
    tread = int(on[row]) - 1
    then, now = (np.diag(x.covariance)[:STEPS] for x in (before, after))
    assert np.all(now <= then + 1e-15) and now[tread] < then[tread]
    assert np.linalg.eigvalsh(after.covariance).min() > -1e-15
    assert after.touchdowns.sum() == 1 and after.touchdowns[tread] == 1


@pytest.mark.parametrize("touches", [1, 5])
@pytest.mark.parametrize("alike", [0.0, 0.95])
@pytest.mark.parametrize("tilt_sigma", [0.0, 0.003])
def test_intervals_hold_as_often_as_they_say(tilt_sigma: float, alike: float, touches: int) -> None:
    """Of 300 walks with errors as they are told, 93 to 97 % of the heights are inside, at 95 %.

    Legs err alike all the way, and stances as long as they last; a foot that touches five times
    where it stands tells no more than one that touches once.
    """
    random = np.random.default_rng(7)
    known, inside = seen(alike=alike, half=0.012), []
    sigmas = known.height_errors / NORMAL_95
    for _ in range(300):
        errors = random.multivariate_normal(np.zeros(STEPS), known.height_correlation)
        heights = true_heights(sigmas * errors)
        tilt, roll = random.normal(0.0, tilt_sigma, 2)
        told = walked(
            known, heights, tilt_sigma=tilt_sigma, tilt=tilt, roll=roll, noise=random,
            touches=touches,
        )  # fmt: skip
        found = map_with_touchdowns(known, told)
        inside.append(np.abs(found.heights - heights[1:]) <= found.height_errors)
    assert 0.93 <= np.mean(inside) <= 0.97


def test_a_tilt_that_nobody_told_of_would_be_taken_for_height() -> None:
    """With the tilt's deviation told, intervals are wider, and have the truth."""
    known, heights, tilt = seen(half=0.03), true_heights(0.0), 0.006
    told, not_told = (
        map_with_touchdowns(known, walked(known, heights, tilt_sigma=sigma, tilt=tilt))
        for sigma in (tilt, 0.0)
    )
    off = [np.abs(found.heights - heights[1:]) for found in (told, not_told)]
    assert np.any(off[1] > not_told.height_errors) and np.all(off[0] < told.height_errors)


def test_a_roll_that_nobody_told_of_would_be_taken_for_height() -> None:
    """A left foot is on the first tread, and the others that stand are on the right of it."""
    known, heights, roll = seen(half=0.03), true_heights(0.0), 0.01
    feet = points(np.array([1, 0, 0, 0]), heights)
    feet[:, 2] += roll * feet[:, 1]
    right = np.array([True, True, False, True])
    inside = []
    for sigma in (roll, 0.0):
        told = heights_as_seen(known, tilt_sigma=sigma)
        found = map_with_touchdowns(known, add_touchdowns(told, known, feet, right, one_of(0)))
        inside.append(abs(found.heights[0] - heights[1]) <= found.height_errors[0])
    assert inside == [True, False]


@pytest.mark.parametrize(
    ("along", "tread"), [(1.5 * RUN, 2), (0.002, -1), (0.012, -1), ((STEPS + 0.5) * RUN, -1)]
)
def test_a_foot_that_may_be_on_either_side_of_a_nosing_tells_nothing(
    along: float, tread: int
) -> None:
    """Nor one behind the last nosing of a flight whose end is not known."""
    known = seen()
    feet = points(np.array([2, 1, 0, 0]), true_heights(0.0))
    feet[0, 0] = FIRST + along
    assert treads_under(known, feet, place_sigma=0.0).tolist() == [tread, 1, 0, 0]
    before = heights_as_seen(known, tilt_sigma=0.0)
    found = add_touchdowns(before, known, feet, ALL, one_of(0))
    assert bool(found.touchdowns.any()) is (tread > 0)
    known_before, known_now = (x.covariance[:STEPS, :STEPS] for x in (before, found))
    assert np.array_equal(known_before, known_now) is (tread < 0)
    alone = add_touchdowns(before, known, feet, one_of(0), one_of(0))
    assert not alone.touchdowns.any()  # there is no foot to compare with


def test_a_robot_that_does_not_know_its_place_does_not_know_its_treads() -> None:
    """With a place known to 60 mm a foot in the middle of a tread of 0.3 m may be on the next."""
    known, feet = seen(), points(np.array([2, 1, 0, 0]), true_heights(0.0))
    assert treads_under(known, feet, place_sigma=0.06).tolist() == [-1, -1, -1, -1]


def test_one_foot_on_a_stone_is_not_believed() -> None:
    """It stands 35 mm higher than its tread is: no height moves by that."""
    known, errors = seen(half=0.012), np.array([0.003, -0.004, 0.004, -0.003, 0.004])
    told = walked(known, true_heights(errors))
    feet = points(np.array([4, 5, 3, 3]), true_heights(errors))
    feet[0, 2] += 0.035
    feet[0, 0] += 0.05
    after = add_touchdowns(told, known, feet, ALL, one_of(0))
    np.testing.assert_allclose(after.state[:STEPS], told.state[:STEPS], atol=1e-12)
    assert not after.contradicted and after.doubted[3, 0] == pytest.approx(0.035, abs=0.002)


def test_a_tread_that_two_feet_find_elsewhere_is_there() -> None:
    """It was seen 25 mm too high: the first foot is not believed, the second one is."""
    known, errors = seen(half=0.004), np.array([0.0, 0.0, -0.025, 0.0, 0.0])
    told = walked(known, true_heights(errors))
    found = map_with_touchdowns(known, told)
    assert not told.contradicted
    assert np.abs(found.heights - true_heights(errors)[1:]).max() < 0.002


def test_a_tread_far_off_contradicts_the_map() -> None:
    """Two feet find it 50 mm lower; it is named."""
    known = seen()
    for off in (-0.05, 0.06):
        assert abs(off) > FEET_APART
        told = walked(known, true_heights(np.array([0.0, 0.0, off, 0.0, 0.0])))
        assert {tread for tread, _ in told.contradicted} == {3}
        assert told.contradicted[0][1] == pytest.approx(off, abs=0.003)


def stepping(
    told: TouchdownHeights, known: StairMap, *steps: tuple[int, list[int], float, float]
) -> TouchdownHeights:
    """What feet tell that step one after the other on stairs just as mapped.

    Args:
        told: What they told before.
        known: The map.
        steps: Of each the foot, the treads under all, how far its place is beside the middle of its
            tread, and how much higher than the tread [m].
    """
    up = np.zeros(4)
    for row, on, along, higher in steps:
        feet = points(np.array(on), true_heights(0.0))
        up[row] = higher
        feet[:, 2] += up
        feet[row, 0] += along
        told = add_touchdowns(told, known, feet, ALL, one_of(row))
    return told


@pytest.mark.parametrize("stone", [0.03, 0.045])
def test_a_stone_in_the_footprint_of_two_feet_is_no_tread(stone: float) -> None:
    """The rear foot steps where the fore foot stood, as gaits do: both are on the same stone."""
    known = seen()
    told = stepping(
        heights_as_seen(known, tilt_sigma=0.0), known, (0, [1, 0, 0, 0], 0.0, stone),
        (1, [1, 1, 0, 0], 0.0, 0.0), (0, [2, 1, 0, 0], 0.0, 0.0), (2, [2, 1, 1, 0], 0.01, stone),
    )  # fmt: skip
    np.testing.assert_allclose(told.state[:STEPS], known.heights, atol=1e-6)
    assert not told.contradicted


def test_two_feet_that_do_not_say_the_same_are_not_believed() -> None:
    """One stands 30 mm higher, the other 100 mm: neither tells how high the tread is."""
    known = seen()
    told = stepping(
        heights_as_seen(known, tilt_sigma=0.0), known, (0, [1, 0, 0, 0], 0.0, 0.03),
        (1, [1, 1, 0, 0], 0.0, 0.1),
    )  # fmt: skip
    np.testing.assert_allclose(told.state[:STEPS], known.heights, atol=1e-6)
    assert not told.contradicted and told.ignored.tolist() == [True, True, False, False]


def test_a_doubt_is_gone_once_a_foot_has_found_the_tread_where_it_is() -> None:
    """A later foot on a stone is the first one again."""
    known = seen()
    told = stepping(
        heights_as_seen(known, tilt_sigma=0.0), known, (0, [1, 0, 0, 0], 0.0, 0.03),
        (1, [1, 1, 0, 0], 0.0, 0.0), (0, [1, 1, 0, 0], 0.06, 0.03),
    )  # fmt: skip
    np.testing.assert_allclose(told.state[:STEPS], known.heights, atol=1e-6)
    assert told.touchdowns.tolist() == [1, 0, 0, 0, 0]


@pytest.mark.parametrize("stone", [0.015, 0.06])
def test_a_foot_that_stands_on_a_stone_is_no_measure_for_others(stone: float) -> None:
    """It stands there from the start; the first feet on the first tread find it where it is."""
    known = seen()
    feet = points(np.zeros(4), true_heights(0.0))
    feet[2, 2] += stone
    told = add_touchdowns(heights_as_seen(known, tilt_sigma=0.0), known, feet, ALL, ALL)
    assert told.ignored.tolist() == [False, False, True, False]
    for row, on in ((0, [1, 0, 0, 0]), (1, [1, 1, 0, 0])):
        feet = points(np.array(on), true_heights(0.0))
        feet[2, 2] += stone
        told = add_touchdowns(told, known, feet, ALL, one_of(row))
    np.testing.assert_allclose(told.state[:STEPS], known.heights, atol=1e-6)
    assert told.touchdowns[0] == 2


def test_a_foot_that_sinks_is_no_measure_any_more() -> None:
    """One that stood on the second tread is 20 mm lower as the next foot lands."""
    known = seen()
    told = stepping(
        heights_as_seen(known, tilt_sigma=0.0), known, (0, [1, 0, 0, 0], 0.0, 0.0),
        (1, [1, 1, 0, 0], 0.0, 0.0), (0, [2, 1, 0, 0], 0.0, 0.0),
    )  # fmt: skip
    feet = points(np.array([2, 1, 1, 0]), true_heights(0.0))
    feet[0, 2] -= 0.02
    told = add_touchdowns(told, known, feet, ALL, one_of(2))
    np.testing.assert_allclose(told.state[:STEPS], known.heights, atol=1e-6)
    assert told.ignored.tolist() == [True, False, False, False]


def test_of_two_feet_that_disagree_neither_is_a_measure() -> None:
    """With no third foot it is not known which of them stands on a stone."""
    known = seen()
    feet = points(np.array([1, 0, 0, 0]), true_heights(0.0))
    feet[1, 2] += 0.03
    two = np.array([True, True, False, False])
    told = add_touchdowns(heights_as_seen(known, tilt_sigma=0.0), known, feet, two, one_of(0))
    assert told.ignored.tolist() == [True, True, False, False] and not told.touchdowns.any()
    np.testing.assert_array_equal(told.state[:STEPS], known.heights)


def test_a_foot_of_which_nothing_is_known_is_left_out() -> None:
    """A place that is no number makes no height one that is none."""
    known = seen()
    feet = points(np.array([1, 0, 0, 0]), true_heights(0.002))
    feet[3] = np.nan
    told = add_touchdowns(heights_as_seen(known, tilt_sigma=0.0), known, feet, ALL, one_of(0))
    assert np.isfinite(told.state).all() and told.touchdowns[0] == 1


def test_what_lies_on_the_floor_or_on_the_only_tread_contradicts_no_map() -> None:
    """A foot on a sill 45 mm high, among feet on the same tread, or on the floor, tells nothing."""
    known, heights = seen(), true_heights(0.0)
    for on, row in ((np.array([3, 3, 3, 3]), 0), (np.array([1, 1, 0, 0]), 2)):
        told = heights_as_seen(known, tilt_sigma=0.0)
        for by in (0.0, 0.02):  # it steps onto it twice
            feet = points(on, heights)
            feet[row] += [by, 0.0, 0.045]
            told = add_touchdowns(told, known, feet, ALL, one_of(row))
        assert not told.contradicted and np.isnan(told.doubted).all()
        np.testing.assert_array_equal(told.state[:STEPS], known.heights)


def test_only_treads_that_feet_stood_on_are_told_anew() -> None:
    """Where heights err apart, others are as they were seen; the course has the new rises."""
    known = seen(half=0.008)
    told = heights_as_seen(known, tilt_sigma=0.0)
    feet = points(np.array([1, 0, 0, 0]), true_heights(0.004))
    told = add_touchdowns(told, known, feet, ALL, one_of(0))
    found = map_with_touchdowns(known, told)
    assert found.touched_treads.tolist() == [True, *[False] * (STEPS - 1)]
    np.testing.assert_array_equal(found.heights[1:], known.heights[1:])
    np.testing.assert_allclose(found.height_errors[1:], known.height_errors[1:], rtol=1e-12)
    assert known.heights[0] < found.heights[0] < known.heights[0] + 0.004
    before, after = (m.course(foot_radius=0.02) for m in (known, found))
    np.testing.assert_allclose(before.nosings()[..., :2], after.nosings()[..., :2], atol=1e-12)
    np.testing.assert_allclose(after.nosings()[:, 0, 2], found.heights, atol=1e-12)
    again = map_with_touchdowns(replace(found, touched=(False, True, False, False, False)), told)
    assert again.touched_treads.tolist() == [True, True, False, False, False]


def test_the_error_that_is_planned_with_is_that_of_steps_that_are_planned_on() -> None:
    """Of a map whose last steps are not trusted these do not count; of a whole map all do."""
    known = replace(seen(), height_errors=np.array([0.004, 0.004, 0.004, 0.02, 0.02]), trusted=3)
    told = heights_as_seen(known, tilt_sigma=0.0)
    assert map_with_touchdowns(known, told).error_height == pytest.approx(0.004)
    whole = replace(known, complete=True)
    assert map_with_touchdowns(whole, told).error_height == pytest.approx(0.02)


def test_where_heights_err_together_a_foot_tells_of_the_treads_ahead() -> None:
    """All of a flight that was seen 4 mm too low rises with its first tread."""
    known = seen(alike=0.95, half=0.008)
    told = heights_as_seen(known, tilt_sigma=0.0)
    for row, on in ((0, [1, 0, 0, 0]), (1, [1, 1, 0, 0])):
        feet = points(np.array(on), true_heights(0.004))
        told = add_touchdowns(told, known, feet, ALL, one_of(row))
    found = map_with_touchdowns(known, told)
    assert np.all(found.heights - known.heights > 0.002)
    assert np.all(found.height_errors < known.height_errors)
    assert found.touched_treads.sum() == 1
    np.testing.assert_allclose(np.diag(found.height_correlation), 1.0)


def test_heights_that_are_certain_stay_so() -> None:
    """No interval of nothing makes a map of nothing."""
    known = seen(half=0.0)
    found = map_with_touchdowns(known, walked(known, true_heights(0.001)))
    np.testing.assert_allclose(found.heights, known.heights, atol=1e-12)
    assert np.isfinite(found.height_correlation).all()


def test_what_was_told_is_kept_where_the_map_grows() -> None:
    """Of touched treads, with tilt, legs and stances; the others are as the map has them now."""
    known = seen(alike=0.5)
    told = walked(known, true_heights(0.003), tilt_sigma=0.002)
    refined = map_with_touchdowns(known, told)
    more = first_map(STEPS + 2)
    grown = replace(
        more, heights=np.concatenate([refined.heights[:4], FLOOR + more.heights[4:]]),
        touched=(True, True, True, True, False), height_correlation=0.5 + 0.5 * np.eye(STEPS + 2),
    )  # fmt: skip
    kept = heights_on_grown_map(told, grown)
    extra = len(told.state) - STEPS
    at = np.append(np.arange(4), np.arange(STEPS + 2, STEPS + 2 + extra))
    old = np.append(np.arange(4), np.arange(STEPS, STEPS + extra))
    np.testing.assert_array_equal(kept.state[at], told.state[old])
    np.testing.assert_array_equal(
        kept.covariance[np.ix_(at, at)], told.covariance[np.ix_(old, old)]
    )
    np.testing.assert_array_equal(kept.state[4 : STEPS + 2], grown.heights[4:])
    new = kept.covariance[4 : STEPS + 2, 4 : STEPS + 2]
    np.testing.assert_allclose(NORMAL_95 * np.sqrt(np.diag(new)), grown.height_errors[4:])
    assert new[0, 1] == pytest.approx(0.5 * np.sqrt(new[0, 0] * new[1, 1]))
    assert np.all(kept.covariance[4 : STEPS + 2][:, at] == 0.0)
    assert kept.touchdowns.tolist() == [*told.touchdowns[:4], 0, 0, 0]
    np.testing.assert_array_equal(kept.places, told.places)
