"""Laws of steps over stairs as they are: blocks, curbs, slopes, and treads of all sizes."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from rig import course_of, paper_robot, walk_plan

from drake_quad.planning.foothold_grid import make_foothold_grid
from drake_quad.planning.motion_plan import MotionPlan, evaluate
from drake_quad.planning.recovery_step import StepTargetMap
from drake_quad.planning.replan import in_place
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.terrain.course import Course
from drake_quad.terrain.drake_geometry import AddCourse
from drake_quad.terrain.elements import Element
from drake_quad.terrain.lane import Lane

SPACING = 0.5  # [m]
FLOOR = Element("floor", length=3.0)
STAIRS = Element("stairs", going="up", rise=0.13, run=0.5, count=3)
UPHILL = Element("slope", going="up", length=2.0, height=0.3)
DOWNHILL = Element("slope", going="down", length=2.0, height=0.3)
CURB = Element("curb", going="up", height=0.1)


def places(lane: Lane) -> np.ndarray:
    """The lattice's places from 1.2 m after the lane's start to 1.2 m before its end."""
    lattice = make_foothold_grid(lane, start=1.2, goal=lane.length - 1.2, spacing=SPACING)
    np.testing.assert_allclose(lattice.z, lane.height(lattice.s))
    return np.asarray(lattice.s)


@given(st.floats(2.6, 5.0), st.floats(2.6, 5.0), st.floats(0.21, 0.74))
def test_a_block_to_step_on_has_a_place_on_its_middle(
    before: float, after: float, length: float
) -> None:
    """Wherever it is; and no two places are farther apart than elsewhere."""
    block = Element("block", length=length, height=0.1)
    lane = course_of(Element("floor", length=before), block, Element("floor", length=after)).lanes[
        0
    ]
    s = places(lane)
    assert np.min(np.abs(s - (before + 0.5 * length))) < 1e-9
    assert np.max(np.diff(s)) <= SPACING + 1e-9


@given(st.floats(2.6, 5.0), st.floats(0.05, 0.19))
def test_a_narrow_block_is_stepped_over(before: float, length: float) -> None:
    """No place is on it or near it: it is in the middle between two."""
    block = Element("block", length=length, height=0.1)
    s = places(course_of(Element("floor", length=before), block, FLOOR).lanes[0])
    beside = np.sort(np.abs(s - (before + 0.5 * length)))[:2]
    np.testing.assert_allclose(beside, 0.5 * SPACING)


@given(st.floats(2.6, 5.0), st.sampled_from(["up", "down"]))
def test_a_curb_is_in_the_middle_between_two_places(before: float, going: str) -> None:
    """So that a foot has room before and behind its riser."""
    curb = Element("curb", going=going, height=0.1)
    s = places(course_of(Element("floor", length=before), curb, FLOOR).lanes[0])
    np.testing.assert_allclose(np.sort(np.abs(s - before))[:2], 0.5 * SPACING)


@settings(max_examples=40)
@given(st.lists(st.sampled_from(["block", "curb", "flight", "slope", "floor"]), max_size=5),
       st.floats(0.3, 1.5))  # fmt: skip
def test_places_go_forward_whatever_is_on_the_way(kinds: list[str], between: float) -> None:
    """They increase strictly, even in number from start to goal, and all have ground."""
    parts = {
        "block": Element("block", length=0.3, height=0.1),
        "curb": CURB,
        "flight": STAIRS,
        "slope": UPHILL,
        "floor": Element("floor", length=0.5),
    }
    elements = [x for kind in kinds for x in (parts[kind], Element("floor", length=between))]
    lane = course_of(FLOOR, *elements, FLOOR).lanes[0]
    lattice = make_foothold_grid(lane, start=1.2, goal=lane.length - 1.2, spacing=SPACING)
    assert np.all(np.diff(lattice.s) > 0.0)
    assert lattice.s[lattice.behind + 2 * lattice.cycles] == pytest.approx(lane.length - 1.2)


@pytest.mark.parametrize("slope", [UPHILL, DOWNHILL])
@pytest.mark.parametrize("s", [1.0, 3.4, 4.7])
def test_a_foot_that_stands_touches_the_ground(slope: Element, s: float) -> None:
    """Its sphere is as far from the ground as its radius, on a slope along the slope's normal."""
    course = course_of(FLOOR, slope, FLOOR)
    builder = StepBuilder(course.lanes[0], np.zeros((4, 3)), foot_radius=0.04, clearance=0.02)
    gap = signed_distance(course, np.array([s, 0.2, builder.ground(np.array([s, 0.2]))]))
    assert gap == pytest.approx(0.04, abs=1e-9)


def signed_distance(course: Course, p_W: np.ndarray) -> float:
    """Of a point (3,) from what the simulation's feet would touch [m], by Drake."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.001)
    AddCourse(plant, course, friction=1.0)
    plant.Finalize()
    diagram = builder.Build()
    context = scene_graph.GetMyContextFromRoot(diagram.CreateDefaultContext())
    query = scene_graph.get_query_output_port().Eval(context)
    return min(float(d.distance) for d in query.ComputeSignedDistanceToPoint(p_W))


@pytest.mark.parametrize("going", ["up", "down"])
def test_under_a_nose_a_foot_could_be_caught(going: str) -> None:
    """In Drake too there is room under a nose, and the nose over it."""
    flight = Element("stairs", going=going, rise=0.2, run=0.5, count=2, overhang=0.06)
    course = course_of(FLOOR, flight, FLOOR)
    s, z = course.lanes[0].nosings()[1]
    under = s + (0.03 if going == "up" else -0.03)
    assert signed_distance(course, np.array([under, 0.0, z - 0.1])) == pytest.approx(0.03)
    assert signed_distance(course, np.array([under, 0.0, z - 0.02])) < 0.0


@pytest.mark.parametrize("first", [UPHILL, CURB])
def test_swings_clear_slopes_and_curbs(first: Element) -> None:
    """The foot's sphere stays out of the ground; room for errors of the map only adds to that."""
    course = course_of(FLOOR, first, Element("floor", length=1.0), CURB, FLOOR)
    lane, radius = course.lanes[0], 0.04
    plain, roomy = (
        StepBuilder(lane, np.zeros((4, 3)), foot_radius=radius, clearance=0.03,
                    map_error_place=place, map_error_height=height)
        for place, height in ((0.0, 0.0), (0.05, 0.03))
    )  # fmt: skip
    higher = 0
    for s in np.arange(2.2, lane.length - 1.5, 0.31):
        if np.min(np.abs(lane.breaks - s)) < 0.12 or np.min(np.abs(lane.breaks - s - 0.6)) < 0.12:
            continue
        for a, b in ((s, s + 0.6), (s + 0.6, s)):
            p_from = np.array([a, 0.2, plain.ground(np.array([a, 0.2]))])
            swings = [x.swing(p_from, np.array([b, 0.2]), 1.2) for x in (plain, roomy)]
            for swing in swings:
                p = swing.positions(np.linspace(0.0, 1.2, 200))
                assert np.min(p[:, 2] - lane.height(p[:, 0])) >= radius - 1e-4
            assert swings[1].apex_z >= swings[0].apex_z - 1e-4
            higher += swings[1].apex_z > swings[0].apex_z + 0.01
    assert higher > 0


@cache
def walk(name: str) -> tuple[MotionPlan, Lane, float]:
    """A whole walk over ground of one kind, its lane, and the feet's radius."""
    ground = {
        "slope": (UPHILL, Element("floor", length=2.0), DOWNHILL),
        "block": (Element("block", length=0.3, height=0.1),),
        "narrow block": (Element("block", length=0.1, height=0.1),),
        "curb": (CURB,),
        "irregular": (
            Element("stairs", going="up", rises=[0.1, 0.15, 0.12], runs=[0.5, 0.42, 0.55]),
        ),
    }[name]
    course = course_of(FLOOR, *ground, FLOOR)
    plan = walk_plan(course, goal=course.lanes[0].length - 1.25)
    return plan, course.lanes[0], paper_robot().foot_radius


@pytest.mark.parametrize("name", ["slope", "block", "narrow block", "curb", "irregular"])
def test_a_walk_is_planned_over_it_with_a_margin(name: str) -> None:
    """From end to end within the legs' reach, stable by 0.05 m at all times, feet on the ground."""
    plan, lane, radius = walk(name)
    table = evaluate(paper_robot(), plan, np.linspace(0.0, plan.duration, 300))
    assert np.min(table.margin) > 0.05 and np.max(table.reach_excess) <= 1e-9
    for step in plan.contacts.steps:
        s, _ = lane.coordinates(step.swing.p_end)
        room = step.swing.p_end[2] - lane.height(s + radius * np.array([-1.0, 0.0, 1.0]))
        assert room[1] >= radius and np.ptp(room) < 0.31 * radius  # 0.15 uphill: no riser there


def test_a_foot_may_stay_and_be_caught_on_a_slope_but_not_where_it_bends() -> None:
    """A slope is as good as level ground to what puts feet down after a push; its ends are not."""
    course = course_of(FLOOR, UPHILL, FLOOR)
    lane = course.lanes[0]
    s = np.array([2.0, 3.0, 4.0, 5.0])
    feet = np.column_stack([s, 0.2 * np.ones(4), lane.height(s)])
    stays = in_place(lane, feet, feet, tolerance=0.01, foot_radius=0.03)
    assert stays.tolist() == [True, False, True, False]
    assert StepTargetMap(course, 0.03).whole(feet[:, :2]).tolist() == [True, False, True, False]
    places = np.random.default_rng(0).uniform([0.1, -0.9], [7.9, 0.9], size=(200, 2))
    np.testing.assert_allclose(
        StepTargetMap(course, 0.03).height(places), course.height(*places.T), atol=1e-12
    )


@given(
    st.integers(1, 4), st.floats(1.2, 2.5), st.floats(0.05, 0.2), st.sampled_from(["up", "down"])
)
def test_treads_like_floors_have_the_places_of_floors_with_curbs_between(
    count: int, run: float, rise: float, going: str
) -> None:
    """A flight whose treads are all deep is none; with one that is not, each has its own place."""
    flight = Element("stairs", going=going, rise=rise, run=run, count=count)
    lane = course_of(FLOOR, flight, FLOOR).lanes[0]
    curb, tread = Element("curb", going=going, height=rise), Element("floor", length=run)
    curbs = course_of(FLOOR, *[curb, tread] * count, FLOOR).lanes[0]
    ends: dict[str, Any] = {"start": 1.2, "goal": lane.length - 1.2, "spacing": SPACING}
    deep = make_foothold_grid(lane, **ends, deep=1.2)
    same = make_foothold_grid(curbs, **ends)
    np.testing.assert_allclose(deep.s, same.s, atol=1e-9)
    np.testing.assert_allclose(deep.z, same.z, atol=1e-9)
    assert not any(deep.on_tread) and deep.cycles == same.cycles
    close = make_foothold_grid(lane, **ends, deep=run + 0.01)
    np.testing.assert_array_equal(close.s, make_foothold_grid(lane, **ends).s)
    assert sum(close.on_tread) == count
