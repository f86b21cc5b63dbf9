"""`drake-quad check` after a no: the nearest stairs that work, and when they are told."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import typer
from design_rig import COUNT, RUN, asked
from rich.console import Console
from rig import URL, paper_robot

import drake_quad as dq
from drake_quad.cli import robots as cli_robots
from drake_quad.cli.check_answer import print_next
from drake_quad.feasibility import result as check_result, work_out
from drake_quad.feasibility.check import check_flight
from drake_quad.feasibility.check_report import LIMITS, feasibility_report, with_nearest
from drake_quad.feasibility.check_request import CheckRequest, run_check
from drake_quad.feasibility.nearest import nearest_stairs
from drake_quad.feasibility.result import Feasibility
from drake_quad.gait_design.objective import NAMES
from drake_quad.scenario.config import Scenario
from drake_quad.terrain.elements import DEFAULT_THICKNESS, Stairs


def test_a_no_is_told_with_its_reason_before_the_nearest_is_sought(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """First a whole answer without what is near, then the same with it; or, asked so, none."""
    happened: list[str] = []

    def near(*_: object) -> Stairs:
        happened.append("sought")
        return Stairs(0.2, RUN, COUNT)

    def first(told: dict[str, Any]) -> None:
        assert told["nearest"] is None and "work" not in told["answer"] and told["reason"]
        happened.append("told")

    monkeypatch.setattr(Feasibility, "nearest", near)
    monkeypatch.setattr(work_out, "check_flight", asked)
    question = CheckRequest(URL, rise=1.9, run=RUN, count=COUNT)
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
    check = Feasibility(Scenario(), None, "a reason", {"slacks": dict.fromkeys(NAMES, -1.0)})
    asked = {"rise": 0.3, "run": 0.3, "count": 7}
    told = feasibility_report(check, paper_robot(), source=URL, asked=asked)

    def looks(
        _asked: CheckRequest, *, first: Callable[[dict[str, Any]], object], **_: Any
    ) -> object:
        first(told)
        printed = capsys.readouterr().out
        assert (
            printed.startswith("Unknown: ") and "a reason" in printed and "Nearest" not in printed
        )
        return with_nearest(told, Stairs(0.2, 0.3, 7))

    monkeypatch.setattr(dq, "run_check", looks)
    with pytest.raises(typer.Exit) as end:
        cli_robots.check(URL)
    assert end.value.exit_code == 1
    printed = capsys.readouterr().out
    assert "Unknown: " not in printed and "Nearest: 0.2 m on treads of 0.3 m would work." in printed


def test_a_proof_that_was_not_found_is_told_and_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Asked for a proof where none is found, the command says that it writes no file."""
    check = Feasibility(Scenario(), None, "a reason", {"slacks": dict.fromkeys(NAMES, -1.0)})
    asked = {"rise": 0.3, "run": 0.3, "count": 7}
    told = feasibility_report(check, paper_robot(), source=URL, asked=asked)
    monkeypatch.setattr(dq, "run_check", lambda *_, **__: told)
    wanted = tmp_path / "no.json"
    with pytest.raises(typer.Exit):
        cli_robots.check(URL, proof=wanted)
    assert f"{wanted.name} is not written: no proof was found" in capsys.readouterr().err
    assert not wanted.exists()


@pytest.mark.parametrize("near", [Stairs(0.2, 0.3, 7), None])
def test_what_is_near_is_printed_below_the_no(near: Stairs | None) -> None:
    """By its numbers, with the command that asks for it; or that there is nothing."""
    check = Feasibility(Scenario(), None, "a reason", {"slacks": dict.fromkeys(NAMES, -1.0)})
    asked = {"rise": 0.3, "run": 0.3, "count": 7}
    told = with_nearest(feasibility_report(check, paper_robot(), source=URL, asked=asked), near)
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
    monkeypatch.setattr(check_result, "highest_rise", lambda *_, **__: 0.1234)
    notes: list[str] = []
    data: dict[str, Any] = {"slacks": {}, "run": 0.3}
    check = Feasibility(
        Scenario(), None, "", data, paper_robot(), Stairs(0.9, 0.3, 4), quick_margin=lambda _: 0.1
    )
    assert check.nearest(notes.append) == Stairs(0.123, 0.3, 4)
    assert notes[-1] == "not these; trying 4 steps of 0.123 m on treads of 0.3 m"


@pytest.mark.slow
def test_no_names_what_is_short_and_the_nearest_stairs() -> None:
    """A riser as high as a leg: no, a limit by name, and stairs that are then judged feasible."""
    told = run_check(CheckRequest(URL, rise=1.2, run=RUN, count=COUNT))
    assert not told["feasible"] and told["limit"] in set(NAMES) | {"speed"}
    rise, run = told["nearest"]["rise"], told["nearest"]["run"]
    assert 0.1 < rise < 1.2 and run == RUN
    assert check_flight(URL, Stairs(rise, run, COUNT)).feasible
    assert (
        told["answer"].startswith(("Unknown: ", "No, and proven: "))
        and f"{rise:g} m" in told["answer"]
    )
    assert LIMITS[told["limit"]] in told["answer"]
    assert told["answer"].count("would work") == 1 and "quick search" not in told["answer"]


@pytest.mark.parametrize("highest", [0.03, 0.111, 0.24, 0.2995])
def test_nearest_rise_is_the_highest_that_works(highest: float) -> None:
    """Whatever the robot can, to a centimetre below it, and never above."""
    near = nearest_stairs(lambda stairs: stairs.rise <= highest, {}, Stairs(0.3, 0.3))
    assert near is not None and near.run == 0.3
    assert highest - 0.0111 <= near.rise <= highest


def test_above_the_rise_that_was_said_to_work_none_is_judged() -> None:
    """What the search on endless stairs ruled out is not planned; what it named is judged first."""
    judged: list[float] = []

    def climbs(stairs: Stairs) -> bool:
        judged.append(stairs.rise)
        return True

    near = nearest_stairs(climbs, {"nearest_rise": 0.2117}, Stairs(0.3, 0.3, 4))
    assert near == Stairs(0.211, 0.3, 4)
    assert judged == [0.211]


def test_nearest_stairs_hold_for_all_steps_of_the_flight() -> None:
    """Where ten steps allow less than four, what is named is judged with ten."""
    near = nearest_stairs(
        lambda stairs: stairs.rise <= (0.2 if stairs.count < 10 else 0.19),
        {},
        Stairs(0.3, 0.3),
    )
    assert near is not None and 0.17 <= near.rise <= 0.19


def test_where_no_rise_works_a_deeper_run_may() -> None:
    """A run that suits the rise is named, and if there is none either, nothing."""

    def climbs(stairs: Stairs) -> bool:
        return stairs.run >= 0.3

    data = {"nearest_rise": None}
    assert nearest_stairs(climbs, data, Stairs(0.2, 0.22)) == Stairs(0.2, 0.33)
    assert nearest_stairs(climbs, data, Stairs(0.2, 0.10)) is None


def test_the_nearest_stairs_to_treads_like_floors_are_sought_briefly() -> None:
    """They take long to plan; and deeper ones are no easier."""
    judged: list[Stairs] = []

    def climbs(stairs: Stairs) -> bool:
        judged.append(stairs)
        return False

    assert nearest_stairs(climbs, {"deep": True}, Stairs(0.3, 2.0, 4)) is None
    assert len(judged) == 2 and {stairs.run for stairs in judged} == {2.0}
    near = nearest_stairs(lambda stairs: stairs.rise <= 0.2, {"deep": True}, Stairs(0.3, 2.0, 4))
    assert near is not None and 0.19 <= near.rise <= 0.2


def test_treads_thicker_than_steps_are_not_judged() -> None:
    """Treads over open risers are thicker than the lowest stairs that there can be."""
    judged: list[float] = []

    def climbs(stairs: Stairs) -> bool:
        judged.append(stairs.rise)
        return False

    assert nearest_stairs(climbs, {}, Stairs(0.2, 0.3, open=True)) is None
    assert judged and min(judged) > DEFAULT_THICKNESS
    judged.clear()
    assert nearest_stairs(climbs, {"nearest_rise": 0.03}, Stairs(0.2, 0.3, overhang=0.03)) is None
    assert min(judged, default=1.0) > DEFAULT_THICKNESS
