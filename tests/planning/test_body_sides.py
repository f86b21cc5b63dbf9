"""The sides that hold the robot: all of them, where they have to, eased where none has margin."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from rig import flat_course, walk_plan

from drake_quad.errors import PlanningError
from drake_quad.planning.body_sides import CROSSING_TIME, make_sides
from drake_quad.planning.contact_plan import ContactPlan, sample_times
from drake_quad.planning.problem import PlanSettings
from drake_quad.stability.support_polygon import stability_margins


@cache
def contacts_of(duty_factor: float, wait: float = 0.0) -> ContactPlan:
    gait = PlanSettings(duty_factor=duty_factor, switch_wait=wait)
    return walk_plan(flat_course(), goal=3.25, settings=gait).contacts


@pytest.mark.parametrize("duty_factor", [0.75, 0.8, 0.85])
def test_least_distance_to_the_sides_is_the_static_margin(duty_factor: float) -> None:
    """Without a guard, for any point inside, at every sample away from a switch."""
    contacts = contacts_of(duty_factor)
    times = sample_times(contacts)
    switches = np.array([p.start for p in contacts.phases])
    times = times[np.abs(times[:, None] - switches).min(axis=1) > 1e-6]
    sides = make_sides(contacts, times, 0.0)[0]
    feet, standing = contacts.feet_at(times)
    points = np.einsum("nij,ni->nj", feet[..., :2], standing) / standing.sum(axis=1)[:, None]
    reach = np.einsum("ij,ij->i", sides.normal, points[sides.sample]) - sides.offset
    least = np.full(len(times), np.inf)
    np.minimum.at(least, sides.sample, reach)
    np.testing.assert_allclose(least, stability_margins(points, feet[..., :2], standing), atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(sides.normal, axis=1), 1.0)


def test_guard_asks_for_three_feet_before_they_are_alone_and_after() -> None:
    """On four feet, within the guard of a swing, that swing's three feet have to do as well."""
    contacts = contacts_of(0.85)
    times, guard = sample_times(contacts, 0.02), 0.15
    guarded, bare = (make_sides(contacts, times, g)[0] for g in (guard, 0.0))
    rows = [np.bincount(s.sample, minlength=len(times)) for s in (guarded, bare)]
    near = np.zeros(len(times), dtype=bool)
    for step in contacts.steps:
        near |= (times >= step.lift_off - guard) & (times < step.lift_off - 1e-6)
        near |= (times > step.touchdown + 1e-6) & (times <= step.touchdown + guard)
    assert np.all(rows[0][near] > rows[1][near])
    away = ~near & np.all(
        [
            np.abs(times - t) > guard + 1e-6
            for s in contacts.steps
            for t in (s.lift_off, s.touchdown)
        ],
        axis=0,
    )
    np.testing.assert_array_equal(rows[0][away], rows[1][away])


def test_within_the_guard_feet_have_rolled_as_far_as_in_the_swing_itself() -> None:
    """Also where one that the swing counts on is still in the air: it has not rolled at all there.

    With a short time on four feet, sides were up to 18 mm from where they are.
    """
    contacts, guard = contacts_of(0.76), 0.3
    times = sample_times(contacts, 0.02)
    assert contacts.roll is not None and np.abs(contacts.roll.offset).max() > 0.003
    sides, compared = make_sides(contacts, times, guard)[0], 0
    for k, phase in enumerate(contacts.phases):
        if phase.step is None:
            continue
        mine, count = sides.phase == k, len(phase.corners)
        first = np.searchsorted(times, phase.start - 1e-9)
        rows = mine & (sides.sample < first) & (sides.weight > 0.0)
        own = mine & (sides.sample == first)
        if not np.any(rows) or np.any(sides.weight[own] == 0.0):
            continue
        compared += int(rows.sum())
        for name in ("normal", "offset"):
            values = getattr(sides, name)
            before = values[rows].reshape(-1, count, *values.shape[1:])
            np.testing.assert_allclose(before, np.broadcast_to(values[own], before.shape))
    assert compared > 100


def test_margin_is_eased_around_diagonal_switches_without_time_on_four_feet() -> None:
    """To zero at the switch, linearly over the crossing time, and nowhere else."""
    contacts = contacts_of(0.75)
    times = sample_times(contacts, 0.02)
    sides = make_sides(contacts, times, 0.15)[0]
    diagonal = [
        after.lift_off
        for before, after in pairwise(contacts.steps)
        if after.leg.row + before.leg.row == 3 and after.lift_off - before.touchdown < 1e-9
    ]
    assert diagonal
    apart = np.abs(times[:, None] - np.array(diagonal)).min(axis=1)
    expected = np.minimum(apart / CROSSING_TIME, 1.0)
    np.testing.assert_allclose(sides.weight, expected[sides.sample], atol=1e-6)


@pytest.mark.parametrize(("duty_factor", "wait"), [(0.76, 0.0), (0.85, 0.0), (0.75, 0.3)])
def test_with_any_time_on_four_feet_the_margin_is_asked_for_in_full(
    duty_factor: float, wait: float
) -> None:
    """However short it is, a path with margin may exist."""
    contacts = contacts_of(duty_factor, wait)
    assert np.all(make_sides(contacts, sample_times(contacts), 0.15)[0].weight == 1.0)


def test_feet_on_one_line_are_refused() -> None:
    """They hold nothing."""
    feet = np.column_stack([np.arange(4.0), np.arange(4.0), np.zeros(4)])
    with pytest.raises(PlanningError, match="one line"):
        make_sides(ContactPlan(feet, (), 1.0), np.linspace(0.0, 1.0, 5), 0.0)
