"""Treads with several places to step: where they are, how walks use them, how gaits are judged."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import paper_robot, stairs_course, walk_plan

from drake_quad.gait_design.candidates import (
    EDGE,
    Staircase,
    candidate_bounds,
    make_candidates,
    make_cycle,
    make_foothold_patterns,
)
from drake_quad.planning.body_reference import body_lift
from drake_quad.planning.foothold_grid import make_foothold_grid
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.planning.problem import EDGE_CLEARANCE, PlanSettings
from drake_quad.planning.walk_footsteps import foothold
from drake_quad.robot.legs import LEGS, WAVE_ORDER

RUN = 0.5
TWICE = PlanSettings(pattern=FootholdPattern(1, 3, 2), stride=0.25, cycle_time=6.0)


@pytest.mark.parametrize("per_tread", [1, 2, 3])
@pytest.mark.parametrize("going", ["up", "down"])
def test_treads_have_so_many_places_evenly_spaced(going: str, per_tread: int) -> None:
    """Symmetric about the tread's middle; the slope's line does not depend on how many."""
    lane = stairs_course(going).lanes[0]
    ends: dict[str, Any] = {"start": 1.25, "goal": 6.25}
    places = make_foothold_grid(
        lane, **ends, spacing=RUN / per_tread, behind=2, per_tread=per_tread
    )
    one = make_foothold_grid(lane, **ends, spacing=RUN, behind=2, per_cycle=1)
    assert np.all(np.diff(places.s) > 0.0)
    for a, b, z in lane.treads(lane.flights[0]):
        mine = (places.s > a) & (places.s < b)
        own = (np.arange(per_tread) + 0.5) / per_tread
        np.testing.assert_allclose(places.s[mine], a + (b - a) * own)
        np.testing.assert_allclose(places.z[mine], z)
    s = np.linspace(0.5, 7.0, 300)
    np.testing.assert_allclose(places.height(s), one.height(s), atol=1e-12)


@given(
    start=st.floats(0.8, 1.6), goal=st.floats(5.4, 6.4), spacing=st.floats(0.2, 0.3),
    going=st.sampled_from(["up", "down"]),
)  # fmt: skip
def test_flights_begin_with_the_places_of_stairs_without_end(
    start: float, goal: float, spacing: float, going: str
) -> None:
    """Of two places a tread and two a cycle, the body's are the first of treads as cycles begin.

    So every foot stands on the same one of each tread as on the stairs on which the gait was found.
    """
    lane = stairs_course(going).lanes[0]
    grid = make_foothold_grid(
        lane, start=start, goal=goal, spacing=spacing, behind=2, per_cycle=2, per_tread=2
    )
    treads = lane.treads(lane.flights[0])
    for a, b, _ in treads:
        first = int(np.argmin(np.abs(grid.s - (0.75 * a + 0.25 * b))))
        assert abs(grid.s[first] - (0.75 * a + 0.25 * b)) < 1e-9
        assert (first - grid.behind) % 2 == 0
    level = (grid.s[1:] <= treads[0, 0]) | (grid.s[:-1] >= treads[-1, 1])
    assert np.all(np.diff(grid.s)[level] <= max(spacing, 0.25) + 1e-9)


@pytest.mark.parametrize("going", ["up", "down"])
def test_every_leg_steps_on_every_place_in_the_waves_order(going: str) -> None:
    """Twice on each tread, one leg at a time, and the margin is positive."""
    course = stairs_course(going)
    lane = course.lanes[0]
    plan = walk_plan(course, goal=6.25, settings=TWICE)
    begin = next(s for s in plan.segments if s.kind == "wave").start
    steps = [s for s in plan.contacts.steps if s.lift_off >= begin - 1e-9]
    assert [s.leg for s in steps] == list(WAVE_ORDER) * (len(steps) // 4)
    for leg in LEGS:
        s = np.array([step.swing.p_end[0] for step in steps if step.leg is leg])
        assert np.all(np.diff(s) > 0.0)
        for a, b, _ in lane.treads(lane.flights[0]):
            np.testing.assert_allclose(s[(s > a) & (s < b)], [a + 0.125, a + 0.375], atol=1e-9)
    assert plan.margin > 0.03


@given(st.floats(-0.4, 0.4))
def test_feet_stand_off_their_places_but_whole_on_treads(phase: float) -> None:
    """By the same share of the whole tread at every place, but for the treads' ends."""
    settings = PlanSettings(pattern=FootholdPattern(1, 3, 2), tread_phase_up=phase, stride=0.25)
    lane, radius = stairs_course("up").lanes[0], paper_robot().foot_radius
    places = make_foothold_grid(lane, start=1.25, goal=6.25, spacing=0.25, behind=2,
                          per_cycle=1, per_tread=2)  # fmt: skip
    a, b, _ = lane.treads(lane.flights[0])[1]
    k = int(np.searchsorted(places.s, a)) - places.behind
    room = radius + EDGE_CLEARANCE
    for place in (k, k + 1):
        own = places.s[place + places.behind] + RUN * phase
        for leg in LEGS:
            found = foothold(lane, places, leg, place, settings, radius)
            assert found == pytest.approx(np.clip(own, a + room, b - room))


@given(st.floats(-0.2, 0.2))
def test_body_is_lifted_on_the_way_down_alone(lift: float) -> None:
    """In full where the flight is steep all around, not at all on level ground or going up."""
    settings = PlanSettings(lift_down=lift)
    for going, share in (("down", 1.0), ("up", 0.0)):
        lane = stairs_course(going).lanes[0]
        places = make_foothold_grid(lane, start=1.25, goal=6.25, spacing=0.5)
        found = body_lift(places, np.array([1.25, 3.75, 6.25]), settings)
        np.testing.assert_allclose(found, [0.0, share * lift, 0.0], atol=1e-12)
        fine = body_lift(places, np.linspace(1.0, 6.5, 2000), settings)
        assert np.max(np.abs(np.diff(fine))) <= 0.02 * abs(lift) + 1e-12


@pytest.mark.parametrize("rise", [0.15, -0.15])
def test_cycles_of_candidates_stand_whole_on_treads_and_close(rise: float) -> None:
    """Every standing foot is on its tread; the cycles end as they began, whole treads on."""
    stairs, radius = Staircase(rise, RUN), 0.03
    patterns = make_foothold_patterns(paper_robot(), [RUN], per_tread=2)
    assert patterns
    for pattern in patterns:
        lower, upper, _ = candidate_bounds(pattern)
        p = np.random.default_rng(0).uniform(lower, upper, (12, len(lower)))
        grid = make_candidates(paper_robot(), pattern, p)
        cycle = make_cycle(grid, stairs, foot_radius=radius, clearance=0.02)
        place = np.round(cycle.feet[..., 0] / RUN)
        stands = np.broadcast_to(cycle.standing, place.shape)
        off = np.abs(cycle.feet[..., 0] - place * RUN)
        assert np.all(off[stands] <= 0.5 * RUN - radius - EDGE + 1e-9)
        height = cycle.feet[..., 2] - radius - rise * place
        np.testing.assert_allclose(height[stands], 0.0, atol=1e-9)
        went = cycle.feet[:, -1] - cycle.feet[:, 0]
        np.testing.assert_allclose(went[..., 2], went[..., 0] / RUN * rise, atol=1e-9)
        assert len({round(float(v), 9) for v in went[0, :, 0]}) == 1


def test_no_pattern_has_places_too_near_to_nosings() -> None:
    """Of a run on which two feet are not whole one behind the other there is none."""
    robot = paper_robot()
    narrow = 4.0 * (robot.foot_radius + EDGE) - 1e-3
    assert make_foothold_patterns(robot, [narrow], per_tread=2) == []
