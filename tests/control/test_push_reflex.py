"""The push reflex: when the robot would tip, with which foot that is caught, when it is over."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from rig import flat_course, flat_walk, paper_robot

from drake_quad.common import FloatArray
from drake_quad.control.ports import BALANCE_SIZE, Balance, Catch
from drake_quad.control.push_recovery import (
    Reflex,
    balance_margin,
    capture_point,
    choose_swing_foot,
    has_settled,
    needs_recovery,
)
from drake_quad.planning.recovery_step import StepTargetMap
from drake_quad.stability.support_polygon import stability_margin

ALL = np.ones(4, dtype=bool)
REFLEX = Reflex(robot=paper_robot(), ground=StepTargetMap(flat_course(), paper_robot().foot_radius))
speeds = st.floats(-1.0, 1.0)


def standing_with(vx: float = 0.0, vy: float = 0.0) -> FloatArray:
    """The robot amidst its four feet on level ground, its base this much faster than planned."""
    feet = np.array(flat_walk().contacts.feet)
    middle = feet[:, :2].mean(axis=0)
    balance = np.zeros(BALANCE_SIZE)
    balance[:3] = [*middle, 0.8]
    balance[Balance.VELOCITY_ERROR : Balance.FEET] = vx, vy
    balance[Balance.FEET : Balance.BODY] = feet.ravel()
    balance[Balance.BODY : Balance.BODY + 4] = [*middle, 0.85, 0.0]
    return balance


@given(speeds, speeds)
@settings(max_examples=40)
def test_capture_point_runs_ahead_with_the_velocity(vx: float, vy: float) -> None:
    """At rest it is the centre of mass; else it leads by so much a speed, in any direction."""
    (x, y), omega = capture_point(standing_with(vx, vy), ALL)
    lead = np.array([x, y]) - standing_with()[:2]
    assert omega == pytest.approx(np.sqrt(9.81 / 0.8), rel=0.02)
    np.testing.assert_allclose(lead, 0.8 * np.array([vx, vy]) / omega, atol=1e-12)


def test_planned_braking_counts_like_speed() -> None:
    """A plan that slows down has its pressure ahead of the centre of mass."""
    balance = standing_with()
    balance[Balance.ACCELERATION] = -1.0
    (x, _), _ = capture_point(balance, ALL)
    height = balance[2] - balance[Balance.FEET + 2]
    assert x - balance[0] == pytest.approx(height / 9.81)


@given(speeds, speeds, st.integers(0, 3))
@settings(max_examples=40)
def test_margin_is_that_of_the_capture_point(vx: float, vy: float, without: int) -> None:
    """Over the feet that support it, and no others; none support nothing."""
    balance, support = standing_with(vx, vy), np.arange(4) != without
    point, _ = capture_point(balance, support)
    feet = balance[Balance.FEET : Balance.BODY].reshape(4, 3)[support, :2]
    assert balance_margin(balance, support) == pytest.approx(stability_margin(point, feet))
    assert balance_margin(balance, np.zeros(4, dtype=bool)) < 0.0


def test_only_what_tips_the_robot_is_a_push() -> None:
    """Slow errors are none, whatever the margin; fast ones are where the feet do not hold them."""
    one_side = np.array([True, False, True, False])
    nobody = np.zeros(4)
    assert not needs_recovery(REFLEX, standing_with(vy=0.1), nobody, one_side)
    assert needs_recovery(REFLEX, standing_with(vy=-0.2), nobody, one_side)
    assert not needs_recovery(REFLEX, standing_with(vy=-0.2), nobody, ALL)
    assert not needs_recovery(
        REFLEX, standing_with(vy=-0.2), np.ones(4), one_side
    )  # they bear after all
    assert needs_recovery(REFLEX, standing_with(vy=-1.5), np.ones(4), ALL)


def test_calm_is_on_four_feet_and_nearly_at_rest() -> None:
    """Not while it moves, not on three feet, not at the edge."""
    assert has_settled(standing_with(), np.ones(4))
    assert not has_settled(standing_with(vx=0.06), np.ones(4))
    assert not has_settled(standing_with(), np.array([1.0, 1.0, 0.0, 1.0]))
    edge = standing_with()
    edge[1] -= 0.25
    assert not has_settled(edge, np.ones(4))


def test_nothing_is_put_down_where_four_feet_hold() -> None:
    """Standing still is all there is to do."""
    assert choose_swing_foot(REFLEX, standing_with(vy=-0.2), ALL, ())[Catch.LEG] == 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_hard_push_is_caught_on_the_side_that_it_goes_to(sign: float) -> None:
    """A foot of that side is lifted and put farther out, where it then holds the capture point."""
    balance = standing_with(vy=sign * 1.3)
    catch = choose_swing_foot(REFLEX, balance, ALL, ())
    row = int(catch[Catch.LEG]) - 1
    before = balance[Balance.FEET + 3 * row : Balance.FEET + 3 * row + 3]
    assert row >= 0 and np.sign(before[1]) == sign
    assert sign * (catch[Catch.Y] - before[1]) > 0.05
    assert catch[Catch.DURATION] > 0.0 and catch[Catch.LIFT] > 0.0


def test_foot_in_the_air_is_put_down_first() -> None:
    """With a leg swinging that can hold the robot, that one is taken, without a lift."""
    step = flat_walk().contacts.steps[0]
    balance = standing_with()
    place = slice(Balance.FEET + 3 * step.leg.row, Balance.FEET + 3 * step.leg.row + 3)
    balance[place] += [0.0, 0.0, 0.1]
    outward = np.sign(balance[place][1])
    balance[Balance.VELOCITY_ERROR + 1] = outward * 0.4
    catch = choose_swing_foot(REFLEX, balance, np.arange(4) != step.leg.row, [step])
    assert catch[Catch.LEG] == step.leg and catch[Catch.LIFT] == 0.0
    assert catch[Catch.Z] == pytest.approx(paper_robot().foot_radius)
