"""Gaits for a bus: swings that are high and calm, and footholds away from edges."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from drake_quad.bus import drift
from drake_quad.bus.processes import load_for_bus
from drake_quad.errors import InputError, PlanningError
from drake_quad.planning.mission import join_plans
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import PreparedScenario, prepare

OUT_OF_REACH = InputError(source="test", field="course[1].rise", value=0.3, remedy="lower")
STAIRS = "  - {kind: stairs, going: up, rise: 0.1, run: 0.4, count: 2}\n"
FLOOR = "  - {kind: floor, length: 3.0}\n"


def allowing(folder: Path, course: str, *fields: str, design: str = "auto") -> Scenario:
    path = folder / "climb.yaml"
    path.write_text(f"robot: {{model: paper_quadruped}}\ndesign: {design}\ncourse:\n{course}")
    scenario = load_for_bus(str(path), list(fields))
    return drift.allow_for_drift(scenario, list(fields), source=str(path))


def least_clearance(plan: MotionPlan) -> float:
    """Of the middles of level swings, over the ground under both of their ends [m]."""
    swings = [step.swing for step in plan.contacts.steps]
    level = [s for s in swings if abs(float(s.p_start[2] - s.p_end[2])) < 1e-9]
    return min(float(s.apex_z - s.p_start[2]) for s in level)


def test_a_gait_designed_for_stairs_allows_for_drift(tmp_path: Path) -> None:
    """Swings do, by 30 mm in place and 10 mm in height, and are 30 mm over what they pass."""
    found = allowing(tmp_path, FLOOR + STAIRS + FLOOR)
    assert (found.gait.map_error_place, found.gait.map_error_height) == (0.03, 0.01)
    assert found.design == "given" and found.estimator.kind == "ekf"
    walks = prepare(found).plan.plans[1:-1]
    assert min(plan.margin for plan in walks) > 0.03
    assert min(least_clearance(plan) for plan in walks) >= 0.03
    ahead = found.gait.tread_phase_up, found.gait.tread_phase_down
    assert ahead == (0.0, 0.0)  # feet are in the treads' middles


def test_swings_are_high_and_calm_on_level_ground_too(tmp_path: Path) -> None:
    """There no stairs can be elsewhere; a trunk sags and feet sink in all the same."""
    found = allowing(tmp_path, FLOOR)
    assert found.gait.map_error_place == 0.0
    assert found.gait.swing_clearance == 0.03
    assert found.gait.swing_speed == pytest.approx(0.3 * (9.81 * 1.22) ** 0.5, rel=0.02)


def test_what_a_person_says_stays(tmp_path: Path) -> None:
    """A gait of their own, a map that is exact, and swings as they want them."""
    assert allowing(tmp_path, FLOOR, design="given").gait.swing_clearance == 0.02
    exact = allowing(tmp_path, FLOOR + STAIRS + FLOOR, "gait.map_error_place=0")
    assert exact.gait.map_error_place == exact.gait.map_error_height == 0.0
    assert allowing(tmp_path, FLOOR, "gait.swing_speed=0.7").gait.swing_speed == 0.7


@pytest.mark.parametrize("problem", [PlanningError("no plan"), OUT_OF_REACH])
@pytest.mark.parametrize("changed", [drift.centre_footholds, drift.raise_swings])
def test_a_gait_stays_where_no_other_can_be_planned(
    monkeypatch: pytest.MonkeyPatch, problem: Exception, changed: Callable[..., Scenario]
) -> None:
    """Neither a plan that there is not, nor a foot out of reach, nor a robot that only stands."""
    given = Scenario()
    given.gait.tread_phase_down = 0.1

    def ways(scenario: Scenario) -> tuple[float, ...]:
        gait = scenario.gait
        return gait.swing_clearance, gait.swing_speed, gait.tread_phase_down

    before = ways(given)

    def planned(scenario: Scenario, **_: str) -> PreparedScenario:
        if ways(scenario) != before:
            raise problem
        return whole

    whole = prepare(load_scenario("quick", []))
    monkeypatch.setattr(drift, "prepare", planned)
    assert changed(given, source="test") is given
    standing = replace(whole, plan=join_plans(whole.plan.plans[:1], 0.0))
    assert not standing.plan.plans[0].contacts.steps
    monkeypatch.setattr(drift, "prepare", lambda *_, **__: standing)
    assert changed(given, source="test") is given
