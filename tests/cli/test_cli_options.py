"""What a person may mistype on the command line, and Ctrl-C: one line each, before long work."""

import io
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer
import yaml
from command import LONGEST, drake_quad, refused
from design_rig import made_up
from import_rig import write
from rich.console import Console
from rich.status import Status
from rig import URL, paper_robot
from synthetic_robot import Quadruped
from typer.testing import CliRunner

from drake_quad import __version__
from drake_quad.cli import main as cli, robots as cli_robots
from drake_quad.cli.common import claim, claim_apart, claim_file
from drake_quad.errors import InputError
from drake_quad.feasibility import chart as chart_grid, work_out
from drake_quad.feasibility.chart import Span, grid_of
from drake_quad.feasibility.check_request import CheckRequest, run_check
from drake_quad.feasibility.inspect_robot import describe_robot, print_robot
from drake_quad.feasibility.result import Feasibility
from drake_quad.robot.doubts import doubts
from drake_quad.robot.importer.pipeline import MAPPING
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.config import Scenario
from drake_quad.util.parallel import MOST_PER_CORE, check_workers
from drake_quad.util.stopping import Stopping

pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.mark.parametrize(
    ("command", "option", "value"),
    [
        ("check", "--save", "file/x.yaml"),
        ("check", "--save", "/proc/nope/x.yaml"),
        ("check", "--save", f"new/{'x' * 252}"),
        ("check", "--save", f"{'x' * 300}/x.yaml"),
        ("check", "--save", os.devnull),
        ("check", "--picture", "file/x.svg"),
        ("check", "--picture", "folder.svg"),
        ("inspect", "--picture", "file/x.svg"),
        ("inspect", "--picture", "folder.svg"),
    ],
)
def test_a_file_that_cannot_be_written_is_told_before_the_robot_is_read(
    command: str, option: str, value: str, tmp_path: Path
) -> None:
    """One line with option and value, of a robot that is none, so before any work; all stays."""
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder.svg").mkdir()
    line = refused(drake_quad(command, "nobody", option, value, cwd=tmp_path))
    assert line.startswith(f"drake-quad: {option}: {option[2:]} = ") and value[-20:] in line
    assert "--out" not in line
    assert {p.name for p in tmp_path.iterdir()} == {"file", "folder.svg"}
    assert (tmp_path / "file").read_text() == "mine"


def test_a_file_that_can_be_written_is_not_made_nor_changed_by_asking(tmp_path: Path) -> None:
    """Neither it nor its folders; and what was there before is still there."""
    claim_file(None, "--save")
    claim_file(tmp_path / "new" / "deep" / "x.yaml", "--save")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "old.yaml").write_text("mine")
    claim_file(tmp_path / "old.yaml", "--save")
    assert [p.name for p in tmp_path.iterdir()] == ["old.yaml"]
    assert (tmp_path / "old.yaml").read_text() == "mine"


@pytest.mark.parametrize("option", ["save", "picture"])
def test_a_disk_that_fills_while_it_is_designed_loses_no_answer(
    option: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The yes is told before anything is written; the line names the option that asked for it."""
    designed = SimpleNamespace(scenario=Scenario())
    yes: Any = Feasibility(Scenario(), designed, "", {})  # type: ignore[arg-type]
    monkeypatch.setattr(work_out, "check_flight", lambda *_, **__: yes)
    monkeypatch.setattr(work_out, "feasibility_report", lambda *_, **__: {"answer": "Yes"})
    monkeypatch.setattr(
        "drake_quad.feasibility.check_picture.draw_check", lambda *_: SimpleNamespace()
    )
    (tmp_path / "file").write_text("")
    told: list[dict[str, Any]] = []
    path = tmp_path / "file" / "x.svg"
    with pytest.raises(InputError) as caught:
        run_check(CheckRequest(URL), first=told.append, **{option: path})  # type: ignore[arg-type]
    assert [report["answer"] for report in told] == ["Yes"]
    assert caught.value.source == f"--{option}" and f"with --{option}" in caught.value.remedy
    assert "--out" not in str(caught.value)


def test_ctrl_c_while_a_quicker_gait_is_looked_for_gives_the_best_so_far(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The answer is printed, and says so; before there is a gait Ctrl-C interrupts as ever."""
    stopped, status = made_up(feasible=True), SimpleNamespace(told=list[str]())
    before = signal.getsignal(signal.SIGINT)

    def ask(*_: Any, stopping: Stopping, note: Callable[[str], object], **__: Any) -> Feasibility:
        note("planning")
        with stopping() as stop:
            note("looking")
            assert not stop()
            signal.raise_signal(signal.SIGINT)
            return replace(stopped, stopped=stop())

    monkeypatch.setattr(work_out, "check_flight", ask)
    monkeypatch.setattr(Status, "update", lambda _, words: status.told.append(words))
    done = CliRunner().invoke(cli.app, ["check", URL, "--anew"])
    assert done.exit_code == 0 and "the search for a quicker gait had not ended" in done.stdout
    words = [told for told in status.told if told in ("planning", "looking") or "Ctrl-C" in told]
    assert words == ["planning", "looking (Ctrl-C: answer with the best so far)"]
    assert signal.getsignal(signal.SIGINT) is before


def test_inspect_prints_before_it_draws(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A picture that cannot be written after all leaves the tables on the screen."""

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    with pytest.raises(InputError, match=r"--picture: .*No space left.* with --picture"):
        cli_robots.inspect(URL, picture=tmp_path / "robot.svg")
    assert f"{paper_robot().mass:.2f} kg" in capsys.readouterr().out


RUNS = Span(0.25, 0.45, 0.1)


@pytest.mark.parametrize(
    ("rises", "runs", "named"),
    [
        (Span(0.05, 0.25, 1e-310), RUNS, "--rise-step: rise-step = 1e-310: give metres, 0.0001"),
        (Span(0.05, 0.25, 9e-5), RUNS, "--rise-step: rise-step = 9e-05: give metres, 0.0001"),
        (Span(1e-5, 0.25, 0.1), RUNS, "--rise-from: rise-from = 1e-05: give metres, 0.0001 to 2"),
        (Span(9.0, 10.0, 0.1), RUNS, "--rise-from: rise-from = 9.0"),
        (Span(0.1, 1e308, 0.1), RUNS, "--rise-to: rise-to = 1e+308: give metres, 0.0001 to 2"),
        (Span(0.1, 0.2, float("inf")), RUNS, "--rise-step: rise-step = inf"),
        (RUNS, Span(0.2, 5.1, 0.1), "--run-to: run-to = 5.1: give metres, 0.0001 to 5"),
        (Span(0.001, 0.9, 1e-4), Span(0.1, 1.0, 1e-4), "--rise-step: rise-step = 0.0001: 809"),
    ],
)
def test_the_bound_that_fails_is_named(rises: Span, runs: Span, named: str) -> None:
    """Option, value and what would be right, at once: 80 million cells are counted, not made."""
    with pytest.raises(InputError, match=re.escape(named)):
        grid_of(rises, runs, 4)


@pytest.mark.parametrize("first", [0.00015, 0.00025, 0.00035, 0.1, 0.12345])
def test_no_value_is_there_twice(first: float) -> None:
    """Of the finest step that is taken, wherever it begins; each would be planned in full."""
    values = Span(first, first + 0.01, chart_grid.FINEST).values("rise")
    assert len(set(values)) == len(values) >= 99
    assert np.all(np.diff(values) > 0.5 * chart_grid.FINEST)


@pytest.mark.parametrize("workers", [-1, 0, 1000])
def test_workers_are_as_many_as_the_machine_bears(
    workers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Eight a core as for a sweep; the line says how many, and of how many cores."""
    monkeypatch.setattr("os.cpu_count", lambda: 3)
    check_workers(1)
    check_workers(MOST_PER_CORE * 3)
    with pytest.raises(
        InputError, match=f"--workers: workers = {workers}: give 1 to 24 .* 3 cores"
    ):
        check_workers(workers)


def test_a_chart_of_a_thousand_workers_is_refused(tmp_path: Path) -> None:
    """The command has the check, before it reads the robot."""
    line = refused(drake_quad("chart", "nobody", "--workers", "1000000", cwd=tmp_path))
    assert "--workers: workers = 1000000" in line
    assert line.startswith("drake-quad: ") and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["plan", "check"])
def test_ctrl_c_is_told_in_a_line(command: str, tmp_path: Path) -> None:
    """A real process that reads a file slowly is interrupted there: 130, one line, no traceback."""
    path, reads = tmp_path / "slow.yaml", tmp_path / "reads"
    path.write_text("course: [{kind: floor, length: 3.0}]\n")
    asked = ["plan", str(path)] if command == "plan" else ["check", URL, "--scenario", str(path)]
    process = subprocess.Popen(
        # A test that is run in the background may have Ctrl-C ignored, also by its children.
        [sys.executable, "-c", "import signal, sys, time; from pathlib import Path; "
         "from drake_quad.scenario import load as scenario; from drake_quad.cli.main import main; "
         "signal.signal(signal.SIGINT, signal.default_int_handler); "
         "slow = lambda *_, **__: (Path('reads').touch(), time.sleep(600)); "
         "scenario.read_given_text = slow; main()", *asked],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not reads.exists() and process.poll() is None:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=LONGEST)
    assert process.returncode == 130, err
    assert err.strip() == "drake-quad: interrupted" and out == ""


def _raises(error: BaseException) -> Callable[[], None]:
    def command() -> None:
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (KeyboardInterrupt(), 130, "drake-quad: interrupted\n"),
        (typer.Exit(1), 1, ""),
        (typer.Exit(0), 0, ""),
        (typer.Exit(2), 2, ""),
        (InputError(source="f", field="x", value=1, remedy="no"), 2, "drake-quad: f: x = 1: no\n"),
    ],
)
def test_each_end_has_its_status(
    error: BaseException, status: int, line: str,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """Through Typer itself: an interrupt is told, and every other end keeps its status."""
    app = typer.Typer(pretty_exceptions_enable=False)
    app.command()(_raises(error))
    monkeypatch.setattr(cli, "app", app)
    monkeypatch.setattr("sys.argv", ["drake-quad"])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == status and capsys.readouterr().err == line


def test_a_call_that_is_wrong_is_one_line(tmp_path: Path) -> None:
    """An unknown option: status 2, its name and where to look; help: 0; nothing: help, and 2."""
    unknown = drake_quad("plan", "--no-such", cwd=tmp_path)
    assert unknown.returncode == 2 and unknown.stdout == ""
    assert unknown.stderr.count("\n") == 1 and "no such option: --no-such" in unknown.stderr
    assert "plan --help` tells what there is" in unknown.stderr
    command = drake_quad("paln", cwd=tmp_path)
    assert command.returncode == 2 and command.stderr.count("\n") == 1
    assert "no such command 'paln'. Did you mean 'plan'? `" in command.stderr
    shown, bare = drake_quad("--help", cwd=tmp_path), drake_quad(cwd=tmp_path)
    assert shown.returncode == 0 and "Usage" in shown.stdout and shown.stderr == ""
    assert bare.returncode == 2 and "Usage" in bare.stdout and bare.stderr == ""


DEGREES = Quadruped(limits=((-34.0, 46.0), (-69.0, 86.0), (-143.0, -17.0)))


def test_limits_in_degrees_are_quoted(tmp_path: Path) -> None:
    """They count as none, as ever; but the note says what the file has, and why that is not it."""
    robot = load_robot(write(tmp_path, DEGREES.text()))
    np.testing.assert_allclose(robot.q_lower[:3], [-0.8, -2.6, -2.7])
    notes = yaml.safe_load((Path(robot.url).parent / MAPPING).read_text())["notes"]
    told = {note["text"].split(":")[0]: note["text"] for note in notes}
    for joint, ends in (("FL_haa", "-34 to 46"), ("FR_haa", "-46 to 34"), ("RL_hfe", "-69 to 86"),
                        ("RR_kfe", "-143 to -17")):  # fmt: skip
        assert f"limits {ends} rad in the file" in told[joint]
        assert "in degrees? a URDF has radians" in told[joint]
    assert not [text for text in told.values() if "no limits" in text]
    console = Console(width=200, record=True, file=io.StringIO())
    print_robot(describe_robot(robot, source="robot.urdf"), console)
    (line,) = [line for line in console.export_text().splitlines() if "FL  FL_haa" in line]
    assert "-46 to 46*" in line


@pytest.mark.parametrize("most", [1e16, 1e4, 6.2832, 3.1416])
def test_limits_that_say_nothing_are_told_as_none(most: float, tmp_path: Path) -> None:
    """A turn, two, or huge ones: as a file writes that there are no limits."""
    bare = Quadruped(limits=((-most, most), (-most, most), (-most, most)))
    robot = load_robot(write(tmp_path, bare.text()))
    notes = yaml.safe_load((Path(robot.url).parent / MAPPING).read_text())["notes"]
    assert sum(": no limits; " in note["text"] for note in notes) == 12


def test_masses_in_grams_are_doubted(tmp_path: Path) -> None:
    """A robot that its knees cannot hold by far is told so, one of the same in kilograms is not."""

    def thousandfold(found: re.Match[str]) -> str:
        return f'{found[1]}="{1e3 * float(found[2])}"'

    text = re.sub(r'\b(mass value|i[xyz][xyz])="([^"]*)"', thousandfold, Quadruped().text())
    heavy = load_robot(write(tmp_path, text, "heavy.urdf"))
    told = describe_robot(heavy, source="heavy.urdf")
    (line,) = told["doubts"]
    assert "grams" in line and "2.15e+05 N" in line
    console = Console(width=200, record=True, file=io.StringIO())
    print_robot(told, console)
    assert f"doubtful: {line}" in console.export_text()
    for robot in (load_robot(write(tmp_path, Quadruped().text())), paper_robot()):
        assert doubts(robot) == []


def test_the_version_is_told(tmp_path: Path) -> None:
    """In one line, with Drake's and Python's; status 0."""
    done = drake_quad("--version", cwd=tmp_path)
    assert done.returncode == 0 and done.stderr == ""
    assert re.fullmatch(r"drake-quad \S+ \(Drake \S+, Python 3\.\S+\)\n", done.stdout)
    assert f"drake-quad {__version__} (Drake {version('drake')}," in done.stdout


def test_two_options_do_not_write_to_one_place(tmp_path: Path) -> None:
    """The second of them is refused, before any work; two places are two."""
    claim_apart({"--save": tmp_path / "a", "--picture": tmp_path / "b", "--proof": None})
    with pytest.raises(InputError, match=r"--picture: .*is what --save writes"):
        claim_apart({"--save": tmp_path / "a", "--picture": tmp_path / "c" / ".." / "a"})


def test_what_a_command_reads_it_does_not_write_over(tmp_path: Path) -> None:
    """By whatever name: a link to it is the same file."""
    read, link = tmp_path / "depth.png", tmp_path / "link.png"
    read.write_bytes(b"an image")
    link.symlink_to(read)
    for path in (read, link):
        with pytest.raises(InputError, match="is read by this command"):
            claim_file(path, "--picture", reads=[read])
    claim_file(tmp_path / "other.png", "--picture", reads=[read])


def test_a_directory_in_a_files_place_is_told_at_once(tmp_path: Path) -> None:
    """Not after a minute of planning."""
    (tmp_path / "passport.json").mkdir()
    claim(tmp_path)
    with pytest.raises(InputError, match=r"--out: .*passport\.json.*is a directory"):
        claim(tmp_path, files=("passport.json",))
