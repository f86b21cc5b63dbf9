"""The region of balance in a run's report."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from report_run import (
    add_margins,
    draw_only,
    make_log,
    short_scenario,
    wave_begins,
    write_run,
)

from drake_quad.report.figures_margin import draw_regions, was_measured
from drake_quad.report.overlay import Regions
from drake_quad.report.page import write_report
from drake_quad.report.replay import bar_data
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.runs.run_log import RunLog
from drake_quad.scenario.sensing_config import MonitorConfig
from drake_quad.stability.support_polygon import stability_margin


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    log = add_margins(make_log(short_scenario(), seconds=2.0, start=wave_begins()))
    return load_run(write_run(tmp_path_factory.mktemp("run"), log=log))


def asking(run: RecordedRun, margins: str) -> RecordedRun:
    """The run as if it had asked for these."""
    monitor = MonitorConfig(margins=margins)
    return dataclasses.replace(run, scenario=dataclasses.replace(run.scenario, monitor=monitor))


@pytest.mark.parametrize("kind", ["hull", "friction", "feasible"])
def test_the_region_drawn_is_that_of_the_margin(run: RecordedRun, kind: str) -> None:
    """On level treads all three are the hull of the feet that bear; its margin is the log's."""
    regions = Regions(asking(run, kind))
    com, margin = run.log.vector("com"), run.log.number("margin")
    for k in range(0, len(run.log), 37):
        if run.log.flags("bearing")[k].sum() > 2:
            found = stability_margin(com[k, :2], regions.corners(k))
            # The made-up run's shanks are off their contacts: their ground is not quite level.
            assert abs(found - margin[k]) < 0.02
    assert regions.kind == kind
    assert np.array_equal(
        regions.margin,
        run.log.number({"hull": "margin"}.get(kind, f"margin_{kind}")),
    )


@pytest.mark.parametrize(
    ("kind", "region", "margin"),
    [
        ("hull", "support polygon", "static margin"),
        ("friction", "region of balance within friction", "margin within friction"),
    ],
)
def test_the_page_names_the_region_and_the_bar_tells_its_margin(
    run: RecordedRun, kind: str, region: str, margin: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the margin that the bar tells the region is coloured, and both say which it is."""
    column = "margin" if kind == "hull" else f"margin_{kind}"
    values = np.array(run.log.number(column))
    values[:] = 0.0123
    values[-1] = -9.0
    log = RunLog({**run.log.columns, column: values})
    shown = dataclasses.replace(asking(run, kind), log=log)
    data = bar_data(shown, 10.0)
    assert data["margin_name"] == margin
    assert set(data["margin"][:-1]) == {0.0123} and data["margin"][-1] is None
    draw_only(monkeypatch)
    html = " ".join(write_report(shown).read_text(encoding="utf-8").split())
    assert f"The {region} lies on the ground: green while the {margin}, which" in html


def test_what_was_not_measured_is_not_drawn(tmp_path: Path) -> None:
    """A log of before shows the hull, and has no such figure."""
    bare = load_run(write_run(tmp_path, log=make_log(short_scenario(), seconds=1.0)))
    assert Regions(bare).kind == "hull" and not was_measured(bare)


def test_planned_lines_are_dashed_beside_the_measured(run: RecordedRun) -> None:
    """Each margin has its line, and only those of the plan are dashed."""
    figure = draw_regions(run)
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    named = {k: v for k, v in lines.items() if not str(k).startswith("_")}
    assert len(named) == 5
    for label, line in named.items():
        assert (line.get_linestyle() != "-") == ("planned" in str(label))
