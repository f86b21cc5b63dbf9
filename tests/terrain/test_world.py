"""A world unlike the map: by as much as was said, whole, and with ground under the robot."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.terrain.as_built import MapErrors, build_as_built
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import Element

UP = Element("stairs", going="up", rise=0.13, run=0.5, count=4)
DOWN = Element("stairs", going="down", rise=0.13, run=0.5, count=4)
FLOOR, END = Element("floor", length=3.0), Element("floor", length=2.5)


def turning(turn: float = 90.0) -> Course:
    landing = Element("landing", length=3.5, turn_deg=turn)
    return build_course([FLOOR, UP, landing, DOWN, END])


def straight(*, going: str = "up") -> Course:
    flights = (UP, DOWN) if going == "up" else (DOWN, UP)
    return build_course([FLOOR, flights[0], Element("landing", length=2.0), flights[1], END])


def real(course: Course, seed: int = 0, **errors: object) -> Course:
    given_errors = MapErrors(**errors)  # type: ignore[arg-type]
    return build_as_built(course, given_errors, generator=np.random.default_rng(seed))


def treads(course: Course) -> FloatArray:
    """Middle in W and top (n, 3) of every tread, in walking order."""
    return np.array([[*b.centre[:2], b.top] for b in course.boxes if "_tread_" in b.name])


def heights_along(course: Course, on: Course) -> list[FloatArray]:
    """The ground of `course` along the lanes of `on`, from start to end."""
    found = []
    for lane in on.lanes:
        x, y = lane.point(np.linspace(0.001, lane.length - 0.001, 997)).T
        found.append(course.height(x, y))
    return found


def test_without_errors_it_is_the_map_itself() -> None:
    """The very same object: nothing can differ. Nor without stairs."""
    course = turning()
    assert real(course) is course and real(course, random=True) is course
    flat = build_course([FLOOR])
    assert real(flat, rise=0.01, yaw=0.1, tread=0.01) is flat


@pytest.mark.parametrize("rise", [0.01, -0.02])
def test_every_rise_is_off_and_what_follows_is_raised(rise: float) -> None:
    """Up the errors add up, down they take each other away; landings are level with the treads."""
    course, world = turning(), real(turning(), rise=rise)
    up, down = np.arange(1, 5) * rise, np.arange(3, -1, -1) * rise
    np.testing.assert_allclose(treads(world)[:, 2] - treads(course)[:, 2], [*up, *down])
    by_name = {box.name: box.top for box in world.boxes}
    assert by_name["floor_0"] == 0.0
    assert by_name["landing_2"] == pytest.approx(4 * (0.13 + rise))
    assert by_name["floor_4"] == pytest.approx(0.0)
    np.testing.assert_allclose(treads(world)[:, :2], treads(course)[:, :2])
    for lane, old in zip(world.lanes, course.lanes, strict=True):
        rises, before = np.diff(lane.heights), np.diff(old.heights)
        np.testing.assert_allclose(np.abs(rises), np.abs(before) + rise * (before != 0.0))


@pytest.mark.parametrize("position", [0.1, -0.1])
def test_flights_are_farther_along_each_for_itself(position: float) -> None:
    """Both by the same: the second is not moved by the first's error as well."""
    course, world = turning(), real(turning(), position=position)
    moved = treads(world) - treads(course)
    np.testing.assert_allclose(moved[:4], np.tile([position, 0.0, 0.0], (4, 1)), atol=1e-12)
    np.testing.assert_allclose(moved[4:], np.tile([0.0, position, 0.0], (4, 1)), atol=1e-12)


def test_runs_are_off_about_the_flights_middle() -> None:
    """Every tread is as much deeper; the flight reaches as far before its place as past it."""
    course, world = straight(), real(straight(), run=0.02)
    depth = [b.size[0] for b in world.boxes if "_tread_" in b.name]
    np.testing.assert_allclose(depth, 0.52)
    np.testing.assert_allclose(
        (treads(world) - treads(course))[:4, 0], 0.02 * np.array([-1.5, -0.5, 0.5, 1.5]), atol=1e-12
    )


def strip(course: Course, n: int = 150, m: int = 41) -> FloatArray:
    """Places (n * m, 2) in W all over the strip along the lanes, as wide as the flights."""
    places = []
    for lane in course.lanes:
        s = np.linspace(0.0, lane.length, n)[:, None]
        places.append(lane.point(s, lane.half_width * np.linspace(-1.0, 1.0, m)).reshape(-1, 2))
    return np.concatenate(places)


def turned_stairs(places: FloatArray, yaw: float, *, going: str, rise: float) -> FloatArray:
    """The height of `straight` at places (n, 2) if its flights were turned: by geometry alone.

    Each flight as if endless to both sides, steps along a direction turned about its middle.
    """
    along = np.array([np.cos(yaw), np.sin(yaw)])
    z = np.zeros(len(places))
    for middle, sign in ((4.0, 1.0), (8.0, -1.0)):
        s = (places - [middle, 0.0]) @ along + 1.0
        z += (sign if going == "up" else -sign) * rise * np.clip(np.floor(s / 0.5) + 1.0, 0.0, 4.0)
    return z


@pytest.mark.parametrize("yaw", [0.05, -0.05, 0.2])
@pytest.mark.parametrize("going", ["up", "down"])
def test_each_flight_is_turned_about_its_own_middle(yaw: float, going: str) -> None:
    """All over the strip the ground is that of turned stairs: no gap, nothing that sticks out."""
    course = straight(going=going)
    world = real(course, yaw=yaw, rise=0.01)
    places = strip(course)
    near = np.min(
        [np.abs((places - [m, 0.0]) @ [np.cos(yaw), np.sin(yaw)] - r)
         for m in (4.0, 8.0) for r in np.linspace(-1.0, 1.0, 5)], axis=0)  # fmt: skip
    expected = turned_stairs(places, yaw, going=going, rise=0.14)
    clear = near > 1e-6
    found = world.height(*places.T)
    np.testing.assert_allclose(found[clear], expected[clear], atol=1e-12)
    assert np.all(np.isfinite(found))


def test_floors_and_landings_stay_where_the_map_has_them() -> None:
    """Turned flights turn nothing that follows: the lanes' middle lines and ends are the map's."""
    course = turning()
    world = real(course, yaw=0.05)
    for lane, old in zip(world.lanes, course.lanes, strict=True):
        np.testing.assert_array_equal(lane.p_WL, old.p_WL)
        assert lane.yaw == old.yaw and lane.length == old.length
    kept = {box.name: box.yaw for box in world.boxes if "tread" not in box.name}
    assert kept["landing_2"] == 0.0 and kept["floor_0"] == 0.0 and kept["floor_4"] == np.pi / 2
    np.testing.assert_allclose(treads(world)[:, 1][:4], 0.0, atol=1e-12)  # on the middle line


@pytest.mark.parametrize("turn", [90.0, -90.0, 45.0])
def test_nosings_are_drawn_where_the_ground_steps(turn: float) -> None:
    """On either side of a nosing, all along it, are the two heights of its riser."""
    world = real(turning(turn), yaw=-0.05, position=0.03, rise=0.01)
    assert len(world.nosings()) == 8
    for k, (right, left) in enumerate(world.nosings()):
        across = (left - right)[:2]
        ahead = np.array([across[1], -across[0]]) / np.hypot(*across)
        at = right[:2] + np.linspace(0.02, 0.98, 21)[:, None] * across
        at = at[np.abs(world.lanes[k // 4].coordinates(at)[1]) < 0.99]  # the flight is 2 m wide
        before, after = (world.height(*(at + d * ahead).T) for d in (-1e-4, 1e-4))
        assert len(at) > 5
        np.testing.assert_allclose(after - before, 0.14 if k < 4 else -0.14, atol=1e-12)
        np.testing.assert_allclose(np.maximum(before, after), right[2], atol=1e-12)


def test_left_and_right_are_alike() -> None:
    """A course that turns the other way, errors turned the other way: the mirror image."""
    course, mirrored = turning(60.0), turning(-60.0)
    one = real(course, 3, yaw=0.04, position=0.05, rise=0.01, tread=0.01)
    other = real(mirrored, 3, yaw=-0.04, position=0.05, rise=0.01, tread=0.01)
    for a, b in zip(one.boxes, other.boxes, strict=True):
        assert a.name == b.name and a.yaw == pytest.approx(-b.yaw)
        np.testing.assert_allclose(a.centre, b.centre * [1.0, -1.0, 1.0], atol=1e-12)
        np.testing.assert_allclose(a.size, b.size, atol=1e-12)


def test_each_flight_has_its_own_yaw() -> None:
    """Drawn within minus and plus the value, for one flight not as for the next, both signs."""
    yaws = np.array(
        [
            [lane.flights[0].yaw for lane in real(turning(), seed, yaw=0.05, random=True).lanes]
            for seed in range(60)
        ]
    )
    assert np.abs(yaws).max() <= 0.05
    assert np.all(yaws.min(axis=0) < -0.035) and np.all(yaws.max(axis=0) > 0.035)
    assert abs(np.corrcoef(yaws.T)[0, 1]) < 0.5


def test_treads_are_off_by_the_seed_within_what_was_said() -> None:
    """Another seed, other treads; the same, the same; all within; what follows stays level."""
    course = turning()
    off = [treads(real(course, seed=k, tread=0.01)) - treads(course) for k in (1, 1, 2)]
    np.testing.assert_array_equal(off[0], off[1])
    assert np.abs(off[0] - off[2]).max() > 0.001
    up = off[0][:4, 2]
    assert np.all(np.abs(up) <= 0.01) and np.ptp(up) > 0.001
    assert np.all(np.abs(off[0][4:, 2] - up[-1]) <= 0.01)
    world = real(course, seed=1, tread=0.01)
    by_name = {box.name: box.top for box in world.boxes}
    assert by_name["landing_2"] == by_name["stairs_1_tread_4"]
    assert by_name["floor_4"] == by_name["stairs_3_tread_4"]


def test_random_errors_are_drawn_evenly_between_minus_and_plus() -> None:
    """Over many seeds they fill the range, on both sides of zero, and no farther."""
    course = straight()
    first, second, rises = [], [], []
    for seed in range(60):
        moved = treads(real(course, seed, position=0.1, rise=0.02, random=True)) - treads(course)
        first.append(moved[0, 0])
        second.append(moved[4, 0])
        rises.append(moved[0, 2])
    for values, most in ((first, 0.1), (second, 0.1), (rises, 0.02)):
        assert np.max(np.abs(values)) <= most
        assert min(values) < -0.7 * most and max(values) > 0.7 * most
        assert abs(np.mean(values)) < 0.25 * most
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.5  # each flight has its own


def test_whether_random_or_not_the_treads_are_the_same() -> None:
    """What one error draws does not depend on another."""
    a, b = (treads(real(straight(), 5, tread=0.01, random=r)) for r in (False, True))
    np.testing.assert_array_equal(a, b)


@settings(max_examples=60)
@given(
    st.integers(0, 10**6),
    st.floats(-0.02, 0.02),
    st.floats(-0.02, 0.02),
    st.floats(-0.1, 0.1),
    st.floats(-0.06, 0.06),
    st.floats(0.0, 0.02),
    st.sampled_from([90.0, -90.0, None]),
)
def test_there_is_ground_wherever_the_map_has_some(
    seed: int, rise: float, run: float, position: float, yaw: float, tread: float, turn: float
) -> None:
    """All over the map's lanes no hole opens, steps stay steps, and the start stays as it is."""
    course = straight() if turn is None else turning(turn)
    world = real(
        course, seed, rise=rise, run=run, position=position, yaw=yaw, tread=tread, random=True
    )
    assert np.all(np.isfinite(world.height(*strip(course, 70, 9).T)))
    for heights, expected in zip(
        heights_along(world, course), heights_along(course, course), strict=True
    ):
        assert np.all(np.isfinite(heights))
        assert np.abs(np.diff(heights)).max() < 0.13 + 0.02 + 0.04 + 1e-9
        assert np.abs(heights - expected).max() < 2 * 0.13 + 8 * 0.02 + 2 * 0.02
    assert len(world.nosings()) == len(course.nosings())
    x, y = np.meshgrid(np.linspace(0.01, 2.3, 12), np.linspace(-0.99, 0.99, 5))
    np.testing.assert_allclose(world.height(x, y), 0.0, atol=1e-12)
    assert len({box.name for box in world.boxes}) == len(world.boxes)


def test_flights_that_meet_move_together() -> None:
    """With no level ground between, the top stays joined."""
    course = build_course([FLOOR, UP, DOWN, END])
    world = real(course, position=0.1, random=True)
    moved = (treads(world) - treads(course))[:, 0]
    assert np.ptp(moved) < 1e-12 and moved[0] != 0.0


def test_an_oblique_turn_is_no_obstacle() -> None:
    """Where the landing is not made of right angles, it has ground, and no corner over a tread."""
    course = turning(45.0)
    world = real(course, position=-0.05, yaw=0.03, rise=0.005)
    assert np.all(np.isfinite(world.height(*strip(course).T)))
    lane = world.lanes[1]
    past = lane.breaks[lane.flights[0].first] + 1.0 * np.tan(0.03) + 1e-4
    x, y = lane.point(past, np.linspace(-0.99, 0.99, 99)).T
    np.testing.assert_allclose(world.height(x, y), lane.height(past), atol=1e-12)


@pytest.mark.parametrize(
    ("errors", "field"),
    [
        ({"rise": -0.13}, "world.rise_error"),
        ({"tread": 0.3}, "world.tread_error"),
        ({"tilt": 0.3}, "world.tread_tilt"),
        ({"run": -0.45}, "world.run_error"),
        ({"position": 2.3}, "world.position_error"),
        ({"position": -2.8}, "world.position_error"),
        ({"yaw": 1.3}, "world.yaw_error_deg"),
        ({"yaw": -0.7}, "world.yaw_error_deg"),
    ],
)
def test_a_world_that_cannot_be_is_refused(errors: dict[str, Any], field: str) -> None:
    """No rise, no tread, no level ground: an input error that names the field."""
    with pytest.raises(InputError) as caught:
        real(straight(), **errors)
    assert caught.value.field == field and caught.value.remedy


@given(st.sampled_from(["up", "down"]), st.floats(-0.2, 0.2), st.floats(-0.05, 0.05))
def test_treads_fall_towards_their_nosings_about_their_middles(
    going: str, tilt: float, yaw: float
) -> None:
    """Ahead of its middle a tread is higher going up, lower going down; the last is level."""
    course = straight(going=going)
    flat, world = real(course, yaw=yaw), real(course, yaw=yaw, tilt=tilt)
    np.testing.assert_allclose(treads(world)[:, 2], treads(flat)[:, 2], atol=1e-9)
    lane = world.outward[0]
    for flight in lane.flights:
        for k in range(flight.first, flight.last + 1):
            middle = 0.5 * (lane.breaks[k] + lane.breaks[k + 1])
            x, y = lane.point(np.array([middle - 0.1, middle, middle + 0.1])).T
            rise = tilt * 0.1 * np.cos(yaw) * (1.0 if flight.going == "up" else -1.0)
            last = k == flight.last
            there = flat.height(x, y) + np.array([-rise, 0.0, rise]) * (not last)
            np.testing.assert_allclose(world.height(x, y), there, atol=1e-9)


def test_tilts_are_drawn_after_all_else_and_tread_by_tread() -> None:
    """By the seed, between minus and plus; what else is drawn stays as it was without tilt."""
    errors = {"rise": 0.01, "tread": 0.005, "random": True}
    flat, world = real(turning(), 3, **errors), real(turning(), 3, tilt=0.1, **errors)
    np.testing.assert_array_equal(treads(world)[:, 2], treads(flat)[:, 2])
    tilts = np.array([box.gradient for box in world.boxes if "_tread_" in box.name])
    assert np.all(np.abs(tilts) <= 0.1) and len(np.unique(np.abs(tilts))) == 7
    assert tilts[3] == tilts[7] == 0.0
