"""A reader that goes away, such as `head`, ends neither a command's work nor its status."""

import os
import subprocess
import sys
from multiprocessing import Pipe
from pathlib import Path

import pytest
import sweep_rig as rig
from command import COMMAND, LONGEST

from drake_quad.sweep.executors import serve
from drake_quad.sweep.trials import Trial


def unread(*words: str, cwd: Path, both: bool = False) -> tuple[int, str]:
    """Exit status and stderr of a command whose output is a pipe that nobody reads any more."""
    reads, writes = os.pipe()
    os.close(reads)
    done = subprocess.run(
        words, cwd=cwd, stdout=writes, stderr=writes if both else subprocess.PIPE, text=True,
        timeout=LONGEST, check=False,
    )  # fmt: skip
    os.close(writes)
    return done.returncode, done.stderr or ""


@pytest.mark.parametrize("json", [[], ["--json"]])
def test_a_comparison_ends_as_if_it_were_read(tmp_path: Path, json: list[str]) -> None:
    """With the status of its verdict, and without a word: 0 if nothing is worse."""
    rig.sweep_made_up(tmp_path, tmp_path / "one")
    assert unread(*COMMAND, "compare", "one", "one", *json, cwd=tmp_path) == (0, "")


def test_a_refusal_that_nobody_reads_has_its_status(tmp_path: Path) -> None:
    """Also where messages go into the same pipe."""
    assert unread(*COMMAND, "plan", "nobody", cwd=tmp_path, both=True)[0] == 2


@pytest.mark.parametrize("both", [False, True])
def test_a_check_saves_its_file_although_nobody_reads(tmp_path: Path, both: bool) -> None:
    """As with `check ... --save f | head`: here of a check that prints at once and then writes."""
    script = tmp_path / "check.py"
    script.write_text(
        "import sys\n"
        "from pathlib import Path\n"
        "from drake_quad.cli import main as cli, robots\n"
        "from drake_quad.feasibility import check_request\n"
        "def ask(asked, *, save, first, **_):\n"
        "    first({})\n"
        "    save.write_text('saved')\n"
        "    return {'feasible': True}\n"
        "check_request.run_check = ask\n"
        "robots.print_check = lambda _, console: console.print('long ' * 100_000)\n"
        "robots.print_next = lambda _, console: console.print('next')\n"
        "sys.argv = ['drake-quad', 'check', 'go2', '--save', 'f.yaml']\n"
        "cli.main()\n"
    )
    status, told = unread(sys.executable, "check.py", cwd=tmp_path, both=both)
    assert (status, told) == (0, "") and (tmp_path / "f.yaml").read_text() == "saved"


@pytest.mark.parametrize("given", [0, 1])
def test_a_process_whose_sweep_has_ended_ends_without_a_word(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: int
) -> None:
    """Whether it waits for a trial or has one: nobody is there to be told of a closed pipe."""
    monkeypatch.setattr("drake_quad.sweep.executors.begin_process", lambda: None)
    monkeypatch.setattr("drake_quad.sweep.executors.signal.signal", lambda *_: None)
    done: list[Trial] = []
    monkeypatch.setattr("drake_quad.sweep.executors.guarded", lambda _, trial: done.append(trial))
    near, far = Pipe()
    for trial in rig.trials_of(tmp_path)[:given]:
        near.send((rig.made_up, trial))
    near.close()
    serve(far)
    assert len(done) <= given
