"""Laws of the feet's part of a plan: who stands, where, and that nothing jumps."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.common import FloatArray
from drake_quad.gait.swing import Swing
from drake_quad.planning.contact_plan import ContactPlan, Step
from drake_quad.planning.phase_table import phase_table, sample_feet
from drake_quad.robot.legs import LEGS, SIGNS

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=30)
START = np.column_stack([SIGNS * [0.4, 0.3], np.full(4, 0.01)])


def random_plan(seed: int) -> ContactPlan:
    """Up to eight times one leg or two, with or without time on four feet between and after."""
    rng = np.random.default_rng(seed)
    feet, steps, t = START.copy(), [], 0.0
    for _ in range(rng.integers(0, 9)):
        t += rng.choice([0.0, rng.uniform(0.01, 1.0)])
        duration = rng.uniform(0.2, 1.5)
        for row in rng.permutation(4)[: rng.integers(1, 3)].tolist():
            apex, to = rng.uniform(0.2, 0.8), feet[row] + rng.normal(scale=0.2, size=3)
            swing = Swing(feet[row], to, duration, apex * duration, 0.2)
            steps.append(Step(LEGS[row], t, t + duration, swing))
            feet[row] = to
        t += duration
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
def test_two_legs_are_in_the_air_at_most_and_only_during_their_steps(seed: int) -> None:
    """At any time all legs but those whose steps are under way stand."""
    plan = random_plan(seed)
    for t in grid(plan, 100) if plan.phases else []:
        swinging = sorted(s.leg for s in plan.steps if s.lift_off <= t < s.touchdown)
        standing = plan.phase(t).standing
        if t < plan.duration:
            assert [leg for leg in LEGS if not standing[leg.row]] == swinging
            assert sorted(s.leg for s in plan.phase(t).steps) == swinging
        assert (~standing).sum() <= 2


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
        for step in phase.steps:
            expected[step.leg.row] = step.swing.sample(t - phase.start)[0]
        np.testing.assert_allclose(p, expected, atol=1e-12)
        np.testing.assert_array_equal(stands, phase.standing)


def test_a_switch_belongs_to_the_phase_that_begins_there() -> None:
    """At lift-off the leg is in the air, at touchdown it stands; outside, the ends hold."""
    swing = Swing(START[0], START[0] + [0.3, 0.0, 0.0], 1.0, 0.5, 0.1)
    plan = ContactPlan(START, (Step(LEGS[0], 1.0, 2.0, swing),), 3.0)
    assert [plan.phase_index(t) for t in (-1.0, 0.0, 0.999, 1.0, 1.999, 2.0, 3.0, 9.0)] == [
        0, 0, 0, 1, 1, 2, 2, 2]  # fmt: skip
    assert not plan.phase(1.0).standing[0] and plan.phase(2.0).standing[0]


@examples
@given(seeds)
def test_the_control_loop_samples_the_same_feet(seed: int) -> None:
    """The table's kernel gives every foot, one in the air or two, where the plan itself has it."""
    plan = random_plan(seed)
    if not plan.phases:
        return
    table, times = phase_table(plan), grid(plan, 60)
    feet, standing = plan.feet_at(times)
    for t, places, stands in zip(times, feet, standing, strict=True):
        found = sample_feet(table, t)
        np.testing.assert_allclose(found.place, places, atol=1e-9)
        np.testing.assert_array_equal(found.standing, stands)
        assert np.isnan(found.swing_phase) == bool(stands.all())
        assert np.all(found.velocity[stands] == 0.0)


def two_swings(second: float) -> tuple[Step, Step]:
    """Steps of two diagonal legs from 1 s to 2 s, the other `second` [s] later."""
    return tuple(
        Step(LEGS[k], 1.0 + late, 2.0 + late, Swing(START[k], START[k] + 0.1, 1.0, 0.5, 0.2))
        for k, late in ((0, 0.0), (3, second))
    )  # type: ignore[return-value]


def test_steps_that_begin_and_end_together_are_one_phase_and_others_may_not_overlap() -> None:
    """Two such steps make one phase on two feet; a plan whose swings overlap in part is refused."""
    plan = ContactPlan(START, two_swings(0.0), 3.0)
    assert [len(phase.steps) for phase in plan.phases] == [0, 2, 0]
    np.testing.assert_array_equal(plan.phases[1].standing, [False, True, True, False])
    with pytest.raises(ValueError, match="2 legs swing"):
        _ = plan.phases[1].step
    with pytest.raises(ValueError, match=r"RR lifts off at 1\.5 s"):
        ContactPlan(START, two_swings(0.5), 3.0)
    apart = ContactPlan(START, two_swings(1.0), 3.0)
    assert [len(phase.steps) for phase in apart.phases] == [0, 1, 1]
