"""The region of balance in a run's report."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from report_run import add_margins, make_log, short_scenario, wave_begins, write_run

from drake_quad.report.figures_margin import draw_regions, was_measured
from drake_quad.report.overlay import Regions
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.scenario.motion_config import MonitorConfig
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
