"""The smallest margin in a run's report: one figure everywhere, and what it is of."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_run import SHORT, draw_only, make_log, short_scenario, wave_begins, write_run

from drake_quad.report.figures_course import draw_footprints
from drake_quad.report.figures_margin import draw_margin
from drake_quad.report.page import grade_run, write_report
from drake_quad.report.replay import recorded_samples
from drake_quad.report.style import report_style
from drake_quad.report.tables import bounds, segment_rows
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.runs.run_log import RunLog
from drake_quad.scenario.load import parse_scenario


@pytest.fixture(scope="module")
def log() -> dict[str, Any]:
    return make_log(short_scenario(), seconds=2.0, start=wave_begins() - 1.0)


@pytest.fixture(scope="module")
def run(log: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    return load_run(write_run(tmp_path_factory.mktemp("run"), log=log))


def changed(run: RecordedRun, **columns: Any) -> RecordedRun:
    """The run with some columns of its log changed."""
    return dataclasses.replace(run, log=RunLog({**run.log.columns, **columns}))


def told(run: RecordedRun, **summary: Any) -> RecordedRun:
    """The run with some of its summary's keys changed."""
    return dataclasses.replace(run, summary={**run.summary, **summary})


def test_the_verdict_names_the_least_margin_and_where_it_was(run: RecordedRun) -> None:
    """A negative margin in one sample is found; reaching the goal over it is no clean success."""
    k = 123
    margin = np.array(run.log.number("margin"))
    margin[k] = -0.0234
    verdict = grade_run(changed(run, margin=margin))
    assert "−0.023 m" in verdict.sentence
    assert f"at {run.log.t[k]:.1f} s ({run.log.text('segment')[k]})" in verdict.sentence
    assert verdict.grade == "warn" and verdict.least_time == run.log.t[k]


def test_the_head_the_table_and_the_figures_tell_one_least_margin(run: RecordedRun) -> None:
    """That of the summary, which a tick of the monitor saw between two samples."""
    k, n = 123, len(run.log)
    least = np.array(run.log.number("margin"))
    for margin, words in ((-0.0123, "−0.012 m"), (-9.0, "not borne by its feet")):
        least[k] = margin
        seen = told(changed(run, margin_least=least.copy()), margin={"minimum": margin})
        verdict = grade_run(seen)
        assert words in verdict.sentence.split(" Not safe")[0] and verdict.grade == "warn"
        assert words in verdict.sentence.replace("-", "−").split("Not safe: ")[1]
        assert verdict.least_time == run.log.t[k] and "9.000" not in verdict.sentence
        assert bounds(seen)[0].measured == words
        with report_style():
            for draw in (draw_margin, draw_footprints):
                written = [text.get_text() for text in draw(seen).axes[0].texts]
                assert any(f"{words} at {run.log.t[k]:.1f} s" in text for text in written)
        assert k in recorded_samples(seen, 10.0)
    lost = told(run, segments=[{"name": "a", "margin_min": -9.0}])
    assert segment_rows(lost)[0].margin == "not borne by its feet" and n > k


def test_a_replay_of_massless_legs_shows_what_legs_with_mass_leave(
    log: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The curve that is named so is the whole robot's; the log's margins are the body's centre's.

    And wherever these stand, the page says that they are without the legs' mass.
    """
    whole, centre = log["margin"], np.full(len(log["t"]), 0.0456)
    paper = {**log, "margin": centre, "margin_planned": centre}
    text = f"{SHORT}body: {{path: uniform}}\nsimulation: {{mode: kinematic}}\n"
    scenario = parse_scenario(text, source="paper")
    run = load_run(write_run(tmp_path, scenario=scenario, log=paper, simulation="kinematic"))
    with report_style():
        lines = {line.get_label(): line for line in draw_margin(run).axes[0].lines}
    low = np.min(lines["static, legs with mass"].get_ydata())
    assert low == pytest.approx(np.min(whole), abs=1e-9) and abs(low - 0.0456) > 1e-3
    assert np.ptp(lines["static, legs without mass (as in the paper)"].get_ydata()) == 0.0
    assert "margin (legs without mass) was 0.046 m" in grade_run(run).sentence
    names = [bound.name for bound in bounds(run)]
    assert names[0] == "Smallest static margin, legs without mass"
    draw_only(monkeypatch, "margin")
    words = " ".join(write_report(run, replay=False).read_text(encoding="utf-8").split())
    assert "The legs of this replay have no mass" in words
