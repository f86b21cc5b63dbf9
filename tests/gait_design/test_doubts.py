"""Doubtful gaits are planned after all others: no yes becomes a no, no sound gait is put off."""

from dataclasses import replace

import pytest
from design_rig import MODEL, designed
from rig import course_of as course_of_elements, paper_robot

from drake_quad.errors import PlanningError
from drake_quad.feasibility.flight import make_stairs_scenario
from drake_quad.gait_design import doubts, plan_candidates
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.doubts import find_doubt
from drake_quad.gait_design.plan_candidates import (
    LOWER,
    SURE,
    Gait,
    doubt_gait,
    plan_any,
    plan_gaits,
)
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.problem import PlanSettings, derive_mission
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.terrain.elements import Element, Stairs


def doubt_on(rise: float, *, margin: float = 0.01, shanks: float = 0.01) -> PlanningError | None:
    """What speaks against the paper's robot's gait for two low steps on steps of another rise."""
    robot, gait = paper_robot(), designed().scenario
    scenario = make_stairs_scenario(robot, Stairs(rise, 0.3, 2), model=MODEL)
    scenario.gait = gait.gait
    course = course_of(scenario, foot_radius=robot.foot_radius)
    return find_doubt(
        robot, course, plan_settings(scenario), mission_of(scenario, course),
        start=scenario.start.distance, margin=margin, shanks=shanks,
    )  # fmt: skip


def test_a_gait_that_has_a_plan_is_not_doubted() -> None:
    """Its plan keeps all limits, so that there are poses that do."""
    assert doubt_on(0.1) is None


def test_stairs_that_no_pose_reaches_are_told_with_what_is_short() -> None:
    """Legs of 1.2 m do not go up steps of 0.9 m."""
    doubt = doubt_on(0.9)
    assert doubt is not None and "walk 1" in doubt.reason
    assert doubt.data.get("excess", 0.0) > 0.0 or doubt.data.get("room", 0.0) < 0.0


def test_a_gait_that_is_good_on_endless_stairs_is_planned_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Poses are not looked at for it; they are for a gait with less room."""
    asked: list[float] = []

    def find(*_: object, margin: float, **__: object) -> PlanningError:
        asked.append(margin)
        return PlanningError("no pose")

    monkeypatch.setattr(plan_candidates, "find_doubt", find)
    robot, found = paper_robot(), designed()
    course = course_of(found.scenario, foot_radius=robot.foot_radius)

    def doubt(score: float) -> PlanningError | None:
        design = replace(found.design, score=score)
        return doubt_gait(found.scenario, design=design, robot=robot, course=course, source="test")

    assert doubt(SURE) is None and not asked
    assert doubt(0.9 * SURE) is not None
    assert asked and asked[0] >= found.scenario.controller.lift_off_margin


def gait(name: str, tried: list[str], found: Designed | None, *, doubtful: bool) -> Gait:
    """A gait that notes when it is planned."""

    def plan(scenario: Scenario, beat: Designed | None) -> Designed:
        tried.append(name)
        if found is None:
            raise PlanningError(f"{name} cannot")
        return found

    def doubt(scenario: Scenario) -> PlanningError | None:
        return PlanningError(f"{name} hardly can") if doubtful else None

    return Gait(1.0, Scenario(), plan, doubt)


def test_doubtful_gaits_are_planned_when_no_other_can_be() -> None:
    """All heights of the others come first; then the doubtful one is planned after all."""
    tried: list[str] = []
    good = designed()
    best, refused = plan_gaits(
        [gait("a", tried, good, doubtful=True), gait("b", tried, None, doubtful=False)], 0.5, None
    )
    assert tried == ["b"] * len(LOWER) + ["a"] and best is good
    assert refused is not None and refused.reason == "b cannot"


def test_doubtful_gaits_are_not_planned_where_another_is_fair() -> None:
    """It costs them nothing but the doubt."""
    tried: list[str] = []
    gaits = [gait("a", tried, None, doubtful=True), gait("b", tried, designed(), doubtful=False)]
    best, refused = plan_gaits(gaits, 0.5, None)
    assert tried == ["b"] and best is not None and refused is None


def test_a_no_has_planned_every_height_of_every_gait() -> None:
    """Doubts change the order alone: what is refused is refused by the planner."""
    tried: list[str] = []
    gaits = [gait("a", tried, None, doubtful=True), gait("b", tried, None, doubtful=False)]
    best, refused = plan_gaits(gaits, 0.5, None)
    assert best is None and refused is not None
    assert sorted(tried) == ["a"] * len(LOWER) + ["b"] * len(LOWER)


@pytest.mark.parametrize("doubtful", [True, False])
def test_where_any_plan_will_do_doubtful_gaits_are_not_planned(doubtful: bool) -> None:
    """A quick search for stairs that work leaves these out; their doubt is its reason."""
    tried: list[str] = []
    found, refused = plan_any([gait("a", tried, designed(), doubtful=doubtful)], 0.5)
    assert (found is None) == doubtful == (not tried)
    assert (refused is not None and refused.reason == "a hardly can") == doubtful


def test_a_walk_without_a_flight_takes_the_start_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The walk on the second lane is looked at from that lane's beginning, not from the start."""
    looked: list[tuple[object, float]] = []

    def stand(robot: object, lane: object, settings: object, s: float) -> Stance:
        looked.append((lane, s))
        raise PlanningError("looked at")

    monkeypatch.setattr(doubts, "_stand", stand)
    course = course_of_elements(
        Element("floor", length=5.0),
        Element("landing", length=3.5, turn_deg=90.0),
        Element("stairs", going="up", rise=0.13, run=0.5, count=3),
        Element("floor", length=3.0),
    )
    settings = PlanSettings()
    tasks = derive_mission(course, settings)
    with pytest.raises(PlanningError, match="looked at"):
        find_doubt(paper_robot(), course, settings, tasks, start=2.5, margin=0.01, shanks=0.0)
    assert looked == [(course.lanes[1], 0.0)]
