"""Walks that end on a flight, and begin there: the same footprints, and no step for the stop."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import course_of, paper_robot, stance_at

from drake_quad.planning.foothold_grid import FootholdGrid, make_foothold_grid
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.planning.mission import check_mission, plan_mission
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.settled_places import flight_places
from drake_quad.planning.walk_footsteps import walk_start
from drake_quad.robot.legs import LEGS
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element
from drake_quad.terrain.lane import Lane

SPACING, START = 0.5, 1.2  # [m]


@st.composite
def lanes(draw: st.DrawFn) -> Lane:
    """Floor, a flight of any steps up or down, floor."""
    count = draw(st.integers(5, 10))

    def length(low: float, high: float) -> float:
        return draw(st.floats(low, high).map(lambda x: round(x, 3)))

    runs, rises = (
        [length(0.28, 0.6) for _ in range(count)],
        [length(0.05, 0.2) for _ in range(count)],
    )
    going = draw(st.sampled_from(["up", "down"]))
    stairs = Element("stairs", going=going, rises=rises, runs=runs)
    floor = Element("floor", length=length(3.0, 5.0))
    return course_of(floor, stairs, floor).lanes[0]


def grid(lane: Lane, start: float, goal: float, *, n: int = 1) -> FootholdGrid:
    return make_foothold_grid(
        lane, start=start, goal=goal, spacing=SPACING, behind=n, ahead=n, per_cycle=n
    )


@given(lanes(), st.integers(0, 3), st.floats(-0.1, 0.1))
def test_a_walk_may_end_over_any_tread_but_the_last(lane: Lane, k: int, off: float) -> None:
    """It ends over the place that is nearest to its goal, with the treads beyond as places."""
    places = flight_places(lane, lane.flights[0])
    found = grid(lane, START, float(places[k]) + off)
    end = found.behind + found.cycles
    assert found.ends_on_flight and not found.starts_on_flight
    assert found.s[end] == places[k] and found.s[end + 1] == places[k + 1]
    assert np.all(np.diff(found.s) > 0.0)


@given(lanes(), st.integers(1, 3), st.integers(1, 2))
def test_a_walk_goes_on_from_the_places_of_the_one_before(lane: Lane, k: int, n: int) -> None:
    """Of a walk that ends on a flight and one that begins there all places are the same treads."""
    places = flight_places(lane, lane.flights[0])
    first = grid(lane, START, float(places[k]), n=n)
    second = grid(lane, float(places[k]), lane.length - START, n=n)
    assert second.starts_on_flight and not second.ends_on_flight
    assert second.s[second.behind] == places[k]
    end = first.behind + n * first.cycles
    both = range(-1, 2)
    np.testing.assert_array_equal(
        [first.s[end + i] for i in both], [second.s[second.behind + i] for i in both]
    )


SETTINGS = PlanSettings(pattern=FootholdPattern(2, 1))


@cache
def long_course() -> Course:
    """A flight of seven steps."""
    return course_of(
        Element("floor", length=3.0),
        Element("stairs", going="up", rise=0.13, run=0.5, count=7),
        Element("floor", length=3.0),
    )


@pytest.mark.parametrize("tread", [2, 3])
def test_the_robot_stops_on_a_flight_and_goes_on_without_a_step_for_it(tread: int) -> None:
    """Both walks have a margin; the second begins with the gait, from the feet as they stand."""
    course, robot = long_course(), paper_robot()
    lane = course.lanes[0]
    goal = float(flight_places(lane, lane.flights[0])[tread])
    tasks = (
        Task(kind="walk", name="up", lane=0, goal=goal),
        Task(kind="stand", name="stand", lane=0, duration=1.0),
        Task(kind="walk", name="on", lane=0, goal=lane.length - 1.2),
    )
    mission = plan_mission(robot, course, SETTINGS, tasks, stance_at(course, SETTINGS))
    check_mission(robot, mission)
    up, stand, on = mission.plans
    assert up.margin > 0.05 and on.margin > 0.05
    assert on.segments[0].kind == "wave"
    np.testing.assert_array_equal(stand.end.feet, up.contacts.final_feet)
    np.testing.assert_allclose(on.contacts.feet, up.contacts.final_feet)
    heights = lane.height(lane.coordinates(up.end.feet)[0]) + robot.foot_radius
    np.testing.assert_allclose(up.end.feet[:, 2], heights)
    assert walk_start(lane, SETTINGS, up.end) == pytest.approx(goal)


@pytest.mark.parametrize("waits", [0.0, 0.14])
def test_rear_feet_that_wait_before_a_flight_do_not_put_the_walk_back(waits: float) -> None:
    """With two places a tread none is close before the riser: rear feet may stand a place back."""
    settings = PlanSettings(pattern=FootholdPattern(1, 3, per_tread=2))
    lane = course_of(
        Element("floor", length=3.0),
        Element("stairs", going="up", rise=0.13, run=0.28, count=7),
        Element("floor", length=3.0),
    ).lanes[0]
    places = flight_places(lane, lane.flights[0], 2)
    first = np.array([settings.pattern.first(leg) for leg in LEGS])
    # As the gait has them over its first place, but for the rear feet.
    feet = np.concatenate([places[0] - 0.14 * np.arange(6, 0, -1), places])[6 + first]
    behind = feet < 3.0
    assert np.sum(behind) == 2
    stance = Stance(
        body=np.array([places[0] - 0.1, 0.0, 0.9, 0.0, 0.0]),
        feet=np.column_stack([feet - waits * behind, np.zeros(4), np.zeros(4)]),
    )
    assert walk_start(lane, settings, stance) == pytest.approx(places[0])
