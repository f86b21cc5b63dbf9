"""Two feet at a time, in physics: a short trot on level ground."""

import numpy as np

from drake_quad.control.ports import is_swinging
from drake_quad.robot.legs import DIAGONALS, SHORT_NAMES
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.run import simulate

LEVEL = (
    "course=[{kind: floor, length: 4.0}]",
    "mission=[{kind: stand, duration: 0.2}, {kind: walk, distance: 0.7}]",
    "gait.lag=2",
    "transition.swing_time=0.8",
    "transition.shift_time=0.6",
    "monitor.margins=hull",
)


def test_a_robot_trots_on_level_ground() -> None:
    """It gets there on its plan, feet neither slip nor come late, and nothing else touches.

    The summary does not call it safe: for more than a second it stood on two feet.
    """
    result = simulate(load_scenario("trot", list(LEVEL)))
    figures = result.summary
    assert result.outcome == "goal_reached", result.reason
    assert figures["base_error_max"] < 0.02 and figures["slip_max"] < 0.002
    assert figures["nonfoot_contact_samples"] == 0 and figures["swing_hit_samples"] == 0
    assert figures["clock_waited"] < 0.1
    assert figures["time_under_three_feet"] > 1.0 and figures["margin"]["minimum"] < 0.0
    assert figures["safety"]["safe"] is False
    swinging = result.table["swing_leg"].to_numpy()
    pairs = {10 * int(a) + int(b) for a, b in DIAGONALS}
    assert pairs <= set(swinging.tolist())
    for leg, name in enumerate(SHORT_NAMES, start=1):
        planned = result.table[f"{name}_standing_planned"].to_numpy()
        np.testing.assert_array_equal(is_swinging(swinging, leg), ~planned)
