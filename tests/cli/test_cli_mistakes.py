"""What newcomers give by mistake: inputs are never overwritten, and each line says what it was."""

import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from command import drake_quad, refused
from rich.console import Console
from rich.progress import TextColumn
from rich.table import Table
from rig import URL

from drake_quad.util.display import folded
from drake_quad.util.progress import LateProgress

pytestmark = pytest.mark.usefixtures("own_cache")

ROBOT = Path(__file__).parents[2] / "models" / URL.rpartition("/")[2]
FLAT = "course: [{kind: floor, length: 3.0}]\nmission: [{kind: stand, duration: 0.3}]\n"
CHECK = ("--rise", "0.1", "--run", "0.4", "--count", "1", "--prefer", "margin")


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A directory with a robot, a scenario, a study and a text of somebody's own."""
    shutil.copy(ROBOT, tmp_path / "me.urdf")
    (tmp_path / "me.robot.yaml").write_text("model: me.urdf\n", encoding="utf-8")
    (tmp_path / "scenario.yaml").write_text(f"# by hand\n{FLAT}", encoding="utf-8")
    (tmp_path / "study.yaml").write_text("scenario: scenario.yaml\ntrials: 2\n", encoding="utf-8")
    (tmp_path / "notes.txt").write_text("notes\n", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "option", "file"),
    [
        (("check", "me.urdf", *CHECK), "--save", "me.urdf"),
        (("check", "me.robot.yaml", *CHECK), "--save", "me.robot.yaml"),
        (("check", "me.robot.yaml", *CHECK), "--save", "me.urdf"),
        (("check", URL, "--scenario", "scenario.yaml"), "--save", "scenario.yaml"),
        (("check", "me.urdf", *CHECK), "--proof", "notes.txt"),
        (("sweep", "study.yaml"), "--page", "study.yaml"),
        (("sweep", "study.yaml"), "--page", "notes.txt"),
        (("run", "scenario.yaml"), "--out", "."),
        (("control", "scenario.yaml", "--dry-run"), "--record", "scenario.yaml"),
    ],
)
def test_no_command_overwrites_what_it_reads(
    words: tuple[str, ...], option: str, file: str, place: Path
) -> None:
    """Nor another file that it would not have written: status 2, and all is as it was."""
    before = {path: path.read_bytes() for path in place.iterdir()}
    line = refused(drake_quad(*words, option, file, cwd=place))
    assert line.startswith(f"drake-quad: {option}: ") and "give another" in line
    assert {path: path.read_bytes() for path in place.iterdir()} == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("run", "me.urdf"), "is a robot; ask about it by `drake-quad check me.urdf`"),
        (("run", "me.robot.yaml"), "is a robot; ask about it by `drake-quad check me.robot.yaml`"),
        (("plan", "spot"), "is a robot; ask about it by `drake-quad check spot`"),
        (("check", "scenario.yaml"), "this is a scenario; give a robot"),
        (("check", URL, "--rise", "15cm"), "--rise: rise = '15cm': must be a number with a"),
        (("check", URL, "--rise=0,15"), "--rise: rise = '0,15': must be a number with a decimal"),
        (("see", "no.png", "--intrinsics", "d435", "--tilt", "30"), "no.png: file = 'no.png'"),
        (("check", URL, "--count", "2.5"), "--count: count = '2.5': must be a whole number"),
    ],
)
def test_what_was_mistaken_for_something_else_is_named(
    words: tuple[str, ...], said: str, place: Path
) -> None:
    """A robot for a scenario, a scenario for a robot, a text for a number: and what would do."""
    assert said in refused(drake_quad(*words, cwd=place))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("scenario: nope.yaml", "study.yaml: scenario = 'nope.yaml': "),
        ("set: [gait.dutyfactor=0.4]\nscenario: scenario.yaml", "study.yaml: set[0] = "),
        ("set: [gait.pitch=slope, gait.stride=x]\nscenario: scenario.yaml", "yaml: set[1] = "),
        ("scenario: scenario.yaml\nvary: [{path: gait.stride, values: [x]}]", "vary[0]"),
    ],
)  # fmt: skip
def test_an_error_of_a_studys_scenario_names_the_studys_field(
    text: str, said: str, place: Path
) -> None:
    """Where in the study's file the person has to look, and what the scenario says of it."""
    (place / "study.yaml").write_text(f"{text}\ntrials: 2\n", encoding="utf-8")
    assert said in refused(drake_quad("sweep", "study.yaml", cwd=place))


def test_a_run_that_logs_nothing_ends_without_a_traceback(place: Path) -> None:
    """Its files are there, with empty figures."""
    words = ("--set", "simulation.log_period=1", "--out", "runs/a", "--no-report")
    done = drake_quad("run", "scenario.yaml", *words, cwd=place)
    assert "Traceback" not in done.stderr and "stand" not in done.stderr, done.stderr
    assert done.returncode == 1 and done.stdout.startswith("stopped: "), done.stdout
    assert (place / "runs" / "a" / "summary.json").is_file()


def test_a_robot_that_has_changed_since_its_run_is_told(place: Path) -> None:
    """A report or a table of the run would be of another robot."""
    model = ("--set", "robot.model=me.urdf", "--set", "design=given")
    done = drake_quad("run", "scenario.yaml", *model, "--out", "a", "--no-report", cwd=place)
    assert done.returncode == 0, done.stderr
    assert "has changed" not in drake_quad("export", "a", cwd=place).stderr
    text = (place / "me.urdf").read_text(encoding="utf-8")
    (place / "me.urdf").write_text(text.replace('effort="300.0"', 'effort="310.0"'), "utf-8")
    assert "me.urdf, has changed since this run" in drake_quad("export", "a", cwd=place).stderr


def test_ctrl_c_while_the_command_loads_ends_it_quietly() -> None:
    """By the signal itself, status 130 to shells; a compiled module would make a fault of it."""
    script = (
        "import os, signal, sys\n"
        # A job in a shell's background is born deaf to it.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'drake_quad.cli.main':\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "from drake_quad.__main__ import main\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False)
    assert done.returncode == -signal.SIGINT and done.stderr == b""


def test_figures_and_names_are_not_cut_in_a_narrow_terminal() -> None:
    """They go on in a further line."""
    table = Table("joint", "margin", box=None)
    table.add_row("front_left_leg_hip_roll_joint", "0.1234567890123")
    console = Console(width=24, record=True)
    console.print(folded(table))
    text = console.export_text()
    assert "…" not in text
    for part in ("front_left", "_leg_hip_r", "oll_joint", "0.12345678", "90123"):
        assert part in text


def test_long_work_says_how_far_it_is_without_a_terminal(tmp_path: Path) -> None:
    """A line now and then, and the last state of a bar that stays ends its line."""
    with (tmp_path / "log").open("w", encoding="utf-8") as file:
        console = Console(file=file)
        columns = TextColumn("{task.description}"), TextColumn("{task.completed:.0f} of 3")
        with LateProgress(*columns, console=console, transient=True, every=0.0) as bar:
            task = bar.add_task("simulating", total=3)
            for done in (1, 2, 3):
                bar.update(task, completed=done)
        with LateProgress(*columns, console=console) as bar:
            bar.update(bar.add_task("sweeping", total=3), completed=3)
        console.print("done")
    lines = (tmp_path / "log").read_text(encoding="utf-8").splitlines()
    assert lines[:3] == [f"simulating {k} of 3" for k in (1, 2, 3)]
    assert lines[-1] == "done" and lines[-2].startswith("sweeping 3 of 3")
