"""The body goes down after a foot that its leg cannot bring to the ground."""

import numpy as np
import pytest
from control_rig import TICK, phase_at, state_on
from hypothesis import given, strategies as st
from rig import flat_walk, paper_robot
from whole_body_rig import CONTROL, controller_of

from drake_quad.common import FloatArray
from drake_quad.control.base_tracking import MOST_LOWER, next_lower, shortage
from drake_quad.control.kernel_state import Pace, longest_legs
from drake_quad.math.rotations import rotations
from drake_quad.robot.kinematics import calc_feet, leg_array, solve_legs

ROBOT = paper_robot()
LEGS = leg_array(ROBOT.geometry)
LONGEST = longest_legs(ROBOT.geometry, ROBOT.q_lower, ROBOT.q_upper)
PACE = Pace(
    period=0.002,
    foothold_time=0.03,
    touchdown_press=0.0,
    landing_speed=0.15,
    search_speed=0.05,
    height_time=0.5,
)
ALL = np.ones(4, dtype=bool)


def stretched(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A body (5,), leaning or not, its R_WB, and its feet in W where straight legs have them."""
    rng = np.random.default_rng(seed)
    body = np.array([*rng.uniform(-1.0, 1.0, 3), rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0)])
    q = np.column_stack([rng.uniform(-0.3, 0.3, 4), rng.uniform(-0.3, 0.5, 4), ROBOT.q_upper[2::3]])
    R = rotations(body)
    return body, R, body[:3] + calc_feet(ROBOT.geometry, q) @ R.T


@given(st.integers(0, 2**32 - 1), st.floats(0.001, 0.04))
def test_so_much_lower_the_legs_do_reach_and_no_less(seed: int, deep: float) -> None:
    """The leg that has the farthest to go ends with its knee at its limit."""
    body, R, feet = stretched(seed)
    feet[:, 2] += np.random.default_rng(seed).uniform(0.02, 0.1, 4)
    feet[1, 2] -= 0.12 + deep
    lower = shortage(LEGS, LONGEST, feet, ALL, body[:3], R)
    assert lower > 0.0
    q, missed = solve_legs(ROBOT.geometry, (feet - body[:3] + [0.0, 0.0, lower]) @ R)
    if lower < MOST_LOWER:
        assert np.all(missed == 0.0)
        assert q[:, 2].max() == pytest.approx(ROBOT.q_upper[2], abs=0.005)


@given(st.integers(0, 2**32 - 1))
def test_what_legs_reach_takes_no_lowering(seed: int) -> None:
    """Nor does what they cannot reach, but need not: no foot that swings counts."""
    body, R, feet = stretched(seed)
    feet[:, 2] += 1e-6
    feet[3, 2] -= 0.1
    counts = np.arange(4) != 3
    assert shortage(LEGS, LONGEST, feet, counts, body[:3], R) == 0.0
    assert 0.0 < shortage(LEGS, LONGEST, feet, ALL, body[:3], R) <= MOST_LOWER


def test_down_as_fast_as_feet_search_and_back_by_and_by() -> None:
    """Never past what is wanted."""
    down = [0.0]
    for _ in range(300):
        down.append(next_lower(down[-1], 0.02, PACE))
    assert np.diff(down).max() == pytest.approx(PACE.search_speed * PACE.period)
    assert down[-1] == 0.02
    back = [0.02]
    for _ in range(250):  # `height_time`
        back.append(next_lower(back[-1], 0.0, PACE))
    assert np.all(np.diff(back) < 0.0) and back[-1] == pytest.approx(0.02 / np.e, rel=0.01)


def test_body_goes_down_after_a_foot_that_finds_no_ground() -> None:
    """While the clock waits, where the leg ends; it comes back when the clock goes on."""
    plan = flat_walk()
    step = plan.contacts.steps[0]
    t = step.touchdown - TICK
    state, height = state_on(plan, t), plan.sample(t).body[0, 2]
    controller = controller_of(plan, state, t=t).tick()
    controller.give(plan, state, phase_at(t, rate=0.0))
    lower = []
    for _ in range(12):
        controller.tick(round(0.05 / CONTROL.landing_speed / CONTROL.period))  # 5 cm deeper
        lower.append(height - float(controller.out("body_desired")[2]))
    assert lower[0] == pytest.approx(0.0, abs=1e-6)
    first = int(np.argmax(np.array(lower) > 1e-3))
    body, row = plan.sample(t).body[0], step.leg.row
    hip = body[:3] + rotations(body) @ ROBOT.geometry.p_BH[row]
    foot, down = plan.sample(t).feet[row], np.array([0.0, 0.0, -0.05])
    longest = np.hypot(LONGEST[row], ROBOT.geometry.offset[row])
    assert np.linalg.norm(foot + first * down - hip) < longest
    assert np.linalg.norm(foot + (first + 2) * down - hip) > longest
    assert lower[-1] == pytest.approx(MOST_LOWER)
    controller.give(plan, state, phase_at(t))
    assert height - controller.tick(round(3.0 / CONTROL.period)).out("body_desired")[2] < 1e-3
