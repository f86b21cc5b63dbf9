"""`drake-quad check`: what it answers holds, and what cannot be asked is refused in a line."""

import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from command import drake_quad, refused
from design_rig import asked
from rich.console import Console
from rig import URL, paper_robot

from drake_quad import check_command, check_nearest, cli_robots
from drake_quad.check_ask import ask_course, ask_stairs
from drake_quad.check_command import Asked, run_check
from drake_quad.check_moments import find_stretches
from drake_quad.check_nearest import nearest_of, nearest_stairs
from drake_quad.check_picture import save_picture
from drake_quad.check_print import gait_lines, print_check, print_next
from drake_quad.check_report import LIMITS, describe_check, limit_of, with_nearest
from drake_quad.check_stairs import Around, Check, stairs_scenario
from drake_quad.design import choose
from drake_quad.design.evaluate import NAMES
from drake_quad.errors import InputError
from drake_quad.planning.plan_mission import check_plan
from drake_quad.planning.plan_torques import torque_ratio
from drake_quad.scenario import Scenario, course_of, load_scenario, save_scenario
from drake_quad.simulation import prepare

RISE, RUN, COUNT = 0.12, 0.32, 2


def found() -> Check:
    return asked(URL, rise=RISE, run=RUN, count=COUNT)


def made_up(rise: float, run: float, *, feasible: bool) -> Check:
    check = found() if feasible else Check(Scenario(), None, "", {})
    assert check.feasible is feasible
    return check


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
    told = describe_check(
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
    assert json.loads(json.dumps(told)) == told


def test_a_plan_that_asks_too_much_of_a_drive_is_told_with_how_much() -> None:
    """Its torques on the course are in the table, count for quality, and stand in the answer."""
    check, designed, asked = found(), found().designed, {"rise": RISE, "run": RUN, "count": COUNT}
    assert designed is not None and 0.0 < designed.torque < 1.0
    told = describe_check(check, paper_robot(), source=URL, asked=asked)
    assert told["slacks"]["torque"]["on_course"] == designed.torque
    most = 0.0
    for plan in designed.plan.plans:
        samples = check_plan(paper_robot(), plan, dynamic=False)
        most = max(most, float(torque_ratio(paper_robot(), samples).max()))
    assert designed.torque == pytest.approx(1.0 - most, abs=0.01)
    weak = replace(designed, torque=-0.08)
    assert weak.quality < 0.0 < designed.quality
    answer = describe_check(
        replace(check, designed=weak), paper_robot(), source=URL, asked=asked
    )["answer"]  # fmt: skip
    assert answer.startswith("Yes: ") and "108%" in answer and "108%" not in told["answer"]


def test_pace_and_pitch_are_the_plans_own() -> None:
    """Amid the flight the body goes on as fast as told, and is pitched as told at most."""
    designed = found().designed
    assert designed is not None
    question = {"rise": RISE, "run": RUN, "count": COUNT}
    gait = describe_check(found(), paper_robot(), source=URL, asked=question)["gait"]
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
    told = describe_check(
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
        scenario = stairs_scenario(robot, model=URL, rise=0.1, run=0.3, count=2, around=around)
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
        run_check(Asked(URL, **option))


def test_the_next_command_is_quoted() -> None:
    """Names with blanks or worse are one word of a shell's command."""
    console = Console(width=200, file=io.StringIO(), record=True)
    told = {"feasible": True, "sought": False, "saved": "a b; rm", "robot": "$(x)", "nearest": None}
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
        describe_check(
            replace(check, designed=replace(designed, margin=margin)),
            paper_robot(), source=URL, asked=asked,
        )["answer"]
        for margin in (0.99 * wanted, wanted)
    ]  # fmt: skip
    assert f"less than the {1e3 * wanted:.0f} mm wanted" in answers[0]
    assert all(answer.startswith("Yes: ") for answer in answers) and "wanted" not in answers[1]


def test_a_no_is_told_with_its_reason_before_the_nearest_is_sought(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """First a whole answer without what is near, then the same with it; or, asked so, none."""
    happened: list[str] = []

    def near(*_args: object, **_more: object) -> tuple[float, float]:
        happened.append("sought")
        return 0.2, RUN

    def first(told: dict[str, Any]) -> None:
        assert told["nearest"] is None and "work" not in told["answer"] and told["reason"]
        happened.append("told")

    monkeypatch.setattr(check_command, "nearest_of", near)
    monkeypatch.setattr(check_command, "ask_stairs", asked)
    question = Asked(URL, rise=1.9, run=RUN, count=COUNT)
    told = run_check(question, first=first)
    assert happened == ["told", "sought"] and told["nearest"] == {"rise": 0.2, "run": RUN}
    assert told["answer"].endswith("; 0.2 m on treads of 0.32 m would work")
    without = run_check(question, nearest=False)
    assert len(happened) == 2 and without["nearest"] is None
    assert told["answer"].startswith(without["answer"])


def test_the_command_prints_a_no_while_it_still_looks(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The reason is on the screen before the nearest stairs are known, once, then these."""
    check = Check(Scenario(), None, "a reason", {"slacks": dict.fromkeys(NAMES, -1.0)})
    asked = {"rise": 0.3, "run": 0.3, "count": 7}
    told = describe_check(check, paper_robot(), source=URL, asked=asked)

    def looks(_asked: Asked, *, first: Callable[[dict[str, Any]], object], **_: Any) -> object:
        first(told)
        printed = capsys.readouterr().out
        assert printed.startswith("No: ") and "a reason" in printed and "Nearest" not in printed
        return with_nearest(told, (0.2, 0.3))

    monkeypatch.setattr(check_command, "run_check", looks)
    with pytest.raises(typer.Exit) as end:
        cli_robots.check(URL)
    assert end.value.exit_code == 1
    printed = capsys.readouterr().out
    assert "No: " not in printed and "Nearest: 0.2 m on treads of 0.3 m would work." in printed


@pytest.mark.parametrize("near", [(0.2, 0.3), None])
def test_what_is_near_is_printed_below_the_no(near: tuple[float, float] | None) -> None:
    """By its numbers, with the command that asks for it; or that there is nothing."""
    check = Check(Scenario(), None, "a reason", {"slacks": dict.fromkeys(NAMES, -1.0)})
    asked = {"rise": 0.3, "run": 0.3, "count": 7}
    told = with_nearest(describe_check(check, paper_robot(), source=URL, asked=asked), near)
    console = Console(width=160, file=io.StringIO(), record=True)
    print_next(told, console)
    text = console.export_text()
    assert ("Nearest: 0.2 m" in text and "--rise 0.2 --run 0.3 --count 7" in text) == (
        near is not None
    )
    assert (near is not None) != ("was found that works" in text)


def test_on_endless_stairs_that_allow_nothing_no_lower_rise_is_planned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What a search finds there is where planning begins, and it is told what is looked at."""
    monkeypatch.setattr(check_nearest, "highest_rise", lambda *_, **__: 0.1234)
    monkeypatch.setattr(
        check_nearest, "ask_stairs",
        lambda _, *, rise, run, **__: made_up(rise, run, feasible=True),
    )  # fmt: skip
    notes: list[str] = []
    check = Check(Scenario(), None, "", {"slacks": {}, "run": 0.3})
    near = nearest_of(
        check, paper_robot(), model=URL, rise=0.9, run=0.3, count=4, note=notes.append
    )
    assert near == (0.123, 0.3)
    assert notes[-1] == "not these; trying 4 steps of 0.123 m on treads of 0.3 m"


@pytest.mark.slow
def test_no_names_what_is_short_and_the_nearest_stairs() -> None:
    """A riser as high as a leg: no, a limit by name, and stairs that are then judged feasible."""
    told = run_check(Asked(URL, rise=1.2, run=RUN, count=COUNT))
    assert not told["feasible"] and told["limit"] in set(NAMES) | {"speed"}
    rise, run = told["nearest"]["rise"], told["nearest"]["run"]
    assert 0.1 < rise < 1.2 and run == RUN
    assert ask_stairs(URL, rise=rise, run=run, count=COUNT).feasible
    assert told["answer"].startswith("No: ") and f"{rise:g} m" in told["answer"]
    assert LIMITS[told["limit"]] in told["answer"]
    assert told["answer"].count("would work") == 1 and "quick search" not in told["answer"]


@pytest.mark.parametrize("highest", [0.03, 0.111, 0.24, 0.2995])
def test_nearest_rise_is_the_highest_that_works(highest: float) -> None:
    """Whatever the robot can, to a centimetre below it, and never above."""
    near = nearest_stairs(
        lambda rise, run, _: made_up(rise, run, feasible=rise <= highest),
        made_up(0.3, 0.3, feasible=False), rise=0.3, run=0.3, count=10,
    )  # fmt: skip
    assert near is not None and near[1] == 0.3
    assert highest - 0.0111 <= near[0] <= highest


def test_above_the_rise_that_was_said_to_work_none_is_judged() -> None:
    """What the search on endless stairs ruled out is not planned; what it named is judged first."""
    judged: list[float] = []

    def judge(rise: float, run: float, _count: int) -> Check:
        judged.append(rise)
        return made_up(rise, run, feasible=True)

    check = Check(Scenario(), None, "", {"nearest_rise": 0.2117})
    assert nearest_stairs(judge, check, rise=0.3, run=0.3, count=4) == (0.211, 0.3)
    assert judged == [0.211]


def test_nearest_stairs_hold_for_all_steps_of_the_flight() -> None:
    """Where ten steps allow less than four, what is named is judged with ten."""
    near = nearest_stairs(
        lambda rise, run, count: made_up(rise, run, feasible=rise <= (0.2 if count < 10 else 0.19)),
        made_up(0.3, 0.3, feasible=False), rise=0.3, run=0.3, count=10,
    )  # fmt: skip
    assert near is not None and 0.17 <= near[0] <= 0.19


def test_where_no_rise_works_a_deeper_run_may() -> None:
    """A run that suits the rise is named, and if there is none either, nothing."""
    check = Check(Scenario(), None, "", {"nearest_rise": None})

    def judge(_rise: float, run: float, _count: int) -> Check:
        return made_up(0.2, run, feasible=run >= 0.3)

    assert nearest_stairs(judge, check, rise=0.2, run=0.22, count=10) == (0.2, 0.33)
    assert nearest_stairs(judge, check, rise=0.2, run=0.10, count=10) is None


def test_treads_that_no_stance_fits_are_told_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a pattern of footprints there is an answer, and no crash."""
    monkeypatch.setattr(choose, "make_patterns", lambda *_: [])
    check = ask_stairs(URL, rise=0.05, run=0.3, count=2)
    assert limit_of(check, paper_robot()) == "pattern" and "0.3 m" in check.reason


def test_treads_like_floors_are_walked_in_the_stride_of_level_ground() -> None:
    """No stance fits treads of two metres: a curb between one and the next is crossed at a time."""
    check = asked(URL, rise=0.1, run=2.0, count=2)
    assert check.designed is not None
    gait = check.designed.scenario.gait
    assert gait.deep_tread < 2.0 and gait.places_per_tread == 1
    assert check.designed.margin > 0.03


def test_the_nearest_stairs_to_treads_like_floors_are_sought_briefly() -> None:
    """They take long to plan; and deeper ones are no easier."""
    judged: list[tuple[float, float]] = []

    def judge(rise: float, run: float, _count: int) -> Check:
        judged.append((rise, run))
        return made_up(rise, run, feasible=False)

    check = Check(Scenario(), None, "", {"deep": True})
    assert nearest_stairs(judge, check, rise=0.3, run=2.0, count=4) is None
    assert len(judged) == 2 and {run for _, run in judged} == {2.0}
    near = nearest_stairs(
        lambda rise, run, _: made_up(rise, run, feasible=rise <= 0.2),
        check, rise=0.3, run=2.0, count=4,
    )  # fmt: skip
    assert near is not None and 0.19 <= near[0] <= 0.2


def test_a_scenarios_course_is_kept_and_its_gait_is_not(tmp_path: Path) -> None:
    """The same course with a gait of another robot in the file gives the same design."""
    own = found().scenario
    path = tmp_path / "course.yaml"
    save_scenario(own, path)
    text = path.read_text()
    path.write_text(text.replace("design: auto", "design: given"))
    check = ask_course(URL, str(path))
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
    save_picture(designed, paper_robot(), tmp_path / "climb.svg")
    assert "<svg" in (tmp_path / "climb.svg").read_text()


@pytest.mark.parametrize(
    ("asked", "named"),
    [
        (Asked(URL, rise=0.0), "--rise: rise = 0.0"),
        (Asked(URL, rise=float("nan")), "--rise: rise = nan"),
        (Asked(URL, run=0.0), "--run: run = 0.0"),
        (Asked(URL, run=float("inf")), "--run: run = inf"),
        (Asked(URL, run=0.05), "--run: run = 0.05"),
        (Asked(URL, count=0), "--count: count = 0"),
        (Asked("nobody"), "nobody"),
        (Asked(URL, scenario="case_study", rise=0.1), "--rise: rise = 0.1"),
        (Asked(URL, scenario="no_such"), "no_such"),
    ],
)
def test_what_cannot_be_asked_is_an_error_that_names_it(asked: Asked, named: str) -> None:
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
    numbers = ("--rise", str(RISE), "--run", str(RUN), "--count", str(COUNT))
    done = drake_quad("check", URL, *numbers, "--save", "stairs.yaml", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["feasible"] and told["answer"].startswith("Yes: ")
    assert load_scenario(tmp_path / told["saved"]).design == "given"
