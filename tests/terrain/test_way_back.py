"""A course that ends with `return`: the same ground, walked to its end and back to its start."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.errors import InputError
from drake_quad.planning.problem import PlanSettings, derive_mission
from drake_quad.terrain.as_built import MapErrors, build_as_built
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import Element
from drake_quad.terrain.lane import Lane, reverse_lane

FLOOR, LANDING = Element("floor", length=2.4), Element("landing", length=3.0)
UP = Element("stairs", going="up", rises=[0.10, 0.12, 0.14], runs=[0.5, 0.4, 0.45])
BACK = Element("return")


@st.composite
def flights(draw: st.DrawFn) -> list[Element]:
    """One or two flights up or down, a level piece or a slope between them."""

    def flight() -> Element:
        n = draw(st.integers(1, 4))
        return Element(
            "stairs",
            going=draw(st.sampled_from(["up", "down"])),
            rises=draw(st.lists(st.floats(0.05, 0.2), min_size=n, max_size=n)),
            runs=draw(st.lists(st.floats(0.3, 0.6), min_size=n, max_size=n)),
        )

    level = Element("landing", length=0.8)
    slope = Element("slope", going="up", length=1.0, height=0.2)
    corner = Element("landing", length=2.0, turn_deg=90.0)
    between = draw(st.sampled_from([[], [level], [level, slope, level], [corner]]))
    more = [*between, flight()] if draw(st.booleans()) else []
    return [FLOOR, flight(), *more, LANDING, BACK]


def away_from_risers(lane: Lane, n: int = 200) -> np.ndarray:
    """Places along a lane that are not right at a riser [m]."""
    s = np.linspace(0.0, lane.length, n + 2)[1:-1]
    risers, _ = lane.risers()
    return s[np.all(np.abs(s[:, None] - risers) > 1e-6, axis=1)] if len(risers) else s


@settings(max_examples=40, deadline=None)
@given(flights())
def test_the_way_back_is_over_the_same_ground(elements: list[Element]) -> None:
    """Lane for lane from the far end: ground, ends and headings are those of the way there."""
    course = build_course(elements)
    there, back = course.outward, course.lanes[len(course.outward) :]
    assert len(there) == len(back) == course.returning
    for lane, again in zip(there, back[::-1], strict=True):
        s = away_from_risers(lane)
        np.testing.assert_allclose(again.height(again.length - s), lane.height(s), atol=1e-12)
        np.testing.assert_allclose(again.point(again.length - s), lane.point(s), atol=1e-9)
        np.testing.assert_allclose(again.heading, -lane.heading, atol=1e-12)
        np.testing.assert_allclose(course.height(*again.point(s).T), again.height(s), atol=1e-9)
    for k, turn in enumerate(course.turns):
        ahead, after = course.lanes[k], course.lanes[k + 1]
        np.testing.assert_allclose(ahead.point(ahead.length), after.point(0.0), atol=1e-9)
        assert math.remainder(ahead.yaw + turn - after.yaw, math.tau) == pytest.approx(0.0)


@settings(max_examples=40, deadline=None)
@given(flights())
def test_its_flights_have_a_riser_before_each_tread(elements: list[Element]) -> None:
    """As every flight has: the same rises in reverse, up for down, the inner runs as they were."""
    for lane in build_course(elements).outward:
        again = reverse_lane(lane)
        assert len(again.flights) == len(lane.flights)
        for old, new in zip(lane.flights, again.flights[::-1], strict=True):
            assert {old.going, new.going} == {"up", "down"}
            rises = lane.heights[old.first : old.last + 1] - [
                lane.height(lane.breaks[old.first] - 1e-6),
                *lane.heights[old.first : old.last],
            ]
            first = again.heights[new.first] - again.height(again.breaks[new.first] - 1e-6)
            found = [first, *np.diff(again.heights[new.first : new.last + 1])]
            np.testing.assert_allclose(found, -rises[::-1], atol=1e-6)
            runs = np.diff(lane.breaks)[old.first : old.last]
            inner = np.diff(again.breaks)[new.first : new.last]
            np.testing.assert_allclose(inner, runs[::-1], atol=1e-9)
            assert set(again.kinds[new.first : new.last]) <= {"tread"}


def test_nothing_is_built_twice() -> None:
    """Boxes and nosings are those of the way there, and no box runs into another."""
    one = build_course([FLOOR, UP, LANDING])
    both = build_course([FLOOR, UP, LANDING, BACK])
    assert len(both.boxes) == len(one.boxes)
    np.testing.assert_array_equal(both.nosings(), one.nosings())


@pytest.mark.parametrize("turn", [180.0, -180.0])
def test_the_robot_walks_up_turns_in_the_middle_and_walks_down(turn: float) -> None:
    """To the middle of the landing, half a turn the way that is asked for, and to the start."""
    course = build_course([FLOOR, UP, LANDING, Element("return", turn_deg=turn)])
    tasks = derive_mission(course, PlanSettings())
    assert [task.kind for task in tasks] == ["stand", "walk", "spin", "walk", "stand"]
    assert tasks[1].goal == pytest.approx(2.4 + 0.5 + 0.4 + 0.45 + 1.5)
    assert tasks[2].angle == pytest.approx(math.radians(turn))
    assert tasks[3].lane == 1 and tasks[3].goal < course.lanes[1].length == tasks[1].goal


def built(course: Course) -> Course:
    errors = MapErrors(rise=0.01, run=0.02, position=0.05, yaw=0.05, tread=0.005, random=True)
    return build_as_built(course, errors, generator=np.random.default_rng(3))


def test_a_world_unlike_the_map_is_walked_both_ways_too() -> None:
    """It is the world of the way there, and the way back is over its steps and not the map's."""
    one = built(build_course([FLOOR, UP, LANDING]))
    world = built(build_course([FLOOR, UP, LANDING, BACK]))
    assert world.returning == 1
    assert [(b.name, b.top) for b in world.boxes] == [(b.name, b.top) for b in one.boxes]
    lane = world.lanes[1]
    s = away_from_risers(lane)
    np.testing.assert_allclose(world.height(*lane.point(s).T), lane.height(s), atol=1e-9)


@pytest.mark.parametrize(
    ("elements", "field"),
    [
        ([BACK], "course[0].kind"),
        ([FLOOR, BACK, LANDING], "course[1].kind"),
        ([FLOOR, UP, BACK], "course[2].kind"),
        ([FLOOR, UP, Element("landing", length=2.0, turn_deg=90.0), BACK], "course[3].kind"),
        ([FLOOR, UP, Element("landing", length=1.2), BACK], "course[2].length"),
        ([FLOOR, UP, Element("landing", length=3.0, width=1.0), BACK], "course[2].width"),
        ([FLOOR, UP, LANDING, Element("return", turn_deg=90.0)], "course[3].turn_deg"),
        ([FLOOR, UP, LANDING, Element("return", length=2.0)], "course[3].length"),
    ],
)
def test_a_way_back_that_cannot_be_is_refused(elements: list[Element], field: str) -> None:
    """In one line that names the field, wherever it stands in the course."""
    with pytest.raises(InputError) as refused:
        build_course(elements, source="file.yaml")
    assert refused.value.field == field and refused.value.source == "file.yaml"
