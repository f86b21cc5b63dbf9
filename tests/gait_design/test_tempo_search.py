"""Trials of a gait's times are of the walks that have the least margin; the answer is of all."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from design_rig import designed
from rig import paper_robot
from tempo_rig import plan_with, trial_of

from drake_quad.errors import PlanningError
from drake_quad.gait_design import tempo_planner
from drake_quad.gait_design.designed import Walks
from drake_quad.gait_design.preference import RequiredMargins
from drake_quad.gait_design.tempo import Tempo, TempoTrial, least_margin, try_tempo, usual_tempo
from drake_quad.gait_design.tempo_planner import GaitChoice, TempoPlanner
from drake_quad.gait_design.tempo_search import TempoSearch
from drake_quad.gait_design.tempo_trials import Trials
from drake_quad.planning.motion_plan import MotionPlan


def test_a_walk_planned_alone_is_the_one_of_the_whole_mission() -> None:
    """From the stance that the mission begins it in, a task's plan is the same to the bit."""
    robot, slow = paper_robot(), designed()
    tempo = usual_tempo(slow.scenario.gait, robot, 1.25)
    whole = try_tempo(slow.scenario, slow.design, robot, tempo)
    plans = whole.designed.plan.plans
    walks = tuple((k, plans[k - 1].end) for k in (3, 1))
    part = try_tempo(slow.scenario, slow.design, robot, tempo, walks=walks)
    assert [p.index for p in part.designed.plan.plans] == [3, 1]
    for plan in part.designed.plan.plans:
        assert np.array_equal(plan.body.control, plans[plan.index].body.control)
    assert part.designed.margin == min(
        min(plans[k].margin, least_margin(robot, plans[k])) for k in (1, 3)
    )
    first = try_tempo(
        slow.scenario, slow.design, robot, tempo, walks=walks, enough=lambda plan: plan.index == 1
    )
    assert [p.index for p in first.designed.plan.plans] == [3]  # which was not enough


@pytest.mark.parametrize("spin", [0.08, 0.02])
def test_trials_are_of_the_walks_with_the_least_margin(
    spin: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer is a plan of all; where that leaves too little elsewhere, trials are of more."""
    tried: list[tuple[float, list[int] | None]] = []

    def plan(*given: Any, walks: Walks | None, **_: object) -> TempoTrial:
        switch = given[3].switch
        tried.append((switch, None if walks is None else [k for k, _ in walks]))
        margins = {1: 0.07 * switch, 2: spin if switch < 0.6 else 0.08, 3: 0.05 * switch}
        return trial_of(margins, switch, walks)

    plan_with(monkeypatch, plan)
    slow, kept = designed(), RequiredMargins(0.025, 0.0)
    gait = GaitChoice(slow.scenario, slow.design, planned=True)
    notes: list[str] = []
    search = TempoSearch(gait, slow, paper_robot(), kept, "check", notes.append)
    monkeypatch.setattr(search, "_longest_switch", lambda stretch, _: 9.0 * (stretch > 1.0))
    found = search.quickest(None, 0.1)
    assert found is not None and found.walks is None and found.designed.margin >= kept.margin
    assert "m/s, which leaves 45 mm" in notes[0]  # somebody waits for half a minute
    assert tried[0][1] is None and tried[1][1] == [3]  # least of all, and by a quarter of `kept`
    if spin == 0.08:
        assert found.tempo.switch == pytest.approx(0.5, rel=0.06)
        assert all(walks == [3] for _, walks in tried[1:-1])
        assert tried[-1] == (found.tempo.switch, None)
    else:
        assert found.tempo.switch >= 0.6
        assert any(walks and 2 in walks for _, walks in tried)


def test_trials_begin_with_earlier_plans_and_the_answer_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The answer is what anyone finds who has its times; another height's plans are of no use."""
    slow = designed()
    begun: list[bool] = []

    def plan(*given: Any, warm_starts: dict[int, MotionPlan], **_: object) -> TempoTrial:
        begun.append(bool(warm_starts))
        found = replace(trial_of({1: 0.06}, given[3].switch, None), from_scratch=not warm_starts)
        warm_starts[1] = slow.plan.plans[1]
        return found

    monkeypatch.setattr(tempo_planner, "try_tempo", plan)
    gait = GaitChoice(slow.scenario, slow.design, planned=True)
    planner = TempoPlanner(gait, slow, paper_robot(), RequiredMargins(0.025, 0.0), "check")
    tempo = planner.usual(1.25)
    for _ in range(2):
        planner.plan(tempo)
    anew = planner.plan_from_scratch(tempo)
    assert anew is not None and anew.from_scratch
    planner.lower(0.03)
    planner.plan(tempo)
    assert begun == [False, True, False, False]


def test_an_answer_found_from_other_plans_is_planned_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """What leaves enough only when begun with another plan is not the answer."""
    slow = designed()

    def plan(*given: Any, warm_starts: dict[int, MotionPlan], **_: object) -> TempoTrial:
        switch, anew = given[3].switch, not warm_starts
        warm_starts[1] = slow.plan.plans[1]
        return replace(trial_of({1: 0.05 * switch - 4e-3 * anew}, switch, None), from_scratch=anew)

    plan_with(monkeypatch, plan)
    kept = RequiredMargins(0.025, 0.0)
    gait = GaitChoice(slow.scenario, slow.design, planned=True)
    search = TempoSearch(gait, slow, paper_robot(), kept, "check")
    monkeypatch.setattr(search, "_longest_switch", lambda stretch, _: 9.0 * (stretch > 1.0))
    found = search.quickest(None, 0.1)
    assert found is not None and found.from_scratch and found.designed.margin >= kept.margin
    assert found.tempo.switch == pytest.approx(0.58, rel=0.1)
    assert search.verified_best(0.0) is found and search.verified_best(found.speed) is None


def test_a_stopped_search_plans_its_best_again_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    """From scratch, at its own height and with the margin that it sought; the next if it fails."""
    slow, robot = designed(), paper_robot()
    gait = GaitChoice(slow.scenario, slow.design)
    kept = RequiredMargins(0.025, 0.0)
    search = TempoSearch(gait, slow, robot, kept, "check")
    planner = search._planner
    monkeypatch.setattr(
        planner, "spare", lambda t: -1.0 if t is None else t.designed.margin - 0.025
    )
    monkeypatch.setattr(TempoTrial, "speed", property(lambda self: 1.0 / self.tempo.switch))
    asked: list[tuple[float, float, float]] = []
    for share, most, switch in ((0.0, 0.06, 0.5), (0.03, 0.05, 0.6)):
        planner.lower(share)
        planner.most = most
        search._keep(replace(trial_of({1: 0.05}, switch, None), from_scratch=False))
    planner.most = 9.0

    def plan(tempo: Tempo) -> TempoTrial | None:
        asked.append((planner.scenario.gait.body_height, planner.most, tempo.switch))
        return None if tempo.switch == 0.5 else trial_of({1: 0.05}, tempo.switch, None)

    monkeypatch.setattr(planner, "plan_from_scratch", plan)
    height = slow.scenario.gait.body_height
    assert search.verified_best(1.9) is None and asked == [(height, 0.06, 0.5)]
    found = search.verified_best(0.1)
    assert found is not None and found.tempo.switch == 0.6
    assert asked[1][1:] == (0.05, 0.6) and asked[1][0] < height
    assert search.verified_best(0.1) is found and len(asked) == 2


def test_a_speed_that_is_asked_for_may_be_less_than_that_of_the_slow_gait(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A gait that is to be balanced by its motion need not be the quicker one."""
    slow = designed()
    gait = GaitChoice(slow.scenario, slow.design, planned=True)
    search = TempoSearch(gait, slow, paper_robot(), RequiredMargins(0.025, 0.0), "check")
    monkeypatch.setattr(TempoTrial, "speed", property(lambda self: 0.02))
    monkeypatch.setattr(search._planner, "spare", lambda _: 0.01)
    begun = replace(trial_of({1: 0.05}, 0.5, None), from_scratch=False)
    whole = trial_of({1: 0.05}, 0.5, None)
    monkeypatch.setattr(search, "_at_speed", lambda _: begun)
    monkeypatch.setattr(search._planner, "plan_from_scratch", lambda _: whole)
    assert search._quickest_here(0.02, 0.05, 0.5) is whole
    monkeypatch.setattr(search, "_seek", lambda *_: begun)
    assert search._quickest_here(None, 0.05, 0.5) is None


def test_trials_of_all_tasks_stay_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a speed is asked for: what was learned from one that had a warm start is no reason."""
    slow = designed()
    gait = GaitChoice(slow.scenario, slow.design, planned=True)
    search = TempoSearch(gait, slow, paper_robot(), RequiredMargins(0.025, 0.0), "check")
    monkeypatch.setattr(search, "_critical", lambda _: (2,))
    whole = replace(trial_of({1: 0.03}, 0.5, None), from_scratch=False)
    trials = Trials(known={0.5: whole}, first=whole)
    search._trials = {1.25: trials}
    search._learn(whole, trial_of({1: 0.02}, 0.5, None))
    assert trials.critical == () and trials.walks is None
    walks = ((1, slow.plan.plans[0].end),)
    part = trial_of({1: 0.03}, 0.6, walks)
    trials.known[0.6], trials.critical = part, (1,)
    search._learn(part, trial_of({1: 0.02}, 0.6, None))
    assert list(trials.critical) == [2, 1]


def test_a_gait_that_falls_over_with_two_times_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither what the path seeks nor longer swings give it a margin; a lower body is tried."""
    slow = designed()
    tried: list[tuple[float, float, float]] = []
    margin = -0.02

    def plan(scenario: Any, *given: Any, **_: object) -> TempoTrial:
        tried.append((scenario.gait.body_height, given[2].swing, given[2].switch))
        raise PlanningError("it would fall over", margin=margin)

    monkeypatch.setattr(tempo_planner, "try_tempo", plan)
    for margin in (-0.02, -0.005):
        tried.clear()
        gait = GaitChoice(slow.scenario, slow.design)
        kept = RequiredMargins(0.025, 0.0)
        search = TempoSearch(gait, slow, paper_robot(), kept, "check")
        monkeypatch.setattr(search, "_longest_switch", lambda *_: 9.0)
        assert search.quickest(None, 0.1) is None
        assert len({height for height, _, _ in tried}) == 2
        assert (len(tried) <= 4) is (margin < -0.01)
