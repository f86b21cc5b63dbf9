"""Feet that stand keep off risers, though they roll towards them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig import flat_course, paper_robot, stairs_course

from drake_quad.gait.legs import LEGS
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.lattice import make_lattice
from drake_quad.planning.mission import Task
from drake_quad.planning.pattern import Pattern
from drake_quad.planning.plan_mission import initial_stance
from drake_quad.planning.plan_task import plan_task
from drake_quad.planning.plan_walk import EDGE_CLEARANCE, foothold
from drake_quad.planning.riser_room import ENOUGH, likely_room, riser_room, room_at
from drake_quad.planning.settings import PlanSettings

BIG = 0.04  # [m]
AHEAD = PlanSettings(
    pattern=Pattern(1, 3, 2), stride=0.25, cycle_time=8.0, tread_phase_up=0.4, max_shift=0.2
)


@given(st.floats(0.0, 0.3), st.sampled_from(["up", "down"]))
def test_room_is_to_the_higher_ground_on_either_side(away: float, going: str) -> None:
    """Of the first riser; towards lower ground there is none to touch."""
    lane = stairs_course(going).lanes[0]
    at, rise = lane.risers()
    side = -1.0 if rise[0] > 0.0 else 1.0
    s = np.array([at[0] + side * (BIG + away)])
    assert room_at(lane, s, BIG)[0] == pytest.approx(away, abs=1e-12)
    beyond = lane.risers()[0][-1] - side * np.array([5.0])
    assert room_at(lane, beyond, BIG)[0] == np.inf
    assert np.all(room_at(flat_course().lanes[0], s, BIG) == np.inf)


def test_big_feet_that_roll_touch_no_riser() -> None:
    """They roll by more than what every footprint keeps from a riser, and are set down farther."""
    robot = replace(paper_robot(), foot_radius=BIG)
    course = stairs_course("up")
    lane = course.lanes[0]
    task = Task(kind="walk", name="walk", lane=0, goal=6.25)
    stance = initial_stance(robot, course, AHEAD, start=1.25)
    plan = plan_task(robot, course, AHEAD, task, stance, index=0)
    assert riser_room(lane, plan.contacts, BIG) >= ENOUGH
    times = sample_times(plan.contacts)
    feet, standing = plan.contacts.feet_at(times)
    rolled = plan.contacts.roll.at(times) if plan.contacts.roll else np.zeros((len(times), 4, 2))
    near = room_at(lane, lane.coordinates(feet[standing])[0], BIG) < 0.05
    assert near.any() and rolled[standing][near, 0].max() > EDGE_CLEARANCE


def test_footprints_give_way_to_a_riser_as_far_as_the_tread_is_deep_enough() -> None:
    """Those that are near it ahead, and where the ground beyond is higher."""
    wide = 10.0
    for going, gives in (("up", True), ("down", False)):
        lane = stairs_course(going).lanes[0]
        phases = {"tread_phase_up": 0.4, "tread_phase_down": 0.4}
        asked = PlanSettings(pattern=Pattern(1, 3, 1), stride=0.25, **phases)
        places = make_lattice(lane, start=1.25, goal=6.25, spacing=0.25, behind=3, per_cycle=1)
        a, b, _ = lane.treads(lane.flights[0])[0]
        k = int(np.searchsorted(places.s, a)) - places.behind
        at = {room: foothold(lane, places, LEGS[0], k, replace(asked, riser_room=room), BIG)
              for room in (0.0, 0.02, wide)}  # fmt: skip
        edge = BIG + EDGE_CLEARANCE
        assert at[0.0] == pytest.approx(b - edge)
        assert at[0.02] == pytest.approx(b - edge - (0.02 if gives else 0.0))
        assert at[wide] == pytest.approx(a + edge if gives else b - edge)


def test_small_feet_are_asked_for_no_more() -> None:
    """What they roll is less than what footprints keep in any case."""
    assert likely_room(0.008) == 0.0 < likely_room(0.02) < likely_room(0.04)
