"""A passport: what it says of a flight is what `check` says, and its files can be used."""

import json
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from command import drake_quad, refused
from rich.console import Console
from rig import URL

import drake_quad as dq
from drake_quad.cli.passport import print_passport
from drake_quad.feasibility.passport import (
    BuiltOtherwise,
    Entry,
    Passport,
    Question,
    plan_passport,
)
from drake_quad.feasibility.passport_page import passport_cells, passport_columns, write_passport
from drake_quad.feasibility.same_gait import check_same_gait
from drake_quad.feasibility.standard_stairs import BUILDS, CHARTED, STANDARDS, Standard
from drake_quad.sweep import passport_trials
from drake_quad.terrain.elements import Stairs

FLIGHTS = (
    Standard("low", 0.12, 0.4, "a rule"),
    Standard("too high", 1.5, 0.3, "a rule"),
    Standard("too shallow", 0.12, 0.01, "a rule"),
)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Passport, Path]:
    """A passport of three flights, and its directory."""
    directory = tmp_path_factory.mktemp("passport")
    found = plan_passport(Question(URL, FLIGHTS, count=4, directory=directory))
    write_passport(found, directory)
    return found, directory


def test_an_entry_says_what_check_says(made: tuple[Passport, Path]) -> None:
    """Margin and speed of a yes are those of the same question asked alone; a no has its reason."""
    passport, _ = made
    low, high, shallow = passport.entries
    check = dq.check_stairs(URL, Stairs(0.12, 0.4, 4), prefer="margin")
    assert check.designed is not None
    assert (low.verdict, low.margin, low.speed) == ("yes", check.designed.margin, check.speed)
    assert high.verdict == "no" and high.margin is None and high.reason and high.limit
    assert shallow.verdict == "unknown" and "run 0.01 m" in shallow.reason
    assert passport.complete and passport.leg > 0.5 and passport.mass == pytest.approx(60.0, abs=5)


def test_the_files_of_a_passport_can_be_used(made: tuple[Passport, Path]) -> None:
    """The scenario of a yes loads; JSON and page hold every flight; the picture is there."""
    passport, directory = made
    scenario = dq.load_scenario(directory / passport.entries[0].scenario)
    assert scenario.course[1].rise == 0.12
    told = json.loads((directory / "passport.json").read_text())
    assert told == passport.as_dict()
    page = (directory / "passport.md").read_text()
    for entry in passport.entries:
        assert "| " + " | ".join(passport_cells(entry, tried=False)) + " |" in page
    for name in ("passport.svg", "passport.png"):
        assert (directory / name).stat().st_size > 1000
    assert "too high" in passport._repr_html_()


def test_a_yes_below_the_wanted_margin_says_so() -> None:
    """It is no plain yes, on the page and on the console."""
    entry = Entry(FLIGHTS[0], "yes", margin=0.012, wanted=0.03, speed=0.05)
    assert passport_cells(entry, tried=False)[2] == "yes, below the 30 mm wanted"


def copy_scenario(made: tuple[Passport, Path], to: Path) -> Passport:
    """The passport, whose one scenario is in another directory, too."""
    scenario = made[0].entries[0].scenario
    (to / scenario).write_bytes((made[1] / scenario).read_bytes())
    return made[0]


def test_the_trials_are_a_study_of_the_flights_own_scenario(
    made: tuple[Passport, Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Each yes gets a study that can be loaded, so many trials, and its rate on the page."""
    passport, scenario = copy_scenario(made, tmp_path), made[0].entries[0].scenario
    seen: list[Any] = []

    def run(asked: Any, *_: Any) -> dict[str, Any]:
        study = dq.load_study(asked.study)
        assert study.trials == 3 and study.scenario.endswith(scenario)
        seen.append(study)
        rate = {"good": 3, "trials": 3, "low": 0.29, "high": 1.0, "text": "100.0 %"}
        figures = {"margin.minimum": {"least": 0.05}, "cost_of_transport": {"median": 0.4}}
        return {"rate": rate, "figures": figures}

    monkeypatch.setattr(passport_trials, "run_sweep", run)
    tried = dq.try_passport(passport, tmp_path, 3, workers=1, console=Console(quiet=True))
    assert len(seen) == 1 and "cost_of_transport" in seen[0].figures
    assert tried.entries[0].trials is not None and tried.entries[0].trials["margin"] == 0.05
    assert tried.entries[1].trials is None
    page = (tmp_path / "passport.md").read_text()
    assert "| 3 of 3: 100.0 % | 0.40 |" in page and "true state" in page  # what the rate assumes
    assert json.loads((tmp_path / "passport.json").read_text()) == tried.as_dict()
    with pytest.raises(dq.InputError, match="--trials"):
        dq.try_passport(passport, tmp_path, 0)


def test_a_stopped_passport_keeps_what_is_done() -> None:
    """Asked to stop after the first flight, it has that one, and says that it is not complete."""
    counted: list[int] = []
    found = plan_passport(
        Question(URL, FLIGHTS[1:], count=1),
        progress=lambda done, _: counted.append(done),
        stop=lambda: counted[-1] > 0,
    )
    assert len(found.entries) == 1 and not found.complete


def test_the_standards_are_stairs() -> None:
    """From low to steep, each once; those of a chart are among them."""
    slopes = [one.rise / one.run for one in STANDARDS]
    assert slopes == sorted(slopes)
    assert len({(one.rise, one.run) for one in STANDARDS}) == len(STANDARDS)
    assert len(CHARTED) == 4 and set(CHARTED) < set(STANDARDS)


def test_the_command_refuses_what_cannot_be(tmp_path: Path) -> None:
    """In a line before any long work; nothing is written."""
    assert "--trials" in refused(drake_quad("passport", URL, "--trials", "-1", cwd=tmp_path))
    assert "--prefer" in refused(drake_quad("passport", URL, "--prefer", "fast", cwd=tmp_path))
    assert "--count" in refused(drake_quad("passport", URL, "--count", "0", cwd=tmp_path))
    assert not list(tmp_path.iterdir())


def test_the_console_has_every_flight_and_what_is_assumed(made: tuple[Passport, Path]) -> None:
    """With the answers' words, and where the picture is."""
    console = Console(record=True, width=160, file=StringIO())
    print_passport(made[0], made[1], console)
    told = console.export_text()
    for entry in made[0].entries:
        assert entry.stairs.name in told
    assert "no, proven" in told and "closed risers" in told and "passport.png" in told


def test_a_flight_built_otherwise_has_a_plan_of_its_own_course(
    made: tuple[Passport, Path],
) -> None:
    """Its scenario has nosings or open risers; its margin is that of its plan, on the page, too."""
    passport, directory = made
    low, high, shallow = passport.entries
    for other, build in zip(low.others, BUILDS, strict=True):
        assert other.build == build and other.verdict == "yes" and other.same_gait
        scenario = dq.load_scenario(directory / other.scenario)
        stairs = scenario.course[1]
        assert (stairs.overhang, stairs.open) == (build.overhang, build.open or None)
        least = min(p.margin for p in dq.plan(scenario).plan.plans if p.margin == p.margin)
        assert least == pytest.approx(other.margin, abs=1e-4)
    assert passport_cells(low, tried=False)[-1] == "the same" and not (
        high.others or shallow.others
    )
    columns = len(passport_columns(tried=False))
    assert all(len(passport_cells(one, tried=False)) == columns for one in passport.entries)


def test_what_is_built_otherwise_is_told_where_it_differs() -> None:
    """Another margin, another gait or no plan is said; two alike are said once."""
    nosings, no_risers = BUILDS
    entry = Entry(FLIGHTS[0], "yes", margin=0.05, wanted=0.03)

    def cell(*others: BuiltOtherwise) -> str:
        return passport_cells(replace(entry, others=list(others)), tried=False)[-1]

    same = BuiltOtherwise(nosings, "yes", margin=0.0501, same_gait=True)
    other = BuiltOtherwise(no_risers, "yes", margin=0.04, same_gait=False)
    assert cell(same, replace(same, build=no_risers)) == "the same"
    assert cell(same, other) == "the same; 40 mm, another gait"
    assert cell(BuiltOtherwise(nosings, "unknown"), other) == "unknown; 40 mm, another gait"


def test_no_build_is_easier_than_closed_risers() -> None:
    """Treads are solid to a plan: an overhang gives no room, and the gait is as near as before."""
    closed = dq.check_stairs(URL, Stairs(0.2, 0.24, 2), prefer="margin")
    assert closed.designed is not None and closed.stairs is not None
    for build in ({"overhang": 0.12}, {"open": True}):
        same = check_same_gait(closed, replace(closed.stairs, **build))
        assert same is not None and same.designed is not None
        assert same.designed.clearance.weighted == pytest.approx(closed.designed.clearance.weighted)
        assert same.margin == pytest.approx(closed.margin)


def test_a_gait_is_not_taken_for_stairs_that_it_does_not_climb() -> None:
    """On steps six times as high the gait for low ones has no plan."""
    low = dq.check_stairs(URL, Stairs(0.08, 0.3, 2), thorough=False)
    assert low.feasible and low.stairs is not None
    assert check_same_gait(low, replace(low.stairs, rise=0.5)) is None


def test_an_interrupted_passport_replaces_none_that_is_whole(
    made: tuple[Passport, Path], tmp_path: Path
) -> None:
    """What was there stays, to the byte; where nothing was, what is done is kept."""
    passport, _ = made
    write_passport(passport, tmp_path)
    before = (tmp_path / "passport.json").read_bytes()
    found = dq.make_passport(URL, tmp_path, count=1, workers=1, stop=lambda: True)
    assert not found.complete and (tmp_path / "passport.json").read_bytes() == before
    dq.make_passport(URL, tmp_path / "new", count=1, workers=1, stop=lambda: True)
    assert not json.loads((tmp_path / "new" / "passport.json").read_text())["complete"]


def test_trials_go_on_where_they_were_and_each_flight_is_kept(
    made: tuple[Passport, Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A journal that is there is gone on with; a flight without a trial has no rate."""
    passport = copy_scenario(made, tmp_path)
    seen: list[bool] = []

    def run(asked: Any, *_: Any) -> dict[str, Any]:
        seen.append(asked.resume)
        asked.out.mkdir(exist_ok=True)
        (asked.out / "journal.jsonl").touch()
        rate = {
            "good": len(seen) - 1,
            "trials": len(seen) - 1,
            "low": 0.0,
            "high": 1.0,
            "text": "-",
        }
        return {"rate": rate, "figures": {}}

    monkeypatch.setattr(passport_trials, "run_sweep", run)
    console = Console(quiet=True)
    first = dq.try_passport(passport, tmp_path, 2, workers=1, console=console)
    assert first.entries[0].trials is None and not first.drawn
    second = dq.try_passport(passport, tmp_path, 2, workers=1, console=console)
    assert seen == [False, True] and second.entries[0].trials is not None


@pytest.mark.parametrize(
    "stairs",
    [
        {"rise": "0.1"}, {"rise": None}, {"rise": 10**400}, {"run": "0.3"}, {"count": 2.5},
        {"count": "3"}, {"count": True}, {"overhang": float("nan")}, {"open": "no"},
        {"rise": 0.03, "open": True}, {"rise": 0.04, "overhang": 0.02},
    ],
)  # fmt: skip
def test_stairs_that_are_none_are_refused_in_a_line(stairs: dict[str, Any]) -> None:
    """Of whatever type a value is: the field is named, by `check_stairs` as by `check`."""
    flight = Stairs(**{"rise": 0.1, "run": 0.3, "count": 2} | stairs)
    with pytest.raises(dq.InputError, match=rf"--{next(iter(stairs))}:"):
        dq.check_stairs(URL, flight)


@pytest.mark.parametrize("margin", ["HULL", "nonsense", None])
def test_a_margin_that_is_none_is_refused(margin: Any) -> None:
    """A typing error is no answer about another margin."""
    with pytest.raises(dq.InputError, match="--margin"):
        dq.check_stairs(URL, Stairs(0.1, 0.3, 2), margin=margin)
    with pytest.raises(dq.InputError, match="--margin"):
        dq.check_course(URL, "flat_walk", margin=margin)


@pytest.mark.parametrize("trials", [0, 2.5, True, "29", None])
def test_so_many_trials_are_none(trials: Any) -> None:
    """Neither halves nor words."""
    with pytest.raises(dq.InputError, match="--trials"):
        dq.check_trials(trials)
