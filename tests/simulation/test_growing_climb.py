"""A flight that ends above the camera, in physics: climbed in stretches, or stopped on a tread.

The gait is given, so that nothing is designed.
"""

from functools import cache

import numpy as np
import pytest

from drake_quad.runs.result import RunResult
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.simulation.run import replay_plan, simulate

TEXT = """
course:
  - {kind: floor, length: 2.2}
  - {kind: stairs, going: up, rises: RISES, runs: RUNS}
  - {kind: landing, length: 3.0}
start: {distance: 1.0}
gait: {swing_clearance: 0.04}
controller: {kind: whole_body, period: 0.002}
monitor: {margins: hull}
perception: {map: seen, look_time: 0.5, camera_hold: portrait, camera_pitch_deg: 35.0}
"""
STEEP = 0.4  # [m]: a rise that no gait of this robot climbs


@cache
def prepared(*rises: float, state: str = "truth", then: str = "stay") -> PreparedScenario:
    text = TEXT.replace("RISES", str(list(rises))).replace("RUNS", str([0.5] * len(rises)))
    overrides = [f"estimator.kind={state}", f"perception.no_way_on={then}"]
    return prepare(parse_scenario(text, source="test", overrides=overrides), source="test")


def run(*rises: float, state: str = "truth") -> RunResult:
    return simulate(prepared(*rises, state=state))


def test_a_flight_that_ends_above_the_camera_is_planned_as_far_as_it_is_known() -> None:
    """To a tread from which it looks again: no foot goes beyond what is known well."""
    p = prepared(*[0.14] * 9)
    assert p.sight is not None and p.sight.map is not None and not p.sight.refused
    assert p.growth is not None and not p.sight.map.complete
    assert [task.kind for task in p.tasks] == ["stand", "walk", "stand"]
    lane = p.course.lanes[0]
    places = [lane.coordinates(s.swing.p_end)[0] for s in p.plan.plans[1].contacts.steps]
    assert np.max(places) < p.sight.map.places[p.sight.map.trusted - 1]


def test_a_replay_of_the_plan_ends_where_it_would_look_again() -> None:
    """It says so, and does not claim the goal."""
    result = replay_plan(prepared(*[0.14] * 9))
    assert result.outcome == "stopped" and "does not look again" in result.reason


@pytest.mark.slow
def test_it_is_climbed_to_its_end_on_estimated_state() -> None:
    """Nine steps of 0.14 m: safely, and every nosing of the map is nearer than 40 mm to its own."""
    result = run(*[0.14] * 9, state="ekf")
    assert result.outcome == "goal_reached", result.reason
    assert result.summary["safety"]["safe"] is True
    seen = result.summary["seen"]
    assert seen["looks"] >= 2 and seen["map_complete"] is True and seen["map_steps"] == 9
    assert seen["map_place_error_max"] < 0.04 and seen["map_height_error_max"] < 0.02


@pytest.mark.slow
def test_where_the_flight_goes_on_too_steep_it_stops_on_a_tread() -> None:
    """On four feet, with its margin, and in words where it stands and why."""
    result = run(*[0.14] * 7, STEEP, STEEP)
    assert result.outcome == "stopped"
    assert result.reason.startswith("stands ") and "on step" in result.reason
    assert "; what is seen is: " in result.reason
    assert result.seen is not None and result.seen.told["revisions"][-1]["reason"]
    assert result.summary["samples_under_three_feet"] == 0
    assert result.summary["margin"]["minimum"] > 0.03
    assert result.summary["nonfoot_contact_samples"] == 0
    assert result.summary["seen"]["looks"] >= 2


@pytest.mark.slow
def test_if_it_is_told_to_it_goes_back_down_from_there() -> None:
    """To the floor where it started, within 30 mm; nothing but its standing feet touches."""
    p = prepared(*[0.14] * 7, STEEP, STEEP, state="ekf", then="back_down")
    result = simulate(p)
    assert result.outcome == "stopped"
    assert result.reason.startswith("stands where it started, on four feet before the flight")
    assert result.summary["nonfoot_contact_samples"] == 0
    assert result.summary["swing_contact_samples"] == 0
    assert result.summary["margin"]["minimum"] > 0.03
    end = [result.table[f"q_{p.robot.name}_trunk_{a}"][-1].as_py() for a in "xy"]
    assert np.allclose(end, p.stance.body[:2], atol=0.03)
