"""Trials of a gait's times with made-up margins, and the search that takes them for plans."""

import copy
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from design_rig import designed
from rig import paper_robot

from drake_quad.gait_design import tempo_planner, tempo_search
from drake_quad.gait_design.designed import Walks
from drake_quad.gait_design.foot_speeds import NO_SPEEDS
from drake_quad.gait_design.pace import PlanPace
from drake_quad.gait_design.preference import RequiredMargins
from drake_quad.gait_design.short_course import FEWEST
from drake_quad.gait_design.tempo import TempoTrial, usual_tempo
from drake_quad.gait_design.tempo_planner import GaitChoice
from drake_quad.gait_design.tempo_search import STRETCHES, TempoSearch
from drake_quad.scenario.config import Scenario

KEPT = RequiredMargins(0.025, 0.0)


def trial_of(margins: dict[int, float], switch: float, walks: Walks | None) -> TempoTrial:
    """A trial of tasks whose plans have so much margin [m]."""
    robot, slow = paper_robot(), designed()
    made = replace(usual_tempo(slow.scenario.gait, robot, STRETCHES[0]), switch=switch)
    plans = [
        replace(slow.plan.plans[k], margin=margins.get(k, np.nan))
        for k in ([w[0] for w in walks] if walks else range(len(slow.plan.plans)))
    ]
    plan = replace(slow.plan, plans=tuple(plans))
    least = min(p.margin for p in plans if p.margin == p.margin)
    pace = PlanPace((), None, 1.0)
    return TempoTrial(made, replace(slow, plan=plan, margin=least), pace, NO_SPEEDS, walks)


def plan_with(monkeypatch: pytest.MonkeyPatch, plan: Callable[..., TempoTrial]) -> None:
    """Has trials made by a function in place of `try_tempo`; their speeds are those of switches."""
    monkeypatch.setattr(tempo_planner, "try_tempo", plan)
    monkeypatch.setattr(tempo_planner, "least_margin", lambda *_: np.inf)
    monkeypatch.setattr(tempo_planner, "zmp_margin", lambda *_: np.inf)
    for module in (tempo_planner, tempo_search):
        monkeypatch.setattr(module, "keeps_all_else", lambda *_: True)
    monkeypatch.setattr(TempoTrial, "speed", property(lambda self: 1.0 / self.tempo.switch))


def ten_steps(*, planned: bool = True) -> GaitChoice:
    """The gait on a course with flights that are long enough to be cut short."""
    slow = designed()
    scenario = copy.deepcopy(slow.scenario)
    for element in scenario.course:
        element.count = None if element.count is None else 10
    return GaitChoice(scenario, slow.design, planned=planned)


def is_cut(scenario: Scenario) -> bool:
    """Whether the flights of `ten_steps` have been cut short."""
    (count,) = {e.count for e in scenario.course if e.count is not None}
    assert count in (FEWEST, 10)
    return count == FEWEST


def search_for(gait: GaitChoice, longest: float = 9.0) -> TempoSearch:
    """The search for a gait's times, with no longer time at the switches [s]."""
    search = TempoSearch(gait, designed(), paper_robot(), KEPT, "check")
    setattr(search, "_longest_switch", lambda stretch, _: longest * (stretch >= STRETCHES[0]))  # noqa: B010
    return search
