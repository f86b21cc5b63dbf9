"""Clearances, footholds and steps on courses with slopes, up and down."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import paper_robot

from drake_quad.gait_design.candidates import flights_of
from drake_quad.planning.clearance import find_clearance, from_ground, from_nosings
from drake_quad.planning.mission import check_mission, initial_stance, plan_mission
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.walk_footsteps import _level_stretch
from drake_quad.robot.model import link_outline_of
from drake_quad.scenario.build import course_of
from drake_quad.scenario.load import parse_scenario
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane

FLOOR = "{kind: floor, length: 2.0, width: 2.0}"


def course(*elements: str) -> Course:
    """A course of floors with elements between them."""
    text = f"course: [{', '.join([FLOOR, *elements, FLOOR])}]"
    return course_of(parse_scenario(text, source="test"))


def slope(height: float, length: float = 1.5) -> str:
    """A slope that rises by `height` [m], or falls."""
    going = "up" if height > 0.0 else "down"
    return f"{{kind: slope, going: {going}, length: {length}, height: {abs(height)}, width: 2.0}}"


def ground_points(lane: Lane) -> np.ndarray:
    """The ground's profile as points a tenth of a millimetre apart (N, 2) [m]."""
    d, z = lane.profile(0.0, lane.length)
    places = np.linspace(0.0, lane.length, 60_000)
    return np.column_stack([places, np.interp(places, d, z)])


@given(
    height=st.floats(0.05, 1.0),
    down=st.booleans(),
    s=st.floats(0.6, 4.9),
    over=st.floats(0.002, 0.5),
)
def test_distances_from_a_slope_are_those_from_its_line(
    height: float, down: bool, s: float, over: float
) -> None:
    """Over the ground they are as from the profile's points; in it they are below zero."""
    (lane,) = course(slope(-height if down else height)).lanes
    ground = float(lane.height(s))
    above = np.array([s, 0.0, ground + over])
    line = ground_points(lane)
    least = float(np.hypot(line[:, 0] - s, line[:, 1] - above[2]).min())
    assert from_ground(lane, above) == pytest.approx(least, abs=2e-4)
    assert from_ground(lane, np.array([s, 0.0, ground - over])) <= 0.0


def away(line: np.ndarray, point: np.ndarray) -> float:
    """Least distance of a point (2,) from a line through points (N, 2) [m]."""
    begin, way = line[:-1], np.diff(line, axis=0)
    square = np.maximum((way**2).sum(axis=1), 1e-18)
    t = np.clip(((point - begin) * way).sum(axis=1) / square, 0.0, 1.0)
    return float(np.linalg.norm(begin + t[:, None] * way - point, axis=1).min())


KERB = "{{kind: curb, going: {}, height: 0.15}}"
WITH_KERBS = [
    (KERB.format("up"), slope(height), KERB.format(going))
    for height in (0.5, -0.5)
    for going in ("up", "down")
]


@given(
    elements=st.sampled_from(WITH_KERBS),
    s=st.floats(1.5, 4.0) | st.sampled_from([1.98, 2.02, 3.48, 3.52]),
    over=st.floats(0.002, 0.4),
)
def test_distances_beside_kerbs_are_from_the_nearest_of_line_and_face(
    elements: tuple[str, ...], s: float, over: float
) -> None:
    """A slope that begins and ends at a kerb: the distance is that from its whole outline."""
    (lane,) = course(*elements).lanes
    line = np.column_stack(lane.profile(0.0, lane.length))
    ground = float(lane.height(s))
    least = away(line, np.array([s, ground + over]))
    assert from_ground(lane, np.array([s, 0.0, ground + over])) == pytest.approx(least, abs=1e-9)
    assert from_ground(lane, np.array([s, 0.0, ground - over])) <= 0.0


@pytest.mark.parametrize(("height", "crest"), [(0.5, 3.5), (-0.5, 2.0)])
def test_a_line_through_a_crest_is_seen(height: float, crest: float) -> None:
    """Both of its ends are above the ground, its middle is below where the slope is highest."""
    (lane,) = course(slope(height)).lanes
    top = float(lane.height(crest))
    before, after = crest - 0.3, crest + 0.3
    ends = [[s, 0.0, float(lane.height(s)) + 0.01] for s in (before, after)]
    told = from_nosings(lane, np.array(ends))
    assert (from_ground(lane, np.array(ends)) > 0.0).all()
    assert told[0] < 0.0
    over = np.array([[before, 0.0, top + 0.05], [after, 0.0, top + 0.05]])
    assert from_nosings(lane, over)[0] == pytest.approx(0.05)


@pytest.mark.parametrize("height", [0.4, -0.4])
def test_a_walk_over_a_slope_has_room_up_and_down(height: float) -> None:
    """The plan of a walk that is above the slope is not told to be inside it."""
    ground, robot, settings = course(slope(height, 3.0)), paper_robot(), PlanSettings()
    stance = initial_stance(robot, ground, settings, start=1.25)
    tasks = (Task(kind="walk", name="walk", lane=0, goal=5.25),)
    mission = plan_mission(robot, ground, settings, tasks, stance)
    samples = check_mission(robot, mission)
    room = find_clearance(robot, link_outline_of(robot), ground, tasks, samples)
    assert room.distance > 0.02


@pytest.mark.parametrize(("ramp", "rise"), [(0.3, 0.15), (-0.3, 0.15), (0.15, -0.15)])
def test_the_first_step_after_a_slope_is_as_high_as_the_others(ramp: float, rise: float) -> None:
    """A slope's own height is no part of a step."""
    going = "up" if rise > 0.0 else "down"
    stairs = f"{{kind: stairs, going: {going}, rise: {abs(rise)}, run: 0.4, count: 3, width: 2.0}}"
    (only,) = flights_of(course(slope(ramp), stairs))
    assert (only.rise, only.run) == pytest.approx((rise, 0.4))


def test_a_kerb_after_a_ramp_of_its_height_is_an_edge() -> None:
    """No foothold's stretch goes over it, though the floors on both sides are of one height."""
    (lane,) = course(slope(0.1, 1.0), "{kind: curb, going: down, height: 0.1}").lanes
    assert _level_stretch(lane, 1.0) == (-np.inf, 2.0)
    assert _level_stretch(lane, 2.5) == (2.0, 3.0)
    assert _level_stretch(lane, 3.5) == (3.0, np.inf)
    flat = replace(lane, gradients=np.zeros(3), heights=np.zeros(3))
    assert _level_stretch(flat, 2.5) == (-np.inf, np.inf)
