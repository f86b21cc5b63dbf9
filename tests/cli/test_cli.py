"""The command line: exit statuses, one-line errors, JSON, and files after Ctrl-C."""

import json
import os
import re
import select
import signal
import subprocess
import time
from contextlib import suppress
from importlib import resources
from pathlib import Path

import pyarrow.parquet as pq
import pytest
import typer
from command import COMMAND, drake_quad, refused

import drake_quad as dq
from drake_quad.cli import main as cli
from drake_quad.cli.main import app
from drake_quad.cli.runs import print_plan
from drake_quad.runs.read_summary import read_summary
from drake_quad.runs.reader import load_run

FLOOR = "{kind: floor, length: 4.0}"
UP = "{kind: stairs, going: up, rise: 0.13, run: 0.5, count: 6}"

BAD_SCENARIOS = [
    (f"course: [{FLOOR}]\ngait: {{dutty_factor: 0.8}}\n", "gait.dutty_factor", "duty_factor"),
    (f"course: [{FLOOR}]\nrobot: {{model: nowhere.urdf}}\n", "robot.model", "nowhere.urdf"),
    (f"course: [{FLOOR}, {UP.replace('0.13', '0.6')}, {FLOOR}]\n", "course[1].rise", "0.6"),
    (f"course: [{FLOOR}, {UP.replace('0.5,', '0.02,')}, {FLOOR}]\n", "course[1].run", "0.02"),
    (f"course: [{FLOOR}]\ngait: {{duty_factor: 0.6}}\n", "gait.duty_factor", "0.6"),
    (
        f"course: [{FLOOR}, {{kind: landing, length: 0.8, turn_deg: 90}}, {FLOOR}]\n",
        "course[1].length",
        "0.8",
    ),
    (
        f"course: [{FLOOR}, {UP.replace('count: 6', 'count: -6')}, {FLOOR}]\n",
        "course[1].count",
        "-6",
    ),
    (f"course: [{FLOOR}, {UP.replace('0.13', '-0.13')}, {FLOOR}]\n", "course[1].rise", "-0.13"),
    ("", "", "empty"),
    ("course: [\n", "", "line"),
]


@pytest.mark.parametrize(("text", "field", "also"), BAD_SCENARIOS)
def test_a_bad_scenario_gets_one_line(tmp_path: Path, text: str, field: str, also: str) -> None:
    """File, field, value and remedy in one line, exit status 2, nothing simulated."""
    (tmp_path / "mine.yaml").write_text(text)
    line = refused(drake_quad("plan", "mine.yaml", cwd=tmp_path))
    assert "mine.yaml" in line and field in line and also in line


def test_a_directory_is_not_a_scenario(tmp_path: Path) -> None:
    """A directory given as the scenario is refused by name."""
    assert "directory" in refused(drake_quad("run", str(tmp_path), cwd=tmp_path))


def test_an_unwritable_directory_is_refused_before_the_run(tmp_path: Path) -> None:
    """--out that cannot be made is refused at once, and names the option."""
    (tmp_path / "file").write_text("")
    began = time.monotonic()
    line = refused(drake_quad("run", "flat_walk", "--out", "file/run", cwd=tmp_path))
    assert "--out" in line and "file/run" in line
    assert time.monotonic() - began < 20.0


def test_a_run_that_is_not_there_has_no_report(tmp_path: Path) -> None:
    """`report` and `replay` of a directory without a run say what to give."""
    for command in ("report", "replay"):
        line = refused(drake_quad(command, "nowhere", cwd=tmp_path))
        assert "summary.json" in line and "no such directory" in line
        assert ("`drake-quad sweep`" in line) == (command == "report")


def test_plan_prints_one_json_object(tmp_path: Path) -> None:
    """`plan --json` has the documented keys, and a transition its steps' legs and margins."""
    done = drake_quad("plan", "flat_walk", "--json", cwd=tmp_path)
    assert done.returncode == 0
    plan = json.loads(done.stdout)
    assert plan["feasible"] and plan["planned_margin_min"] > 0.05 and plan["duration"] > 20.0
    transition = next(s for s in plan["segments"] if s["kind"] == "transition")
    assert {step["leg"] for step in transition["steps"]} <= {1, 2, 3, 4}
    assert min(step["margin"] for step in transition["steps"]) >= transition["margin_min"] - 1e-9
    wave = next(s for s in plan["segments"] if s["kind"] == "wave")
    assert wave["stroke"] == pytest.approx(wave["stride"] * wave["duty_factor"])


def test_plan_says_which_files_it_wrote(tmp_path: Path) -> None:
    """The plan and its certificate, in the directory of --out; without it nothing is written."""
    done = drake_quad("plan", "flat_walk", "--out", "mine", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stdout.rstrip().endswith("plan.json and certificate.json in mine")
    assert sorted(f.name for f in (tmp_path / "mine").iterdir()) == [
        "certificate.json",
        "plan.json",
    ]
    # A plan that is not certified has no certificate.
    more = ("--set", "certify.margin=0.5")
    done = drake_quad("plan", "flat_walk", *more, "--out", "mine", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.rstrip().endswith("\nplan.json in mine")


def test_a_plan_says_that_its_margin_is_little(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Less than a run has to have to count as safe is told beside it; enough is not."""
    found = dq.report_plan(dq.load_scenario("flat_walk"))
    safe = found["safe_margin"]
    words = f"less than the {safe:.3f} m of a run that counts as safe"
    print_plan(found)
    assert words not in capsys.readouterr().out
    print_plan({**found, "planned_margin_min": safe - 0.005})
    assert words in " ".join(capsys.readouterr().out.split())


def test_plan_tells_what_may_be_wrong_in_the_robots_file(tmp_path: Path) -> None:
    """A thigh without mass: the line that `inspect` has for it, on the console and as JSON."""
    text = (resources.files("drake_quad_models") / "paper_quadruped.urdf").read_text()
    light = re.sub(r'(<link name="FL_thigh">).*?</inertial>', r"\1", text, flags=re.DOTALL)
    assert light != text
    (tmp_path / "light.urdf").write_text(light)
    given = ("plan", "flat_walk", "--set", "robot.model=light.urdf")
    done = drake_quad(*given, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(drake_quad(*given, "--json", cwd=tmp_path).stdout)["doubts"]
    assert any("FL_thigh" in line for line in told)
    for line in told:
        assert f"doubtful in the robot's file: {line}" in done.stdout


def test_an_infeasible_plan_exits_with_1(tmp_path: Path) -> None:
    """With no time on four feet the margin cannot stay positive: status 1, with the reason."""
    done = drake_quad("plan", "flat_walk", "--json", "--set", "gait.duty_factor=0.75", cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    plan = json.loads(done.stdout)
    assert not plan["feasible"] and "margin" in plan["reason"]


def test_scenarios_lists_what_is_shipped(tmp_path: Path) -> None:
    """A line each, and the same as JSON."""
    names = [s["name"] for s in json.loads(
        drake_quad("scenarios", "--json", cwd=tmp_path).stdout)["scenarios"]]  # fmt: skip
    assert {"case_study", "paper", "flat_walk", "spin_both_ways", "descend"} <= set(names)
    assert len(drake_quad("scenarios", cwd=tmp_path).stdout.splitlines()) == len(names)


def test_every_command_has_help(tmp_path: Path) -> None:
    """--help of each command explains it and exits with 0."""
    for command in ("run", "plan", "report", "replay", "scenarios"):
        done = drake_quad(command, "--help", cwd=tmp_path)
        assert done.returncode == 0 and "Usage" in done.stdout


def test_help_is_shown_as_it_is_written() -> None:
    """Square brackets in texts are escaped, or they would be taken for markup and left out."""
    commands = typer.main.get_group(app).commands
    assert {"run", "check", "chart", "sweep"} <= set(commands)
    for name, command in commands.items():
        texts = [command.help or "", *(getattr(p, "help", None) or "" for p in command.params)]
        assert not [text for text in texts if re.search(r"(?<!\\)\[", text)], name


def test_ctrl_c_keeps_what_was_logged(tmp_path: Path) -> None:
    """Interrupted once its bar has got on: ends promptly, status 1, all five files whole."""
    ours, terminal = os.openpty()
    process = subprocess.Popen(
        [*COMMAND, "run", "flat_walk", "--out", "run"],
        cwd=tmp_path,
        stderr=terminal,
        stdout=terminal,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    )
    os.close(terminal)
    told, interrupted, until = b"", None, time.monotonic() + 90.0
    # A terminal tells by an error that nobody writes to it any more.
    with suppress(OSError):
        while select.select([ours], [], [], max(until - time.monotonic(), 0.0))[0]:
            told += os.read(ours, 4096)
            if interrupted is None and re.search(rb" [1-9]\d* of \d+ s", told):
                process.send_signal(signal.SIGINT)
                interrupted = time.monotonic()
                until = interrupted + 30.0
    os.close(ours)
    process.kill()  # does nothing to one that has ended
    assert process.wait(timeout=60) == 1, told
    assert interrupted is not None and time.monotonic() < until
    assert b"stopping; writing what was logged" in told
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["outcome"], summary["reason"]) == ("stopped", "interrupted")
    log = pq.read_table(tmp_path / "run" / "log.parquet")
    assert log.num_rows == summary["samples"] > 10
    assert log["t"].to_numpy()[-1] == pytest.approx(summary["simulated_time"], abs=0.02)
    for name in ("scenario.yaml", "report.html", "scene.lcmlog"):
        assert (tmp_path / "run" / name).stat().st_size > 0
    # What a run writes is what `report` and `replay` read.
    assert read_summary(tmp_path / "run") == summary
    read = load_run(tmp_path / "run")
    assert len(read.log) == log.num_rows and not read.notices


def test_systems_error_without_a_file_names_the_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not every error of the system says which file it is about; then the command is told."""

    def fail(**_: object) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(cli, "app", fail)
    monkeypatch.setattr("sys.argv", ["drake-quad", "inspect", "some.urdf"])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    assert caught.value.code == 2
    line = "drake-quad: in `drake-quad inspect some.urdf`: Input/output error\n"
    assert capsys.readouterr().err == line
