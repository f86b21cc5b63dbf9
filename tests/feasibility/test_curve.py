"""Speed against margin: every point is a plan that can be run, and none is beaten in both."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from design_rig import found
from rig import paper_robot

from drake_quad.feasibility.curve_picture import save_speed_curve
from drake_quad.gait_design import speed_curve
from drake_quad.gait_design.preference import GaitPreference
from drake_quad.gait_design.quicken import Proven
from drake_quad.gait_design.tempo import least_margin
from drake_quad.gait_design.tempo_search import TempoSearch
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import prepare


@pytest.mark.parametrize("good", [True, False])
def test_a_plan_that_is_not_proven_is_no_point(good: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """What `check` would not answer with is not drawn or saved either."""
    check = found()
    slow, pace = check.designed, check.pace
    assert slow is not None and pace is not None and pace.slowest is not None
    quicker = replace(pace, flights=tuple(replace(f, speed=2.0 * f.speed) for f in pace.flights))
    trial = SimpleNamespace(designed=replace(slow, margin=0.9 * slow.margin), pace=quicker)
    monkeypatch.setattr(TempoSearch, "spread", lambda *_: iter([trial]))
    monkeypatch.setattr(Proven, "as_good", lambda *_: good)
    curve = speed_curve.trace_curve(slow, paper_robot())
    assert [p.designed for p in curve.points] == [slow, *([trial.designed] if good else [])]


@pytest.mark.long
def test_the_curve_goes_down_and_its_points_can_be_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Quicker points have less margin, all are safe, and what is saved plans to what was told."""
    monkeypatch.setattr(speed_curve, "TIMES", ((1.25, 1.0), (1.0, 0.6)))
    notes: list[str] = []
    curve = found().curve(notes.append)
    slow = found().designed
    assert curve is not None and slow is not None and len(notes) == 3
    speeds, margins = [p.speed for p in curve.points], [p.margin for p in curve.points]
    assert speeds == sorted(speeds) and margins == sorted(margins, reverse=True)
    assert len(set(speeds)) == len(speeds) >= 2
    safe = GaitPreference("speed").least_margin(paper_robot(), slow.margin)
    assert min(p.margin for p in curve.points) >= safe
    save_speed_curve(curve, tmp_path / "curve", "the paper's robot")
    told = json.loads((tmp_path / "curve" / "curve.json").read_text())
    assert told == curve.as_dict() and (tmp_path / "curve" / "curve.png").stat().st_size > 1000
    last = len(curve.points)
    plans = prepare(load_scenario(tmp_path / "curve" / f"point_{last}.yaml")).plan.plans
    planned = min(p.margin for p in plans if p.margin == p.margin)
    seen = min(least_margin(paper_robot(), p) for p in plans)  # the plan's own is of fewer moments
    assert told["points"][-1]["margin"] == pytest.approx(min(planned, seen), abs=1e-9)
