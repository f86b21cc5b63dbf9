"""Stairs as they are built: with noses, with open risers; and blocks, curbs and slopes."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.math.rotations import rotation
from drake_quad.terrain.as_built import MapErrors, build_as_built
from drake_quad.terrain.boxes import Box
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import Element

FLOOR = Element("floor", length=2.0)
STAIRS = Element("stairs", going="up", rise=0.15, run=0.4, count=3)
SLOPE = Element("slope", going="up", length=2.0, height=0.3)
TURN = Element("landing", length=3.0, turn_deg=37.0)

few = settings(max_examples=30)
styles = st.fixed_dictionaries(
    {
        "overhang": st.sampled_from([None, 0.0, 0.02, 0.05]),
        "open": st.sampled_from([None, False, True]),
    }
)
senses = st.sampled_from(["up", "down"])


def course_with(flight: Element, *, turn: float = 37.0) -> Course:
    """The flight, a turn, and the flight again."""
    landing = dataclasses.replace(TURN, turn_deg=turn)
    return build_course([FLOOR, flight, landing, flight, FLOOR])


def holds(box: Box, p_W: FloatArray) -> np.ndarray:
    """Which points (n, 3) are inside a box, by its centre, size, yaw and pitch alone."""
    c, s = math.cos(box.pitch), math.sin(box.pitch)
    about_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    about_z = np.eye(3)
    about_z[:2, :2] = rotation(box.yaw)
    return np.all(np.abs((p_W - box.centre) @ (about_z @ about_y)) <= 0.5 * box.size, axis=1)


def solid(course: Course, x: Any, y: Any, z: Any) -> np.ndarray:
    """Which points are inside of some box."""
    p_W = np.column_stack([np.ravel(v) for v in np.broadcast_arrays(x, y, z)])
    return np.any([holds(box, p_W) for box in course.boxes], axis=0)


def places(course: Course, n: int = 500) -> FloatArray:
    """Places (n, 2) all over the course and a little beside it."""
    lo, hi = course.bounds()[:, :2]
    return np.random.default_rng(1).uniform(lo - 0.2, hi + 0.2, size=(n, 2))


@few
@given(styles, senses)
def test_from_above_noses_and_open_risers_change_nothing(style: dict[str, Any], going: str) -> None:
    """Ground, lanes and nosings are those of the same stairs without: runs are seen from above."""
    plain = dataclasses.replace(STAIRS, going=going)
    built, course = course_with(dataclasses.replace(plain, **style)), course_with(plain)
    xy = places(course).T
    np.testing.assert_allclose(built.height(*xy), course.height(*xy), atol=1e-12)
    for a, b in zip(built.lanes, course.lanes, strict=True):
        np.testing.assert_array_equal(a.breaks, b.breaks)
        np.testing.assert_array_equal(a.heights, b.heights)
    np.testing.assert_array_equal(built.nosings(), course.nosings())


@pytest.mark.parametrize("going", ["up", "down"])
@pytest.mark.parametrize("overhang", [0.02, 0.06])
def test_under_a_nose_there_is_air_back_to_the_riser(going: str, overhang: float) -> None:
    """Below each nosing, on the side of the upper tread, as deep as the overhang and no deeper."""
    flight = dataclasses.replace(STAIRS, going=going, overhang=overhang, thickness=0.03)
    course = course_with(flight)
    for lane in course.lanes:
        for s, z in lane.nosings():
            under = z - 0.03 - 0.04  # in the middle of what is left of the riser
            back = (1.0 if going == "up" else -1.0) * overhang
            at = [lane.point(s + share * back, 0.3) for share in (0.02, 0.5, 0.98, 1.02)]
            x, y = np.array(at).T
            assert solid(course, x, y, under).tolist() == [False, False, False, True]
            assert solid(course, x, y, z - 0.015).all()  # the nose itself


@pytest.mark.parametrize("going", ["up", "down"])
def test_between_open_treads_there_is_air_down_to_the_ground(going: str) -> None:
    """A tread is a board as thick as told; the ground of the lower end goes on under the flight."""
    flight = dataclasses.replace(STAIRS, going=going, open=True, thickness=0.05, count=4)
    course = build_course([FLOOR, flight, FLOOR])
    lane = course.lanes[0]
    boards = lane.treads(lane.flights[0])
    low = min(lane.heights)
    for a, b, z in boards[boards[:, 2] > low + 1e-9]:
        x = np.linspace(a + 0.01, b - 0.01, 7)
        assert solid(course, x, 0.3, z - 0.04).all()
        assert not solid(course, x, 0.3, z - 0.06).any()
        assert not solid(course, x, 0.3, low + 0.01).any()
        assert solid(course, x, 0.3, low - 0.01).all()


@few
@given(st.floats(0.02, 0.2), senses)
def test_noses_and_treads_share_no_space(overhang: float, going: str) -> None:
    """No two solids of a flight with noses reach into one another, nor into its neighbours."""
    flight = dataclasses.replace(STAIRS, going=going, overhang=overhang)
    course = build_course([FLOOR, flight, FLOOR])
    spans = np.array(
        [
            [(box.centre[i] - 0.5 * box.size[i], box.centre[i] + 0.5 * box.size[i]) for i in (0, 2)]
            for box in course.boxes
        ]
    )
    for i, a in enumerate(spans):
        for b in spans[:i]:
            shared = np.minimum(a[:, 1], b[:, 1]) - np.maximum(a[:, 0], b[:, 0])
            assert np.min(shared) < 1e-9


@few
@given(styles, senses, st.floats(-0.06, 0.06), st.integers(0, 99))
def test_the_real_course_is_built_like_the_map(
    style: dict[str, Any], going: str, yaw: float, seed: int
) -> None:
    """With errors too, noses and open risers change nothing from above, and are still there."""
    plain = dataclasses.replace(STAIRS, going=going)
    flight = dataclasses.replace(plain, **style)
    errors = MapErrors(yaw=yaw, position=0.05, rise=0.01, run=0.01, tread=0.005, random=True)
    built, course = (
        build_as_built(course_with(f), errors, generator=np.random.default_rng(seed))
        for f in (flight, plain)
    )
    for lane in course.lanes:
        draws = np.random.default_rng(2).uniform(-1.0, 1.0, size=(2, 200))
        xy = lane.point(0.5 * lane.length * (1.0 + draws[0]), 0.99 * lane.half_width * draws[1]).T
        np.testing.assert_allclose(built.height(*xy), course.height(*xy), atol=1e-9)
    mapped = [box.name for box in course_with(flight).boxes]
    assert [b.name for b in built.boxes if "apron" not in b.name] == mapped
    if style["overhang"] and not style["open"]:
        for lane in built.lanes:
            own = lane.flights[0]
            back = (1.0 if going == "up" else -1.0) * own.overhang / math.cos(own.yaw)
            s, z = lane.nosings()[1]
            x, y = lane.point(s + np.array([0.5, 1.5]) * back, 0.0).T
            assert solid(built, x, y, z - 0.05).tolist() == [False, True]


@pytest.mark.parametrize("going", ["up", "down"])
@pytest.mark.parametrize("turn", [0.0, 90.0, -37.0])
def test_a_slope_rises_evenly_from_level_to_level(going: str, turn: float) -> None:
    """All across its width; and the solid ends there: just below is inside, just above outside."""
    slope = dataclasses.replace(SLOPE, going=going)
    landing = dataclasses.replace(TURN, turn_deg=turn)
    course = build_course([FLOOR, landing, FLOOR, slope, FLOOR])
    lane, sign = course.lanes[-1], 1.0 if going == "up" else -1.0
    k = lane.kinds.index("slope")
    share = np.linspace(0.0, 1.0, 21)[:, None]
    s = lane.breaks[k] + 2.0 * share
    x, y = lane.point(s, np.linspace(-0.99, 0.99, 5)).reshape(-1, 2).T
    z = np.broadcast_to(sign * 0.3 * share, (21, 5)).ravel()
    np.testing.assert_allclose(course.height(x, y), z, atol=1e-9)
    np.testing.assert_allclose(lane.height(s).ravel(), sign * 0.3 * share.ravel(), atol=1e-12)
    np.testing.assert_allclose(lane.gradient(s[1:-1]), sign * 0.15)
    x, y, z = (v.reshape(21, 5)[1:-1].ravel() for v in (x, y, z))
    assert solid(course, x, y, z - 1e-4).all() and not solid(course, x, y, z + 1e-4).any()
    assert len(lane.nosings()) == 0
    d, heights = lane.profile(float(s[0, 0]) - 0.5, float(s[-1, 0]) + 0.5)
    np.testing.assert_allclose(d, [0.0, 0.5, 2.5, 3.0])
    np.testing.assert_allclose(heights, [0.0, 0.0, sign * 0.3, sign * 0.3], atol=1e-12)


def test_a_slope_walked_backward_is_the_mirror() -> None:
    """From its upper end to its lower the same ground comes in the opposite order."""
    lane = build_course([FLOOR, SLOPE, FLOOR]).lanes[0]
    d, z = lane.profile(1.0, 3.1)
    d_back, z_back = lane.profile(3.1, 1.0)
    np.testing.assert_allclose(d_back, (d[-1] - d)[::-1], atol=1e-12)
    np.testing.assert_allclose(z_back, z[::-1], atol=1e-12)


@given(st.floats(0.02, 0.3), st.floats(0.1, 2.0))
def test_a_block_is_stepped_on_and_off(height: float, length: float) -> None:
    """Two risers, as high up as down, the block between them; past it the ground is as before."""
    block = Element("block", length=length, height=height)
    lane = build_course([FLOOR, block, FLOOR]).lanes[0]
    np.testing.assert_allclose(lane.nosings(), [[2.0, height], [2.0 + length, height]])
    np.testing.assert_allclose(lane.height([1.0, 2.0 + 0.5 * length, 3.0 + length]), [0, height, 0])
    np.testing.assert_allclose(lane.single_risers(), [2.0, 2.0 + length])


def test_a_curb_is_one_riser() -> None:
    """It has no length; up and down again gives back the height; what is between is one level."""
    up, down = (Element("curb", going=going, height=0.12) for going in ("up", "down"))
    course = build_course([FLOOR, up, FLOOR, down, FLOOR])
    lane = course.lanes[0]
    assert lane.length == 6.0 and len(course.boxes) == 3
    np.testing.assert_allclose(lane.nosings(), [[2.0, 0.12], [4.0, 0.12]])
    np.testing.assert_allclose(course.height([1.0, 3.0, 5.0], 0.0), [0.0, 0.12, 0.0])


def test_the_riser_of_a_curb_before_stairs_is_the_flights() -> None:
    """Right before a flight a curb makes its first riser higher: it is no riser of its own."""
    lane = build_course([FLOOR, Element("curb", going="up", height=0.05), STAIRS, FLOOR]).lanes[0]
    assert len(lane.single_risers()) == 0
    np.testing.assert_allclose(lane.nosings()[:, 1], [0.2, 0.35, 0.5])


def test_with_errors_blocks_curbs_and_slopes_keep_their_shape() -> None:
    """Only flights differ; what follows one is as much higher as its last tread, slopes too."""
    kinds = [Element("block", length=0.5, height=0.1), Element("curb", going="up", height=0.1)]
    elements = [FLOOR, STAIRS, FLOOR, *kinds, FLOOR, SLOPE, FLOOR]
    course = build_course(elements)
    world = build_as_built(course, MapErrors(rise=0.01), generator=np.random.default_rng(0))
    s = np.linspace(2.0 + 3 * 0.4 + 0.1, course.lanes[0].length - 0.01, 300)
    np.testing.assert_allclose(world.height(s, 0.0) - course.height(s, 0.0), 0.03, atol=1e-9)
    np.testing.assert_allclose(world.lanes[0].height(s), world.height(s, 0.0), atol=1e-9)


def test_a_slope_beside_stairs_is_refused_where_the_stairs_may_move() -> None:
    """There is no level ground that could give way."""
    course = build_course([FLOOR, SLOPE, STAIRS, FLOOR])
    with pytest.raises(InputError, match=r"course\[2\].*slope"):
        build_as_built(course, MapErrors(position=0.01), generator=np.random.default_rng(0))


@pytest.mark.parametrize("turn", [37.0, -37.0, 60.0, 120.0, -120.0])
def test_flights_meet_at_any_angle_that_has_room(turn: float) -> None:
    """A landing of 3.5 m takes flights of 2 m at up to 120 degrees, no width given."""
    landing = Element("landing", length=3.5, turn_deg=turn)
    course = build_course([FLOOR, STAIRS, landing, STAIRS, FLOOR])
    assert course.lanes[1].yaw == pytest.approx(math.radians(turn))


@pytest.mark.parametrize("turn", [150.0, 180.0])
def test_flights_that_would_meet_side_by_side_are_refused(turn: float) -> None:
    """The second would lie on the first: that takes two landings."""
    with pytest.raises(InputError, match="runs into"):
        build_course([FLOOR, STAIRS, Element("landing", length=3.5, turn_deg=turn), STAIRS, FLOOR])


WRONG = [
    (dataclasses.replace(STAIRS, overhang=-0.01), "overhang", "half of the shortest run"),
    (dataclasses.replace(STAIRS, overhang=0.21), "overhang", "half of the shortest run"),
    (dataclasses.replace(STAIRS, overhang=0.02, thickness=0.15), "thickness", "thinner"),
    (dataclasses.replace(STAIRS, open=True, rise=0.03), "thickness", "thinner"),
    (dataclasses.replace(STAIRS, open=True, thickness=0.0), "thickness", "more than 0"),
    (dataclasses.replace(STAIRS, thickness=0.03), "thickness", "only of treads"),
    (dataclasses.replace(STAIRS, height=0.1), "height", "stairs has no height"),
    (dataclasses.replace(FLOOR, overhang=0.1), "overhang", "floor has no overhang"),
    (dataclasses.replace(FLOOR, going="up"), "going", "floor has no going"),
    (dataclasses.replace(SLOPE, height=1.5), "height", "too steep"),
    (dataclasses.replace(SLOPE, height=-0.3), "height", "more than 0"),
    (dataclasses.replace(SLOPE, length=None), "length", "must say its length"),
    (dataclasses.replace(SLOPE, going=None), "going", "up or down"),
    (Element("block", length=0.5), "height", "must say its height"),
    (Element("block", length=0.5, height=0.0), "height", "more than 0"),
    (Element("curb", going="up", height=0.1, length=1.0), "length", "curb has no length"),
    (Element("curb", going="up", height=0.1, width=1.0), "width", "curb has no width"),
    (Element("curb", height=0.1), "going", "up or down"),
]


@pytest.mark.parametrize(("element", "field", "remedy"), WRONG)
def test_a_wrong_field_is_named(element: Element, field: str, remedy: str) -> None:
    """The error names the path of the wrong field and says what would be right."""
    with pytest.raises(InputError) as caught:
        build_course([FLOOR, element, FLOOR])
    assert caught.value.field == f"course[1].{field}" and remedy in caught.value.remedy


@pytest.mark.parametrize("element", [SLOPE, Element("block", length=0.5, height=0.1)])
def test_a_course_begins_and_ends_on_level_ground(element: Element) -> None:
    """A robot cannot begin or end on a slope, a block or a curb."""
    for elements in ([element, FLOOR], [FLOOR, element]):
        with pytest.raises(InputError, match="begins and ends"):
            build_course(elements)


def test_noses_that_reach_back_need_ground_to_reach_from() -> None:
    """Stairs down with an overhang begin at the edge of a floor or a landing, not of a slope."""
    down = dataclasses.replace(STAIRS, going="down", overhang=0.03)
    up = dataclasses.replace(STAIRS, overhang=0.03)
    assert build_course([FLOOR, SLOPE, up, FLOOR]).boxes
    with pytest.raises(InputError, match=r"course\[2\]\.overhang"):
        build_course([FLOOR, SLOPE, down, FLOOR])


@pytest.mark.parametrize("side", [1, -1])
def test_a_half_turn_back_onto_its_flight_is_told_a_way_that_works(side: int) -> None:
    """Two quarter turns on landings one after the other lead back beside it."""
    flight = Element(kind="stairs", going="up", rise=0.15, run=0.3, count=5)
    ends = Element(kind="floor", length=3.0)
    half = Element(kind="landing", length=2.5, turn_deg=side * 180)
    with pytest.raises(InputError, match=rf"two landings.*turn_deg: {side * 90}$"):
        build_course([ends, flight, half, flight, ends])
    quarter = Element(kind="landing", length=2.5, turn_deg=side * 90)
    course = build_course([ends, flight, quarter, quarter, flight, ends])
    assert len(course.lanes) == 3
