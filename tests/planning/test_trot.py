"""Two feet at a time, as planned: who swings when, where feet stand, and what balances it."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from rig import course_of, flat_course, paper_robot, walk_plan

from drake_quad.common import FloatArray
from drake_quad.gait.schedule import trot_intervals
from drake_quad.planning.body_path import DYNAMIC_GUARD
from drake_quad.planning.body_sides import Sides, make_sides
from drake_quad.planning.contact_forces import held_com, torque_ratio
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.foothold_grid import make_foothold_grid
from drake_quad.planning.foothold_pattern import TROT, FootholdPattern
from drake_quad.planning.mission import check_plan
from drake_quad.planning.motion_plan import MotionPlan, evaluate
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.walk_footsteps import foothold
from drake_quad.planning.zmp import ZMP_CHECK_PERIOD, sample_zmp
from drake_quad.robot.legs import DIAGONALS, Leg
from drake_quad.stability.support_polygon import stability_margin
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element

SETTINGS = PlanSettings(
    duty_factor=0.6,
    cycle_time=1.0,
    stride=0.4,
    pattern=FootholdPattern(treads=2, lag=3, per_tread=2, gait=TROT),
    stance_stagger=0.0,
    swing_speed=20.0,
    body_height=0.88,
    dynamic=True,
    swing_time=0.8,
    shift_time=0.6,
)


def steps_course() -> Course:
    """Two low steps up."""
    return course_of(
        Element("floor", length=3.0),
        Element("stairs", going="up", rise=0.08, run=0.5, count=2),
        Element("floor", length=3.0),
    )


@cache
def trot_plan(stairs: bool) -> MotionPlan:
    """A short walk on level ground, or over the two steps."""
    if stairs:
        return walk_plan(steps_course(), start=1.6, goal=4.9, settings=SETTINGS)
    return walk_plan(flat_course(), goal=2.25, settings=SETTINGS)


@pytest.mark.parametrize("beta", [0.51, 0.6, 0.75, 0.9])
def test_pairs_swing_in_turn_with_time_on_four_feet_between(beta: float) -> None:
    """Half a cycle apart, each leg once, for (1 - β) T, and (β - ½) T from one to the next."""
    (first, on, off), (second, later, end) = trot_intervals(duty_factor=beta, cycle_time=2.0)
    assert (first, second) == DIAGONALS and sorted([*first, *second]) == list(Leg)
    assert (on, later) == (0.0, 1.0)
    assert off - on == pytest.approx(2.0 * (1.0 - beta)) == end - later
    assert later - off == pytest.approx(2.0 * (beta - 0.5))


@pytest.mark.parametrize("beta", [0.5, 1.0, float("nan")])
def test_without_time_on_four_feet_it_is_no_walking_trot(beta: float) -> None:
    """β in (½, 1) alone is accepted."""
    with pytest.raises(ValueError, match="duty_factor"):
        trot_intervals(duty_factor=beta, cycle_time=1.0)


@pytest.mark.parametrize("stairs", [False, True])
def test_the_gait_is_that_of_its_schedule(stairs: bool) -> None:
    """After a transition of single steps, diagonal pairs alternate, at the schedule's times."""
    plan = trot_plan(stairs)
    gait = next(s for s in plan.segments if s.kind == TROT)
    swings = [p for p in plan.contacts.phases if p.steps and p.start >= gait.start]
    pairs = [tuple(sorted(step.leg for step in phase.steps)) for phase in swings]
    assert pairs == [DIAGONALS[k % 2] for k in range(len(pairs))] and len(pairs) >= 4
    for before, after in pairwise(swings):
        assert before.end - before.start == pytest.approx(0.4)
        assert after.start - before.end == pytest.approx(0.1)
    singles = [p for p in plan.contacts.phases if p.steps and p.start < gait.start]
    assert all(len(phase.steps) == 1 for phase in singles)


@pytest.mark.parametrize("stairs", [False, True])
def test_the_zero_moment_point_is_on_the_line_of_two_feet(stairs: bool) -> None:
    """Within millimetres in the mean over each swing, a foot's radius or so at its quickest parts.

    And well within three feet or four where these stand.
    """
    plan, robot = trot_plan(stairs), paper_robot()
    zmp = sample_zmp(robot, plan.contacts, plan.body, ZMP_CHECK_PERIOD)
    _, standing = plan.contacts.feet_at(zmp.times)
    two = standing.sum(axis=1) == 2
    assert np.any(two) and np.all(np.isinf(zmp.margin[two])) and np.all(zmp.off_line[~two] == 0.0)
    assert zmp.off_line.max() < 1.25 * robot.foot_radius
    for phase in plan.contacts.phases:
        mine = (zmp.times > phase.start) & (zmp.times < phase.end)
        assert zmp.off_line[mine].mean() < 0.2 * robot.foot_radius
    assert zmp.margin.min() > 0.03 and plan.margin > 0.03
    told = next(s for s in plan.segments if s.kind == TROT).details["zmp_line_distance_max"]
    assert told == pytest.approx(float(zmp.off_line.max()))
    check_plan(robot, plan, dynamic=True)


def test_each_pair_stands_once_on_each_tread() -> None:
    """A stride is a tread: all four feet step on every tread, none next to its edges."""
    plan, lane = trot_plan(True), steps_course().lanes[0]
    radius = paper_robot().foot_radius
    ends = {leg: [] for leg in Leg}  # type: dict[Leg, list[float]]
    for step in plan.contacts.steps:
        ends[step.leg].append(float(lane.coordinates(step.swing.p_end[:2])[0]))
    for places in ends.values():
        assert sum(3.0 < s < 3.5 for s in places) == 1
        assert all(np.abs(lane.edges - s).min() > radius for s in places)


@pytest.mark.parametrize("together", [0.0, 0.4, 0.8])
def test_feet_stand_nearer_to_the_treads_middles(together: float) -> None:
    """By that share of their distance, on each tread and on the ground before the first one."""
    lane, robot = steps_course().lanes[0], paper_robot()
    settings = replace(SETTINGS, stride=0.5, places_together=together)
    grid = make_foothold_grid(
        lane, start=1.6, goal=4.9, spacing=0.25, behind=3, ahead=3, per_cycle=2, per_tread=2
    )
    stands = np.array([
        foothold(lane, grid, Leg.FRONT_LEFT, k - grid.behind, settings, robot.foot_radius)
        for k in range(len(grid.s))
    ])  # fmt: skip
    for low in (3.0, 3.5):
        on = (grid.s > low) & (grid.s < low + 0.5)
        away = 0.125 * (1.0 - together)
        assert stands[on] == pytest.approx([low + 0.25 - away, low + 0.25 + away])
    before = int(np.flatnonzero(grid.s < 3.0)[-1])
    plain = replace(settings, places_together=0.0)
    where = foothold(lane, grid, Leg.FRONT_LEFT, before - grid.behind, plain, robot.foot_radius)
    assert stands[before] == pytest.approx(where - 0.125 * together)
    far = grid.s < 2.5
    assert stands[far] == pytest.approx([
        foothold(lane, grid, Leg.FRONT_LEFT, int(k) - grid.behind, plain, robot.foot_radius)
        for k in np.flatnonzero(far)
    ])  # fmt: skip


def test_two_feet_have_a_line_and_an_end_at_either_foot() -> None:
    """At each sample: the row of the line is 0 on it alone, and the ends hold what is between."""
    contacts = trot_plan(False).contacts
    times = sample_times(contacts, 0.02)
    sides, line = make_sides(contacts, times, DYNAMIC_GUARD)
    index = next(k for k, phase in enumerate(contacts.phases) if len(phase.steps) == 2)
    phase = contacts.phases[index]
    k = int(np.searchsorted(times, 0.5 * (phase.start + phase.end)))
    feet, _ = contacts.feet_at(times[k : k + 1])
    a, b = feet[0, phase.standing, :2]
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)

    def reach(rows: Sides, point: FloatArray) -> FloatArray:
        mine = (rows.phase == index) & (rows.sample == k)
        return np.asarray(rows.normal[mine] @ point - rows.offset[mine])

    for share in (0.0, 0.3, 1.0):
        on = a + share * (b - a)
        assert reach(line, on) == pytest.approx([0.0], abs=1e-9)
        assert np.abs(reach(line, on + 0.02 * normal)) == pytest.approx([0.02])
        length = np.linalg.norm(b - a)
        assert sorted(reach(sides, on)) == pytest.approx(
            sorted([share * length, (1.0 - share) * length]), abs=1e-9
        )
    # In the guard the line of the swing to come holds beside the polygon of four feet.
    before = np.flatnonzero((times < phase.start - 1e-6) & (times > phase.start - DYNAMIC_GUARD))
    assert np.all(np.isin(before, line.sample)) and np.all(np.isin(before, sides.sample))


def test_two_feet_are_asked_for_what_they_can_bear() -> None:
    """The weight shared along their line: as if the centre of mass were over it, and it nearly is.

    Planned torques then are those of the weight on two feet, more than on four.
    """
    plan, robot = trot_plan(False), paper_robot()
    gait = next(s for s in plan.segments if s.kind == TROT)
    samples = evaluate(robot, plan, np.linspace(gait.start, gait.end, 200))
    com, two = held_com(samples), samples.standing.sum(axis=1) == 2
    np.testing.assert_array_equal(com[~two], samples.com[~two])
    for k in np.flatnonzero(two):
        assert stability_margin(com[k, :2], samples.feet[k, samples.standing[k], :2]) > -1e-9
        moved = np.linalg.norm(com[k] - samples.com[k])
        assert moved == pytest.approx(-samples.margin[k], abs=1e-9)
    ratio = torque_ratio(robot, samples)
    assert np.all(np.isfinite(ratio)) and 0.1 < np.median(ratio[~two]) < np.median(ratio[two]) < 1.0


def test_one_tread_for_both_pairs_is_a_trot_as_well() -> None:
    """With a place a tread the pairs stand side by side, and the plan keeps its point all the same.

    The body then goes beside the middle of its feet.
    """
    one = FootholdPattern(treads=1, lag=1, per_tread=1, gait=TROT)
    plan = walk_plan(flat_course(), goal=2.05, settings=replace(SETTINGS, pattern=one))
    check_plan(paper_robot(), plan, dynamic=True)
