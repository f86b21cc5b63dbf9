"""Laws of the feet's part of a plan: who stands, where, and that nothing jumps."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.common import FloatArray
from drake_quad.gait.swing import Swing
from drake_quad.planning.contact_plan import ContactPlan, Step
from drake_quad.robot.legs import LEGS, SIGNS

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=30)
START = np.column_stack([SIGNS * [0.4, 0.3], np.full(4, 0.01)])


def random_plan(seed: int) -> ContactPlan:
    """Up to eight steps of any legs, with or without time on four feet between and after."""
    rng = np.random.default_rng(seed)
    feet, steps, t = START.copy(), [], 0.0
    for _ in range(rng.integers(0, 9)):
        leg = LEGS[rng.integers(4)]
        t += rng.choice([0.0, rng.uniform(0.01, 1.0)])
        duration, apex = rng.uniform(0.2, 1.5), rng.uniform(0.2, 0.8)
        to = feet[leg.row] + rng.normal(scale=0.2, size=3)
        swing = Swing(feet[leg.row], to, duration, apex * duration, 0.2)
        steps.append(Step(leg, t, t + duration, swing))
        feet[leg.row], t = to, t + duration
    return ContactPlan(START, tuple(steps), t + float(rng.choice([0.0, 0.7])))


def grid(plan: ContactPlan, count: int = 400) -> FloatArray:
    return np.linspace(0.0, plan.duration, count)


@examples
@given(seeds)
def test_phases_are_without_gaps_and_cover_the_plan(seed: int) -> None:
    """Each phase begins where the one before ended, from 0 to the end."""
    plan = random_plan(seed)
    if not plan.phases:
        assert plan.duration == 0.0
        return
    edges = [plan.phases[0].start, *(p.end for p in plan.phases)]
    assert edges[0] == 0.0 and edges[-1] == pytest.approx(plan.duration, abs=1e-9)
    assert [p.start for p in plan.phases] == pytest.approx(edges[:-1], abs=1e-9)
    assert all(p.end > p.start for p in plan.phases)


@examples
@given(seeds)
def test_at_most_one_leg_is_in_the_air_and_only_during_its_step(seed: int) -> None:
    """At any time all legs but the one whose step is under way stand."""
    plan = random_plan(seed)
    for t in grid(plan, 100) if plan.phases else []:
        swinging = [s.leg for s in plan.steps if s.lift_off <= t < s.touchdown]
        standing = plan.phase(t).standing
        if t < plan.duration:
            assert [leg for leg in LEGS if not standing[leg.row]] == swinging
        assert (~standing).sum() <= 1


@examples
@given(seeds)
def test_standing_feet_do_not_move_and_swinging_ones_do_not_jump(seed: int) -> None:
    """Each foot is where it stood until its step lifts it, and moves continuously."""
    plan = random_plan(seed)
    if not plan.phases:
        return
    times = grid(plan)
    feet, standing = plan.feet_at(times)
    moved = np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    stands_on = standing[1:] & standing[:-1]
    index = np.array([plan.phase_index(t) for t in times])
    same = index[1:] == index[:-1]
    assert np.all(moved[stands_on & same[:, None]] == 0.0)
    switches = np.array([p.start for p in plan.phases[1:]])
    before, after = (plan.feet_at(switches + sign * 1e-6)[0] for sign in (-1.0, 1.0))
    np.testing.assert_allclose(before, after, atol=1e-9)


@examples
@given(seeds)
def test_feet_end_where_the_last_steps_put_them(seed: int) -> None:
    """`final_feet` is where each leg's last step ended, or where it stood at first."""
    plan = random_plan(seed)
    expected = START.copy()
    for step in plan.steps:
        expected[step.leg.row] = step.swing.p_end
    np.testing.assert_array_equal(plan.final_feet, expected)
    if plan.phases:
        feet, _ = plan.feet_at(np.array([plan.duration]))
        np.testing.assert_allclose(feet[0], expected, atol=1e-12)


@examples
@given(seeds)
def test_first_stance_is_the_one_given(seed: int) -> None:
    """At time 0 the feet stand where they stood; a plan keeps its own copy of that."""
    plan = random_plan(seed)
    np.testing.assert_array_equal(plan.feet, START)
    assert not plan.feet.flags.writeable and not plan.final_feet.flags.writeable
    if plan.phases:
        np.testing.assert_allclose(plan.feet_at(np.zeros(1))[0][0], START, atol=1e-12)


@examples
@given(seeds)
def test_many_times_at_once_are_each_alone(seed: int) -> None:
    """`feet_at` gives for every time what `phase` and its swing give for that one."""
    plan = random_plan(seed)
    if not plan.phases:
        return
    switches = [p.start for p in plan.phases]
    times = np.unique(np.concatenate([grid(plan, 50), switches]))
    feet, standing = plan.feet_at(times)
    for t, p, stands in zip(times, feet, standing, strict=True):
        phase = plan.phase(t)
        expected = np.array(phase.feet)
        if phase.step is not None:
            expected[phase.step.leg.row] = phase.step.swing.sample(t - phase.start)[0]
        np.testing.assert_allclose(p, expected, atol=1e-12)
        np.testing.assert_array_equal(stands, phase.standing)


def test_a_switch_belongs_to_the_phase_that_begins_there() -> None:
    """At lift-off the leg is in the air, at touchdown it stands; outside, the ends hold."""
    swing = Swing(START[0], START[0] + [0.3, 0.0, 0.0], 1.0, 0.5, 0.1)
    plan = ContactPlan(START, (Step(LEGS[0], 1.0, 2.0, swing),), 3.0)
    assert [plan.phase_index(t) for t in (-1.0, 0.0, 0.999, 1.0, 1.999, 2.0, 3.0, 9.0)] == [
        0, 0, 0, 1, 1, 2, 2, 2]  # fmt: skip
    assert not plan.phase(1.0).standing[0] and plan.phase(2.0).standing[0]
