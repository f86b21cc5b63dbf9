"""What a walk is: the wave's order and rhythm, footprints whole on treads, legs that clear them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from rig import (
    course_of,
    flat_course,
    flat_walk,
    paper_robot,
    stairs_course,
    stairs_walk,
    stance_at,
    walk_plan,
)

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait.workspace import Workspace
from drake_quad.planning.body_reference import robot_stance
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.motion_plan import MotionPlan, Stance
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.task import plan_task
from drake_quad.robot.legs import LEGS, WAVE_ORDER
from drake_quad.robot.variants import with_foot_radius
from drake_quad.stability.support_polygon import stability_margins
from drake_quad.terrain.elements import Element
from drake_quad.terrain.lane import Lane

DEFAULT = PlanSettings()
TABLE_I = PlanSettings(
    duty_factor=0.75,
    workspace=Workspace(R_x=0.76, R_y=0.5, P_x=0.8, P_y=0.54),
    stance_stagger=0.0,
    on_centre=False,
    body_still=True,
    via_centres=True,
    uniform_body=True,
)


def wave_steps(plan: MotionPlan) -> list[Step]:
    """The steps of the wave alone."""
    wave = next(s for s in plan.segments if s.kind == "wave")
    return [s for s in plan.contacts.steps if s.lift_off >= wave.start - 1e-9]


def clearances(step: Step, lane: Lane, count: int = 200) -> tuple[float, float]:
    """Of a foot's centre: least height over the ground, least distance to a nosing passed [m]."""
    p = step.swing.positions(np.linspace(0.0, step.swing.duration, count))
    s, _ = lane.coordinates(p[:, :2])
    over = float(np.min(p[:, 2] - lane.height(s)))
    low, high = sorted((s[0], s[-1]))
    passed = [(a, z) for a, z in lane.nosings() if low < a < high]
    near = [float(np.hypot(s - a, p[:, 2] - z).min()) for a, z in passed]
    return over, min(near, default=np.inf)


@pytest.mark.parametrize("going", ["up", "down"])
def test_wave_lifts_the_legs_in_the_papers_order_evenly_in_time(going: str) -> None:
    """1-4-2-3, a quarter of the cycle apart, each for (1 - β) T."""
    plan = stairs_walk(going)
    steps = wave_steps(plan)
    assert [s.leg for s in steps] == list(WAVE_ORDER) * (len(steps) // 4)
    lifts = np.array([s.lift_off for s in steps])
    np.testing.assert_allclose(np.diff(lifts), DEFAULT.cycle_time / 4)
    times = [s.touchdown - s.lift_off for s in steps]
    np.testing.assert_allclose(times, (1 - DEFAULT.duty_factor) * DEFAULT.cycle_time)


@pytest.mark.parametrize("going", ["up", "down"])
def test_every_tread_is_stepped_on_at_its_centre_by_the_feet_of_one_side(going: str) -> None:
    """Two treads a cycle: left feet take the odd ones and right feet the even ones, or so."""
    plan, lane = stairs_walk(going), stairs_course(going).lanes[0]
    sides = []
    for a, b, z in lane.treads(lane.flights[0]):
        on = [s for s in wave_steps(plan) if a < s.swing.p_end[0] < b]
        assert {s.leg.short[1] for s in on} in ({"L"}, {"R"})
        assert sorted(s.leg.short[0] for s in on) == ["F", "R"]
        for step in on:
            place = [0.5 * (a + b), z + paper_robot().foot_radius]
            np.testing.assert_allclose(step.swing.p_end[[0, 2]], place, atol=1e-9)
        sides.append(on[0].leg.short[1])
    assert all(x != y for x, y in pairwise(sides))


@pytest.mark.parametrize("going", ["up", "down", "level"])
def test_feet_stand_where_the_ground_is_and_under_their_hips(going: str) -> None:
    """Every footprint is on the ground, at its leg's place across the lane."""
    plan = flat_walk() if going == "level" else stairs_walk(going)
    course = flat_course() if going == "level" else stairs_course(going)
    for step in plan.contacts.steps:
        x, y, z = step.swing.p_end
        assert z == pytest.approx(float(course.height(x, y)) + paper_robot().foot_radius)
        assert y == pytest.approx(robot_stance(DEFAULT)[step.leg.row, 1], abs=1e-9)


@settings(max_examples=12)
@given(
    st.sampled_from(["up", "down"]),
    st.floats(0.05, 0.16).map(lambda x: round(x, 3)),
    st.floats(0.4, 0.6).map(lambda x: round(x, 3)),
    st.sampled_from([0.8, 0.85, 0.9]),
)
def test_legs_clear_any_stairs(going: str, rise: float, run: float, beta: float) -> None:
    """A foot's sphere passes every nosing with the clearance asked for, and never scrapes."""
    course = stairs_course(going, rise=rise, run=run)
    plan_settings = PlanSettings(duty_factor=beta, swing_clearance=0.03)
    plan = walk_plan(course, goal=3.0 + 3 * run + 1.75, settings=plan_settings)
    radius = paper_robot().foot_radius
    for step in plan.contacts.steps:
        over, near = clearances(step, course.lanes[0])
        assert over >= radius - 1e-6
        assert near >= radius + 0.03 - 1e-4
    assert plan.margin > 0.0


@pytest.mark.parametrize("goal", [2.1, 3.25, 4.0])
def test_body_ends_at_the_goal_with_its_feet_around_it(goal: float) -> None:
    """Whatever the distance, the stride adapts and the walk ends where it was to end."""
    plan = walk_plan(flat_course(), goal=goal)
    assert plan.end.body[[0, 1, 4]] == pytest.approx([goal, 0.0, 0.0], abs=2e-3)
    centre = plan.end.feet[:, 0].mean()
    assert abs(centre - goal) < 0.26
    wave = next(s for s in plan.segments if s.kind == "wave")
    assert wave.details["stride"] <= DEFAULT.stride + 1e-9
    assert wave.details["stroke"] == pytest.approx(wave.details["stride"] * DEFAULT.duty_factor)
    assert wave.details["cycles"] * wave.details["stride"] == pytest.approx(goal - 1.25)


def test_walk_on_a_lane_that_heads_elsewhere_is_the_walk_turned() -> None:
    """Nothing of a walk depends on where in the world it is, or which way it heads."""
    course = course_of(
        Element("floor", length=1.0),
        Element("landing", length=5.0, turn_deg=90.0),
        Element("floor", length=3.0),
    )
    here = walk_plan(flat_course(8.0), start=1.5, goal=3.5)
    lane = course.lanes[1]
    stance = stance_at(flat_course(8.0), DEFAULT, 1.5)
    c, s = np.cos(lane.yaw), np.sin(lane.yaw)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    shift = np.array([*lane.point(0.5), 0.0]) - turn @ [1.5, 0.0, 0.0]
    body = np.array([*(turn @ stance.body[:3] + shift), 0.0, lane.yaw])
    turned = Stance(body, stance.feet @ turn.T + shift)
    task = Task(kind="walk", name="walk", lane=1, goal=2.5)
    there = plan_task(paper_robot(), course, DEFAULT, task, turned, index=0)
    assert there.margin == pytest.approx(here.margin, abs=1e-4)
    times = np.linspace(0.0, here.duration, 200)
    feet, standing = here.contacts.feet_at(times)
    other, others_stand = there.contacts.feet_at(times)
    # The feet roll as the body goes, whose program is solved to a tolerance.
    np.testing.assert_allclose(other, feet @ turn.T + shift, atol=1e-7)
    np.testing.assert_array_equal(others_stand, standing)


def table_one_walk() -> MotionPlan:
    robot = with_foot_radius(paper_robot(), 0.0)
    return walk_plan(flat_course(8.0), goal=5.25, settings=TABLE_I, robot=robot)


def test_papers_settings_give_the_papers_places() -> None:
    """With Table I a cycle begins with the feet 0.025, -0.525, 0.525 and -0.025 m from the body."""
    plan = table_one_walk()
    wave = next(s for s in plan.segments if s.kind == "wave")
    begin = wave_steps(plan)[0].lift_off
    sample = plan.sample(begin)
    at = sample.feet[:, 0] - sample.body[0, 0]
    np.testing.assert_allclose(at, [0.025, 0.525, -0.025, -0.525], atol=2e-3)
    assert wave.details["stroke"] == pytest.approx(0.75)
    kinds = [s.kind for s in plan.segments]
    assert kinds[:-2] in (["transition"], ["transition", "transition"])
    steps = [s["leg"] for segment in plan.segments for s in segment.details.get("steps", [])]
    assert len(steps) == 5


def test_papers_wave_touches_a_margin_of_zero_at_two_switches_a_cycle() -> None:
    """A massless-legged robot's margin is never negative at β = 0.75, and zero at 1→4 and 2→3."""
    plan = table_one_walk()
    steps = wave_steps(plan)
    begin, end = steps[4].lift_off, steps[-4].lift_off  # whole cycles, away from start and stop
    times = np.linspace(begin, end, 1601)
    feet, standing = plan.contacts.feet_at(times)
    margin = stability_margins(plan.body.samples(times)[:, 0, :2], feet[..., :2], standing)
    assert margin.min() == pytest.approx(0.0, abs=1e-6)
    switches = {steps[k].leg: steps[k].lift_off for k in range(4, 8)}
    at = {leg: float(margin[np.argmin(np.abs(times - t))]) for leg, t in switches.items()}
    assert at[LEGS[3]] == pytest.approx(0.0, abs=2e-3) and at[LEGS[2]] == pytest.approx(0, abs=2e-3)
    assert at[LEGS[0]] > 0.05 and at[LEGS[1]] > 0.05


def test_no_transition_where_the_feet_stand_already() -> None:
    """A walk that begins as the one before ended, in the wave's configuration, only walks."""
    first = walk_plan(flat_course(9.0), goal=3.25)
    task = Task(kind="walk", name="on", lane=0, goal=5.25)
    second = plan_task(paper_robot(), flat_course(9.0), DEFAULT, task, first.end, index=1)
    assert [s.kind for s in second.segments] == ["wave", "stand"]
    assert len(second.contacts.steps) == 8


def test_transition_says_its_steps() -> None:
    """Leg, times and places of each, as they are in the plan."""
    plan = flat_walk()
    segment = plan.segments[0]
    assert segment.kind == "transition"
    for told, step in zip(segment.details["steps"], plan.contacts.steps, strict=False):
        assert told["leg"] == int(step.leg)
        np.testing.assert_allclose(told["from"], step.swing.p_start[:2], atol=1e-9)
        np.testing.assert_allclose(told["to"], step.swing.p_end[:2], atol=1e-9)
    assert 1 <= len(segment.details["steps"]) <= 5


@pytest.mark.parametrize(
    ("goal", "word"), [(5.9, "beyond the ground"), (1.0, "walk ends")], ids=["off", "backward"]
)
def test_walks_off_the_ground_are_refused(goal: float, word: str) -> None:
    """The error says where a foot would have to stand."""
    with pytest.raises(PlanningError, match=word):
        walk_plan(flat_course(), goal=goal)


def test_feet_beside_the_ground_are_refused() -> None:
    """On ground narrower than the stance there is no walk."""
    wide = PlanSettings(workspace=Workspace(R_x=0.8, R_y=0.5, P_x=0.75, P_y=0.72))
    with pytest.raises(PlanningError, match="beyond the ground"):
        walk_plan(course_of(Element("floor", length=6.0, width=0.8)), goal=3.25, settings=wide)


def places(plan: MotionPlan) -> FloatArray:
    return np.array([s.swing.p_end for s in plan.contacts.steps])


def test_planning_twice_gives_the_same_plan_to_the_bit() -> None:
    """No part of planning is left to chance."""
    a, b = (walk_plan(stairs_course("up"), goal=6.25) for _ in range(2))
    np.testing.assert_array_equal(places(a), places(b))
    np.testing.assert_array_equal(a.body.control, b.body.control)


@pytest.mark.parametrize("wait", [0.3, 0.6])
def test_waits_are_put_before_the_leg_diagonal_to_the_one_that_landed(wait: float) -> None:
    """On four feet before legs 4 and 3 alone, every cycle; swings and their order stay."""
    gait = PlanSettings(duty_factor=0.75, switch_wait=wait)
    plan = walk_plan(stairs_course(), goal=6.25, settings=gait)
    without = walk_plan(stairs_course(), goal=6.25, settings=replace(gait, switch_wait=0.0))
    steps = wave_steps(plan)
    assert [s.leg for s in steps] == list(WAVE_ORDER) * (len(steps) // 4)
    for before, after in pairwise(steps):
        diagonal = after.leg.short in {"FL": "RR", "FR": "RL"}.get(before.leg.short, "")
        waited = wait if diagonal else 0.0
        assert after.lift_off - before.touchdown == pytest.approx(waited, abs=1e-9)
    for one, other in zip(steps, wave_steps(without), strict=True):
        np.testing.assert_allclose(one.swing.p_end, other.swing.p_end, atol=1e-9)
        assert one.swing.duration == other.swing.duration
    wave = next(s for s in plan.segments if s.kind == "wave")
    assert wave.details["cycle_lasts"] == pytest.approx(gait.cycle_time + 2 * wait)
    assert plan.duration - without.duration == pytest.approx(2 * wait * wave.details["cycles"])


def test_dynamic_walk_says_the_margin_of_its_zero_moment_point_in_every_segment() -> None:
    """Also with the plan's own margin as the least of them."""
    gait = PlanSettings(dynamic=True, duty_factor=0.76, cycle_time=1.88, switch_wait=0.06)
    plan = walk_plan(flat_course(), goal=3.25, settings=gait)
    found = [s.details["zmp_margin_min"] for s in plan.segments]
    assert min(found) == pytest.approx(plan.margin, abs=5e-3)
    assert min(found) > 0.05


@pytest.mark.parametrize("off", [-1e-5, 1e-5])
def test_a_start_off_by_the_programs_tolerance_makes_no_walk_longer(off: float) -> None:
    """Ten microns before or behind: as many cycles, to the same goal."""
    exact, other = (walk_plan(flat_course(), goal=3.25, start=1.25 + d) for d in (0.0, off))
    assert len(exact.contacts.steps) == len(other.contacts.steps)
    np.testing.assert_allclose(exact.end.body, other.end.body, atol=1e-3)
