"""Swing feet are as fast as their own joints allow, going up, down and on one level."""

import copy
from math import inf

import numpy as np
import pytest
from design_rig import designed
from rig import paper_robot

from drake_quad.errors import InputError, PlanningError
from drake_quad.gait.swing import Swing
from drake_quad.gait_design import tempo_planner
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.foot_speeds import (
    ANY_SPEED,
    NO_SPEEDS,
    PEAK,
    FootSpeeds,
    slowest,
    suited_speeds,
)
from drake_quad.gait_design.pace import JointPeak, PlanPace, joint_speeds
from drake_quad.gait_design.preference import RequiredMargins
from drake_quad.gait_design.tempo import Tempo, TempoTrial, is_calm
from drake_quad.gait_design.tempo_planner import GaitChoice, TempoPlanner
from drake_quad.gait_design.tempo_search import TempoSearch
from drake_quad.planning.mission import initial_stance, plan_tasks
from drake_quad.planning.step_builder import goes, peak_speed
from drake_quad.robot.legs import LEGS
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario

UP, DOWN = (0.3, 0.35, 0.4, 0.45), (0.4, 0.45, 0.5, 0.0)


def test_speeds_put_into_a_scenario_come_out_of_it() -> None:
    """Leg by leg; one that is as on one level is not written, and comes out as that."""
    gait = Scenario().gait
    assert FootSpeeds.of(gait) == NO_SPEEDS
    FootSpeeds(1.2, UP, (*DOWN[:3], 1.2)).put(gait)
    assert gait.swing_speed_down.RR == 0.0 and gait.swing_speed_up.RL == 0.4
    assert FootSpeeds.of(gait) == FootSpeeds(1.2, UP, (*DOWN[:3], 1.2))
    assert slowest([]) == FootSpeeds.all_at(inf)
    most = (0.3, 0.35, 0.38, 0.38)
    assert FootSpeeds(1.2, UP, UP).at_most(0.38) == FootSpeeds(0.38, most, most)


def test_each_swing_lasts_as_long_as_the_speed_of_its_leg_and_way_asks() -> None:
    """Up, down and on one level, no swing of the gait exceeds its own, and tall ones reach it."""
    robot, scenario = paper_robot(), copy.deepcopy(designed().scenario)
    FootSpeeds(2.0, UP, DOWN).put(scenario.gait)
    settings = plan_settings(scenario)
    course = course_of(scenario, foot_radius=robot.foot_radius)
    seen = set()
    stance = initial_stance(robot, course, settings, start=scenario.start.distance)
    for plan in plan_tasks(robot, course, settings, mission_of(scenario, course), stance):
        begin = min((s.start for s in plan.segments if s.kind == "wave"), default=inf)
        for step in (s for s in plan.contacts.steps if s.lift_off >= begin):
            if step.swing.duration == settings.swing_time:  # a transition's
                continue
            way = goes(step.swing)
            own = {1: UP, -1: DOWN, 0: (2.0,) * 4}[way][step.leg.row] or 2.0
            assert peak_speed(step.swing) <= own * (1.0 + 1e-9)
            if peak_speed(step.swing) >= own * (1.0 - 1e-9):
                seen.add((way, step.leg))
    assert {(1, leg) for leg in LEGS} <= seen
    assert {(-1, leg) for leg in LEGS if DOWN[leg.row] > 0.0} <= seen


def test_ends_that_differ_by_millimetres_are_on_one_level() -> None:
    """A standing foot is not quite where it is mapped; half a step is up or down."""
    for rise, way in ((0.005, 0), (-0.005, 0), (0.04, 1), (-0.04, -1)):
        ends = np.zeros(3), np.array([0.3, 0.0, rise])
        assert goes(Swing(*ends, duration=1.0, apex_time=0.5, apex_z=0.2)) == way


def test_suited_speeds_are_those_at_which_joints_are_asked_for_their_share() -> None:
    """The least of each group; infinite where it has no swing, or none that is held back."""
    robot, found = paper_robot(), designed()
    for plan in found.plan.plans:
        begin = min((s.start for s in plan.segments if s.kind == "wave"), default=inf)
        steps = [s for s in plan.contacts.steps if s.lift_off >= begin]
        suits = suited_speeds(robot, plan, 0.0)
        wanted = np.full((3, 4), inf)
        for step in steps:
            row = step.leg.row
            times = np.linspace(step.lift_off + 1e-3, step.touchdown - 1e-3, 200)
            speed = joint_speeds(robot, plan, times)[0] / robot.speed
            mine = peak_speed(step.swing) * PEAK / speed[:, 3 * row : 3 * row + 3].max()
            wanted[goes(step.swing), row] = min(wanted[goes(step.swing), row], mine)
        assert suits.up == pytest.approx(tuple(wanted[1]), rel=0.03)
        assert suits.down == pytest.approx(tuple(wanted[-1]), rel=0.03)
        assert suits.level == pytest.approx(wanted[0].min(), rel=0.03)
        longest = max((s.swing.duration for s in steps), default=1.0)
        assert suited_speeds(robot, plan, longest) == FootSpeeds.all_at(inf)


def test_speeds_of_legs_need_a_speed_of_all() -> None:
    """Without `swing_speed` they would do nothing: an error names the field."""
    with pytest.raises(InputError) as error:
        load_scenario("flat_walk", ["gait.swing_speed_down.RL=0.5"])
    assert "gait.swing_speed_down.RL = 0.5" in str(error.value)
    load_scenario("flat_walk", ["gait.swing_speed_down.RL=0.5", "gait.swing_speed=1.0"])


class Trials:
    """Plans as `try_tempo` makes them, of a robot whose legs suit other speeds."""

    def __init__(self, suits: FootSpeeds, slow: Designed) -> None:
        self.suits, self.slow, self.asked = suits, slow, list[FootSpeeds]()

    def __call__(self, *given: object, **_: object) -> TempoTrial:
        """Refuses what is too fast for a joint by more than its limit, as the planner does."""
        tempo = given[3]
        assert isinstance(tempo, Tempo)
        self.asked.append(tempo.speeds)
        over = max(a / b for a, b in zip(tempo.speeds.values, self.suits.values, strict=True))
        if over * PEAK > 1.0:
            fast = max(min(a, 10.0) for a in tempo.speeds.values)
            least = min(self.suits.values)
            raise PlanningError("too fast", too_fast=fast / least * PEAK, foot_speed=fast)
        pace = _pace(over * PEAK)
        return TempoTrial(tempo, self.slow, pace, self.suits)


def _pace(share: float) -> PlanPace:
    peak = JointPeak("knee", "FL", "knee", 10.0 * share, 10.0, True, "walk 1", 0.0)
    return PlanPace((), peak, 1.0)


def test_feet_that_were_slowed_for_one_joint_become_as_fast_as_their_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All are slowed at first; the plan that is taken has each group at its own speed, once."""
    robot, slow = paper_robot(), designed()
    suits = FootSpeeds(3.0, (1.0, 1.5, 2.0, 2.5), (1.1, 1.6, 2.1, 2.6))
    trials = Trials(suits, slow)
    monkeypatch.setattr(tempo_planner, "try_tempo", trials)
    gait = GaitChoice(slow.scenario, slow.design, planned=True)
    search = TempoSearch(gait, slow, robot, RequiredMargins(0.01, 0.01), "test")
    found = search.trial(1.0, 0.5)
    assert found is not None and is_calm(found)
    assert found.tempo.speeds.like(suits, 1e-9)
    assert trials.asked[0] == FootSpeeds.all_at(ANY_SPEED)
    assert max(trials.asked[1].values) == pytest.approx(min(suits.values))
    many = len(trials.asked)
    assert many == 3
    assert search.trial(1.0, 0.6) is not None and len(trials.asked) == many + 1


def test_feet_are_only_as_fast_as_the_margin_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of full speeds, half of the way there and none of it, the first that leaves enough."""
    robot, slow = paper_robot(), designed()
    suits = FootSpeeds(3.0, (1.0, 1.5, 2.0, 2.5), (1.1, 1.6, 2.1, 2.6))
    all_slow = FootSpeeds.all_at(1.0)
    half = all_slow.towards(suits, 0.5)
    assert half.level == pytest.approx(3.0**0.5) and all_slow.towards(suits, 1.0).like(suits, 1e-9)
    for enough, wanted in (((suits,), suits), ((half, all_slow), half), ((all_slow,), all_slow)):
        trials = Trials(suits, slow)

        def spare(_: object, trial: TempoTrial, enough: object = enough) -> float:
            assert isinstance(enough, tuple)
            return 0.01 if any(trial.tempo.speeds.like(s, 1e-6) for s in enough) else -0.01

        monkeypatch.setattr(tempo_planner, "try_tempo", trials)
        monkeypatch.setattr(TempoPlanner, "spare", spare)
        gait = GaitChoice(slow.scenario, slow.design, planned=True)
        search = TempoSearch(gait, slow, robot, RequiredMargins(0.01, 0.01), "test")
        found = search.trial(1.0, 0.5)
        assert found is not None and found.tempo.speeds.like(wanted, 1e-6)
        again = search.trial(1.0, 0.6)
        assert again is not None and again.tempo.speeds.like(wanted, 1e-6)


def test_feet_that_no_joint_holds_back_are_not_planned_twice(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where all joints can follow, the first plan is taken as it is."""
    robot, slow = paper_robot(), designed()
    trials = Trials(FootSpeeds.all_at(ANY_SPEED), slow)
    monkeypatch.setattr(tempo_planner, "try_tempo", trials)
    gait = GaitChoice(slow.scenario, slow.design, planned=True)
    search = TempoSearch(gait, slow, robot, RequiredMargins(0.01, 0.01), "test")
    assert search.trial(1.0, 0.5) is not None and len(trials.asked) == 1
