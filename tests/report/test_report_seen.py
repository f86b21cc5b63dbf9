"""What the robot saw, in a run's report: table, picture, map; and files that are spoilt."""

import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_run import draw_only, make_log, short_scenario, write_run

from drake_quad.perception.level_beyond import Level
from drake_quad.perception.sight import MapRevision, Sight
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_map import make_stair_map
from drake_quad.report.figures_revisions import draw_revisions, revision_rows, revision_times
from drake_quad.report.figures_seen import draw_sight, seen_rows
from drake_quad.report.page import write_report
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.runs.seen import IMAGE, SEEN, record_sight, seen_figures
from drake_quad.scenario.build import course_of

N, OFF = 4, 0.03  # [m] by which the last nosing is told too far ahead


@pytest.fixture(autouse=True)
def other_figures_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """These tests are about two figures."""
    draw_only(monkeypatch, "seen", "revisions")


def sight(*, seen: bool = True) -> Sight:
    """The short scenario's four steps, seen from 1.6 m along it; the last one not well."""
    depth = np.tile(np.linspace(3.0, 0.9, 48)[:, None], (1, 64))
    if not seen:
        return Sight(None, 0.9, 10, depth, refused="stands still; what is seen is: no stairs")
    places = 1.0 + 0.5 * np.arange(N, dtype=np.float64)
    places[-1] += OFF
    belief = StairBelief(
        stamp=0.9, origin=np.array([1.6, 0.0]), passed=0, places=places,
        heights=0.13 * np.arange(N + 1, dtype=np.float64), yaw=0.0, overhang=0.0, rise=0.13,
        run=0.51, covariance=0.005**2 * np.eye(2 * N + 5), count_least=N, count_most=N,
        is_open=False, right=-0.9, left=0.9,
    )  # fmt: skip
    level = Level(2.0, ends_flight=True)
    found = make_stair_map(
        belief, level, standing=np.array([1.0, 0.0]), floor=0.0, behind=1.0, landing=2.0, reach=0.4
    )
    return Sight(belief, 0.9, 10, depth, level, found)


def grown() -> tuple[MapRevision, MapRevision]:
    """The first two steps of the flight, and all four as a second look told them."""
    whole = sight()
    assert whole.belief is not None and whole.map is not None
    last = whole.map
    known = replace(
        last, places=last.places[:2],
        heights=last.heights[:2], place_errors=last.place_errors[:2],
        height_errors=last.height_errors[:2],
        height_correlation=last.height_correlation[:2, :2], complete=False, trusted=2,
        seen_in=(0, 0),
    )  # fmt: skip
    more = replace(last, seen_in=(0, 1, 1, 1))
    first = MapRevision(0, 0.9, whole.belief, whole.level, known)
    return first, MapRevision(1, 20.0, whole.belief, whole.level, more)


def write_seen(directory: Path, shown: Sight, revisions: tuple[MapRevision, ...] = ()) -> Path:
    """A made-up run's files, with what was seen."""
    scenario = copy.deepcopy(short_scenario())
    scenario.perception.map = "seen"
    write_run(directory, scenario=scenario, log=make_log(short_scenario(), seconds=0.2))
    record = record_sight(shown, course_of(scenario), revisions)
    (directory / SEEN).write_text(json.dumps(record.told), encoding="utf-8")
    record.write_image(directory / IMAGE)
    return directory


@pytest.fixture
def run(tmp_path: Path) -> RecordedRun:
    return load_run(write_seen(tmp_path / "run", sight()))


def test_the_map_of_a_run_is_what_was_seen(run: RecordedRun) -> None:
    """The run's course has the nosings of the belief; its world those of the scenario."""
    assert run.course is not run.world and not run.notices
    off = run.course.nosings()[:, 0, 0] - run.world.nosings()[:, 0, 0]
    assert off == pytest.approx([0.0, 0.0, 0.0, OFF])


def test_each_nosing_has_its_rows_with_its_verdict(run: RecordedRun) -> None:
    """Three figures of the flight, then place and height of each; the last place is outside."""
    rows = {row.name: row for row in seen_rows(run)}
    assert len(rows) == 3 + 2 * N
    assert rows["nosing 1, place"].inside is True and rows["nosing 1, place"].true == "1000.0 mm"
    assert rows["nosing 4, place"].inside is False and rows["nosing 4, place"].error == "30.0 mm"
    assert rows["nosing 4, height"].inside is True
    assert rows["mean rise"].seen == "130.0 mm ± 9.8"


def test_the_page_shows_image_stairs_and_table(run: RecordedRun) -> None:
    """The section is there, says what was seen, and marks what is outside of its interval."""
    html = write_report(run, replay=False).read_text()
    assert 'id="seen"' in html and "Seen: 4 steps up, each 0.13 m high, 0.51 m deep." in html
    assert "✗ outside" in html and "✓ inside" in html
    figure = draw_sight(run)
    assert len(figure.axes) == 3 and figure.axes[0].images[0].get_array() is not None


@pytest.mark.filterwarnings("error:constrained_layout")
def test_a_map_that_grew_is_shown_look_by_look(tmp_path: Path) -> None:
    """A row a look with what came of it, the nosings that each told, and marks in time."""
    run = load_run(write_seen(tmp_path, sight(), grown()))
    first, second = revision_rows(run)
    assert (first.steps, first.inside) == ("2, 2 of them planned on", "4 of 4")
    assert (second.steps, second.inside, second.time) == ("4", "7 of 8", "20.0 s")
    assert second.outcome == "its end is seen" and revision_times(run) == [("look 1", 20.0)]
    assert len(draw_revisions(run).axes) == 3
    html = write_report(run, replay=False).read_text()
    assert 'id="revisions"' in html and "goes on as far as it knows" in html


def test_what_feet_found_is_shown_as_theirs(tmp_path: Path) -> None:
    """It is a row, but no look; its nosings are drawn, and its time is marked."""
    shown = sight()
    assert shown.map is not None
    first = MapRevision(0, 0.9, shown.belief, shown.level, shown.map)
    touched = replace(shown.map, touched=(True,) * N)
    last = replace(first, number=1, stamp=55.0, map=touched, looked=False, stood_on=N)
    run = load_run(write_seen(tmp_path, shown, (first, last)))
    row = revision_rows(run)[1]
    assert (row.name, row.seen) == ("by the feet", f"its feet told the height of {N} of {N} steps")
    assert row.outcome == "the rest is planned on it"
    assert revision_times(run) == [("by the feet", 55.0)]
    labels = draw_revisions(run).axes[0].get_legend_handles_labels()[1]
    assert "nosings as the feet told them" in labels
    figures = seen_figures(run.seen)
    assert figures["looks"] == 1 and figures["map_treads_touched"] == N


def test_a_run_that_looked_once_has_no_such_section(run: RecordedRun) -> None:
    """Nothing is shown of revisions, and none is marked."""
    assert revision_rows(run) == [] == revision_times(run)
    assert 'id="revisions"' not in write_report(run, replay=False).read_text()


@pytest.mark.parametrize(
    "spoil", [[{}, {}], [1, "x", {"nosings": 5}], [{"nosings": [{"look": 0}]}, {"stamp": "late"}]]
)
def test_spoilt_revisions_are_shown_as_far_as_they_go(tmp_path: Path, spoil: list[Any]) -> None:
    """What is no figure is a dash, and the page is made."""
    directory = write_seen(tmp_path, sight(), grown())
    told = json.loads((directory / SEEN).read_text()) | {"revisions": spoil}
    (directory / SEEN).write_text(json.dumps(told))
    assert "The stairs as they were seen" in write_report(directory, replay=False).read_text()


def test_a_robot_that_saw_nothing_shows_its_image(tmp_path: Path) -> None:
    """The picture says that no stairs were seen, and there is no table."""
    run = load_run(write_seen(tmp_path, sight(seen=False)))
    assert seen_rows(run) == [] and not run.notices
    assert draw_sight(run).axes[1].get_title() == "no stairs were seen"


@pytest.mark.parametrize(
    "spoil",
    [
        {"map": {"elements": [{"kind": "x"}], "origin": [0, 0], "yaw": 0, "floor": 0}},
        {"map": 5},
        {"map": {"elements": [{"colour": 1}], "origin": "x", "yaw": None}},
        {"nosings": [{"place": 3, "height": None}], "origin": None},
        {"nosings": "many", "rise": [1], "words": 7, "yaw_deg": {"value": "north"}},
    ],
)
def test_a_spoilt_file_is_shown_as_far_as_it_goes(tmp_path: Path, spoil: dict[str, Any]) -> None:
    """What is no map, or no figure, is a notice or a dash, and the page is made."""
    directory = write_seen(tmp_path, sight())
    told = json.loads((directory / SEEN).read_text()) | spoil
    (directory / SEEN).write_text(json.dumps(told))
    (directory / IMAGE).write_bytes(b"no image")
    run = load_run(directory)
    assert bool(run.notices) == ("map" in spoil)
    assert "The stairs as they were seen" in write_report(run, replay=False).read_text()


def test_a_run_without_the_file_says_so(tmp_path: Path) -> None:
    """Its world is shown as the map, with a notice, and the page has no such section."""
    directory = write_seen(tmp_path, sight())
    (directory / SEEN).unlink()
    run = load_run(directory)
    assert any(SEEN in notice for notice in run.notices)
    assert "The stairs as they were seen" not in write_report(run, replay=False).read_text()
