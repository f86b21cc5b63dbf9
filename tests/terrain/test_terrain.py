"""Laws of the course: boxes, heights, lanes and nosings are all the same staircase."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from shapely.geometry import Point, Polygon
from terrain_rig import CASE_STUDY

from drake_quad.errors import InputError
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import Element
from drake_quad.terrain.lane import Flight, Lane

few = settings(max_examples=40)  # a course is many places at once
lengths = st.floats(0.3, 5.0)
widths = st.floats(0.8, 2.5) | st.none()
floors = st.builds(Element, st.just("floor"), length=lengths, width=widths)
landings = st.builds(Element, st.just("landing"), length=lengths, width=widths)
regular = st.builds(
    Element,
    st.just("stairs"),
    going=st.sampled_from(["up", "down"]),
    rise=st.floats(0.01, 0.4),
    run=st.floats(0.12, 1.0),
    count=st.integers(1, 6),
    width=widths,
)


@st.composite
def irregular(draw: st.DrawFn) -> Element:
    n = draw(st.integers(1, 5))
    return Element(
        "stairs",
        going=draw(st.sampled_from(["up", "down"])),
        rises=draw(st.lists(st.floats(0.01, 0.4), min_size=n, max_size=n)),
        runs=draw(st.lists(st.floats(0.12, 1.0), min_size=n, max_size=n)),
        width=draw(widths),
    )


turns = st.sampled_from([90.0, -90.0, 180.0, 45.0, -30.0]) | st.floats(-180.0, 180.0)
square = st.builds(Element, st.just("landing"), length=st.floats(1.5, 6.0), turn_deg=turns)
oblique = st.builds(
    Element,
    st.just("landing"),
    length=st.floats(1.5, 6.0),
    width=st.floats(0.8, 1.5),
    turn_deg=st.sampled_from([-120.0, -45.0, 30.0, 60.0]) | st.floats(1.0, 89.0),
)
turned = square | oblique
flights = regular | irregular()
Case = tuple[list[Element], Course]


@st.composite
def courses(draw: st.DrawFn) -> Case:
    """Random courses that do not run into themselves, with the elements they came from."""
    middle = draw(st.lists(floors | landings | flights | turned, max_size=5))
    elements = [draw(floors | turned), *middle, draw(floors | turned)]
    try:
        return elements, build_course(elements)
    except InputError as error:
        assume("runs into" not in str(error))
        raise


def places(course: Course) -> np.ndarray:
    """Some 400 places (n, 2) all over the course and a little beside it."""
    lo, hi = course.bounds()[:, :2]
    rng = np.random.default_rng(0)
    return rng.uniform(lo - 0.5, hi + 0.5, size=(400, 2))


def along(lane: Lane) -> np.ndarray:
    """Places along a lane, run-in and run-out too, none of them within 1 um of a riser."""
    s = np.linspace(-lane.run_in, lane.length + lane.run_out, 301)[1:-1]
    return np.asarray(s[np.abs(s[:, None] - lane.breaks).min(axis=1) > 1e-6])


@few
@given(courses())
def test_height_is_the_top_of_the_highest_box_there(case: Case) -> None:
    """height(x, y) is the highest box's top under the point, by shapely; nan beside them all."""
    _, course = case
    xy = places(course)
    measured = course.height(xy[:, 0], xy[:, 1])
    shapes = [(Polygon(box.corners()), box.top) for box in course.boxes]
    for p, z in list(zip(xy, measured, strict=True))[:60]:
        tops = [top for shape, top in shapes if shape.covers(Point(p))]
        near_edge = any(shape.exterior.distance(Point(p)) < 1e-6 for shape, _ in shapes)
        if not near_edge:
            assert z == max(tops) if tops else math.isnan(z)


@few
@given(courses())
def test_lane_is_the_course_along_its_centre_line(case: Case) -> None:
    """What a lane says of the ground is what the boxes say, also past the pivots of turns."""
    _, course = case
    for lane in course.lanes:
        s = along(lane)
        p_W = lane.point(s)
        np.testing.assert_allclose(
            lane.height(s), course.height(p_W[:, 0], p_W[:, 1]), atol=1e-12, equal_nan=False
        )


@few
@given(courses())
def test_lane_is_level_across_its_width(case: Case) -> None:
    """Anywhere within the half width the ground is as high as on the centre line."""
    _, course = case
    for lane in course.lanes:
        s = along(lane)
        # beside a pivot the next lane's stairs may begin within the run-out: stay on the lane
        s = s[(s > lane.run_in) & (s < lane.length - lane.run_out)]
        for side in (-0.999, 0.999):
            p_W = lane.point(s, side * lane.half_width)
            np.testing.assert_allclose(
                course.height(p_W[:, 0], p_W[:, 1]), lane.height(s), atol=1e-12
            )


@few
@given(courses())
def test_boxes_of_different_elements_share_no_ground(case: Case) -> None:
    """By shapely, no two footprints overlap, save the squares of one landing's oblique turn."""
    _, course = case
    shapes = [(Polygon(box.corners()), box) for box in course.boxes]
    for i, (a, box_a) in enumerate(shapes):
        for b, box_b in shapes[:i]:
            if box_a.element == box_b.element and "landing" in box_a.name:
                assert box_a.top == box_b.top
            else:
                assert a.intersection(b).area < 1e-4


@few
@given(courses())
def test_boxes_stand_on_one_foundation_below_the_lowest_level(case: Case) -> None:
    """Every box reaches the same bottom, 0.2 m below the lowest top: no step floats."""
    _, course = case
    bottoms = [box.centre[2] - 0.5 * box.size[2] for box in course.boxes]
    np.testing.assert_allclose(bottoms, min(box.top for box in course.boxes) - 0.2, atol=1e-12)
    assert len({box.name for box in course.boxes}) == len(course.boxes)


@few
@given(courses())
def test_lanes_join_at_the_pivots(case: Case) -> None:
    """Each lane begins where the one before ended, at its height, turned by the turn."""
    elements, course = case
    assert len(course.turns) == len(course.lanes) - 1
    for before, after, turn in zip(course.lanes[:-1], course.lanes[1:], course.turns, strict=True):
        np.testing.assert_allclose(before.point(before.length), after.p_WL, atol=1e-12)
        assert float(before.height(before.length)) == float(after.height(0.0))
        assert after.yaw - before.yaw == pytest.approx(turn)
    total = sum(element.turn_deg or 0.0 for element in elements)
    assert course.lanes[-1].yaw == pytest.approx(math.radians(total))


@few
@given(courses(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_profile_is_the_height_along_the_way(case: Case, a: float, b: float) -> None:
    """Interpolated away from risers the profile is height(s); it starts and ends at the ends."""
    _, course = case
    for lane in course.lanes:
        s0, s1 = a * lane.length, b * lane.length
        d, z = lane.profile(s0, s1)
        assert d[0] == 0.0 and d[-1] == pytest.approx(abs(s1 - s0))
        assert np.all(np.diff(d) >= 0.0)
        level = np.diff(z) == 0.0
        assert not np.any(level[:-1] & level[1:])  # no point inside a level stretch
        assert z[0] == float(lane.height(s0)) and z[-1] == float(lane.height(s1))
        probe = np.linspace(0.0, d[-1], 60)[1:-1]
        s = s0 + probe * np.sign(s1 - s0)
        clear = np.abs(s[:, None] - lane.breaks).min(axis=1) > 1e-6
        np.testing.assert_allclose(np.interp(probe, d, z)[clear], lane.height(s)[clear], atol=1e-12)


@few
@given(courses(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_profile_walked_backward_is_the_mirror(case: Case, a: float, b: float) -> None:
    """From s1 to s0 the same ground comes in the opposite order."""
    _, course = case
    lane = course.lanes[0]
    d, z = lane.profile(a * lane.length, b * lane.length)
    d_back, z_back = lane.profile(b * lane.length, a * lane.length)
    np.testing.assert_allclose(d_back, (d[-1] - d)[::-1], atol=1e-12)
    np.testing.assert_array_equal(z_back, z[::-1])


def test_profile_has_risers_doubled_and_no_needless_points() -> None:
    """Two risers under one stride of the case study give the polyline that a swing needs."""
    d, z = build_course(CASE_STUDY).lanes[0].profile(4.25, 5.25)
    np.testing.assert_allclose(d, [0.0, 0.25, 0.25, 0.75, 0.75, 1.0])
    np.testing.assert_allclose(z, [0.13, 0.13, 0.26, 0.26, 0.39, 0.39])
    d, z = build_course(CASE_STUDY).lanes[0].profile(7.1, 8.4)  # landing: one level stretch
    np.testing.assert_allclose(d, [0.0, 1.3])
    np.testing.assert_allclose(z, [0.78, 0.78])


def test_profile_of_no_way_at_all_is_a_point_twice() -> None:
    """A swing on the spot still has a start and an end."""
    d, z = build_course(CASE_STUDY).lanes[0].profile(1.0, 1.0)
    np.testing.assert_array_equal(d, [0.0, 0.0])
    np.testing.assert_array_equal(z, [0.0, 0.0])


@given(flights, st.floats(-2.0, 2.0))
def test_up_then_down_returns_to_the_start_height(flight: Element, start: float) -> None:
    """A flight and its mirror image leave the robot as high as it was, at any start height."""
    back: dict[str, Any] = {
        "going": "down" if flight.going == "up" else "up",
        "rises": list(reversed(flight.rises)) if flight.rises is not None else None,
        "runs": list(reversed(flight.runs)) if flight.runs is not None else None,
    }
    floor = Element("floor", length=1.0)
    elements = [floor, flight, floor, dataclasses.replace(flight, **back), floor]
    heights = build_course(elements, start_height=start).lanes[0].heights
    assert heights[0] == start
    assert heights[-1] == pytest.approx(start, abs=1e-12)


@given(st.floats(1.0, 179.0), st.sampled_from([1.0, -1.0]))
def test_turning_there_and_back_gives_back_the_heading(angle: float, side: float) -> None:
    """After a turn by +a and one by -a the robot heads along +x again."""
    elements = [
        Element("floor", length=1.0, width=0.8),
        Element("landing", length=6.0, width=1.0 if angle % 90.0 else None, turn_deg=side * angle),
        Element("floor", length=9.0, width=0.8),
        Element("landing", length=6.0, width=1.0 if angle % 90.0 else None, turn_deg=-side * angle),
        Element("floor", length=1.0, width=0.8),
    ]
    try:
        course = build_course(elements)
    except InputError as error:
        assume("runs into" not in str(error))
        raise
    np.testing.assert_allclose(course.lanes[-1].heading, [1.0, 0.0], atol=1e-12)


@given(st.floats(-90.0, 90.0), st.lists(flights, min_size=1, max_size=2))
def test_what_follows_a_turn_is_only_rotated_by_it(angle: float, stairs: list[Element]) -> None:
    """In lane coordinates the ground after a turn is the same whatever the turn's angle."""
    tail = [*stairs, Element("floor", length=2.0)]
    landing = Element("landing", length=6.0)  # long: clear of the first floor at any angle
    lanes = [
        build_course(
            [Element("floor", length=0.5), dataclasses.replace(landing, turn_deg=turn), *tail]
        ).lanes[-1]
        for turn in (90.0, angle if abs(angle) > 1e-6 else 1.0)
    ]
    np.testing.assert_array_equal(lanes[0].breaks, lanes[1].breaks)
    np.testing.assert_array_equal(lanes[0].heights, lanes[1].heights)
    assert lanes[0].flights == lanes[1].flights


@few
@given(courses())
def test_mirrored_turns_give_the_mirrored_course(case: Case) -> None:
    """With every turn to the other side the ground is mirrored in the x-z plane."""
    elements, course = case
    mirrored = build_course(
        [dataclasses.replace(e, turn_deg=e.turn_deg and -e.turn_deg) for e in elements]
    )
    xy = places(course)
    a, b = course.height(xy[:, 0], xy[:, 1]), mirrored.height(xy[:, 0], -xy[:, 1])
    same = (a == b) | (np.isnan(a) & np.isnan(b)) | (np.abs(a - b) < 1e-12)
    assert same.mean() > 0.99  # a place within rounding of an edge may fall to either side


@few
@given(courses(), st.floats(-1.0, 9.0), st.floats(-2.0, 2.0))
def test_lane_coordinates_invert_point(case: Case, s: float, lateral: float) -> None:
    """coordinates(point(s, lateral)) gives back s and lateral."""
    _, course = case
    for lane in course.lanes:
        back = lane.coordinates(lane.point(s, lateral))
        np.testing.assert_allclose(back, (s, lateral), atol=1e-9)


@few
@given(courses())
def test_a_nosing_is_a_convex_edge_of_the_ground(case: Case) -> None:
    """At every nosing the ground is the nosing's height on one side and lower on the other."""
    _, course = case
    risers = 0
    for lane in course.lanes:
        for s, z in lane.nosings():
            beside = lane.height(np.array([s - 1e-6, s + 1e-6]))
            assert beside.max() == z == float(lane.height(s))
            assert beside.min() < z
            risers += 1
    assert course.nosings().shape == (risers, 2, 3)
    assert risers == sum(e.step_count for e in case[0] if e.kind == "stairs")


@few
@given(courses())
def test_course_nosings_lie_on_the_course(case: Case) -> None:
    """The ends of each nosing are on the ground at their own height, in W."""
    _, course = case
    ends = course.nosings().reshape(-1, 3)
    inward = 0.999 * ends[:, :2] + 0.001 * np.repeat(
        course.nosings()[:, :, :2].mean(axis=1), 2, axis=0
    )
    np.testing.assert_allclose(course.height(inward[:, 0], inward[:, 1]), ends[:, 2], atol=1e-9)


def test_six_stairs_are_six_risers() -> None:
    """The case study climbs 6 x 0.13 m in 6 x 0.50 m; its last tread is flush with the landing."""
    course = build_course(CASE_STUDY)
    up, down = course.lanes
    assert list(course.turns) == pytest.approx([math.pi / 2])
    assert up.kinds == ("floor", *["tread"] * 6, "landing")
    assert up.flights == (Flight(1, 6, "up"),) and down.flights == (Flight(1, 6, "down"),)
    assert up.heights[6] == up.heights[7] == pytest.approx(0.78)
    assert up.length == pytest.approx(4.0 + 3.0 + 1.5) and up.run_out == 1.5
    assert down.heights[-1] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(
        up.treads(up.flights[0])[[0, 5]], [[4.0, 4.5, 0.13], [6.5, 7.0, 0.78]]
    )
    np.testing.assert_allclose(course.bounds(), [[0.0, -1.5, -0.2], [10.0, 8.0, 0.78]])


def test_a_riser_bears_on_its_upper_side() -> None:
    """Exactly at a riser the ground is the higher tread, going up and going down."""
    up, down = build_course(CASE_STUDY).lanes
    assert float(up.height(4.0)) == pytest.approx(0.13)
    assert float(down.height(1.5)) == pytest.approx(0.78)


def test_off_the_course_there_is_no_ground() -> None:
    """Beyond the ends of a lane and beside the course the height is nan, not a guess."""
    course = build_course(CASE_STUDY)
    assert np.isnan(course.lanes[0].height([-0.01, 10.01])).all()
    assert np.isnan(course.height([-0.01, 5.0], [0.0, 1.01])).all()


@given(st.floats(-180.0, 180.0), st.floats(1.5, 6.0))
def test_ground_to_turn_on_reaches_all_around_the_pivot(turn: float, length: float) -> None:
    """On a landing to turn on there is ground around the pivot as far as run_in says."""
    assume(abs(turn) > 1e-3)
    course = build_course([Element("landing", length=length, turn_deg=turn)])
    after = course.lanes[1]
    assert 0.5 * length / math.sqrt(2.0) - 1e-9 <= after.run_in <= 0.5 * length + 1e-9
    angles = np.linspace(0.0, 2.0 * math.pi, 73)
    rim = after.p_WL + 0.999 * after.run_in * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    assert not np.isnan(course.height(rim[:, 0], rim[:, 1])).any()


def test_values_cannot_be_written_to() -> None:
    """A course is frozen: its arrays too."""
    course = build_course(CASE_STUDY)
    for array in (course.boxes[0].centre, course.lanes[0].breaks, course.lanes[1].heights):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_a_course_can_begin_elsewhere_and_head_another_way() -> None:
    """Laid from another origin, height and heading, it is the same course moved as a whole."""
    elements = [
        Element(kind="floor", length=2.0),
        Element(kind="stairs", going="up", rise=0.15, run=0.3, count=3),
        Element(kind="landing", length=2.0, turn_deg=90.0),
        Element(kind="floor", length=1.5),
    ]
    origin, yaw = np.array([1.0, -2.0]), 0.3
    R = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    usual = build_course(elements)
    moved = build_course(elements, origin=(1.0, -2.0), yaw=yaw, start_height=0.5)
    for a, b in zip(usual.boxes, moved.boxes, strict=True):
        assert b.centre == pytest.approx([*(origin + R @ a.centre[:2]), a.centre[2] + 0.5])
        assert b.yaw == pytest.approx(a.yaw + yaw) and b.size == pytest.approx(a.size)
    for lane, other in zip(usual.lanes, moved.lanes, strict=True):
        assert other.point(0.7, 0.2) == pytest.approx(origin + R @ lane.point(0.7, 0.2))
