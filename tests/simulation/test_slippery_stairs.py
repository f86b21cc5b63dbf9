"""Stairs on less friction than the controller counts on."""

import pytest

from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.run import simulate

COURSE = (
    "[{kind: floor, length: 2.5}, {kind: stairs, going: up, rise: 0.13, run: 0.5, count: 3}, "
    "{kind: floor, length: 2.5}]"
)


@pytest.mark.slow
def test_feet_stand_on_stairs_with_less_friction_than_is_assumed() -> None:
    """Three steps up at a friction of 0.3, where 0.5 is assumed: by less than 2 mm in a stance.

    With one price for all forces it was 24 mm: feet of different heights pushed against each other
    along the ground, and the light ones slipped.
    """
    said = [f"course={COURSE}", "mission=[]", "simulation.friction=0.3"]
    scenario = load_scenario("case_study", said)
    assert scenario.controller.friction == 0.5
    result = simulate(scenario)
    assert result.outcome == "goal_reached", result.reason
    assert result.summary["slip_max"] < 0.002
    assert result.summary["friction_estimated_min"] == 0.5  # no slip that would have told it
