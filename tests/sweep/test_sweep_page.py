"""What people see of a sweep: report.html and the section of a Markdown page."""

import io
import re
from itertools import combinations
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import fromstring

import pytest
import sweep_rig as rig
import yaml
from markupsafe import escape
from matplotlib.backends.backend_agg import FigureCanvasAgg
from report_run import draw_only
from rich.console import Console

from drake_quad.cli.studies import print_sweep
from drake_quad.errors import InputError, PlanningError
from drake_quad.report.style import stand_alone
from drake_quad.scenario.config import Scenario
from drake_quad.simulation.run import simulate
from drake_quad.sweep import report
from drake_quad.sweep.charts import curves_svg, draw_curves, plain_style
from drake_quad.sweep.findings import bin_indices, bins_of
from drake_quad.sweep.report import (
    check_page,
    in_line,
    make_replays,
    otherwise,
    write_section,
    write_sweep_report,
)
from drake_quad.sweep.results import read_table
from drake_quad.sweep.statistics import grade
from drake_quad.sweep.study import Vary

TEXT = (
    rig.PLUMBING.replace("trials: 4", "trials: 20")
    + "  - {path: controller.kind, choice: [ik, whole_body]}\n"
    + "maps: [[simulation.friction, gait.cycle_time]]\ngate: {rate: 0.9}\n"
)


def test_the_report_says_what_the_sweep_found(tmp_path: Path) -> None:
    """Rate, gate, each band's counts, causes, worst trials with commands; nothing from outside."""
    told = rig.sweep_made_up(tmp_path, tmp_path / "a", TEXT)
    study, _ = rig.made(tmp_path, TEXT)
    write_sweep_report(study, told, tmp_path / "a")
    page = (tmp_path / "a" / "report.html").read_text()
    rate = told["rate"]
    assert f"{rate['good']} of {rate['trials']} succeeded" in page and rate["text"] in page
    assert 0 < rate["good"] < 36 and "missed" in page and 'header class="bad"' in page
    for bands in told["bands"].values():
        assert sum(band["trials"] for band in bands) == 40
        assert all(f"{b['good']}/{b['trials']}" in page for b in bands if b["trials"])
    cells = told["maps"][0]
    assert sum(map(sum, cells["trials"])) == 40 and sum(map(sum, cells["good"])) == rate["good"]
    assert all(cause["cause"] in page for cause in told["causes"])
    assert page.count("drake-quad run flat_walk") == len(told["worst"])
    assert not re.search(r'(src|href)="(?!#)', page)
    write_sweep_report(study, told, tmp_path / "a")
    assert (tmp_path / "a" / "report.html").read_text() == page


def test_cases_are_named(tmp_path: Path) -> None:
    """A picture has a panel for each thing that varies, and no more; cases are told by their names.

    Long names stood on each other side by side, and the last row was filled up with empty panels.
    """
    cases = "".join(
        f"      A robot of some maker on stairs number {k}: [gait.cycle_time={7.0 + k}]\n"
        for k in range(9)
    )
    text = rig.PLUMBING + f"  - name: robot and course\n    cases:\n{cases}gate: {{rate: 0.5}}\n"
    text = text.replace("  - {path: gait.cycle_time, values: [7.0, 8.0]}\n", "")
    told = rig.sweep_made_up(tmp_path, tmp_path / "a", text)
    study, _ = rig.made(tmp_path, text)
    write_sweep_report(study, told, tmp_path / "a")
    page = (tmp_path / "a" / "report.html").read_text()
    with plain_style():
        figure = draw_curves(told["bands"])
        FigureCanvasAgg(figure).draw()
    assert len(figure.axes) == len(told["bands"]) == 2
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            shown = [t.get_window_extent() for t in axis.get_ticklabels() if t.get_text()]
            assert not any(one.overlaps(other) for one, other in combinations(shown, 2))
    worst = page[page.index('id="worst"') :]
    for row in told["worst"]:
        assert row["cell"].startswith("A robot of some maker")
        assert f"<td>{row['cell']}</td>" in worst


@pytest.mark.parametrize("name", ["x$\\foo$", "[/x] [bold]", "<b>&amp;", "100 % of {it}"])
def test_people_may_call_things_as_they_like(tmp_path: Path, name: str) -> None:
    """No name of a thing or a case is taken for a formula, for colours or for HTML."""
    cases = {name: ["gait.cycle_time=7.0"], f"{name} " * 9: ["gait.cycle_time=8.0"]}
    text = rig.PLUMBING.replace("{path: gait.cycle_time, values: [7.0, 8.0]}", "CASES").replace(
        "CASES", yaml.safe_dump({"name": f"{name}!", "cases": cases}, default_flow_style=True)[:-1]
    )
    told = rig.sweep_made_up(tmp_path, tmp_path / "a", text)
    study, _ = rig.made(tmp_path, text)
    write_sweep_report(study, told, tmp_path / "a")
    page = (tmp_path / "a" / "report.html").read_text()
    assert f"<td>{escape(name)}</td>" in page
    console = Console(file=io.StringIO(), width=200)
    print_sweep(told, tmp_path / "a", console)
    assert name in console.file.getvalue()  # type: ignore[attr-defined]
    write_section(tmp_path / "page.md", told, "drake-quad sweep x", "x")
    assert f"| {in_line(name)} |" in (tmp_path / "page.md").read_text()


@pytest.mark.parametrize("draws", ["independent", "common"])
def test_bounds_of_common_draws_are_told_for_what_they_are(tmp_path: Path, draws: str) -> None:
    """On the page and in the section, and of no other study."""
    text = rig.PLUMBING + f"draws: {draws}\n"
    told = rig.sweep_made_up(tmp_path, tmp_path / "a", text)
    write_sweep_report(rig.made(tmp_path, text)[0], told, tmp_path / "a")
    write_section(tmp_path / "page.md", told, "drake-quad sweep x", "x")
    for page in (tmp_path / "a" / "report.html", tmp_path / "page.md"):
        words = "bounds hold for each cell alone, and may be too narrow for several"
        assert (words in page.read_text()) == (draws == "common")


def test_bands_of_whole_numbers_hold_what_they_say() -> None:
    """Few have a band each; many are parted evenly, and no number is in two."""
    few = Vary(path="a", integers=[3, 5])
    assert [(b.label, b.rate.trials) for b in bins_of(few, [3, 4, 4, 5], [True] * 4)] == [
        ("3", 1), ("4", 2), ("5", 1),
    ]  # fmt: skip
    many = Vary(path="a", integers=[0, 99])
    found = bins_of(many, list(range(100)), [True] * 100)
    assert [(b.label, b.rate.trials) for b in found][:2] == [("0 to 19", 20), ("20 to 39", 20)]
    falling = Vary(path="a", values=[0.3, 0.1, 0.2])
    labels, places, _ = bin_indices(falling, [0.3, 0.1])
    assert labels == ["0.1", "0.2", "0.3"] and list(places) == [2, 0]


def test_a_page_that_cannot_take_the_section_is_refused_first(tmp_path: Path) -> None:
    """Before any trial: what is no text, and what has half of the section's marks, or too many."""
    page = tmp_path / "page.md"
    for content, words in (
        (b"\xff\xfe\x00", "not a text file"),
        (b"<!-- begin one -->\n", "must have both"),
        (b"<!-- end one -->\n<!-- begin one -->\n", "must have both"),
        (b"<!-- begin one -->\n<!-- end one -->\n<!-- end one -->\n", "once each"),
    ):
        page.write_bytes(content)
        with pytest.raises(InputError, match=words):
            check_page(page, "one")
        assert page.read_bytes() == content


def test_a_replay_that_is_stopped_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half of a run would be taken for the trial, and never made again."""
    draw_only(monkeypatch)
    study, base = rig.made(tmp_path)
    assert make_replays(study, base, [3, 1], tmp_path, stop=lambda: True) == ([], {})
    assert not (tmp_path / "trials").exists()
    assert make_replays(study, base, [3], tmp_path) == ([3], {})


def test_a_replay_that_has_no_run_here_costs_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on another processor, where a plan is missed that there just was: it is told of."""

    def run_most(scenario: Scenario, **more: Any) -> Any:
        if scenario.gait.cycle_time == 7.0:
            raise PlanningError("no path")
        return simulate(scenario, **more)

    monkeypatch.setattr(report, "simulate", run_most)
    draw_only(monkeypatch)
    study, base = rig.made(tmp_path)
    assert make_replays(study, base, [2, 3], tmp_path) == ([3], {2: "no path"})


def test_a_sweep_without_a_gate_is_good_if_all_is() -> None:
    """The head's colour: of a whole sweep without a gate, or with one, and of none that ran."""

    def of(good: int, gate: float | None = None, complete: bool = True) -> str:
        passed = None if gate is None else good / 4 >= gate
        told = {"rate": {"good": good, "trials": 4}, "gate": gate, "passed": passed}
        return grade({**told, "complete": complete, "kinematic": False})

    assert [of(4), of(3), of(0)] == ["good", "warn", "bad"]
    assert [of(3, 0.7), of(3, 0.8)] == ["good", "bad"]
    assert of(4, complete=False) == of(4, 0.9, complete=False) == "warn"


def test_a_gate_is_not_missed_before_any_trial(tmp_path: Path) -> None:
    """Of nothing nothing is said: interrupted at once, say."""
    text = rig.PLUMBING + "gate: {rate: 1.0}\n"
    told = rig.sweep_made_up(tmp_path, tmp_path / "out", text, carry_out=lambda *_: iter(()))
    write_sweep_report(rig.made(tmp_path, text)[0], told, tmp_path / "out")
    printed = io.StringIO()
    print_sweep(told, tmp_path / "out", Console(file=printed))
    page = (tmp_path / "out" / "report.html").read_text()
    assert told["passed"] is None and "0 of 0" in page
    assert "asked for" not in printed.getvalue() and "asked for" not in page


def test_replays_of_the_worst_are_linked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are runs of those very trials; what is there is not made again."""
    draw_only(monkeypatch)
    told = rig.sweep_made_up(tmp_path, tmp_path / "a")
    study, base = rig.made(tmp_path)
    first = told["worst"][0]["index"]
    assert make_replays(study, base, [first], tmp_path / "a") == ([first], {})
    assert make_replays(study, base, [first], tmp_path / "a") == ([], {})
    write_sweep_report(study, told, tmp_path / "a")
    link = f"trials/{first:06d}/report.html"
    page = (tmp_path / "a" / "report.html").read_text()
    assert page.count(f'href="{link}"') == 1 and "Other replays" not in page
    # What was made up of the trial in the sweep is not what comes of its run.
    assert told["worst"][0]["outcome"] == "fell"
    assert otherwise(read_table(tmp_path / "a"), tmp_path / "a") == {first: "goal_reached"}
    assert page.count('which ended otherwise: <span class="bad">goal_reached</span>') == 1
    write_sweep_report(study, {**told, "worst": told["worst"][1:]}, tmp_path / "a")
    page = (tmp_path / "a" / "report.html").read_text()
    assert f'Other replays: <a href="{link}">trial {first}</a>.</p>' in page
    scenario = (tmp_path / "a" / link).with_name("scenario.yaml").read_text()
    seed = re.search(r"simulation\.seed=(\d+)", told["worst"][0]["command"])
    assert seed is not None and f"seed: {seed[1]}" in scenario


@pytest.mark.parametrize("summary", [None, b"\xff", b"[1]", b'{"outcome": ["fell"]}', b"{}"])
def test_of_a_replay_that_tells_no_end_nothing_is_said(
    tmp_path: Path, summary: bytes | None
) -> None:
    """Its summary is gone, or spoilt: the report is linked to all the same."""
    told = rig.sweep_made_up(tmp_path, tmp_path / "a")
    index = told["worst"][0]["index"]
    replay = tmp_path / "a" / "trials" / f"{index:06d}"
    replay.mkdir(parents=True)
    (replay / "report.html").write_text("a report")
    if summary is not None:
        (replay / "summary.json").write_bytes(summary)
    assert otherwise(read_table(tmp_path / "a"), tmp_path / "a") == {}
    write_sweep_report(rig.made(tmp_path)[0], told, tmp_path / "a")
    page = (tmp_path / "a" / "report.html").read_text()
    assert f'href="trials/{index:06d}/report.html"' in page and "ended otherwise" not in page


def test_a_section_leaves_the_rest_of_the_page(tmp_path: Path) -> None:
    """Written twice it is there once, in its place; all else stays as it was."""
    page = tmp_path / "page.md"
    told = rig.sweep_made_up(tmp_path, tmp_path / "a")
    write_section(page, told, "drake-quad sweep one", "one")
    write_section(page, told, "drake-quad sweep two", "two")
    page.write_text(page.read_text() + "A person's words.\n")
    before = page.read_text()
    write_section(page, told, "drake-quad sweep uno", "one")
    assert page.read_text() == before.replace("sweep one", "sweep uno")
    assert told["rate"]["text"] in before and told["commit"] in before


def test_values_far_apart_have_a_logarithmic_axis() -> None:
    """From ice to rubber; their numbers are written as such, not as powers."""

    def scale(values: list[float]) -> tuple[str, list[str]]:
        vary = Vary(path="friction", values=list(values))
        found = bins_of(vary, values * 3, [True] * 3 * len(values))
        told = [{"label": b.label, "low": b.low, "high": b.high, "middle": b.middle, "trials": 3,
                 "good": 3, "bound_low": 0.3, "bound_high": 1.0} for b in found]  # fmt: skip
        with plain_style():
            figure = draw_curves({"friction": told})
            FigureCanvasAgg(figure).draw()
            (ax,) = figure.axes
            return ax.get_xscale(), [label.get_text() for label in ax.get_xticklabels()]

    far, labels = scale([0.01, 0.03, 0.1, 0.5])
    assert far == "log" and {"0.01", "0.1", "0.5"} <= {*labels}
    assert scale([0.1, 0.2, 0.3])[0] == scale([0.0, 0.1, 9.0])[0] == "linear"


def test_a_picture_of_its_own_has_its_own_ink() -> None:
    """A page's variables are set in the file, which any reader of XML can read."""
    band = {"label": "0.5", "low": 0.5, "high": 0.5, "middle": 0.5, "trials": 3, "good": 2,
            "bound_low": 0.1, "bound_high": 0.99}  # fmt: skip
    written = stand_alone(curves_svg({"friction > 0": [band]}))
    root = fromstring(written)
    assert root.tag.endswith("svg") and root[0].tag.endswith("style")
    assert root.get("aria-label") == "Rate of success over friction > 0"
    used = set(re.findall(r"var\((--\w+)\)", written))
    assert used and all(f"{name}:" in (root[0].text or "") for name in used)
