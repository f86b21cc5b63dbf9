"""A map of what was seen: where it lies, what it allows for, and what no map is made of."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.perception.level_beyond import Level
from drake_quad.perception.stair_belief import NORMAL_95, StairBelief
from drake_quad.perception.stair_map import (
    StairMap,
    course_of_description,
    describe_belief,
    make_stair_map,
)

N, YAW = 3, 0.1
RISES = np.array([0.14, 0.16, 0.15])
CAMERA = np.array([1.6, 0.3])  # in W [m]
STANDING = np.array([1.0, 0.3])
DEEP = Level(2.0, ends_flight=True)


def belief(**other: Any) -> StairBelief:
    """Three uneven steps, the first nosing 0.8 m ahead of the camera."""
    sigmas = np.array([0.004, 0.006, 0.01, 0.002, 0.002, 0.003, 0.004, 0.005, 0.003, 0.001, 0.002])
    made = StairBelief(
        stamp=0.9, origin=CAMERA, passed=0, places=np.array([0.8, 1.15, 1.6]),
        heights=np.concatenate([[0.0], np.cumsum(RISES)]), yaw=YAW, overhang=0.0, rise=0.15,
        run=0.4, covariance=np.diag(sigmas**2), count_least=N, count_most=N, is_open=False,
        right=-0.9, left=0.7,
    )  # fmt: skip
    return replace(made, **other)


def made(seen: StairBelief | None, level: Level | None = DEEP) -> StairMap:
    """The map of a robot whose body is at STANDING, its feet on a floor at height 0."""
    return make_stair_map(
        seen, level, standing=STANDING, floor=0.0, behind=1.0, landing=2.0, reach=0.4
    )


def along(seen: StairBelief) -> FloatArray:
    return seen.direction


def test_nosings_of_the_map_are_where_they_were_seen() -> None:
    """The course's nosings are the believed lines in W, to rounding, at the believed heights."""
    seen = belief()
    nosings = made(seen).course(foot_radius=0.02).nosings()
    assert nosings.shape == (N, 2, 3)
    for i, ends in enumerate(nosings):
        assert (ends[:, :2] - seen.origin) @ along(seen) == pytest.approx([seen.places[i]] * 2)
        assert ends[:, 2] == pytest.approx([seen.heights[i + 1]] * 2)


def test_the_lane_leads_through_the_robot_along_the_climb() -> None:
    """The robot stands `behind` along the lane, on its middle line, and the lane heads as seen."""
    course = made(belief()).course(foot_radius=0.02)
    s, lateral = course.lanes[0].coordinates(STANDING)
    assert float(s) == pytest.approx(1.0) and float(lateral) == pytest.approx(0.0, abs=1e-12)
    assert course.lanes[0].yaw == YAW
    assert course.height(*STANDING) == 0.0


def test_the_map_is_no_wider_than_what_was_seen_about_the_lane() -> None:
    """Both ends of each nosing lie within what was seen of it, on either side."""
    seen = belief()
    aside = np.array([-along(seen)[1], along(seen)[0]])
    for ends in made(seen).course(foot_radius=0.02).nosings():
        lateral = (ends[:, :2] - seen.origin) @ aside
        assert seen.right - 1e-9 <= lateral.min() and lateral.max() <= seen.left + 1e-9


def test_the_landing_is_as_wide_as_it_was_seen_about_the_lane() -> None:
    """Wider than the treads if it was, on the side that was seen less; else as wide as they."""
    wide = Level(2.0, ends_flight=True, right=-1.5, left=1.3)
    seen = belief()
    lane = made(seen, wide).course(foot_radius=0.02).lanes[0]
    aside = np.array([-along(seen)[1], along(seen)[0]])
    offset = float((seen.origin - STANDING) @ aside)
    assert lane.half_widths[-1] == pytest.approx(min(1.3 + offset, 1.5 - offset))
    assert lane.half_widths[-2] == pytest.approx(min(0.7 + offset, 0.9 - offset))
    narrow = made(seen, Level(2.0, ends_flight=True, right=-0.2, left=0.2))
    widths = narrow.course(foot_radius=0.02).lanes[0].half_widths
    assert widths[-1] == widths[-2] == lane.half_widths[-2]


def test_the_map_is_no_wider_than_any_step_is_seen_to_be() -> None:
    """Ends of single steps count, on either side; where none is seen, what all share does."""
    ends = np.full((N, 2), np.inf)
    ends[:, 0] *= -1.0
    shared = made(belief()).elements[1].width
    assert made(belief(), DEEP._replace(ends=ends)).elements[1].width == shared
    aside = np.array([-along(belief())[1], along(belief())[0]])
    offset = float((CAMERA - STANDING) @ aside)
    ends[2] = -2.0, 0.45 - offset
    assert made(belief(), DEEP._replace(ends=ends)).elements[1].width == pytest.approx(0.9)
    ends[1] = -0.3 - offset, 2.0
    with pytest.raises(PlanningError, match=r"step 2 .* ends 0\.30 m to the right"):
        made(belief(), DEEP._replace(ends=ends))


def test_a_flight_cut_by_the_image_is_as_wide_as_feet_need() -> None:
    """If 0.6 m of it are seen about the lane, and no step is seen to end on the narrower side.

    So a robot that stands askew may start; the end of one step on the narrower side forbids it.
    """
    aside = np.array([-along(belief())[1], along(belief())[0]])
    offset = float((CAMERA - STANDING) @ aside)  # of the climb's line, to the left of the lane's
    ends = np.tile([-np.inf, np.inf], (N, 1))
    ends[1, 0] = -1.0
    for half, right in ((0.31, -0.9), (0.39, -0.9)):
        seen = belief(left=half - offset, right=right)
        level = DEEP._replace(ends=ends)
        assert made(seen, level).elements[1].width == pytest.approx(0.8)
        with pytest.raises(PlanningError, match=rf"only {2 * half:.2f} m of the treads"):
            made(seen)  # nobody has looked where steps end
        ended = ends.copy()
        ended[2, 1] = 1.2
        with pytest.raises(PlanningError, match=r"of the treads are seen"):
            made(seen, DEEP._replace(ends=ended))
    with pytest.raises(PlanningError, match=r"only 0\.58 m of the treads"):
        made(belief(left=0.29 - offset), DEEP._replace(ends=ends))


def test_the_plan_allows_for_the_widest_interval() -> None:
    """Places' half intervals are 1.96 deviations, and the yaw's errs where feet are put down."""
    seen = belief()
    found = made(seen)
    assert found.place_errors == pytest.approx(NORMAL_95 * seen.place_sigmas)
    expected = NORMAL_95 * np.hypot(0.01, 0.4 * seen.sigma("yaw"))
    assert found.error_place == pytest.approx(expected) and found.error_place > 0.0196
    assert found.error_height == pytest.approx(NORMAL_95 * 0.004)


def test_a_map_written_down_gives_the_same_course() -> None:
    """Through plain values the boxes are the same to the bit."""
    found = made(belief(overhang=0.02, rise=0.15))
    again = course_of_description(found.describe(), foot_radius=0.02)
    for a, b in zip(found.course(foot_radius=0.02).boxes, again.boxes, strict=True):
        assert a.name == b.name and a.yaw == b.yaw
        assert np.array_equal(a.centre, b.centre) and np.array_equal(a.size, b.size)


@pytest.mark.parametrize(
    ("seen", "level", "words"),
    [
        (None, None, "no stairs"),
        (belief(count_most=None), None, "not known"),
        (belief(count_most=4), Level(0.3, ends_flight=False), "not known"),
        (belief(passed=1), DEEP, "not known"),
        (belief(rise=-0.15, heights=-np.arange(4.0)), None, "leads down"),
        (belief(), Level(2.0, ends_flight=True, below_view=1), "first step is too near"),
        (belief(), Level(2.0, ends_flight=True, below_view=2), "first steps are too near"),
        (belief(left=0.2), DEEP, "only 0.28 m of the treads"),
    ],
)
def test_what_cannot_be_climbed_has_no_map(
    seen: StairBelief | None, level: Level | None, words: str
) -> None:
    """Nothing seen, steps that may go on, a flight down, and a strip too narrow are refused."""
    with pytest.raises(PlanningError, match=words):
        made(seen, level)


def test_a_level_beyond_the_last_nosing_ends_the_flight() -> None:
    """A count that the fit alone leaves open is known where a next riser would have been seen."""
    assert len(made(belief(count_most=None), DEEP).places) == N


def test_what_is_seen_is_told_in_words() -> None:
    """Count, way and sizes; that the count is open is said."""
    assert describe_belief(None) == "no stairs"
    assert describe_belief(belief()) == "3 steps up, each 0.15 m high, 0.40 m deep"
    assert describe_belief(belief(count_most=None)).startswith("3 or more steps up")
    assert describe_belief(belief(count_most=5)).startswith("3 to 5 steps up")
