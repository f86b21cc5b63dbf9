"""Whatever a trial does to its process, or somebody else does, each is in the results just once."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import sweep_rig as rig

from drake_quad.sweep.executors import run_local
from drake_quad.sweep.study import Limits


def crew(trials: list[Any], work: Any, **more: Any) -> dict[int, dict[str, Any]]:
    """What came of the trials, none of which is told of twice."""
    limits = Limits(**more.pop("limits", {}))
    found = list(run_local(trials, limits=limits, work=work, **more))
    assert len({index for index, _ in found}) == len(found)
    return dict(found)


def test_what_a_trial_does_to_its_process_is_a_finding(tmp_path: Path) -> None:
    """Errors, aborts, hangs, greed and exits are counted as such, and harm no other trial."""
    trials = rig.trials_of(tmp_path, wall_time=1.0, memory=1.0)
    found = crew(trials, rig.mishap, workers=2, limits={"retries": 1})
    outcomes = [found[k]["outcome"] for k in range(8)]
    assert outcomes == ["goal_reached", "error", "crashed", "timeout", "memory", "timeout",
                        "goal_reached", "crashed"]  # fmt: skip
    assert found[1]["reason"] == "ValueError: no plan" and "SIGABRT" in found[2]["reason"]
    assert "after 1 s" in found[3]["reason"] and "1 GiB" in found[4]["reason"]
    assert "exit code 3" in found[7]["reason"] and found[7]["clock"]["tried"] == 1
    assert all(found[k]["success"] == (outcomes[k] == "goal_reached") for k in range(8))


@pytest.mark.long
def test_how_a_process_ended_is_known_however_late_one_looks(tmp_path: Path) -> None:
    """One that ends as soon as it has its trial is told of with its exit code.

    Another thread keeps the interpreter busy, so that what the process said and that it ended are
    there to be seen at once.
    """
    trials = rig.trials_of(tmp_path, rig.PLUMBING.replace("trials: 4", "trials: 12"))
    over, interval = threading.Event(), sys.getswitchinterval()

    def be_busy() -> None:
        while not over.is_set():
            pass

    busy = threading.Thread(target=be_busy)
    sys.setswitchinterval(0.1)
    busy.start()
    try:
        found = crew(trials[7::8], rig.mishap, workers=1, limits={"retries": 0})
    finally:
        over.set()
        busy.join()
        sys.setswitchinterval(interval)
    assert [one["outcome"] for one in found.values()] == ["crashed"] * 3
    assert all("exit code 3" in one["reason"] for one in found.values())


def test_a_lower_bound_of_the_machine_is_kept(tmp_path: Path) -> None:
    """Where a process may not have as much as a trial could, it has that, and is no fault."""
    (trial,) = rig.trials_of(tmp_path, memory=4.0)[:1]
    code = (
        "import resource, sweep_rig as rig; from drake_quad.sweep.trials import guarded\n"
        "from pathlib import Path\n"
        "resource.setrlimit(resource.RLIMIT_DATA, (2 << 30, 2 << 30))\n"
        f"(trial,) = rig.trials_of(Path({str(tmp_path)!r}), memory=4.0)[:1]\n"
        "print(guarded(lambda t: {'bound': resource.getrlimit(resource.RLIMIT_DATA)}, trial))\n"
        "print(resource.getrlimit(resource.RLIMIT_DATA))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=Path(__file__).parents[1] / "support",
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    within, after = done.stdout.splitlines()[-2:]
    assert within == f"{{'bound': ({2 << 30}, {2 << 30})}}" and after == f"({2 << 30}, {2 << 30})"
    assert trial.memory == 4.0


@pytest.mark.long
def test_a_killed_process_is_no_finding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its trial is tried again; one that is killed each time is given up after the retries."""
    monkeypatch.setenv("SWEEP_TEST_MARK", str(tmp_path / "mark"))
    trials = rig.trials_of(tmp_path)[:3]
    once = crew(trials, rig.killed_once, workers=1)
    assert [once[k]["outcome"] for k in range(3)] == ["goal_reached"] * 3
    assert [once[k]["clock"]["tried"] for k in range(3)] == [1, 2, 1]
    always = crew(trials, rig.killed_always, workers=1, limits={"retries": 1})
    assert [always[k]["outcome"] for k in range(3)] == ["goal_reached", "killed", "goal_reached"]
    assert always[1]["clock"]["tried"] == 2


def test_processes_are_replaced(tmp_path: Path) -> None:
    """Each does as many trials as it may, and is then another."""
    found = crew(rig.trials_of(tmp_path)[:3], rig.made_up, workers=1, limits={"recycle": 2})
    processes = [found[k]["clock"]["process"] for k in range(3)]
    assert processes[0] == processes[1] != processes[2]


def test_a_stop_is_heeded_at_once(tmp_path: Path) -> None:
    """Those under way are given up, their processes ended, and what is done is kept."""
    begun = time.monotonic()
    seen: list[int] = []
    trials = [t for t in rig.trials_of(tmp_path) if t.index in (0, 3)]
    for index, _ in run_local(
        trials, workers=1, limits=Limits(), work=rig.mishap,
        stop=lambda: bool(seen) and time.monotonic() > begun + 1.0,
    ):  # fmt: skip
        seen.append(index)
    assert seen == [0] and time.monotonic() - begun < 20.0
    assert not [p for p in psutil.Process().children() if "spawn_main" in " ".join(p.cmdline())]


@pytest.mark.slow
def test_processes_killed_at_any_moment_lose_nothing(tmp_path: Path) -> None:
    """Somebody who kills worker after worker slows the sweep down, and that is all."""
    trials = rig.trials_of(tmp_path, rig.PLUMBING.replace("trials: 4", "trials: 100"))
    undisturbed = {trial.index: rig.made_up(trial)["outcome"] for trial in trials}
    over, kills = threading.Event(), 0

    def kill() -> None:
        nonlocal kills
        for moment in np.random.default_rng(6).uniform(0.5, 3.0, size=4):
            if over.wait(moment):
                break
            for child in psutil.Process().children():
                with suppress(psutil.NoSuchProcess, ProcessLookupError):  # it ended just now
                    if "spawn_main" in " ".join(child.cmdline()):
                        os.kill(child.pid, signal.SIGKILL)
                        kills += 1
                        break

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        found = crew(trials, rig.slow, workers=2, limits={"retries": 4})
    finally:
        over.set()
        killer.join()
    assert kills > 0
    assert {index: one["outcome"] for index, one in found.items()} == undisturbed
