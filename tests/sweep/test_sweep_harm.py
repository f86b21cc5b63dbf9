"""What befalls a sweep from outside is no finding about a trial, and costs no finding."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import sweep_rig as rig

from drake_quad.errors import InputError
from drake_quad.robot import loader as load_robot
from drake_quad.simulation import run as simulation
from drake_quad.sweep import executors as process_module
from drake_quad.sweep.executors import (
    Interrupted,
    IsolatedWorker,
    NoTrialsHereError,
    Worker,
    run_local,
)
from drake_quad.sweep.journal import DAMAGED, NAME, Journal, read_journal
from drake_quad.sweep.provenance import own_sources, own_versions
from drake_quad.sweep.run import LEAVINGS
from drake_quad.sweep.study import Limits
from drake_quad.sweep.trials import MACHINE, Trial, guarded, work


def test_a_process_that_does_not_begin_is_no_trials_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The sweep ends then, with what is done; nothing is counted as crashed."""
    monkeypatch.setattr(process_module, "serve", rig.no_server)
    done: list[int] = []
    with pytest.raises(NoTrialsHereError, match=r"exit code 5\), 2 times.*--resume"):
        for index, _ in run_local(
            rig.trials_of(tmp_path), workers=1, limits=Limits(retries=1), work=rig.made_up
        ):
            done.append(index)
    assert done == []


def test_a_machine_that_can_do_no_trial_ends_the_sweep(tmp_path: Path) -> None:
    """A full disk there, say: no line of the journal blames the trials for it."""
    carry_on = rig.here(workers=1)
    with pytest.raises(NoTrialsHereError, match=r"trial 2 .*No space left.*--resume"):
        rig.sweep_made_up(tmp_path, tmp_path / "out", carry_out=carry_on, work=rig.full_disk)
    assert set(read_journal(tmp_path / "out")[1]) == {0, 1}


def roomy(trial: Trial) -> Trial:
    """The trial with a bound on memory that this process, with all its tests, is not near."""
    return replace(trial, memory=256.0)


@pytest.mark.parametrize(("code", "outcome"), [(errno.ENOSPC, MACHINE), (errno.ENOMEM, "memory"),
                                               (errno.ENOENT, "refused")])  # fmt: skip
def test_what_a_machine_cannot_import_is_no_fault_of_the_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int, outcome: str
) -> None:
    """Of what the system says no trial is refused, but for what is not there."""

    def fail(_given: object) -> Path:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(load_robot, "import_robot", fail)
    robot = tmp_path / "own.urdf"
    robot.write_text("<robot name='own'/>")
    text = rig.PLUMBING.replace("set:", f"set:\n  - robot.model={robot}\n  - design=given")
    found = guarded(work, roomy(rig.trials_of(tmp_path, text)[0]))
    assert found["outcome"] == outcome, found["reason"]
    assert os.strerror(code) in found["reason"]


def test_a_run_that_a_full_disk_stopped_is_no_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The simulation says so in its reason alone, as where a kernel cannot be kept."""
    trial = roomy(rig.trials_of(tmp_path)[0])
    for said, outcome in (
        ("simulation failed: OSError: [Errno 28] No space left on device: 'kernel'", MACHINE),
        ("the base is 3 m off: No space left on device", "stopped"),
    ):
        stopped = SimpleNamespace(summary={}, outcome="stopped", reason=said)
        monkeypatch.setattr(simulation, "simulate", lambda *_, one=stopped, **__: one)
        assert guarded(work, trial)["outcome"] == outcome


def test_ctrl_c_is_held_off_the_very_first_process(tmp_path: Path) -> None:
    """In an interpreter that has begun none: multiprocessing would let SIGINT through there."""
    code = (
        "from drake_quad.sweep.executors import Worker\n"
        "from pathlib import Path\n"
        "if __name__ == '__main__':\n"
        "    for begun in (Worker(), Worker()):\n"
        "        status = Path(f'/proc/{begun._process.pid}/status').read_text()\n"
        "        print(status.split('SigBlk:')[1].split()[0])\n"
        "        begun.end()\n"
    )
    (tmp_path / "begin.py").write_text(code)
    done = subprocess.run(
        [sys.executable, "begin.py"], cwd=tmp_path, capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])},
    )  # fmt: skip
    masks = [int(mask, 16) for mask in done.stdout.split()]
    assert len(masks) == 2 and all(mask & 1 << (signal.SIGINT - 1) for mask in masks)


def test_ctrl_c_reaches_no_process_that_begins(tmp_path: Path) -> None:
    """It is for the sweep, whose group the process is in from its first moment on."""
    isolated = IsolatedWorker(recycle=10, retries=0, work=rig.made_up)
    isolated._process = begun = Worker()
    pid = begun._process.pid
    assert pid is not None
    for _ in range(5):
        os.kill(pid, signal.SIGINT)
        time.sleep(0.1)
    try:
        assert isolated.run(rig.trials_of(tmp_path)[0])["outcome"] in ("goal_reached", "fell")
    finally:
        isolated.end()


def test_a_process_that_is_ended_with_its_sweep_leaves_no_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A signal to all of the sweep's processes: the trial is given up, whatever may be retried."""
    mark = tmp_path / "mark"
    monkeypatch.setenv("SWEEP_TEST_MARK", str(mark))
    isolated = IsolatedWorker(recycle=10, retries=0, work=rig.killed_once)
    with pytest.raises(Interrupted):
        isolated.run(rig.trials_of(tmp_path)[1], mark.exists)


def test_what_gave_no_result_says_of_what_sources_it_is(tmp_path: Path) -> None:
    """As every other: a machine with another drake_quad fails its trials in its own ways."""
    known = rig.trials_of(tmp_path, wall_time=0.5)
    trials, seen = [known[k] for k in (2, 1, 3)], []  # one that aborts, one that raises, one hangs
    for _, result in run_local(trials, workers=1, limits=Limits(), work=rig.mishap):
        seen.append(result["outcome"])
        assert result["sources"] == own_sources() and result["versions"] == own_versions()
    assert seen == ["crashed", "error", "timeout"]


def test_memory_that_other_trials_took_is_no_trials_fault(tmp_path: Path) -> None:
    """It is tried again in a process of its own: what comes of it depends on no trial before."""
    known = rig.trials_of(tmp_path)
    trials = [known[k] for k in (0, 1, 3)]
    found = dict(run_local(trials, workers=1, limits=Limits(retries=0), work=rig.hungry))
    assert {k for k, result in found.items() if result["outcome"] == "memory"} == {3}
    assert all(result["clock"]["tried"] == 1 for result in found.values())
    for result in found.values():  # all tries, and what processes take to begin
        clock = result["clock"]
        assert clock["held"] > (clock["wall"] or 0.0)


def test_a_process_that_others_wore_out_is_no_trials_fault(tmp_path: Path) -> None:
    """What ends it at a bound of memory is as often an abort or an exit as a MemoryError."""
    known = rig.trials_of(tmp_path)
    trials = [known[k] for k in (0, 2, 3)]
    found = dict(run_local(trials, workers=1, limits=Limits(retries=0), work=rig.frail))
    assert {k for k, result in found.items() if result["outcome"] == "crashed"} == {3}


def test_a_trial_that_had_a_process_once_is_killed_and_the_sweep_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only where no process ever has the trial do processes not begin."""
    isolated = IsolatedWorker(recycle=10, retries=1, work=rig.made_up)
    begun = iter([{"sources": "a", "versions": "b"}, None])

    def ended(*_: Any) -> tuple[None, str]:
        isolated._basis = next(begun)
        return None, "its process was ended (exit code -9)"

    monkeypatch.setattr(isolated, "_try", ended)
    assert isolated.run(rig.trials_of(tmp_path)[0])["outcome"] == "killed"


class Slept:
    """A pipe that says something at one look; the second takes as long as a pause.

    Args:
        look: At which.
    """

    def __init__(self, look: int) -> None:
        self.looks, self.look = 0, look

    def poll(self, seconds: float) -> bool:
        """As a connection's."""
        self.looks += 1
        time.sleep(0.6 if self.looks == 2 else seconds)
        return self.looks == self.look


@pytest.mark.parametrize(
    ("pause", "heard", "look"), [(0.1, True, 4), (0.1, True, 2), (5.0, False, 4)]
)
def test_a_pause_is_no_trials_time(
    monkeypatch: pytest.MonkeyPatch, pause: float, heard: bool, look: int
) -> None:
    """Of a sweep that is stopped and goes on (Ctrl-Z, fg) the time between does not count.

    It is known before what the process says: it may have been ended by its own clock meanwhile.
    """
    monkeypatch.setattr(process_module, "PAUSE", pause)
    waiting = Worker.__new__(Worker)
    waiting._pipe, waiting.paused = Slept(look), False  # type: ignore[assignment]
    assert waiting.wait(0.5, lambda: False) is heard
    assert waiting.paused is heard


@pytest.mark.parametrize("bad", [b"\x00\xff\x00", b"[" * 200_000, b"[1, 2]", b""])
def test_a_spoilt_line_costs_its_own_trial_alone(tmp_path: Path, bad: bytes) -> None:
    """The others stay, it is done again, and what there was is kept beside it."""
    out, again = tmp_path / "out", []
    rig.sweep_made_up(tmp_path, out)
    tables = (out / "trials.parquet").read_bytes()
    lines = (out / NAME).read_bytes().split(b"\n")
    lines[4] = bad
    damaged = b"\n".join(lines)
    (out / NAME).write_bytes(damaged)
    rig.sweep_made_up(
        tmp_path, out, resume=True, note=lambda index, *_: again.append(index)
    )  # fmt: skip
    assert again == [3] and (out / "trials.parquet").read_bytes() == tables
    copy = (out / NAME).with_suffix(DAMAGED)
    assert copy.read_bytes() == damaged
    assert len(read_journal(out)[1]) == 8
    (out / NAME).write_bytes(damaged + b"\n{\n{")
    rig.sweep_made_up(tmp_path, out, resume=True)
    second = (out / NAME).with_suffix(f".2{DAMAGED}")
    assert copy.read_bytes() == damaged and second.read_bytes() == damaged + b"\n{\n{"


def test_a_line_that_is_no_result_is_refused(tmp_path: Path) -> None:
    """A mapping that lacks what every result has was written by something else."""
    out = tmp_path / "out"
    rig.sweep_made_up(tmp_path, out)
    text = (out / NAME).read_text()
    (out / NAME).write_text(text + json.dumps({"index": 9, "outcome": "fell"}) + "\n")
    with pytest.raises(InputError, match="no trials"):
        read_journal(out)


@pytest.mark.parametrize("emptied", [False, True])
@pytest.mark.parametrize("name", LEAVINGS)
def test_tables_without_a_journal_are_not_taken_for_rubbish(
    tmp_path: Path, name: str, emptied: bool
) -> None:
    """Nobody knows what they are of: they stay, with --resume too."""
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_text("of hours")
    if emptied:
        (out / NAME).touch()
    for resume in (False, True):
        with pytest.raises(InputError, match="without its journal"):
            rig.sweep_made_up(tmp_path, out, resume=resume)
    assert (out / name).read_text() == "of hours"


def test_a_journal_that_is_removed_ends_the_sweep(tmp_path: Path) -> None:
    """What would be written to it would be nowhere."""
    out = tmp_path / "out"
    with pytest.raises(InputError, match="removed while the sweep ran"):
        rig.sweep_made_up(tmp_path, out, note=lambda *_: (out / NAME).unlink(missing_ok=True))


def test_journals_of_one_directory_do_not_shut_each_other_out(tmp_path: Path) -> None:
    """Each file is locked for itself, and an error names it and its option."""
    journals = [Journal(tmp_path, {"study": "a"}, name=f"{k}.jsonl") for k in range(2)]
    for journal in journals:
        journal.open(resume=False)
    again = Journal(tmp_path, {"study": "a"}, name="1.jsonl", option="--lines")
    with pytest.raises(InputError, match=r"--lines.*1\.jsonl.*another sweep is at work"):
        again.open(resume=True)
    for journal in journals:
        journal.close()


def test_a_full_disk_is_told_with_the_file_and_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And what was done before is there to go on from."""
    out = tmp_path / "out"
    full: list[int] = []

    def fsync(file: int) -> None:
        if full:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fsync)
    with pytest.raises(InputError, match=rf"{NAME}.*No space left.*--resume"):
        rig.sweep_made_up(tmp_path, out, note=lambda *_: full.append(1))
    monkeypatch.undo()
    again: list[int] = []
    rig.sweep_made_up(tmp_path, out, resume=True, note=lambda index, *_: again.append(index))
    assert again[0] in (1, 2) and again[-1] == 7


def test_no_other_sweep_begins_before_the_report_is_written(tmp_path: Path) -> None:
    """While the worst trials run again, too."""
    out, seen = tmp_path / "out", []

    def finish(told: dict[str, Any], _trials: Any) -> None:
        seen.append(told["trials"])
        with pytest.raises(InputError, match="another sweep is at work"):
            rig.sweep_made_up(tmp_path, out, resume=True)

    rig.sweep_made_up(tmp_path, out, finish=finish)
    assert seen == [8]


def test_a_robots_file_is_looked_up_where_the_sweep_began(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever a worker runs: an override's path is relative to the command line's directory."""
    (tmp_path / "other").mkdir()
    (tmp_path / "a.urdf").write_text("<robot/>")
    monkeypatch.chdir(tmp_path)
    _, base = rig.made(tmp_path)
    monkeypatch.chdir(tmp_path / "other")
    model = base.load(["robot.model=a.urdf"]).robot.model
    assert model == (tmp_path / "a.urdf").as_uri() or model == str(tmp_path / "a.urdf")
