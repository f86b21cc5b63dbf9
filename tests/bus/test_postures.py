"""Sitting down keeps the feet where they stand, wherever a walk has left them."""

from dataclasses import replace

import numpy as np
import pytest
from bus_rig import PERIOD_NS, QUICK, short_walk
from hypothesis import given, settings, strategies as st
from rig import paper_robot

from drake_quad.bus.control_loop import ControlLoop
from drake_quad.bus.postures import lower
from drake_quad.bus.real_time import ManualClock
from drake_quad.bus.robot_bus import LoopbackBus
from drake_quad.bus.robot_side import RobotLoop, SimulatedRobot
from drake_quad.bus.safety import SafetyMode
from drake_quad.robot.kinematics import calc_feet


@given(
    st.lists(st.floats(-0.12, 0.12), min_size=12, max_size=12),
    st.floats(-0.2, 0.2),
    st.floats(-0.2, 0.2),
)
@settings(max_examples=60)
def test_the_trunk_goes_straight_down_over_feet_that_stay(
    aside: list[float], roll: float, pitch: float
) -> None:
    """From any stance on any tilt: each foot comes nearer along the vertical, all by the same.

    The last posture is the stance, the first is the lowest, and joints keep their limits.
    """
    robot = paper_robot()
    q = np.tile([0.0, 0.7, -1.4], 4) + aside
    up = np.array([np.sin(pitch), np.sin(roll), np.cos(roll) * np.cos(pitch)])
    up /= np.linalg.norm(up)
    postures = lower(robot, q, up)
    np.testing.assert_array_equal(postures[-1], q)
    feet = np.array([calc_feet(robot.geometry, p.reshape(4, 3)) for p in postures])
    moved = feet - feet[-1]
    deep = moved @ up
    np.testing.assert_allclose(moved, deep[..., None] * up, atol=1e-9)
    np.testing.assert_allclose(deep, deep[:, :1] * np.ones(4), atol=1e-9)
    assert np.all(np.diff(deep[:, 0]) <= 1e-9)
    assert deep[0, 0] > 0.1  # this robot has room to fold from such stances
    assert np.all(postures >= robot.q_lower) and np.all(postures <= robot.q_upper)


@pytest.mark.long
def test_a_robot_sits_down_where_its_walk_has_left_it() -> None:
    """Over a bus, to the end of a walk: as it sits down no foot goes by more than 35 mm.

    A foot is a ball of 20 mm that rolls as its shank folds. To sit down where it stood before the
    walk would drag feet by a step's length.
    """
    prepared, clock = short_walk(overrides=QUICK), ManualClock()
    bus = LoopbackBus(clock.now_ns)
    simulated = SimulatedRobot(prepared)
    robot = RobotLoop(simulated, bus, clock)
    loop = ControlLoop(prepared, bus, clock)
    loop.limits = replace(loop.limits, fold_time=0.6, rise_time=1.0)
    stood, dragged, low = np.zeros((4, 3)), 0.0, np.inf
    while not loop.outcome:
        robot.tick()
        loop.tick()
        clock.sleep_until(clock.now_ns() + PERIOD_NS)
        assert loop.time < 60.0
        if loop.mode == SafetyMode.STANDING:
            stood = simulated.feet
        elif loop.mode == SafetyMode.SITTING_DOWN:
            dragged = max(dragged, float(np.abs(simulated.feet - stood)[:, :2].max()))
            low = min(low, float(robot.robot.base[2]))
    assert loop.outcome == "goal_reached"
    assert dragged < 0.035
    assert low < 0.6 * prepared.stance.body[2]
