"""What a report shows of pushes, recoveries, estimates, and a world that is not as mapped."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from pydrake.geometry import Role, SceneGraph
from report_run import (
    PERIOD,
    SHORT,
    add_estimate,
    add_recovery,
    draw_only,
    make_log,
    short_scenario,
    wave_begins,
    write_run,
)

from drake_quad.common import GRAVITY
from drake_quad.report.derived import ARROWS, WORDS, clock_stops, push_events
from drake_quad.report.figures_course import arc_length, draw_footprints, draw_side
from drake_quad.report.figures_gait import draw_clock, draw_forces
from drake_quad.report.figures_margin import (
    believed_errors,
    draw_estimate,
    draw_margin,
    estimate_errors,
)
from drake_quad.report.page import FIGURES, grade_run, write_report
from drake_quad.report.scene import MakeReplayScene
from drake_quad.report.style import report_style
from drake_quad.report.tables import bounds, push_rows, recovery_rows
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.runs.run_log import RunLog
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import parse_scenario

START = wave_begins() - 1.5  # [s] of the made-up logs, of 4 s
PUSHES = (
    f"disturbances: {{pushes: ["
    f"{{time: {START + 0.5}, speed: 0.6, direction_deg: 90.0}}, "
    f"{{time: {START + 2.5}, speed: 0.3, direction_deg: -45.0}}, "
    f"{{time: {START + 60.0}, speed: 0.3, direction_deg: 0.0}}]}}"
)
CONDITIONAL = {"clock", "estimate"}
ENTRIES: list[dict[str, Any]] = [
    {"time": START + 0.5, "base_error_max": 0.15, "recovered": True, "recovery_time": 1.26},
    {"time": START + 2.5, "base_error_max": 0.04, "recovered": True, "recovery_time": 0.91},
    {"time": START + 60.0, "base_error_max": None, "recovered": None, "recovery_time": None},
]


@pytest.fixture(scope="module")
def log() -> dict[str, Any]:
    return make_log(short_scenario(), seconds=4.0, start=START)


@pytest.fixture(scope="module")
def plain(log: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    return load_run(write_run(tmp_path_factory.mktemp("plain"), log=log))


@pytest.fixture(scope="module")
def pushed(log: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    found = add_estimate(add_recovery(log, START + 0.6), ahead=0.02, yaw=-0.01)
    recovery = {"time": START + 0.8, "legs": ["FR"], "duration": 0.85}
    directory = write_run(
        tmp_path_factory.mktemp("pushed"),
        scenario=parse_scenario(SHORT + PUSHES, source="pushed"),
        log=found,
        pushes=ENTRIES,
        recoveries=[recovery],
        estimate={"drift": 0.02, "drift_ratio": 0.0123, "yaw_error_max_deg": 0.57},
    )
    return load_run(directory)


def told(run: RecordedRun, **summary: Any) -> RecordedRun:
    """The run with some of its summary's keys changed."""
    return dataclasses.replace(run, summary={**run.summary, **summary})


def texts(figure: Figure) -> list[str]:
    """All that is written in a figure's axes and legends."""
    found = [text.get_text() for axis in figure.axes for text in axis.texts]
    legends = [*figure.legends, *(a.get_legend() for a in figure.axes if a.get_legend())]
    return found + [text.get_text() for legend in legends for text in legend.get_texts()]


def test_sections_appear_only_when_there_is_something_to_show(
    plain: RecordedRun, pushed: RecordedRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A calm run of a robot that is told its state has neither clock, estimate nor pushes."""
    assert {kind.name for kind in FIGURES} >= CONDITIONAL
    draw_only(monkeypatch, *CONDITIONAL, "margin")
    for run, there in ((plain, False), (pushed, True)):
        html = write_report(run, replay=False).read_text(encoding="utf-8")
        for name in (*CONDITIONAL, "pushes"):
            assert (f'<section id="{name}">' in html) == there, name
            assert (f'href="#{name}"' in html) == there, name
        assert ("Marks along the top" in html) == there
        assert "differs from the map" not in html


def test_the_verdict_says_how_often_it_was_pushed_and_how_fast_it_recovered(
    pushed: RecordedRun,
) -> None:
    """Times in their order; a push that was not reached is none; a lost one is said."""
    assert "Pushed 2 times, recovered in 1.3 s, 0.9 s." in grade_run(pushed).sentence
    lost = {**ENTRIES[1], "recovered": False, "recovery_time": None}
    both = grade_run(told(pushed, pushes=[ENTRIES[0], lost])).sentence
    assert "Pushed 2 times, recovered in 1.3 s; not recovered from 1." in both
    assert "Pushed once, not recovered." in grade_run(told(pushed, pushes=[lost])).sentence
    for pushes in ([], [ENTRIES[2]], None, "two"):
        assert "ushed" not in grade_run(told(pushed, pushes=pushes)).sentence


def test_pushes_are_told_with_size_and_direction(pushed: RecordedRun) -> None:
    """In the robot's own heading; a push after the end of the run is left out."""
    first, second = push_events(pushed)
    assert (first.arrow, first.words) == ("←", "to the left")
    assert (second.arrow, second.words) == ("↗", "ahead to the right")
    assert (first.speed, second.speed) == (0.6, 0.3)
    rows = push_rows(pushed)
    assert [row.recovered for row in rows] == ["in 1.3 s", "in 0.9 s"]
    assert [row.error for row in rows] == ["0.150 m", "0.040 m"]
    unknown = push_rows(told(pushed, pushes=None))
    assert [row.recovered for row in unknown] == ["–", "–"]


def test_a_pushs_speed_is_told_as_that_of_the_files_mass(
    pushed: RecordedRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a robot that is a quarter heavier the page says by how much less it became faster."""
    draw_only(monkeypatch)
    text = SHORT + PUSHES.replace("{pushes", "{mass_factor: 1.25, pushes")
    heavier = dataclasses.replace(pushed, scenario=parse_scenario(text, source="heavier"))
    for run, told_so in ((pushed, False), (heavier, True)):
        words = write_report(run, replay=False).read_text(encoding="utf-8")
        assert "of the mass that its file has" in words
        assert ("by 0.80 times as much" in words) == told_so
    assert push_events(heavier)[0].speed == push_events(pushed)[0].speed == 0.6


@pytest.mark.parametrize("k", range(8))
def test_arrows_and_words_go_round_to_the_left(k: int, pushed: RecordedRun) -> None:
    """From straight ahead by eighths, up to 22 degrees off each; steep pushes are up or down."""
    for off in (-22.0, 0.0, 22.0):
        angle = 45.0 * k + off
        assert directed(pushed, f"speed: 0.5, direction_deg: {angle}") == (ARROWS[k], WORDS[k])
    assert directed(pushed, "force: [1.0, 0.0, 9.0]")[1] == "up"
    assert directed(pushed, "force: [0.0, -1.0, -9.0]")[1] == "down"


def directed(run: RecordedRun, push: str) -> tuple[str, str]:
    text = SHORT + f"disturbances: {{pushes: [{{time: {START + 1.0}, {push}}}]}}"
    scenario = parse_scenario(text, source="directed")
    (mark,) = push_events(dataclasses.replace(run, scenario=scenario))
    return mark.arrow, mark.words


def test_the_clocks_waiting_is_told_by_what_it_is_for(
    plain: RecordedRun, pushed: RecordedRun
) -> None:
    """Bands are as long as the log has them, in order, and add up to all that was waited."""
    bands = clock_stops(pushed)
    assert [band.mode for band in bands] == ["wait", "catch", "settle", "replan"]
    lengths = [band.end - band.start for band in bands]
    assert lengths == pytest.approx([0.2, 0.3, 0.5, 0.05], abs=2 * PERIOD)
    assert sum(lengths) == pytest.approx(pushed.log.number("gait_waited")[-1], abs=2 * PERIOD)
    assert clock_stops(plain) == []


def test_a_tick_at_the_end_of_a_recovery_is_no_wait_for_a_foot(pushed: RecordedRun) -> None:
    """What the clock waited for in the sample in which it began to run was the recovery."""
    waited = np.array(pushed.log.number("gait_waited"))
    mode = pushed.log.text("gait_mode")
    last = max(k for k, word in enumerate(mode) if word == "replan")
    waited[last + 1 :] += PERIOD
    columns = {**pushed.log.columns, "gait_waited": waited}
    bands = clock_stops(dataclasses.replace(pushed, log=RunLog(columns)))
    assert [band.mode for band in bands] == ["wait", "catch", "settle", "replan"]


def test_the_clocks_figure_says_all_that_it_waited(pushed: RecordedRun) -> None:
    """In all and by reason, in seconds."""
    with report_style():
        written = texts(draw_clock(pushed))
    assert "waited in all: 1.05 s" in written
    assert (
        "catches a push: 0.30 s" in written and "waits until the robot is calm: 0.50 s" in written
    )


def test_a_quarter_of_the_weight_has_the_payload_in_it(plain: RecordedRun) -> None:
    """The line across the feet's forces is what each would bear alike, of all that stands there."""
    text = SHORT + "disturbances: {payload: {mass: 8.0}, mass_factor: 1.1}"
    loaded = dataclasses.replace(plain, scenario=parse_scenario(text, source="loaded"))
    for run, mass in ((plain, plain.robot.mass), (loaded, 1.1 * plain.robot.mass + 8.0)):
        with report_style():
            lines = draw_forces(run).axes[0].lines
        heights = [line.get_ydata()[0] for line in lines if len(line.get_ydata()) == 2]
        assert pytest.approx(0.25 * mass * GRAVITY) in heights


def test_figures_over_time_mark_pushes_by_size_and_direction(
    pushed: RecordedRun, plain: RecordedRun
) -> None:
    """Over each push's line; where two are too near to be named both, the second's arrow is."""
    with report_style():
        written = texts(draw_margin(pushed))
        assert "← 0.6 m/s" in written and any("0.3 m/s" in text for text in written)
        assert not any("m/s" in text for text in texts(draw_margin(plain)))
        near = SHORT + PUSHES.replace(f"{START + 2.5}", f"{START + 0.65}")
        scenario = parse_scenario(near, source="near")
        written = texts(draw_margin(dataclasses.replace(pushed, scenario=scenario)))
    assert "← 0.6 m/s" in written and not any("0.3 m/s" in text for text in written)


def test_errors_of_the_estimate_are_its_distances_from_the_truth(
    pushed: RecordedRun, plain: RecordedRun
) -> None:
    """Place, heading with its sign, tilt; and what the filter believes of each."""
    errors, believed = estimate_errors(pushed), believed_errors(pushed)
    np.testing.assert_allclose(errors[-1], [0.02, -0.01, 0.0], atol=1e-9)
    np.testing.assert_allclose(errors[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(believed[-1], [0.01, 0.005, 0.0], atol=1e-12)
    assert np.all(np.isnan(estimate_errors(plain)))


def test_a_tilt_of_the_estimate_is_told_from_its_heading(pushed: RecordedRun) -> None:
    """Rolled by 2 degrees, whatever the yaw, it is tilted by 2 degrees and not turned."""
    roll = np.array(pushed.log.number("base_estimated_roll")) + np.radians(2.0)
    columns = {**pushed.log.columns, "base_estimated_roll": roll}
    rolled = dataclasses.replace(pushed, log=RunLog(columns))
    place, turn, tilt = (estimate_errors(rolled) - estimate_errors(pushed)).T
    pitch = pushed.log.number("base_estimated_pitch")  # what the roll is about leans by it
    np.testing.assert_allclose(np.degrees(tilt), 2.0 * np.cos(pitch), atol=1e-6)
    assert np.max(np.abs([place, turn])) < 1e-12


def test_the_estimates_figure_is_drawn_however_little_is_known(pushed: RecordedRun) -> None:
    """Without the filter's beliefs, or with a foot taken for slipping, it is drawn too."""
    columns = dict(pushed.log.columns)
    columns["FL_slip_estimated"] = pushed.log.t > START + 2.0
    for name in [name for name in columns if name.startswith("deviation_")]:
        del columns[name]
    with report_style():
        figure = draw_estimate(dataclasses.replace(pushed, log=RunLog(columns)))
    assert "error" in texts(figure) and "estimated, one standard deviation" not in texts(figure)


def test_the_estimates_figures_stand_beside_what_was_asked(
    pushed: RecordedRun, plain: RecordedRun
) -> None:
    """Where there is an estimate, its drift is told in per cent of the way."""
    found = {bound.name: bound.measured for bound in bounds(pushed)}
    assert found["Drift of the estimate at the end, of the way"] == "1.23 %"
    assert not any("stimate" in bound.name for bound in bounds(plain))


def test_recoveries_are_told_with_their_legs(pushed: RecordedRun) -> None:
    """In order; many are cut short, and one that never ended says so."""
    (row,) = recovery_rows(pushed)
    assert (row.legs, row.duration) == ("FR", "0.85 s")
    entry = {"time": 1.0, "legs": ["FR", "FL", "FR", "RL", "RR"], "duration": None}
    long, still = recovery_rows(told(pushed, recoveries=[entry, {**entry, "legs": []}]))
    assert long.legs == "FR, then FL, then FR, then RL, … 5 steps in all"
    assert still.legs == "none" and still.duration == "not again"
    assert recovery_rows(told(pushed, recoveries=None)) == []


def world_scenario(mode: str = "physics") -> Scenario:
    text = SHORT + (
        "world: {rise_error: 0.01, position_error: 0.05, yaw_error_deg: 2.0, random: false}\n"
        f"simulation: {{mode: {mode}}}\n"
    )
    return parse_scenario(text, source="world")


@pytest.fixture(scope="module")
def surprised(log: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    directory = tmp_path_factory.mktemp("world")
    return load_run(write_run(directory, scenario=world_scenario(), log=log))


def test_the_course_that_is_drawn_is_the_world(surprised: RecordedRun, plain: RecordedRun) -> None:
    """Every box of the world is in the scene, where it is and not where the map has it."""
    assert plain.world is plain.course and surprised.world is not surprised.course
    scene = MakeReplayScene(surprised, lambda *_: None)
    graph = scene.diagram.GetSubsystemByName("scene_graph")
    assert isinstance(graph, SceneGraph)
    inspector = graph.model_inspector()
    drawn = {
        inspector.GetName(g).rpartition("::")[2]: inspector.GetPoseInFrame(g).translation()
        for g in inspector.GetAllGeometryIds(Role.kIllustration)
    }
    for box in surprised.world.boxes:
        np.testing.assert_allclose(drawn[box.name], box.centre, atol=1e-12)
    mapped = {box.name: box.centre for box in surprised.course.boxes}
    assert np.linalg.norm(drawn["stairs_1_tread_4"] - mapped["stairs_1_tread_4"]) > 0.04


def test_the_map_is_drawn_thin_where_the_world_is_another(
    surprised: RecordedRun, plain: RecordedRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From above its nosings where it has them, from the side its ground; else neither."""
    with report_style():
        for draw, label in (
            (draw_footprints, "nosings as mapped"),
            (draw_side, "ground as mapped"),
        ):
            assert label in texts(draw(surprised)) and label not in texts(draw(plain))
        lines = draw_footprints(surprised).axes[0].lines
    for ends in surprised.course.nosings():
        assert any(np.array_equal(line.get_xydata(), ends[:, :2]) for line in lines)
    draw_only(monkeypatch, "side")
    html = write_report(surprised, replay=False).read_text(encoding="utf-8")
    assert "differs from the map" in html


def test_from_the_side_the_lanes_are_the_worlds(surprised: RecordedRun, plain: RecordedRun) -> None:
    """How far along is measured along the lane, which is straight where its flights are turned."""
    lane = surprised.world.lanes[0]
    s, _ = lane.coordinates(surprised.log.vector("com"))
    np.testing.assert_allclose(arc_length(surprised).com[:, 0], s, atol=1e-12)
    np.testing.assert_allclose(s, arc_length(plain).com[:, 0], atol=1e-12)
    assert np.abs(lane.breaks - surprised.course.lanes[0].breaks).max() > 0.04


def test_a_kinematic_replay_is_on_the_map_and_is_not_pushed(
    log: dict[str, Any], tmp_path: Path
) -> None:
    """Its robot goes where the plan has it, and nothing touches it."""
    directory = write_run(
        tmp_path, scenario=world_scenario("kinematic"), log=log, simulation="kinematic"
    )
    run = load_run(directory)
    assert run.world is run.course
    scenario = parse_scenario(SHORT + PUSHES, source="pushed")
    assert push_events(dataclasses.replace(run, scenario=scenario)) == []
