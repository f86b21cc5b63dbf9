"""Feet that stand keep off risers, though they roll towards them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import flat_course, paper_robot, stairs_course

from drake_quad.errors import PlanningError
from drake_quad.planning import task as plan_task_module, task as riser_room_module
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.foothold_grid import make_foothold_grid
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.planning.mission import initial_stance
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.problem import EDGE_CLEARANCE, PlanSettings, Task
from drake_quad.planning.task import (
    GOOD_GAP,
    gap_as_it_rises,
    gap_to_riser,
    initial_setback,
    plan_task,
    riser_gap,
)
from drake_quad.planning.walk_footsteps import EDGE_ROOM, foothold, plan_walk_footsteps
from drake_quad.robot.legs import LEGS
from drake_quad.terrain.course import build_course
from drake_quad.terrain.elements import Element
from drake_quad.terrain.lane import Lane

BIG = 0.04  # [m]
AHEAD = PlanSettings(
    pattern=FootholdPattern(1, 3, 2), stride=0.25, cycle_time=8.0, tread_phase_up=0.4, max_shift=0.2
)


@given(st.floats(0.0, 0.3), st.sampled_from(["up", "down"]))
def test_room_is_to_the_riser_ahead_that_leads_up(away: float, going: str) -> None:
    """Towards lower ground there is none to touch, nor beyond the last."""
    lane = stairs_course(going).lanes[0]
    at, _ = lane.risers()
    s = at[:1] - BIG - away
    wanted = away if going == "up" else np.inf
    assert gap_to_riser(lane, s, BIG)[0] == pytest.approx(wanted, abs=1e-12)
    assert gap_to_riser(lane, at[-1:] + 0.1, BIG)[0] == np.inf
    assert np.all(gap_to_riser(flat_course().lanes[0], s, BIG) == np.inf)


def big_footed_walk() -> tuple[Lane, MotionPlan]:
    """Up three steps on feet that stand as far ahead on the treads as they can."""
    robot, course = replace(paper_robot(), foot_radius=BIG), stairs_course("up")
    task = Task(kind="walk", name="walk", lane=0, goal=6.25)
    stance = initial_stance(robot, course, AHEAD, start=1.25)
    return course.lanes[0], plan_task(robot, course, AHEAD, task, stance, index=0)


def laid(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The setbacks of walks that are laid from now on."""
    setbacks: list[float] = []
    whole = plan_walk_footsteps

    def lay(robot, course, settings, *rest):  # type: ignore[no-untyped-def]
        setbacks.append(settings.riser_setback)
        return whole(robot, course, settings, *rest)

    monkeypatch.setattr(plan_task_module, "plan_walk_footsteps", lay)
    return setbacks


def test_feet_that_roll_farther_than_mostly_are_set_down_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Once; if that cannot be planned, the first plan is better than none."""
    monkeypatch.setattr(riser_room_module, "ROLLS", 0.0)
    setbacks = laid(monkeypatch)
    lane, plan = big_footed_walk()
    assert len(setbacks) >= 2 and setbacks[0] == 0.0 < setbacks[1]
    touched = riser_gap(lane, plan.contacts, BIG)[0]
    whole = plan_walk_footsteps

    def lay(robot, course, settings, *rest):  # type: ignore[no-untyped-def]
        if settings.riser_setback > 0.0:
            raise PlanningError("no other footprints")
        return whole(robot, course, settings, *rest)

    monkeypatch.setattr(plan_task_module, "plan_walk_footsteps", lay)
    lane, plan = big_footed_walk()
    assert riser_gap(lane, plan.contacts, BIG)[0] < GOOD_GAP < touched


@given(
    st.lists(st.tuples(st.floats(-0.3, 0.2), st.floats(0.0, 0.5)), min_size=1, max_size=9),
)
def test_a_rising_foot_is_as_near_as_the_riser_s_nearest_point(
    places: list[tuple[float, float]],
) -> None:
    """From beside the riser that was ahead at first, or above its nosing, to the foot's sphere."""
    lane = stairs_course("up").lanes[0]
    at = float(lane.risers()[0][0])
    low, high = (float(lane.height(at + way)) for way in (-1e-3, 1e-3))
    s = at + np.array([-0.3, *(x for x, _ in places)])
    z = low + np.array([0.0, *(h for _, h in places)])
    found = gap_as_it_rises(lane, s, z, BIG)
    face = np.linspace(low - 1.0, high, 4001)  # of the riser, and the tread beyond it
    tread = np.linspace(at, at + 1.0, 4001)
    for one, x, h in zip(found, s, z, strict=True):
        if h <= high and x > at:
            assert one == pytest.approx(at - x - BIG, abs=1e-12)  # inside, by how much
            continue
        nearest = min(np.hypot(at - x, face - h).min(), np.hypot(tread - x, high - h).min())
        assert one == pytest.approx(nearest - BIG, abs=1e-3)
    beyond = gap_as_it_rises(lane, lane.risers()[0][-1:] + 0.1, z[:1], BIG)
    assert np.all(beyond == np.inf)


def test_feet_that_rise_where_they_rolled_to_touch_no_riser() -> None:
    """A foot lifts from where it rolled to, and goes forward as it goes up."""
    lane, plan = big_footed_walk()
    steps, least = plan.contacts.steps, np.inf
    for step in steps:
        times = np.linspace(step.lift_off, step.touchdown, 101)
        foot = plan.contacts.feet_at(times)[0][:, step.leg.row]
        s, z = lane.coordinates(foot)[0], foot[:, 2]
        rising = gap_as_it_rises(lane, s, z, BIG)[times <= step.lift_off + step.swing.apex_time]
        least = min(least, float(rising.min()))
    assert 0.0 < riser_gap(lane, plan.contacts, BIG)[0] <= least + 1e-3


def test_the_top_of_a_slope_is_no_riser() -> None:
    """Footprints need not keep off it."""
    course = build_course([Element("floor", length=3.0),
                           Element("slope", going="up", length=2.0, height=0.4),
                           Element("floor", length=3.0)])  # fmt: skip
    lane = course.lanes[0]
    assert len(lane.risers()[0]) == 0
    asked = PlanSettings(pattern=FootholdPattern(1, 3, 1), stride=0.25)
    places = make_foothold_grid(lane, start=1.25, goal=6.25, spacing=0.25, behind=3, per_cycle=1)
    for k in range(len(places.s) - places.behind):
        near, far = (foothold(lane, places, LEGS[0], k, replace(asked, riser_setback=b), BIG)
                     for b in (0.0, 0.1))  # fmt: skip
        assert near == far


def test_big_feet_that_roll_touch_no_riser() -> None:
    """They roll by more than what every footprint keeps from a riser, and are set down farther."""
    lane, plan = big_footed_walk()
    assert riser_gap(lane, plan.contacts, BIG)[0] >= GOOD_GAP
    times = sample_times(plan.contacts)
    feet, standing = plan.contacts.feet_at(times)
    rolled = plan.contacts.roll.at(times) if plan.contacts.roll else np.zeros((len(times), 4, 2))
    near = gap_to_riser(lane, lane.coordinates(feet[standing])[0], BIG) < 0.05
    assert near.any() and rolled[standing][near, 0].max() > EDGE_CLEARANCE


def test_footprints_give_way_to_a_riser_as_far_as_the_tread_is_deep_enough() -> None:
    """Those that are near it ahead, and where the ground beyond is higher."""
    wide = 10.0
    for going, gives in (("up", True), ("down", False)):
        lane = stairs_course(going).lanes[0]
        phases: dict[str, Any] = {"tread_phase_up": 0.4, "tread_phase_down": 0.4}
        asked = PlanSettings(pattern=FootholdPattern(1, 3, 1), stride=0.25, **phases)
        places = make_foothold_grid(
            lane, start=1.25, goal=6.25, spacing=0.25, behind=3, per_cycle=1
        )
        a, b, _ = lane.treads(lane.flights[0])[0]
        k = int(np.searchsorted(places.s, a)) - places.behind
        at = {room: foothold(lane, places, LEGS[0], k, replace(asked, riser_setback=room), BIG)
              for room in (0.0, 0.02, wide)}  # fmt: skip
        edge = BIG + EDGE_CLEARANCE
        assert at[0.0] == pytest.approx(b - edge)
        assert at[0.02] == pytest.approx(b - edge - (0.02 if gives else 0.0))
        assert at[wide] == pytest.approx(a + edge if gives else b - edge)


@pytest.mark.parametrize("going", ["up", "down"])
@pytest.mark.parametrize("phase", [0.4, -0.4])
def test_footprints_keep_off_edges_by_what_the_map_may_be_off(going: str, phase: float) -> None:
    """Ahead and behind, as far as the tread is deep enough: else they stand on its middle."""
    lane = stairs_course(going).lanes[0]
    phases: dict[str, Any] = {"tread_phase_up": phase, "tread_phase_down": phase}
    asked = PlanSettings(pattern=FootholdPattern(1, 3, 1), stride=0.25, **phases)
    places = make_foothold_grid(lane, start=1.25, goal=6.25, spacing=0.25, behind=3, per_cycle=1)
    a, b, _ = lane.treads(lane.flights[0])[0]
    k = int(np.searchsorted(places.s, a)) - places.behind
    for error, kept in ((0.0, EDGE_CLEARANCE), (0.005, EDGE_CLEARANCE), (0.02, 0.02 + EDGE_ROOM)):
        at = foothold(lane, places, LEGS[0], k, replace(asked, map_error_place=error), BIG)
        nearest = b - at if phase > 0.0 else at - a
        assert nearest == pytest.approx(BIG + kept)
    unknown = foothold(lane, places, LEGS[0], k, replace(asked, map_error_place=10.0), BIG)
    assert unknown == pytest.approx(0.5 * (a + b))


def test_small_feet_are_asked_for_no_more() -> None:
    """What they roll is less than what footprints keep in any case."""
    assert initial_setback(0.008) == 0.0 < initial_setback(0.02) < initial_setback(0.04)
