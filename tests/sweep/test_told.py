"""What people named is printed as they named it: rich's own marks mean nothing in it."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from drake_quad.cli import runs as cli_print
from drake_quad.cli.check_answer import print_check, print_next
from drake_quad.cli.robots import print_chart
from drake_quad.cli.runs import print_certificate
from drake_quad.runs.summary_lines import summary_lines
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.run import assumptions_of

NAMES = ("[/x]", "[red]x[/]", ":dog:", "[link=x]")


def summary(name: str, _: Console) -> None:
    told = {"outcome": name, "reason": name, "margin_kind": name, "margin": {"minimum": 0.1}}
    cli_print.print_summary(told, Path(name), report=True)


def plan(name: str, _: Console) -> None:
    segment = {"name": name, "kind": "walk", "start": 0.0, "end": 1.0, "margin_min": 0.1}
    figures = {
        "duration": 1.0,
        "planned_margin_min": 0.1,
        "planning_time": 1.0,
        "torque_ratio_planned_max": 0.5,
        "balance": "static",
        "safe_margin": 0.03,
        "doubts": [name],
    }
    cli_print.print_plan({"margin_kind": "hull", "segments": [segment], **figures})


def check(name: str, console: Console) -> None:
    asked = {"rise": 0.1, "run": 0.3, "count": 4}
    told = {"feasible": False, "verdict": "unknown", "proof": None, "slacks": {}, "robot": name,
            "answer": f"Unknown: no plan for {name}",
            "sought": True, "nearest": None, "changes": None, "picture": name, "asked": asked,
            "doubts": [name], "stopped": False}  # fmt: skip
    print_check(told, console)
    print_next(told, console)
    print_next(told | {"nearest": {"rise": 0.1, "run": 0.3}}, console)
    print_next(told | {"feasible": True, "saved": name, "pace": None}, console)


def chart(name: str, console: Console) -> None:
    told = {"cells": [], "rises": [0.1], "runs": [0.3], "complete": True, "name": name}
    print_chart(told, Path(name), console)


def certificate(name: str, console: Console) -> None:
    proven = dict.fromkeys(
        ("margin", "foot_clearance", "shank_clearance", "joint_room", "torque_room"), 0.1
    )
    told = {"certified": False, "reason": name, "segment": name, "time": 1.0, "proven": proven}
    print_certificate(told, console)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("tell", "times"), [(summary, 6), (plan, 1), (check, 6), (chart, 2), (certificate, 2)]
)
def test_names_are_printed_as_they_are(
    tell: Callable[[str, Console], Any],
    times: int,
    name: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every time that a name, a path or a reason is told, it is told whole."""
    console = Console(width=200, record=True, file=io.StringIO())
    monkeypatch.setattr(cli_print, "Console", lambda: console)
    tell(name, console)
    assert console.export_text().count(name) >= times


def test_units_of_a_plans_table_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rich took them for styles: [s] struck out what followed."""
    console = Console(width=200, record=True, file=io.StringIO())
    monkeypatch.setattr(cli_print, "Console", lambda: console)
    plan("walk", console)
    head = console.export_text().splitlines()[0]
    assert "from [s]" in head and "to [s]" in head and "smallest margin [m]" in head


def test_a_dynamic_plan_is_told_as_one(capsys: pytest.CaptureFixture[str]) -> None:
    """Beside its static margin, which may be negative, stands what keeps it up."""
    figures = {
        "duration": 1.0, "planned_margin_min": -0.02, "planning_time": 1.0, "segments": [],
        "torque_ratio_planned_max": 0.5, "balance": "dynamic", "planned_zmp_margin_min": 0.07,
        "safe_margin": 0.03, "doubts": [],
    }  # fmt: skip
    cli_print.print_plan({"margin_kind": "hull", **figures})
    told = " ".join(capsys.readouterr().out.split())
    assert "-0.020 m, balanced by its motion: zero-moment point 0.070 m within its feet" in told


def test_a_run_is_told_with_its_pressures_margin_and_what_its_figures_assume() -> None:
    """Beside the static margin stands the zero-moment point's; a replay has none to tell."""
    told = {"margin": {"minimum": 0.071}, "zmp_margin": {"minimum": 0.059}}
    lines = summary_lines(told)
    assert lines[:2] == [
        ("smallest margin measured", "0.071 m"),
        ("the same of the zero-moment point", "0.059 m"),
    ]
    for absent, word in (({"zmp_margin": {"minimum": None}}, "zero-moment"), ({}, "nosing")):
        assert word not in str(summary_lines(absent))


def test_the_margin_planned_is_of_what_was_walked() -> None:
    """Where a run ended before its goal, the line says so: the rest of the plan has its own."""
    for outcome, more in (("goal_reached", ""), ("fallen", ", of what was walked")):
        told = {"outcome": outcome, "margin_planned": {"minimum": 0.191}}
        assert ("smallest margin planned" + more, "0.191 m") in summary_lines(told)


def test_a_replay_is_told_without_what_it_does_not_measure() -> None:
    """No slip, no tolerances kept, no friction: it is where its plan has it, without forces."""
    told = {
        "simulation": "kinematic",
        "margin": {"minimum": 0.071},
        "base_error_max": 0.0,
        "slip_max": 0.0,
        "tracking": {"left": [], "share": 0.0},
        "contact_friction": None,
        "torque_ratio_max": None,
        "torque_ratio_planned_max": 0.5,
        "nonfoot_contact_samples": 0,
        "simulated_time": 3.0,
    }
    lines = summary_lines(told)
    assert [label for label, _ in lines] == [
        "smallest margin replayed", "contacts of anything but feet",
        "largest torque planned, of its limit", "simulated",
    ]  # fmt: skip
    run = str(summary_lines(told | {"simulation": "physics"}))
    for word in ("slipped", "off its plan", "kept, 0.00 used", "friction"):
        assert word in run and word not in str(lines)


def test_what_figures_assume_is_printed_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """True state or an estimate, by the scenario; perfect contact flags and map with either."""
    console = Console(width=200, record=True, file=io.StringIO())
    monkeypatch.setattr(cli_print, "Console", lambda: console)
    told = [
        assumptions_of(load_scenario(name)) for name in ("case_study", "estimated_state", "paper")
    ]
    assert "true state" in told[0] and "estimates its state" in told[1]
    assert all("contact flags without error" in text for text in told[:2])
    assert "nothing was measured" in told[2]
    assert all("an exact map" in text for text in told[:2])
    for name, more in (
        ("case_study", ["world.tread_error=0.001"]),
        ("case_study", ["world.position_error=-0.01", "world.random=true"]),
        ("unmapped", []),  # its map is made of what it sees
    ):
        assert "exact map" not in assumptions_of(load_scenario(name, more))
    assert "an exact map" in assumptions_of(load_scenario("case_study", ["world.random=true"]))
    cli_print.print_summary({"assumes": told[0]}, Path("run"), report=False)
    assert f"these figures assume {told[0]}" in console.export_text()
