"""A map that grows look by look: what is taken over, what stays, and what contradicts it."""

from dataclasses import replace

import numpy as np
import pytest
from growing_rig import DEEP, FEET, FIRST, NOT_SEEN, RISE, RUN, first_map, flight

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.perception.growing_map import (
    TRUSTED_PLACE,
    describe_standing,
    feet_offset,
    ground_height,
    grow_map,
    match_look,
    trust,
)
from drake_quad.perception.level_beyond import Level
from drake_quad.perception.stair_belief import NORMAL_95, StairBelief
from drake_quad.perception.stair_map import STUB, StairMap, course_of_description, make_stair_map
from drake_quad.terrain.elements import Element

RETURN = Element(kind="return")


def grown(
    known: StairMap, seen: StairBelief | None, level: Level = NOT_SEEN, feet: FloatArray = FEET
) -> StairMap:
    return grow_map(known, seen, level, feet=feet, landing=2.0, reach=0.4, look=1, back=(RETURN,))


def test_a_flight_without_an_end_is_mapped_as_far_as_it_was_seen() -> None:
    """Its course has the steps that were seen, and nothing behind the last but a stub."""
    known = first_map()
    assert not known.complete and known.trusted == 5
    lane = known.course(foot_radius=0.02).lanes[0]
    assert len(lane.nosings()) == 5
    assert lane.length == pytest.approx(FIRST + 5 * RUN + STUB)


@pytest.mark.parametrize("sigmas", [[0.004, 0.008, 0.02, 0.004], [0.03, 0.004, 0.004, 0.004]])
def test_steps_are_planned_on_up_to_the_first_that_is_not_known_well(sigmas: list[float]) -> None:
    """A nosing whose 95 % interval is wider than the bound ends what is trusted."""
    seen = flight(0, 4)
    covariance = np.array(seen.covariance)
    covariance[range(4), range(4)] = np.square(sigmas)
    found = make_stair_map(
        replace(seen, covariance=covariance), NOT_SEEN, standing=np.array([1.0, 0.0]), floor=0.0,
        behind=1.0, landing=2.0, reach=0.4, to_its_end=False,
    )  # fmt: skip
    known = trust(found, reach=0.4, yaw_sigma=0.0)
    good = [NORMAL_95 * sigma <= TRUSTED_PLACE for sigma in sigmas]
    assert known.trusted == good.index(False)
    if known.trusted:
        told = NORMAL_95 * np.array(sigmas[: known.trusted])
        assert known.error_place == pytest.approx(told.max())


def test_a_look_adds_steps_and_leaves_those_behind_the_camera() -> None:
    """Nosings in view are the look's, with its number; those before them are as they were."""
    known, seen = first_map(5, sigma=0.01), flight(3, 4)
    seen = replace(seen, places=seen.places + 0.012)
    more = grown(known, seen)
    assert len(more.places) == 7 and not more.complete
    assert more.seen_in == (0, 0, 0, 1, 1, 1, 1)
    np.testing.assert_array_equal(more.places[:3], known.places[:3])
    np.testing.assert_allclose(more.places[3:], FIRST + RUN * np.arange(3, 7) + 0.012)
    np.testing.assert_allclose(more.heights, RISE * np.arange(1.0, 8.0))
    assert np.all(more.place_errors[3:] < known.place_errors[:3].min())


def test_what_lies_below_the_image_is_not_taken_over() -> None:
    """The fit tells a first nosing that nobody sees: the map keeps its own."""
    known, seen = first_map(), flight(2, 4)
    guessed = replace(seen, places=seen.places + np.array([0.03, 0.0, 0.0, 0.0]))
    more = grown(known, guessed, NOT_SEEN._replace(below_view=1))
    assert more.seen_in == (0, 0, 0, 1, 1, 1)
    np.testing.assert_allclose(np.diff(more.places), RUN)


def test_a_seen_end_completes_the_map() -> None:
    """It has the landing, and the way back; written down and read it is the same course."""
    more = grown(first_map(), flight(3, 4, most=4), DEEP)
    assert more.complete and more.trusted == 7
    assert [element.kind for element in more.elements] == ["floor", "stairs", "landing", "return"]
    course = more.course(foot_radius=0.02)
    again = course_of_description(more.describe(), foot_radius=0.02)
    assert len(course.lanes) == 2 and len(course.outward[0].nosings()) == 7
    np.testing.assert_array_equal(course.nosings(), again.nosings())


def test_an_end_that_is_not_seen_well_enough_does_not_complete_the_map() -> None:
    """A landing seen too narrow to turn on; the map says so. One way it will do."""
    narrow = replace(flight(3, 4, most=4), right=-0.42, left=0.42)
    level = Level(2.0, ends_flight=True, right=-0.42, left=0.42)
    seen = grown(first_map(), narrow, level)
    assert not seen.complete and seen.trusted == 7
    assert seen.doubt == "0.84 m of the landing are seen, and 1.50 m are wanted to turn on"
    one_way = grow_map(first_map(), narrow, level, feet=FEET, landing=2.0, reach=0.4, look=1)
    assert one_way.complete and not one_way.doubt


@pytest.mark.parametrize("higher", [-0.02, 0.005, 0.03])
def test_ground_that_is_higher_than_mapped_changes_no_map(higher: float) -> None:
    """What the feet stand higher, and all that is seen with it, is taken out."""
    seen = flight(3, 4)
    raised = grown(first_map(), flight(3, 4, up=higher), feet=FEET + np.array([0.0, 0.0, higher]))
    np.testing.assert_allclose(raised.heights, grown(first_map(), seen).heights, atol=1e-12)


def test_a_lane_keeps_its_heading_whatever_a_later_look_believes() -> None:
    """Nosings of a climb that is believed to head 1 degree aside lie where they cross the lane."""
    known, turn = first_map(), np.radians(1.0)
    seen = flight(3, 4)
    ends = FIRST + RUN * np.arange(3, 7)
    direction = np.array([np.cos(turn), np.sin(turn)])
    aside = replace(seen, yaw=turn, places=(ends - seen.origin[0]) * direction[0])
    more = grown(known, aside)
    assert more.yaw == known.yaw
    np.testing.assert_allclose(more.places[3:], ends)
    count = len(known.places)  # what was known better before stays
    assert np.array_equal(more.place_errors[:count], known.place_errors)
    assert np.all(more.place_errors[count:] > grown(known, seen).place_errors[count:])


def test_what_contradicts_the_map_is_refused() -> None:
    """Steps elsewhere, of another height, fewer than were seen, none, or leading down."""
    known, seen = first_map(), flight(3, 4)
    for wrong, level, words in (
        (replace(seen, places=seen.places + 0.1), NOT_SEEN, "place of step"),
        (
            replace(seen, heights=seen.heights + np.array([0.0, 0.0, 0.07, 0.0, 0.0])),
            NOT_SEEN,
            "height of",
        ),
        (flight(2, 2, most=2), DEEP, "ends after 4 steps"),
        (None, NOT_SEEN, "no steps are seen"),
        (replace(seen, rise=-RISE), NOT_SEEN, "leads down"),
    ):
        with pytest.raises(PlanningError, match=words):
            grown(known, wrong, level)


def test_the_heading_stays_in_the_errors_of_steps_that_are_not_seen_again() -> None:
    """A later look that tells nothing new of them leaves them as uncertain as they were."""
    stood = make_stair_map(flight(0, 5), NOT_SEEN, standing=np.zeros(2), floor=0.0, behind=0.5,
                           landing=1.5, reach=0.4, to_its_end=False)  # fmt: skip
    sure, unsure = (trust(stood, reach=0.4, yaw_sigma=sigma) for sigma in (0.0, 0.01))
    assert np.all(unsure.place_errors > sure.place_errors + 1e-3)
    again = grown(unsure, flight(4, 3), NOT_SEEN)
    np.testing.assert_array_equal(again.place_errors[:4], unsure.place_errors[:4])
    assert again.error_place >= unsure.place_errors[:4].max()


def test_feet_that_stand_apart_make_the_treads_ahead_uncertain() -> None:
    """By as much as they contradict the map and each other: what is taken off is their middle."""
    known = first_map()
    odd = FEET.copy()
    odd[:2, 2] += 0.03
    even, uneven = (
        grow_map(known, flight(3, 4), NOT_SEEN, feet=feet, landing=1.5, reach=0.4, look=1)
        for feet in (FEET, odd)
    )
    assert np.all(even.height_errors[5:] < 0.03) and np.all(uneven.height_errors[5:] >= 0.03)


def test_feet_that_stand_on_other_treads_than_mapped_contradict_it() -> None:
    """One, or two on one tread, a third of a rise off the others end it; all higher do not."""
    known = first_map()
    assert feet_offset(known, FEET + np.array([0.0, 0.0, 0.05])) == pytest.approx(0.05)
    wrong = FEET.copy()
    wrong[0, 2] += 0.06
    pair = FEET.copy()
    pair[:2, 2] += 0.06  # of which the median of all four takes half
    for feet in (wrong, pair):
        with pytest.raises(PlanningError, match="feet contradict"):
            feet_offset(known, feet)


def test_steps_are_told_apart_by_their_heights() -> None:
    """A camera that has passed k steps sees step k + 1 first, wherever it believes to be along."""
    known = first_map()
    for k in range(4):
        found = match_look(known, flight(k, 3), NOT_SEEN, offset=0.0, reach=0.4)
        assert found.first == k
        np.testing.assert_allclose(found.places, FIRST + RUN * np.arange(k, k + 3))


def test_an_image_that_is_narrower_than_the_flight_does_not_narrow_it() -> None:
    """Where treads are seen up to its sides; where they end within it, or feet go beyond, it does.

    To one side alone it counts for as much as there is on the other.
    """
    known, cut = first_map(), NOT_SEEN._replace(cut_right=True, cut_left=True)
    narrow = replace(flight(3, 4), right=-0.41, left=0.41)
    assert known.elements[1].width == pytest.approx(1.8)
    assert grown(known, narrow, cut).elements[1].width == pytest.approx(1.8)
    assert grown(known, narrow, NOT_SEEN).elements[1].width == pytest.approx(0.82)
    one = replace(flight(3, 4), right=-0.45, left=0.41)
    beside = grown(known, one, NOT_SEEN._replace(cut_left=True))
    assert beside.elements[1].width == pytest.approx(0.9)
    with pytest.raises(PlanningError, match=r"only 0\.78 m of the treads are seen"):
        grown(known, replace(flight(3, 4), right=-0.39, left=0.39), cut)


def test_people_are_told_where_it_stands() -> None:
    """In words, with the numbers of the steps."""
    known = first_map()
    assert ground_height(known, np.array([0.0, FIRST + 0.1])).tolist() == [0.0, RISE]
    assert describe_standing(known, FEET) == "with its fore feet on step 3"
    assert describe_standing(known, FEET[:3]) == "on four feet on steps 1 to 3"
    assert describe_standing(known, FEET[3:]) == "on four feet before the flight"
    assert describe_standing(known, FEET[:2]) == "on four feet on step 3"


@pytest.mark.parametrize(("half", "kept"), [(0.001, True), (0.02, False)])
def test_heights_that_feet_have_told_are_told_anew_only_if_that_is_better(
    half: float, kept: bool
) -> None:
    """A look tells a step's place anew; its height too, if no foot has told it better."""
    known = replace(first_map(), height_errors=np.full(5, half))
    heights = known.heights + np.array([0.0, 0.0, 0.0, 0.004, 0.004])
    stood = replace(known, heights=heights, touched=(True, True, True, True, False))
    look = flight(3, 4, sigma=0.001)
    one, other = (
        grow_map(m, look, NOT_SEEN, feet=np.zeros((0, 3)), landing=2.0, reach=0.4, look=1)
        for m in (stood, known)
    )
    np.testing.assert_array_equal(one.places, other.places)
    np.testing.assert_array_equal(other.heights[3:5], known.heights[3:5])
    assert np.array_equal(one.heights[3:5], heights[3:5]) is kept
    assert np.all(one.height_errors[3:5] == (half if kept else one.height_errors[5]))
    assert one.touched_treads.tolist() == [True, True, True, kept, False, False, False]


def test_treads_ahead_are_no_better_known_than_those_under_the_feet() -> None:
    """Their heights are counted from there: intervals are wider, and all err together by that."""
    known = replace(first_map(), height_errors=np.full(5, 0.01))
    look = flight(3, 4, sigma=0.001)
    grown = grow_map(known, look, NOT_SEEN, feet=FEET, landing=2.0, reach=0.4, look=1)
    seen = NORMAL_95 * look.height_sigmas[1]
    assert grown.height_errors[5:] == pytest.approx(np.hypot(0.01, seen))
    share = 0.01**2 / (0.01**2 + seen**2)
    assert grown.height_correlation[5, 6] == pytest.approx(share)
    np.testing.assert_allclose(np.diag(grown.height_correlation), 1.0)


def test_heights_of_one_look_err_together_and_those_of_two_looks_do_not() -> None:
    """Steps that stay as they were keep how they err; those told anew err as the look says."""
    pair = np.array([[1.0, 0.9], [0.9, 1.0]])
    before = np.eye(5)
    before[:2, :2] = pair
    known = replace(first_map(), height_correlation=before)
    look = flight(3, 4, sigma=0.001)
    covariance = np.array(look.covariance)
    covariance[5:7, 5:7] = covariance[5, 5] * pair  # the first two of its treads
    grown = grow_map(
        known, replace(look, covariance=covariance), NOT_SEEN, feet=np.zeros((0, 3)), landing=2.0,
        reach=0.4, look=1,
    )  # fmt: skip
    expected = np.eye(7)
    expected[:2, :2] = expected[3:5, 3:5] = pair
    np.testing.assert_allclose(grown.height_correlation, expected, atol=1e-12)
