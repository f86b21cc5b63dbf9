"""What a notebook shows of results: the figures that matter, with every name escaped."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pyarrow as pa
import pytest
from chart_rig import made_up
from compare_rig import files_of, study_of
from rig import URL, paper_robot

import drake_quad as dq
from drake_quad.certificate.certify import CLAIMS, Certificate
from drake_quad.certificate.failure import Failure
from drake_quad.feasibility.chart import Span, chart_grid
from drake_quad.feasibility.result import Feasibility
from drake_quad.runs.reader import RecordedRun
from drake_quad.runs.result import RunResult
from drake_quad.scenario.config import Scenario
from drake_quad.sweep.compare import compare_sweeps
from drake_quad.terrain.elements import Stairs
from drake_quad.util.display import html_table

NASTY, ESCAPED = "<b>&x</b>", "&lt;b&gt;&amp;x&lt;/b&gt;"
SUMMARY: dict[str, Any] = {
    "outcome": "fell",
    "reason": NASTY,
    "safety": {"safe": False, "lacks": ["a margin of 0.030 m"]},
    "margin": {"minimum": 0.0123},
    "zmp_margin": {"minimum": -0.004},
    "simulated_time": 12.5,
    "assumes": "nothing",
}


def test_what_holds_much_is_a_line_in_a_python_session() -> None:
    """A robot, a course, a scenario's plan, its certificate: the figures that matter, no arrays."""
    prepared = dq.plan("case_study")
    certificate = dq.certify(prepared)
    things = [
        (prepared.robot, "kg"), (prepared.course, "lane"), (prepared, "stairs"),
        (prepared.plan, "tasks in"), (prepared.plan.plans[1], "static margin 0.0"),
        (certificate, "certified for every time; static margin at least 0.0"),
    ]  # fmt: skip
    for thing, part in things:
        line = repr(thing)
        assert len(line) < 400 and "\n" not in line and "array(" not in line
        assert line.startswith(f"<{type(thing).__name__}: ") and part in line


def test_an_answer_is_a_line_in_a_python_session() -> None:
    """Robot, stairs, and yes with its margin or no with its reason."""
    stairs, robot = Stairs(0.17, 0.29, 7), paper_robot()
    no = repr(Feasibility(Scenario(), None, "legs & knees", {}, robot, stairs))
    assert robot.name in no and str(stairs) in no and "no plan was found: legs & knees" in no
    plan: Any = SimpleNamespace(duration=83.2, dynamic=False)
    designed: Any = SimpleNamespace(margin=0.0456, torque=0.25, plan=plan)
    assert "yes, static margin 0.046 m" in repr(Feasibility(Scenario(), designed, "", {}))
    result = RunResult("fell", "it fell", SUMMARY, pa.table({}), Scenario(description="a walk"))
    assert repr(result) == "<RunResult: a walk; fell: it fell>"


def test_a_table_escapes_names_and_values() -> None:
    """Nothing that a person wrote becomes HTML."""
    assert html_table([(NASTY, NASTY)]).count(ESCAPED) == 2
    assert NASTY not in html_table([(NASTY, NASTY)])


@pytest.mark.parametrize("summary", [SUMMARY, {}, {"margin": None, "safety": "x"}])
def test_a_run_shows_its_outcome_and_its_figures(summary: dict[str, Any]) -> None:
    """A result and a run that was read back show the same; what a summary lacks is left out."""
    result = RunResult("fell", NASTY, summary, pa.table({}), Scenario())
    html = result._repr_html_()
    past = cast(RecordedRun, SimpleNamespace(summary=summary))
    assert RecordedRun._repr_html_(past) == html and NASTY not in html
    if summary is SUMMARY:
        for text in ("fell", ESCAPED, "a margin of 0.030 m", "0.012 m", "-0.004 m", "12.500 s"):
            assert text in html
    else:
        assert "unknown" in html and "margin" not in html


def test_a_no_shows_the_question_and_its_reason() -> None:
    """The robot, the flight, and why it is not climbed."""
    robot = replace(paper_robot(), name=NASTY)
    check = Feasibility(Scenario(), None, "legs & knees", {}, robot, Stairs(0.17, 0.29, 7))
    html = check._repr_html_()
    assert ESCAPED in html and NASTY not in html and "no plan was found: legs &amp; knees" in html
    assert "7 steps of 0.17 m on treads of 0.29 m" in html and "margin" not in html


def test_a_yes_shows_what_the_plan_leaves() -> None:
    """Its margin, and what that is of; its torque and how long it takes."""
    for dynamic, name in ((False, "static margin"), (True, "margin of the zero-moment point")):
        plan = SimpleNamespace(duration=83.2, dynamic=dynamic)
        designed: Any = SimpleNamespace(margin=0.0456, torque=0.25, plan=plan)
        html = Feasibility(Scenario(), designed, "", {})._repr_html_()
        assert "yes" in html and "46 mm" in html and "25 % of the limit" in html and "83 s" in html
        assert f"{name} of the plan" in html


def test_a_certificate_shows_what_is_proven_or_where_it_fails() -> None:
    """Every figure that it claims, or the reason and the time."""
    claims = np.array([[0.02, 0.011, 0.012, 0.3, 0.25], [0.03, 0.01, 0.013, 0.4, 0.2]])
    assert claims.shape[1] == len(CLAIMS)
    proven = Certificate(cast(Any, SimpleNamespace(claims=claims)), None, {}, cast(Any, None))
    html = proven._repr_html_()
    for text in ("0.0200 m", "0.0100 m", "0.0120 m", "0.300 rad", "80.0% of their limits"):
        assert text in html
    failure = Failure(task=1, segment=3, time=2.5, value=-0.1, demand=0.0, reason=NASTY)
    html = replace(proven, failure=failure, record=None)._repr_html_()
    assert "not certified" in html and ESCAPED in html and NASTY not in html
    assert "task 2, 2.500 s after its start" in html and "0.0200 m" not in html


def test_a_comparison_shows_both_rates_and_its_verdict(tmp_path: Path) -> None:
    """How many of how many succeeded, before and after, and how probable that is by chance."""
    before = files_of(tmp_path / "a&b", [True] * 20, study_of())
    after = files_of(tmp_path / "c", [True] * 8 + [False] * 12, study_of())
    comparison = compare_sweeps(before, after)
    html = comparison._repr_html_()
    assert comparison.verdict == "worse" and "worse: by chance with p = " in html
    assert "20 of 20 succeeded, 100.0 %" in html and "8 of 20 succeeded, 40.0 %" in html
    assert "a&amp;b" in html and "a&b" not in html


def test_a_chart_shows_its_picture() -> None:
    """An SVG with the robot's name as it is and the margin of a cell."""
    chart = chart_grid(
        URL, Span(0.1, 0.1, 0.1), Span(0.4, 0.4, 0.1), count=2, workers=1, judge=made_up
    )
    svg = replace(chart, name=NASTY)._repr_html_()
    assert svg.startswith("<svg") and f">{1e3 * chart.cells[0].margin:.0f}<" in svg  # type: ignore[operator]
    assert NASTY not in svg and ESCAPED in svg
