"""An answer of `check` is remembered with all that it depends on, and is given again unchanged."""

import errno
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from design_rig import COUNT, RISE, RUN, found
from rig import URL
from typer.testing import CliRunner

from drake_quad.cli.main import app
from drake_quad.feasibility import answers, work_out
from drake_quad.feasibility.answers import MOST_ANSWERS, answer_key, recall, remember
from drake_quad.feasibility.check_request import CheckRequest, run_check
from drake_quad.scenario.load import scenario_text
from drake_quad.util.files import CACHE_VARIABLE

ASKED = CheckRequest(URL, rise=RISE, run=RUN, count=COUNT)


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache directory for one test."""
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache" / "answers"


@pytest.fixture
def designs(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Designs are told of here; what they find was found before."""
    made: list[str] = []

    def design(model: str, *_: Any, **__: Any) -> Any:
        made.append(model)
        return found()

    monkeypatch.setattr(work_out, "check_flight", design)
    return made


def test_the_same_question_has_the_same_answer_without_a_design(
    designs: list[str], tmp_path: Path
) -> None:
    """Word for word, and its scenario to the byte; the answer says when it was found."""
    told: list[dict[str, Any]] = []
    first = run_check(ASKED, remembered=True, save=tmp_path / "a.yaml", first=told.append)
    again = run_check(ASKED, remembered=True, save=tmp_path / "b.yaml", first=told.append)
    assert designs == [URL] and first["remembered"] is None and again["remembered"]
    assert (tmp_path / "a.yaml").read_bytes() == (tmp_path / "b.yaml").read_bytes()
    unlike = ("remembered", "saved")
    plain = [
        json.loads(json.dumps({k: v for k, v in report.items() if k not in unlike}))
        for report in (first, again, *told)
    ]
    assert all(report == plain[0] for report in plain)
    run_check(ASKED)  # nobody asked for it
    run_check(replace(ASKED, turn=-90.0), remembered=True)
    run_check(ASKED, remembered=True, picture=tmp_path / "a.svg")  # which is of the plan itself
    assert designs == [URL] * 4


def test_an_answer_that_was_stopped_is_not_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next who asks may have more time."""
    stopped = replace(found(), stopped=True)
    monkeypatch.setattr(work_out, "check_flight", lambda *_, **__: stopped)
    assert run_check(ASKED, remembered=True)["stopped"]
    monkeypatch.setattr(work_out, "check_flight", lambda *_, **__: found())
    again = run_check(ASKED, remembered=True)
    assert not again["stopped"] and again["remembered"] is None


def test_a_remembered_answer_is_given_without_drake(designs: list[str]) -> None:
    """To load Drake, and what designs a gait, takes a second: an answer needs a third of one."""
    run_check(ASKED, remembered=True)
    heavy = ("pydrake", "numba", "scipy", "piqp", "matplotlib")
    program = (
        "import sys\n"
        "from drake_quad.cli.main import main\n"
        "try:\n"
        "    main()\n"
        "finally:\n"
        f"    print([name for name in {heavy} if name in sys.modules])\n"
    )
    asked = ["--rise", str(RISE), "--run", str(RUN), "--count", str(COUNT)]
    command = [sys.executable, "-c", program, "check", URL, *asked]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert "remembered; --anew" in ended.stdout and ended.stdout.endswith("\n[]\n")


def test_what_an_answer_depends_on_is_part_of_its_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The question, the robot's file by its contents and its place, the sources, the versions."""
    robot = tmp_path / "robot.urdf"
    robot.write_text("<robot name='a'/>")
    question = {"rise": 0.1}
    keys = [answer_key(question, str(robot)), answer_key({"rise": 0.2}, str(robot))]
    robot.write_text("<robot name='b'/>")
    keys.append(answer_key(question, str(robot)))
    (tmp_path / "other.urdf").write_text("<robot name='b'/>")
    keys.append(answer_key(question, str(tmp_path / "other.urdf")))
    for name in ("digest_of_sources", "versions"):
        monkeypatch.setattr(answers, name, lambda: "other")
        keys.append(answer_key(question, str(robot)))
    assert len(set(keys)) == len(keys)
    assert answer_key(question, str(robot)) == keys[-1]


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "null", '{"key": "k"}', '{"key": "other", "when": "", "report": {}}']
)
def test_a_damaged_answer_is_none(text: str, own_cache: Path) -> None:
    """The question is then answered anew, and the file is replaced."""
    own_cache.mkdir(parents=True, mode=0o700)
    (own_cache / "k.json").write_text(text)
    assert recall("k") is None
    remember("k", {"feasible": True}, "gait: {}")
    again = recall("k")
    assert again is not None and again.report == {"feasible": True} and again.scenario == "gait: {}"


def test_nothing_is_remembered_where_others_may_write(own_cache: Path) -> None:
    """An answer that somebody else put there would be taken for ours."""
    own_cache.mkdir(parents=True)
    own_cache.chmod(0o777)
    remember("k", {}, "")
    assert recall("k") is None and not list(own_cache.iterdir())


def test_a_full_disk_costs_no_answer(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The answer is given all the same, and half a file is not left."""

    def full(_: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("drake_quad.util.files.os.fsync", full)
    remember("k", {}, "")
    assert recall("k") is None and not list(own_cache.iterdir())


def test_the_oldest_answers_go(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the directory does not grow without end."""
    monkeypatch.setattr(answers, "MOST_ANSWERS", 3)
    for k in range(5):
        remember(f"{k}", {}, "")
        (own_cache / f"{k}.json").touch()
    assert MOST_ANSWERS > 3 and {path.stem for path in own_cache.iterdir()} == {"2", "3", "4"}


def test_the_command_says_that_it_remembers(designs: list[str], tmp_path: Path) -> None:
    """One line; with --anew the gait is designed anew."""
    words = ["check", URL, "--rise", str(RISE), "--run", str(RUN), "--count", str(COUNT)]
    said = [
        CliRunner().invoke(app, [*words, *more])
        for more in ([], ["--save", str(tmp_path / "s.yaml")], ["--anew"])
    ]
    assert [s.exit_code for s in said] == [0, 0, 0] and len(designs) == 2
    assert ["--anew" in s.stdout for s in said] == [False, True, False]
    assert said[0].stdout.splitlines()[0] == said[1].stdout.splitlines()[0]
    scenario = found().designed
    assert scenario is not None
    assert (tmp_path / "s.yaml").read_text() == scenario_text(scenario.scenario)
