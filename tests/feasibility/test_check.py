"""`drake-quad check`: what it answers holds, and what cannot be asked is refused in a line."""

import copy
import io
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import drake_quad, refused
from design_rig import COUNT, RISE, RUN, asked, found
from rich.console import Console
from rig import URL, paper_robot

import drake_quad as dq
from drake_quad.cli.check_answer import certificate_words, gait_lines, print_check, print_next
from drake_quad.errors import InputError, PlanningError
from drake_quad.feasibility.check import check_flight, design_for_course
from drake_quad.feasibility.check_picture import draw_check, find_stretches
from drake_quad.feasibility.check_report import (
    _answer,
    _close,
    feasibility_report,
    limit_of,
)
from drake_quad.feasibility.check_request import CheckRequest, run_check
from drake_quad.feasibility.check_words import treads_in_words
from drake_quad.feasibility.flight import Around, make_stairs_scenario
from drake_quad.feasibility.robot_picture import save_picture
from drake_quad.gait_design import choose_gait as choose, designer
from drake_quad.gait_design.objective import NAMES
from drake_quad.planning.contact_forces import torque_ratio
from drake_quad.planning.mission import check_plan
from drake_quad.robot.model import leg_length
from drake_quad.scenario.build import course_of
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario, save_scenario
from drake_quad.simulation.plan_report import certify_plan
from drake_quad.simulation.prepare import prepare
from drake_quad.terrain.elements import Element, Stairs


def test_a_feasible_checks_scenario_loads_and_prepares(tmp_path: Path) -> None:
    """What is saved is whole: run prepares it without a design, to the margin that was told."""
    designed = found().designed
    assert designed is not None
    save_scenario(designed.scenario, tmp_path / "stairs.yaml")
    loaded = load_scenario(tmp_path / "stairs.yaml")
    assert loaded == designed.scenario and loaded.design == "given"
    plans = prepare(loaded).plan.plans
    assert min(p.margin for p in plans if p.margin == p.margin) == pytest.approx(designed.margin)


def test_what_is_told_is_the_plans_own() -> None:
    """Yes in the first line, every limit in the table, and what is left is not negative."""
    told = feasibility_report(
        found(), paper_robot(), source=URL, asked={"rise": RISE, "run": RUN, "count": COUNT}
    )
    console = Console(width=160, file=io.StringIO(), record=True)
    print_check(told, console)
    print_next(told, console)
    lines = console.export_text().splitlines()
    assert lines[0].startswith("Yes: ") and "0.12 m" in lines[0] and "0.32 m" in lines[0]
    assert tuple(told["slacks"]) == NAMES
    assert all(row["left"] > 0.0 for row in told["slacks"].values())
    assert all(row["on_course"] is None or row["on_course"] > 0.0
               for row in told["slacks"].values())  # fmt: skip
    assert any("drake-quad run" in line for line in lines)
    assert "--prefer balanced" in lines[-1]
    console = Console(width=160, file=io.StringIO(), record=True)
    print_next({**told, "pace": {**told["pace"], "slow": {}}}, console)
    assert "--prefer" not in console.export_text()  # its times were chosen already
    assert json.loads(json.dumps(told)) == told


def test_a_yes_is_certified_or_says_why_not() -> None:
    """What is proven of the plan at every time is told; of one in the stairs, where it fails."""
    question = {"rise": RISE, "run": RUN, "count": COUNT}
    check = found()
    told = feasibility_report(check, paper_robot(), source=URL, asked=question)
    loaded = prepare(check.scenario)
    plan, certificate = certify_plan(loaded)
    assert plan["certified"] and certificate is not None
    assert told["certificate"]["certified"]
    assert told["certificate"]["proven"] == pytest.approx(plan["proven"])
    assert 0.0 < told["certificate"]["proven"]["margin"] <= told["plan"]["margin"] + 1e-6
    higher = copy.deepcopy(check.scenario)
    flight = next(element for element in higher.course if element.kind == "stairs")
    flight.rise = RISE + 0.03
    assert check.designed is not None
    touches = replace(check, designed=replace(check.designed, scenario=higher))
    told = feasibility_report(touches, paper_robot(), source=URL, asked=question)
    console = Console(width=160, file=io.StringIO(), record=True)
    print_check(told, console)
    assert told["feasible"] and not told["certificate"]["certified"]
    json.dumps(told, allow_nan=False)  # also where nothing is known of a figure
    assert f"not certified: {told['certificate']['reason']}" in console.export_text()


def test_a_yes_claims_no_more_than_is_proven() -> None:
    """The first line has the certificate's margin; both lines are rounded down, never up."""
    question = {"rise": RISE, "run": RUN, "count": COUNT}
    told = feasibility_report(found(), paper_robot(), source=URL, asked=question)
    told["plan"]["margin"] = 0.0999  # as sampled
    told["certificate"]["proven"] |= {"margin": 0.09873, "foot_clearance": 0.0199}
    told["certificate"]["proven"]["shank_clearance"] = 0.012
    assert "static margin of at least 98 mm" in _answer(told)
    (words,) = certificate_words(told)
    assert "98 mm at least, swing feet 19 mm" in words and "shanks 12 mm" in words
    told["certificate"]["certified"] = False  # then there are the samples alone
    assert "static margin of at least 99 mm" in _answer(told)


def test_little_room_is_told_beside_a_yes() -> None:
    """Where less is proven than what a run may be off its plan, it may touch, and says so."""
    question = {"rise": RISE, "run": RUN, "count": COUNT}
    told = feasibility_report(found(), paper_robot(), source=URL, asked=question)
    off = 0.005 * leg_length(paper_robot())
    proven = told["certificate"]["proven"]
    assert min(proven["foot_clearance"], proven["shank_clearance"]) > off
    assert told["certificate"]["close"] == ""
    close = _close({**proven, "shank_clearance": 0.5 * off}, paper_robot())
    assert close.startswith("knees or shanks come to 3.0 mm") and "6.1 mm off its plan" in close
    told["certificate"]["close"] = close
    console = Console(width=160, file=io.StringIO(), record=True)
    print_check(told, console)
    assert f"little room: {close}" in console.export_text()


def test_a_plan_that_asks_too_much_of_a_drive_is_told_with_how_much() -> None:
    """Its torques on the course are in the table, count for quality, and stand in the answer."""
    check, designed, asked = found(), found().designed, {"rise": RISE, "run": RUN, "count": COUNT}
    assert designed is not None and 0.0 < designed.torque < 1.0
    told = feasibility_report(check, paper_robot(), source=URL, asked=asked)
    assert told["slacks"]["torque"]["on_course"] == designed.torque
    most = 0.0
    for plan in designed.plan.plans:
        samples = check_plan(paper_robot(), plan, dynamic=False)
        most = max(most, float(torque_ratio(paper_robot(), samples).max()))
    assert designed.torque == pytest.approx(1.0 - most, abs=0.01)
    weak = replace(designed, torque=-0.08)
    assert weak.quality < 0.0 < designed.quality
    answer = feasibility_report(
        replace(check, designed=weak), paper_robot(), source=URL, asked=asked
    )["answer"]  # fmt: skip
    assert answer.startswith("Yes: ") and "108%" in answer and "108%" not in told["answer"]


def test_pace_and_pitch_are_the_plans_own() -> None:
    """Amid the flight the body goes on as fast as told, and is pitched as told at most."""
    designed = found().designed
    assert designed is not None
    question = {"rise": RISE, "run": RUN, "count": COUNT}
    gait = feasibility_report(found(), paper_robot(), source=URL, asked=question)["gait"]
    up = find_stretches(designed, paper_robot())[0]
    assert up.going == "up" and gait["cycle_lasts"] == pytest.approx(up.cycle_time)
    ends = up.plan.body.samples(np.array([up.start, up.start + up.cycle_time]))[:, 0, :2]
    speed = np.linalg.norm(ends[1] - ends[0]) / up.cycle_time
    assert gait["speed_stairs"] == pytest.approx(speed, rel=0.2)  # of two steps alone
    pitches = [p.body.samples(np.linspace(0.0, p.duration, 300))[:, 0, 3]
               for p in designed.plan.plans]  # fmt: skip
    least, most = (np.degrees(f([f(p) for p in pitches])) for f in (min, max))
    assert gait["pitch_up_deg"] == pytest.approx(-least, abs=0.1)
    assert gait["pitch_down_deg"] == pytest.approx(most, abs=0.1)


def test_half_treads_and_waits_are_told_as_such() -> None:
    """Two places a tread: half a tread a cycle, which lasts longer by its two waits."""
    check, designed = found(), found().designed
    assert designed is not None
    gait = replace(
        designed.scenario.gait, treads=1, lag=3, places_per_tread=2, cycle_time=4.1,
        switch_wait=0.41,
    )  # fmt: skip
    slow = replace(designed, scenario=replace(designed.scenario, gait=gait))
    question = {"rise": RISE, "run": RUN, "count": COUNT}
    told = feasibility_report(
        replace(check, designed=slow), paper_robot(), source=URL, asked=question
    )  # fmt: skip
    lines = gait_lines(told)
    speed = 0.5 * RUN / 4.92
    assert f"half a tread every 4.92 s, {speed:.3f} m/s along the stairs" in lines[0]
    assert "1.5 treads behind" in lines[1] and "°" in lines[2]
    assert told["gait"]["speed_level"] == pytest.approx(gait.stride / 4.92)


def test_width_landing_and_turn_are_as_asked() -> None:
    """All of the course is as wide; a half turn takes two landings, none is a landing ahead."""
    robot = paper_robot()
    for turn, turns in ((0.0, [None]), (-90.0, [-90.0]), (180.0, [90.0, 90.0])):
        around = Around(width=1.6, landing=3.0, turn=turn)
        scenario = make_stairs_scenario(robot, Stairs(0.1, 0.3, 2), around, model=URL)
        course = scenario.course
        landings = [e for e in course if e.kind == "landing"]
        assert [e.turn_deg for e in landings] == turns
        assert all(e.length == 3.0 for e in landings)
        assert all(e.width == 1.6 for e in course if e.turn_deg is None)
        assert len(course_of(scenario, source="x").lanes) == 1 + sum(t is not None for t in turns)


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ({"turn": 45.0}, "--turn.*-180, -90, 0, 90, 180"),
        ({"width": 0.01}, "--width"),
        ({"landing": float("nan")}, "--landing"),
        ({"width": 3.0, "landing": 2.0}, "--landing.*at least the width"),
        ({"landing": 1.0, "width": 0.9}, "--landing.*too short to turn on"),
        ({"turn": 90.0, "scenario": "case_study"}, "--turn.*leave it out"),
    ],
)
def test_what_cannot_be_around_stairs_is_refused(option: dict[str, Any], words: str) -> None:
    """By the option's name, before anything is designed."""
    with pytest.raises(InputError, match=words):
        run_check(CheckRequest(URL, **option))


def test_the_next_command_is_quoted() -> None:
    """Names with blanks or worse are one word of a shell's command."""
    console = Console(width=200, file=io.StringIO(), record=True)
    told = {
        "feasible": True, "sought": False, "stopped": False, "saved": "a b; rm", "robot": "$(x)",
        "nearest": None, "pace": None, "proof": None, "changes": None, "asked": {},
    }  # fmt: skip
    print_next(told, console)
    print_next({**told, "feasible": False}, console)
    text = console.export_text()
    assert "drake-quad run 'a b; rm'" in text and "drake-quad chart '$(x)'" in text


def test_a_yes_with_less_margin_than_is_wanted_says_so() -> None:
    """In its first line, with the figure wanted; one with no less says nothing of it."""
    check, designed, asked = found(), found().designed, {"rise": RISE, "run": RUN, "count": COUNT}
    assert designed is not None
    wanted = designed.design.wanted["margin"]
    answers = [
        feasibility_report(
            replace(check, designed=replace(designed, margin=margin)),
            paper_robot(), source=URL, asked=asked,
        )["answer"]
        for margin in (0.99 * wanted, wanted)
    ]  # fmt: skip
    assert f"less than the {1e3 * wanted:.0f} mm that designs aim at" in answers[0]
    assert all(answer.startswith("Yes: ") for answer in answers) and "aim" not in answers[1]


def test_treads_that_no_stance_fits_are_told_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a pattern of footprints there is an answer, and no crash."""
    monkeypatch.setattr(choose, "make_foothold_patterns", lambda *_: [])
    check = check_flight(URL, Stairs(0.05, 0.3, 2))
    assert limit_of(check, paper_robot()) == "pattern" and "0.3 m" in check.reason


@pytest.mark.long
def test_treads_like_floors_are_walked_in_the_stride_of_level_ground() -> None:
    """No stance fits treads of two metres: a curb between one and the next is crossed at a time."""
    check = asked(URL, Stairs(0.1, 2.0, 2))
    assert check.designed is not None
    gait = check.designed.scenario.gait
    assert gait.deep_tread < 2.0 and gait.places_per_tread == 1
    assert check.designed.margin > 0.03


def test_a_scenarios_course_is_kept_and_its_gait_is_not(tmp_path: Path) -> None:
    """The same course with a gait of another robot in the file gives the same design."""
    own = found().scenario
    path = tmp_path / "course.yaml"
    save_scenario(own, path)
    text = path.read_text()
    path.write_text(text.replace("design: auto", "design: given"))
    check = design_for_course(URL, str(path))
    assert check.scenario.course == own.course
    assert check.designed is not None and found().designed is not None
    assert check.designed.scenario.gait == found().designed.scenario.gait  # type: ignore[union-attr]


def test_moments_are_on_the_stairs_and_the_picture_is_drawn(tmp_path: Path) -> None:
    """A cycle up and one down, the body over the flight at each; the file is a picture."""
    designed = found().designed
    assert designed is not None
    stretches = find_stretches(designed, paper_robot())
    assert [s.going for s in stretches] == ["up", "down"]
    for stretch in stretches:
        (flight,) = stretch.lane.flights
        treads = stretch.lane.treads(flight)
        place = stretch.plan.body.samples(stretch.times)[:, 0, :2]
        s, _ = stretch.lane.coordinates(place)
        even = s[0] + (s[-1] - s[0]) * (stretch.times - stretch.times[0]) / np.ptp(stretch.times)
        assert np.all(abs(s - even) <= 2 * designed.scenario.gait.max_ahead)  # the body sways
        assert s[-1] > s[0] + 0.5 * RUN
        middle = 0.5 * (treads[0, 0] + treads[-1, 1])
        assert s[0] - 2 * RUN <= middle <= s[-1] + 2 * RUN
    figure = draw_check(designed, paper_robot())
    gait = designed.scenario.gait
    way = treads_in_words(gait.treads, gait.places_per_tread)
    assert f": {way} a cycle" in figure.get_suptitle()
    save_picture(figure, tmp_path / "climb.svg", salt="robot")
    assert "<svg" in (tmp_path / "climb.svg").read_text()


@pytest.mark.parametrize(
    ("asked", "named"),
    [
        (CheckRequest(URL, rise=0.0), "--rise: rise = 0.0"),
        (CheckRequest(URL, rise=float("nan")), "--rise: rise = nan"),
        (CheckRequest(URL, run=0.0), "--run: run = 0.0"),
        (CheckRequest(URL, run=float("inf")), "--run: run = inf"),
        (CheckRequest(URL, run=0.05), "--run: run = 0.05"),
        (CheckRequest(URL, count=0), "--count: count = 0"),
        (CheckRequest("nobody"), "nobody"),
        (CheckRequest(URL, scenario="case_study", rise=0.1), "--rise: rise = 0.1"),
        (CheckRequest(URL, scenario="no_such"), "no_such"),
    ],
)
def test_what_cannot_be_asked_is_an_error_that_names_it(asked: CheckRequest, named: str) -> None:
    """The option and the value, before any long work."""
    with pytest.raises(InputError, match=re.escape(named)):
        run_check(asked)


@pytest.mark.parametrize(
    ("option", "value"), [("--rise", "-0.1"), ("--picture", "climb.doc"), ("--save", ".")]
)
def test_wrong_options_get_one_line(option: str, value: str, tmp_path: Path) -> None:
    """Status 2 and one line that names the option and the value."""
    line = refused(drake_quad("check", URL, option, value, cwd=tmp_path))
    assert option in line and value in line


def test_json_is_one_object_and_the_status_the_answer(tmp_path: Path) -> None:
    """Feasible ends with 0; what was saved is there."""
    numbers = ("--rise", str(RISE), "--run", str(RUN), "--count", str(COUNT), "--prefer", "margin")
    done = drake_quad("check", URL, *numbers, "--save", "stairs.yaml", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["feasible"] and told["answer"].startswith("Yes: ")
    assert load_scenario(tmp_path / told["saved"]).design == "given"


def test_stairs_with_an_overhang_or_open_risers_can_be_asked_about(tmp_path: Path) -> None:
    """The answer names them, the saved course has them, and a no of theirs is not proven."""
    asked = dq.CheckRequest(
        "paper_quadruped", rise=0.1, run=0.4, count=2, overhang=0.03, open=True, prefer="margin"
    )
    told = dq.run_check(asked, save=tmp_path / "s.yaml")
    assert "on treads of 0.4 m that reach out by 0.03 m, with open risers" in told["answer"]
    assert told["asked"]["overhang"] == 0.03 and told["asked"]["open"] is True
    stairs = dq.load_scenario(tmp_path / "s.yaml").course[1]
    assert (stairs.overhang, stairs.open) == (0.03, True)
    closed, nosings = (dq.Stairs(1.5, 0.3, 2, overhang=reach) for reach in (0.0, 0.03))
    hopeless = dq.check_stairs("paper_quadruped", closed, thorough=False)
    assert hopeless.proof is not None
    assert dq.check_stairs("paper_quadruped", nosings, thorough=False).proof is None
    with pytest.raises(dq.InputError, match="--overhang"):
        dq.check_stairs("paper_quadruped", dq.Stairs(0.1, 0.3, overhang=0.2))


def test_flights_are_no_wider_than_a_landing_that_is_turned_on() -> None:
    """A landing shorter than the flights' usual width makes them narrower, unless told a width."""
    robot, stairs = paper_robot(), Stairs(0.15, 0.32, 4)
    usual = make_stairs_scenario(robot, stairs, model=URL).course[1].width
    assert usual is not None and usual > 2.5
    for turn, width in ((90.0, 2.5), (180.0, 2.5), (0.0, usual)):
        course = make_stairs_scenario(
            robot, stairs, Around(landing=2.5, turn=turn), model=URL
        ).course
        assert {e.width for e in course if e.kind in ("floor", "stairs")} == {width}


def test_what_would_work_is_sought_for_the_ways_that_are_gone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A course that only climbs names the rise for climbing, which may be higher."""
    asked: list[list[int]] = []

    def highest(*_: object, going: list[int], **__: object) -> None:
        asked.append(going)

    monkeypatch.setattr(designer, "highest_rise", highest)
    floor, stairs = Element("floor", length=3.0), {"rise": 0.9, "run": 0.25, "count": 2}
    up = Element("stairs", going="up", **stairs)  # type: ignore[arg-type]
    down = Element("stairs", going="down", **stairs)  # type: ignore[arg-type]
    for course, going in (([floor, up, floor], [1]), ([floor, up, floor, down, floor], [1, -1])):
        scenario = Scenario(course=course, design="auto")
        scenario.robot.model = URL
        with pytest.raises(PlanningError):
            designer.design_scenario(scenario, robot=paper_robot())
        assert asked.pop() == going and not asked


@pytest.mark.parametrize(
    ("count", "places", "words"),
    [(1, 1, "1 tread"), (2, 2, "1 tread"), (1, 2, "half a tread"), (3, 2, "1.5 treads")],
)
def test_places_are_told_in_treads(count: int, places: int, words: str) -> None:
    """A gait's numbers are of places to step on, of which a tread may have several."""
    assert dq.treads_in_words(count, places) == words
