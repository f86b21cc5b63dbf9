"""Light feet are pressed down by a part of what they bear at rest, and give little aside."""

import numpy as np
import pytest
from control_rig import com_of, state_on
from hypothesis import given, strategies as st
from pydrake.math import RotationMatrix
from rig import flat_walk, model_layout, stairs_walk, state_of
from whole_body_rig import CONTROL, MASS, controller_of, ground_forces

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.control.contact_load import (
    MOST_TIMES,
    REST_SHARE,
    min_normal_forces,
    static_load_shares,
    tangential_prices,
)

seeds = st.integers(0, 2**32 - 1)
LEAST, MOST, WEIGHT = 20.0, 40.0, 600.0


def stance(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Feet of a robot on stairs (4, 3), how much each may carry, and a point amid them (2,)."""
    rng = np.random.default_rng(seed)
    feet = np.array([[0.4, 0.3, 0.2], [0.4, -0.3, 0.2], [-0.4, 0.3, 0.0], [-0.4, -0.3, 0.0]])
    feet += rng.uniform(-0.15, 0.15, (4, 3))
    load = np.ones(4)
    load[rng.integers(4)] = rng.choice([0.0, 1.0, rng.uniform(0.01, 1.0)])
    return feet, load, rng.uniform(-0.2, 0.2, 2)


@given(seeds)
def test_shares_hold_the_weight_and_no_moment_is_left(seed: int) -> None:
    """They add up to 1, and their centre is under the centre of mass."""
    feet, load, com = stance(seed)
    shares = static_load_shares(feet, load, *com)
    assert shares.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(shares @ feet[:, :2], com, atol=1e-9)
    assert np.all(shares[load == 0.0] == 0.0)


@given(seeds)
def test_no_others_that_hold_it_have_a_smaller_sum_of_squares(seed: int) -> None:
    """Each square over the load that the foot may carry; four feet leave one way to differ."""
    feet, load, com = stance(seed)
    if np.any(load == 0.0):
        return
    shares = static_load_shares(feet, load, *com)
    equations = np.column_stack([np.ones(4), feet[:, :2]]).T
    other = np.linalg.svd(equations)[2][3]  # changes no force and no moment
    assert (shares / load) @ other == pytest.approx(0.0, abs=1e-9)


@given(seeds, st.floats(-3.0, 3.0))
def test_shares_are_the_same_wherever_the_robot_stands(seed: int, turn: float) -> None:
    """They are of the feet and the centre of mass alone: moved and turned they do not change."""
    feet, load, com = stance(seed)
    R, by = RotationMatrix.MakeZRotation(turn).matrix(), np.array([3.0, -7.0, 1.0])
    moved = R @ [*com, 0.0] + by
    there = static_load_shares(np.ascontiguousarray(feet @ R.T + by), load, moved[0], moved[1])
    np.testing.assert_allclose(there, static_load_shares(feet, load, *com), atol=1e-9)


@given(st.floats(-3.0, 3.0), st.floats(-5.0, 5.0))
def test_feet_in_a_line_hold_nothing_at_rest(turn: float, away: float) -> None:
    """Two feet, or three in a line: no shares, and so the least force alone."""
    along = np.array([np.cos(turn), np.sin(turn), 0.0])
    feet = away + np.array([[0.4], [0.0], [-0.4], [1.0]]) * along
    for load in (np.array([1.0, 1.0, 1.0, 0.0]), np.array([1.0, 0.0, 1.0, 0.0])):
        shares = static_load_shares(feet, load, away + 0.1 * along[0], away + 0.1 * along[1])
        np.testing.assert_array_equal(shares, 0.0)
        least = min_normal_forces(shares, load, WEIGHT, LEAST, MOST)
        np.testing.assert_array_equal(least, LEAST * load)


@given(seeds)
def test_least_normals_are_half_of_what_rest_gives_within_bounds(seed: int) -> None:
    """Never less than what is kept always, nor more than the most."""
    feet, load, com = stance(seed)
    shares = static_load_shares(feet, load, *com)
    least = min_normal_forces(shares, load, WEIGHT, LEAST, MOST)
    assert np.all(least >= LEAST * load) and np.all(least <= MOST * load)
    raised = least > LEAST * load
    assert np.all(least[raised] <= REST_SHARE * WEIGHT * shares[raised] + 1e-9)
    between = raised & (least < MOST * load)
    np.testing.assert_allclose(least[between], REST_SHARE * WEIGHT * shares[between])


@pytest.mark.parametrize(("away", "kicked"), [(0.03, 0.0), (0.0, 0.12)])
def test_a_body_brought_back_to_its_plan_lifts_no_foot(away: float, kicked: float) -> None:
    """The feet on the far side lose load to it, down to half of what the capture point leaves."""
    plan = flat_walk()
    step = plan.contacts.steps[2]
    t = 0.5 * (step.lift_off + step.touchdown)
    sample, load = plan.sample(t), plan.sample(t).standing.astype(float)
    height = sample.body[0, 2] - sample.feet[:, 2].mean()
    closest = []
    for way in np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False):
        toward = np.array([np.cos(way), np.sin(way)])
        body = sample.body[0].copy()
        body[:2] += away * toward
        state = state_of(body, sample.feet)
        at = model_layout().v_base + 3
        state[at : at + 2] += kicked * toward
        pushed = ground_forces(controller_of(plan, state, t=t, rate=0.0).tick().torque, state)[:, 2]
        capture = com_of(state)[:2] + kicked * toward * np.sqrt(height / GRAVITY)
        shares = static_load_shares(sample.feet, load, *capture)
        most = MOST_TIMES * CONTROL.least_force
        least = min_normal_forces(shares, load, MASS * GRAVITY, 0.0, most)
        assert np.all(pushed > least - 1.0)
        closest.append(float((pushed - least)[load > 0.0].min()))
    assert min(closest) < 1.0  # a bound that holds nothing back would be no test


@given(seeds)
def test_friction_is_used_alike_where_prices_follow_the_shares(seed: int) -> None:
    """What feet give along the ground at the least price, over their load squared, is one number.

    So no light foot gives as much as a heavy one.
    """
    feet, load, com = stance(seed)
    shares = static_load_shares(feet, load, *com)
    heavy = shares > 0.05
    given_along = 1.0 / tangential_prices(shares)[heavy]  # of the least sum of prices times squares
    ratio = given_along / shares[heavy] ** 2
    np.testing.assert_allclose(ratio, ratio[0])


def test_feet_in_a_line_give_alike_along_the_ground() -> None:
    """Where nothing is known of what they bear, none is spared."""
    np.testing.assert_array_equal(tangential_prices(np.zeros(4)), 1.0)


@pytest.mark.parametrize("going", ["up", "down"])
def test_at_rest_on_stairs_no_foot_needs_friction(going: str) -> None:
    """Nothing pushes the robot aside, so feet of different heights push against each other little.

    Wherever it stops on its way, |f_t| / f_n is below 0.05. At one price for all forces it was 0.36
    under a foot that bore 40 N: more than there is where friction is 0.3, so that it slipped.
    """
    plan = stairs_walk(going)
    for t in np.linspace(1.0, plan.duration - 1.0, 60):
        state = state_on(plan, float(t))
        torque = controller_of(plan, state, t=float(t), rate=0.0).tick().torque
        forces = ground_forces(torque, state)
        bears = plan.sample(float(t)).standing & (forces[:, 2] > 0.5 * CONTROL.least_force)
        assert bears.sum() >= 3
        assert np.all(np.hypot(*forces[bears, :2].T) < 0.05 * forces[bears, 2])
