"""Transitions: the paper's, their proofs by exhaustion, and laws for any stances."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait.transition import (
    Transition,
    enumerate_transitions,
    follow_transition,
    plan_transition,
)
from drake_quad.gait.workspace import (
    PAPER_WORKSPACE,
    initial_configuration,
    spin_desired_configuration,
    wave_desired_configuration,
)
from drake_quad.robot.legs import LEGS, Leg
from drake_quad.stability.support_polygon import stability_margin

CENTRES = initial_configuration(PAPER_WORKSPACE)
R = 0.75
WAVE = wave_desired_configuration(PAPER_WORKSPACE, stroke=R, duty_factor=0.75)
SPIN = spin_desired_configuration(PAPER_WORKSPACE, phi=np.radians(67.5), duty_factor=0.75)
MIRROR = [leg.mirrored.row for leg in LEGS]

offsets = arrays(np.float64, (4, 2), elements=st.floats(-0.2, 0.2))


def papers_wave_transition(place: FloatArray) -> Transition:
    """Fig. 3: legs 2, 3, 4, 1, 3, with leg 3's place in between."""
    order = [(2, WAVE[1]), (3, place), (4, WAVE[3]), (1, WAVE[0]), (3, WAVE[2])]
    return follow_transition(CENTRES, [(Leg(number), to) for number, to in order])


def margins(transition: Transition) -> list[float]:
    return [step.margin for step in transition.steps]


def test_papers_transition_to_the_wave_gait() -> None:
    """By way of -R/6 it has the margins 0, 0, 0, 0, 0.175 m and ends as the gait begins."""
    transition = papers_wave_transition(CENTRES[2] + np.array([-R / 6.0, 0.0]))
    assert margins(transition) == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.175], abs=2e-4)
    assert transition.goal == pytest.approx(WAVE)


@given(st.floats(-0.38, 0.38), st.floats(-0.25, 0.25))
def test_leg_three_has_to_rest_exactly_on_the_diagonal(dx: float, dy: float) -> None:
    """Anywhere else than on the ray from leg 2 through the centre of mass, step 3 or 4 fails.

    At the height of its workspace's centre that is -R/6, and nowhere else.
    """
    place = CENTRES[2] + np.array([dx, dy])
    third, fourth = margins(papers_wave_transition(place))[2:4]
    across = (place[0] * WAVE[1, 1] - place[1] * WAVE[1, 0]) / np.hypot(*WAVE[1])
    if abs(across) > 1e-6:
        assert min(third, fourth) < 0.0
    on_row = papers_wave_transition(CENTRES[2] + np.array([dx, 0.0]))
    if abs(dx + R / 6.0) > 1e-6:
        assert min(margins(on_row)[2:4]) < 0.0


@pytest.mark.parametrize(("goal", "best"), [(WAVE, -0.032), (SPIN, -0.093)])
def test_no_order_of_four_steps_is_stable_with_the_body_still(
    goal: FloatArray, best: float
) -> None:
    """All 24 orders fail; the best of them by 0.032 m (wave) and 0.093 m (spin)."""
    everything = enumerate_transitions(CENTRES, goal, steps=4)
    assert len({transition.order for transition in everything}) == 24
    assert everything[0].margin_min == pytest.approx(best, abs=6e-4)
    assert everything[0].margin_min == pytest.approx(max(t.margin_min for t in everything))


@pytest.mark.parametrize("goal", [WAVE, SPIN])
def test_five_steps_are_the_fewest_with_the_body_still(goal: FloatArray) -> None:
    """A stable plan of five steps exists, and its least margin is 0, at the first lift.

    Whichever leg of the symmetric stance is lifted first, the centre of mass is on a diagonal.
    """
    transition = plan_transition(CENTRES, goal, workspace=PAPER_WORKSPACE)
    assert len(transition.steps) == 5
    assert transition.margin_min == pytest.approx(0.0, abs=1e-9)
    first = [stability_margin((0.0, 0.0), np.delete(CENTRES, k, axis=0)) for k in range(4)]
    assert first == pytest.approx([0.0] * 4, abs=1e-12)
    # All the other steps can be kept off the border: better than the paper's 0, 0, 0, 0.
    assert sorted(margins(transition))[1] > 0.03


def test_papers_order_is_among_the_optimal_plans() -> None:
    """Of the five-step plans with the largest least margin, 0, one is 2-3-4-1-3."""
    plans = enumerate_transitions(CENTRES, WAVE, steps=5, workspace=PAPER_WORKSPACE)
    best = max(plan.margin_min for plan in plans)
    orders = [plan.order for plan in plans if plan.margin_min >= best - 1e-9]
    assert (Leg(2), Leg(3), Leg(4), Leg(1), Leg(3)) in orders


def in_order(numbers: str, goal: FloatArray, **more: Any) -> Transition:
    order = [Leg(int(number)) for number in numbers.split("-")]
    return plan_transition(CENTRES, goal, workspace=PAPER_WORKSPACE, order=order, **more)


def test_the_papers_order_can_be_asked_for() -> None:
    """2-3-4-1-3 goes by way of R/6 behind leg 3's centre, straight back, as the paper has it."""
    transition = in_order("2-3-4-1-3", WAVE)
    assert [int(leg) for leg in transition.order] == [2, 3, 4, 1, 3]
    np.testing.assert_allclose(transition.steps[1].p_to, CENTRES[2] - [R / 6.0, 0.0], atol=1e-8)
    assert margins(transition) == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.175], abs=2e-4)


@pytest.mark.parametrize("goal", [WAVE, SPIN])
def test_the_order_found_can_be_asked_for(goal: FloatArray) -> None:
    """Asked for in the order that the search finds, a transition has the same margins."""
    ways: list[dict[str, Any]] = [{}, {"mode": "shift", "max_shift": 0.1}]
    for more in ways:
        found = plan_transition(CENTRES, goal, workspace=PAPER_WORKSPACE, **more)
        again = in_order("-".join(str(int(leg)) for leg in found.order), goal, **more)
        assert again.order == found.order
        assert margins(again) == pytest.approx(margins(found), abs=1e-8)


@pytest.mark.parametrize(
    ("order", "why"),
    [
        ("2-3-4", "2-3-4 does not lift leg 1, which has to move"),
        ("1-2-3-4", "1-2-3-4 has a stability margin of -0.175 m"),
        ("4-3-2-1-3", "4-3-2-1-3 is not stable, whatever the places in between"),
    ],
)
def test_an_order_that_cannot_be_is_refused(order: str, why: str) -> None:
    """The error says which order, and what is wrong with it."""
    with pytest.raises(PlanningError, match=why):
        in_order(order, WAVE)


def test_legs_at_their_goals_are_passed_over_in_an_order() -> None:
    """A leg that is where it has to be is not lifted for the order's sake."""
    goal = np.array(CENTRES)
    goal[1] += [0.1, 0.0]
    assert in_order("2-3-4-1", goal, margin_required=0.0).order == (Leg(2),)


@pytest.mark.parametrize(
    ("goal", "max_shift", "best"),
    [(WAVE, 0.1, 0.105), (SPIN, 0.1, 0.048), (SPIN, 0.2, 0.132)],
)
def test_four_steps_are_enough_for_a_body_that_shifts(
    goal: FloatArray, max_shift: float, best: float
) -> None:
    """With shifts of at most 0.1 m: 0.105 m (wave) and 0.048 m (spin); with 0.2 m 0.132 m."""
    transition = plan_transition(
        CENTRES, goal, mode="shift", max_shift=max_shift, workspace=PAPER_WORKSPACE
    )
    assert len(transition.steps) == 4
    assert transition.margin_min == pytest.approx(best, abs=5e-4)
    feet = np.array(CENTRES)
    for step in transition.steps:
        assert np.abs(step.shift).max() <= max_shift + 1e-12
        standing = np.delete(feet, step.leg.row, axis=0)
        assert step.margin == pytest.approx(stability_margin(step.shift, standing))
        assert PAPER_WORKSPACE.contains(feet - step.shift)
        feet[step.leg.row] = step.p_to
        assert PAPER_WORKSPACE.contains(feet - step.shift)


@given(offsets, offsets)
@settings(max_examples=50)
def test_plans_mirror_with_their_stances(start: FloatArray, goal: FloatArray) -> None:
    """The mirrored task has a plan with the same margins."""
    flip = np.array([1.0, -1.0])
    try:
        plan = plan_transition(CENTRES + start, CENTRES + goal, mode="shift", max_steps=4)
    except PlanningError as error:
        with pytest.raises(PlanningError) as mirrored:
            plan_transition(
                (CENTRES + start)[MIRROR] * flip, (CENTRES + goal)[MIRROR] * flip,
                mode="shift", max_steps=4,
            )  # fmt: skip
        assert mirrored.value.data["margin"] == pytest.approx(error.data["margin"], abs=1e-6)
        return
    image = plan_transition(
        (CENTRES + start)[MIRROR] * flip, (CENTRES + goal)[MIRROR] * flip, mode="shift", max_steps=4
    )
    assert sorted(margins(image)) == pytest.approx(sorted(margins(plan)), abs=1e-7)


@given(offsets, offsets)
@settings(max_examples=50)
def test_a_plan_leads_from_start_to_goal(start: FloatArray, goal: FloatArray) -> None:
    """Steps follow one another, the last feet are the goal, and the least margin is the least."""
    plan = plan_transition(CENTRES + start, CENTRES + goal, mode="shift", margin_required=-1.0)
    feet = np.array(plan.start)
    for step in plan.steps:
        assert (feet[step.leg.row] == step.p_from).all()
        feet[step.leg.row] = step.p_to
    assert (feet == plan.goal).all()
    assert np.abs(feet - CENTRES - goal).max() <= 0.005
    end = stability_margin((0.0, 0.0), feet)
    assert plan.margin_min == pytest.approx(min([*margins(plan), end]))


@given(offsets, offsets, st.floats(0.02, 0.2))
@settings(max_examples=50)
def test_freedom_to_shift_never_costs(start: FloatArray, goal: FloatArray, shift: float) -> None:
    """A body that may shift moves its feet in as few steps, and as stably, as one that may not."""
    still = plan_transition(CENTRES + start, CENTRES + goal, margin_required=-1.0)
    moved = plan_transition(
        CENTRES + start, CENTRES + goal, mode="shift", max_shift=shift, margin_required=-1.0
    )
    assert len(moved.steps) == len(still.steps)
    assert min(margins(moved), default=0.0) >= min(margins(still), default=0.0) - 1e-9


def test_legs_in_place_are_not_moved() -> None:
    """Only legs farther than the tolerance from their goals are lifted."""
    goal = CENTRES + np.array([[0.004, 0.0], [0.1, 0.0], [0.0, 0.0], [0.0, -0.003]])
    plan = plan_transition(CENTRES, goal)
    assert plan.order == (Leg.FRONT_RIGHT,)
    assert plan.goal[0].tolist() == CENTRES[0].tolist()
    assert plan_transition(CENTRES, CENTRES).steps == ()


def test_no_plan_is_an_error_that_says_how_close_one_came() -> None:
    """With the body still a centimetre of margin cannot be had: the best has -0.032 m."""
    with pytest.raises(PlanningError, match="best") as raised:
        plan_transition(CENTRES, WAVE, margin_required=0.01, workspace=PAPER_WORKSPACE)
    assert raised.value.data["margin"] == pytest.approx(-0.0315, abs=1e-3)


def test_an_end_that_does_not_hold_the_centre_of_mass_is_an_error() -> None:
    """The goal has to be stable with the centre of mass where it is to be in the end."""
    plan_transition(CENTRES, WAVE, mode="shift", goal_com=(0.05, 0.0))
    with pytest.raises(PlanningError, match="final stance") as raised:
        plan_transition(CENTRES, WAVE, mode="shift", goal_com=(0.7, 0.0))
    assert raised.value.data["margin"] < 0.0


def test_direct_transition_between_gaits_is_more_stable_than_by_way_of_the_centres() -> None:
    """From the wave to the spin without the initial configuration: five steps, 0.085 m."""
    plan = plan_transition(WAVE, SPIN, workspace=PAPER_WORKSPACE)
    assert len(plan.steps) == 5
    assert plan.margin_min == pytest.approx(0.085, abs=5e-4)


@pytest.mark.parametrize("bad", [{"mode": "jump"}, {"mode": "shift", "max_shift": -0.1}])
def test_bad_arguments_are_refused(bad: dict[str, str]) -> None:
    """Unknown modes, shifts of nothing, and feet of another shape."""
    with pytest.raises(ValueError, match=r"mode|max_shift"):
        plan_transition(CENTRES, WAVE, **bad)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="shape"):
        plan_transition(CENTRES[:3], WAVE[:3])
