"""Times of gaits are tried on flights cut short; the answer is of the course itself."""

from dataclasses import replace
from typing import Any

import pytest
from design_rig import designed
from tempo_rig import KEPT, is_cut, plan_with, search_for, ten_steps, trial_of

from drake_quad.errors import PlanningError
from drake_quad.gait_design.designed import Walks
from drake_quad.gait_design.speed_curve import TIMES
from drake_quad.gait_design.tempo import TempoTrial
from drake_quad.gait_design.tempo_planner import GaitChoice
from drake_quad.gait_design.tempo_search import SearchStoppedError
from drake_quad.gait_design.tempo_trials import SLOWER, Trials
from drake_quad.scenario.config import Scenario


@pytest.mark.parametrize("more", [0.0, 4e-3])
def test_what_the_course_keeps_less_is_taken_off_all_trials(
    more: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The quickest times are found all the same, with one or two plans of the course itself."""
    tried: list[tuple[bool, float]] = []

    def plan(scenario: Scenario, *given: Any, walks: Walks | None, **_: object) -> TempoTrial:
        cut, switch = is_cut(scenario), given[2].switch
        tried.append((cut, switch))
        return trial_of({k: 0.05 * switch + more * cut for k in (1, 2, 3)}, switch, walks)

    plan_with(monkeypatch, plan)
    found = search_for(ten_steps()).quickest(None, 0.1)
    assert found is not None and found.whole and found.from_scratch
    assert found.tempo.switch == pytest.approx(0.5, rel=0.06) and found.tempo.switch >= 0.5
    whole = [switch for cut, switch in tried if not cut]
    assert len(whole) == (1 if more == 0.0 else 2) and found.tempo.switch == whole[-1]


def test_what_was_learned_counts_for_trials_that_seek_the_same_margin(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Paths that seek most keep 10 mm less on the course, others hardly less."""
    mosts: list[float] = []

    def plan(
        scenario: Scenario, *given: Any, most: float, walks: Walks | None, **_: object
    ) -> TempoTrial:
        mosts.append(most)
        less = 0.0 if is_cut(scenario) else 10e-3 if most == mosts[0] else 4e-3
        begin = 0.030 if most == mosts[0] else 0.034
        return trial_of({k: begin - less for k in (1, 2, 3)}, given[2].switch, walks)

    plan_with(monkeypatch, plan)
    found = search_for(ten_steps(), 1.2).quickest(None, 0.1)
    assert found is not None and found.whole and found.designed.margin == pytest.approx(0.03)
    assert mosts[-1] < mosts[0]


def test_a_course_that_has_no_plan_is_not_cut_short_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trials that know nothing of what is in its way would be of no use."""
    tried: list[bool] = []

    def plan(scenario: Scenario, *given: Any, walks: Walks | None, **_: object) -> TempoTrial:
        tried.append(is_cut(scenario))
        if not tried[-1] and given[2].switch < 0.7:
            raise PlanningError("a shank would be inside the stairs")
        return trial_of({k: 0.05 * given[2].switch for k in (1, 2, 3)}, given[2].switch, walks)

    plan_with(monkeypatch, plan)
    found = search_for(ten_steps()).quickest(None, 0.1)
    assert found is not None and found.whole and found.tempo.switch >= 0.7
    first = tried.index(False)
    assert all(tried[:first]) and not any(tried[first:])


def test_a_gait_that_only_short_flights_have_a_plan_of_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As soon as one that has none at all: that it climbs four steps is no plan."""
    tried: list[bool] = []

    def plan(scenario: Scenario, *given: Any, walks: Walks | None, **_: object) -> TempoTrial:
        tried.append(is_cut(scenario))
        if not tried[-1]:
            raise PlanningError("a shank would be inside the stairs")
        return trial_of({k: 0.03 for k in (1, 2, 3)}, given[2].switch, walks)

    plan_with(monkeypatch, plan)
    assert search_for(ten_steps(planned=False), 1.2).quickest(None, 0.1) is None
    assert len(tried) - sum(tried) <= 10


def test_an_answer_is_never_of_flights_cut_short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the first trial, of all tasks, cannot be bettered."""

    def plan(scenario: Scenario, *given: Any, walks: Walks | None, **_: object) -> TempoTrial:
        return trial_of({k: 0.2 for k in (1, 2, 3)}, given[2].switch, walks)

    plan_with(monkeypatch, plan)
    search = search_for(ten_steps())
    search._parts = False
    found = search.quickest(None, 0.1)
    assert found is not None and found.whole
    search = search_for(ten_steps())
    monkeypatch.setattr(search, "_stop", lambda: bool(search._enough))
    with pytest.raises(SearchStoppedError):
        search.quickest(None, 0.1)
    assert search._enough[0][0].cut
    best = search.verified_best(0.1)
    assert best is not None and best.whole and best.from_scratch


def test_a_short_flight_may_be_a_little_slower_than_a_long_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is hardly slower there than another gait may be quicker on the course itself."""

    def plan(scenario: Scenario, *given: Any, walks: Walks | None, **_: object) -> TempoTrial:
        return trial_of({k: 0.05 * given[2].switch for k in (1, 2, 3)}, given[2].switch, walks)

    plan_with(monkeypatch, plan)
    speed = property(lambda t: (0.5 + 0.5 * SLOWER if t.cut else 1.0) / t.tempo.switch)
    monkeypatch.setattr(TempoTrial, "speed", speed)
    quickest = search_for(ten_steps()).quickest(None, 0.1)
    assert quickest is not None
    again = search_for(ten_steps()).quickest(None, 0.995 * quickest.speed)
    assert again is not None and again.speed == quickest.speed


def test_a_speed_that_is_asked_for_is_met_on_the_course_itself() -> None:
    """A short flight's speed is not quite that of a long one."""
    search = search_for(ten_steps())
    assert search._planner.cut
    search._planner.refused = True  # no plan is asked for here
    search.quickest(0.1, 0.05)
    assert not search._planner.cut


def test_a_course_without_long_flights_is_not_planned_twice(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A trial of all tasks, from scratch, is the answer: there is nothing to cut short."""
    tried: list[float] = []

    def plan(scenario: Scenario, *given: Any, walks: Walks | None, **_: object) -> TempoTrial:
        tried.append(given[2].switch)
        return trial_of({k: 0.2 for k in (1, 2, 3)}, given[2].switch, walks)

    plan_with(monkeypatch, plan)
    slow = designed()
    search = search_for(GaitChoice(slow.scenario, slow.design, planned=True))
    search._parts = False
    found = search.quickest(None, 0.1)
    assert found is not None and found.whole and len(tried) == len(set(tried))


def test_a_curve_is_of_the_course_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its height is chosen there, too: at another there may be no plan."""
    high = ten_steps().scenario.gait.body_height

    def plan(scenario: Scenario, *given: Any, walks: Walks | None, **_: object) -> TempoTrial:
        if not is_cut(scenario) and scenario.gait.body_height >= high:
            raise PlanningError("a shank would be inside the stairs")
        return trial_of({k: 0.05 * given[2].switch for k in (1, 2, 3)}, given[2].switch, walks)

    plan_with(monkeypatch, plan)
    points = list(search_for(ten_steps(planned=False)).spread(TIMES, lambda _: None))
    assert points and all(point.whole for point in points)


@pytest.mark.parametrize("has_plan", [None, 1.2])
def test_a_gait_without_a_plan_is_left_after_some_times(
    has_plan: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not before longer waits were tried: one of them may have a plan."""
    tried: list[float] = []

    def plan(scenario: Scenario, *given: Any, walks: Walks | None, **_: object) -> TempoTrial:
        tried.append(given[2].switch)
        if has_plan is None or tried[-1] < has_plan:
            raise PlanningError("a thigh would be inside the stairs")
        return trial_of({k: 0.025 * tried[-1] for k in (1, 2, 3)}, tried[-1], walks)

    plan_with(monkeypatch, plan)
    found = search_for(ten_steps(planned=False), 3.0).quickest(None, 0.1)
    if has_plan is None:
        assert found is None and len(tried) == 8  # six of the usual times, then one each of two
    else:
        assert found is not None and found.tempo.switch == pytest.approx(1.2, rel=0.06)


def test_where_another_task_keeps_too_little_that_is_tried_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is no difference between short flights and long ones, and is not taken for one."""
    search = search_for(ten_steps())
    monkeypatch.setattr(search._planner, "spare", lambda t: t.designed.margin - KEPT.margin)
    first = trial_of({1: 0.03, 3: 0.04}, 0.6, None)
    walks = ((1, first.designed.plan.plans[0].end),)
    part = replace(trial_of({1: 0.03}, 0.5, walks), cut=True)
    trials = Trials(known={0.5: part}, first=first, critical=(1,))
    search._trials = {1.25: trials}
    for task, critical, more in ((2, (2, 1), 0.0), (1, (2, 1), 0.01)):
        monkeypatch.setattr(search, "_critical", lambda _, task=task: (task,))
        trials.known[0.5] = part
        search._learn(part, trial_of({task: 0.02}, 0.5, None))
        assert trials.critical == critical
        assert trials.cut_has_more == pytest.approx(more)
