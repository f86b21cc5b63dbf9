"""On a Dask cluster a sweep gives what it gives here, whatever becomes of workers meanwhile."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import sweep_rig as rig
from command import drake_quad, refused
from distributed import Client, LocalCluster
from rich.console import Console

from drake_quad.errors import InputError
from drake_quad.sweep import dask_executor as cluster
from drake_quad.sweep.dask_executor import ClusterGoneError, connect, run_on_dask
from drake_quad.sweep.executors import Work
from drake_quad.sweep.journal import read_journal
from drake_quad.sweep.run import SweepRequest, run_sweep
from drake_quad.sweep.study import Limits
from drake_quad.sweep.trials import Trial

TEXT = rig.PLUMBING.replace("trials: 4", "trials: 20")


@pytest.mark.parametrize(
    "workers",
    [pytest.param(2, marks=pytest.mark.long), pytest.param(4, marks=pytest.mark.slow)],
)
def test_a_worker_that_is_killed_costs_no_trial(tmp_path: Path, workers: int) -> None:
    """Nor does one that is restarted: each is in the table once, which is that of a sweep here."""
    with LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None,
        host="127.0.0.1",
    ) as local:  # fmt: skip
        seen: list[int] = []

        def meddle(index: int, *_: object) -> None:
            seen.append(index)
            nannies = list(local.workers.values())
            if len(seen) == 8:
                os.kill(nannies[0].pid, signal.SIGKILL)
            if len(seen) == 12 and workers > 2:
                with Client(local.scheduler_address) as client:
                    client.restart_workers([nannies[1].worker_address])

        rig.sweep_made_up(
            tmp_path, tmp_path / "dask", TEXT, work=rig.slow, note=meddle,
            carry_out=lambda trials, work: run_on_dask(
                connect(local.scheduler_address), trials, limits=Limits(recycle=1000), work=work
            ),
        )  # fmt: skip
    assert sorted(seen) == list(range(40))
    rig.sweep_made_up(tmp_path, tmp_path / "here", TEXT)
    names = [tmp_path / name / "trials.parquet" for name in ("dask", "here")]
    assert names[0].read_bytes() == names[1].read_bytes()


def test_a_sweep_that_is_stopped_leaves_the_workers_free(tmp_path: Path) -> None:
    """What was under way is given up within seconds, and the next sweep does not wait for it."""
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as local:

        def carried(work: Work, stop: Callable[[], bool]) -> list[tuple[int, dict[str, Any]]]:
            client = connect(local.scheduler_address)
            trials = rig.trials_of(tmp_path, wall_time=300.0)[:2]
            limits = Limits(recycle=1000)
            return list(run_on_dask(client, trials, limits=limits, stop=stop, work=work))

        assert len(carried(rig.made_up, lambda: False)) == 2  # the worker's process has begun
        until = time.monotonic() + 1.0
        assert carried(rig.endless, lambda: time.monotonic() > until) == []
        begun = time.monotonic()
        assert len(carried(rig.made_up, lambda: False)) == 2
        assert time.monotonic() - begun < 60.0  # the endless one would have had its 300 s


def begin_scheduler(directory: Path) -> tuple[subprocess.Popen[bytes], str]:
    """A scheduler as a person starts one, and its address."""
    process = dask(directory, "scheduler", "--port", "0")
    known, until = directory / "scheduler.json", time.monotonic() + 60.0
    while not known.exists() and time.monotonic() < until:
        time.sleep(0.1)
    return process, str(json.loads(known.read_text())["address"])


def begin_worker(directory: Path) -> subprocess.Popen[bytes]:
    """A worker of the scheduler that was begun in that directory."""
    return dask(directory, "worker", "--nthreads", "1", "--no-nanny", "--death-timeout", "5")


def dask(directory: Path, *words: str) -> subprocess.Popen[bytes]:
    known = ["--scheduler-file", str(directory / "scheduler.json")]
    env = {**os.environ, "PYTHONPATH": str(Path(rig.__file__).parent)}  # its trials are the rig's
    host = ["--host", "127.0.0.1", "--no-dashboard"]
    return subprocess.Popen([sys.executable, "-m", "dask", *words, *known, *host], env=env)


@pytest.mark.long
def test_the_command_waits_for_a_worker_and_gives_what_it_gives_here(tmp_path: Path) -> None:
    """Real runs, by `--dask ADDRESS`: without a worker it says so; the table is the same."""
    rig.study_file(tmp_path)
    scheduler, address = begin_scheduler(tmp_path)
    processes = [scheduler]
    sweep = [sys.executable, "-m", "drake_quad", "sweep", "study.yaml", "--out", "dask"]
    try:
        with subprocess.Popen(
            [*sweep, "--dask", address], cwd=tmp_path, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        ) as swept:  # fmt: skip
            assert swept.stderr is not None and swept.stdout is not None
            line = swept.stderr.readline()
            assert "no worker yet" in line and address in line
            processes.append(begin_worker(tmp_path))
            told = swept.stdout.read()
        assert swept.returncode == 0 and "8 of 8" in told
    finally:
        for process in processes:
            process.kill()
            process.wait()
    done = drake_quad("sweep", "study.yaml", "--out", "here", "--workers", "1", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    tables = [(tmp_path / name / "trials.parquet").read_bytes() for name in ("dask", "here")]
    assert tables[0] == tables[1]


def test_a_scheduler_that_goes_away_ends_the_sweep_with_what_was_done(tmp_path: Path) -> None:
    """One error that says how to go on, no waiting for ever; the journal has what came before."""
    scheduler, address = begin_scheduler(tmp_path)
    worker = begin_worker(tmp_path)
    try:

        def kill_it(index: int, *_: object) -> None:
            if scheduler.poll() is None:
                scheduler.kill()
                scheduler.wait()

        begun = time.monotonic()
        with pytest.raises(ClusterGoneError, match="--resume"):
            rig.sweep_made_up(
                tmp_path, tmp_path / "dask", TEXT, work=rig.slow, note=kill_it,
                carry_out=lambda trials, work: run_on_dask(
                    connect(address), trials, limits=Limits(), work=work
                ),
            )  # fmt: skip
        assert time.monotonic() - begun < 90.0
    finally:
        for process in (scheduler, worker):
            process.kill()
            process.wait()
    assert 1 <= len(read_journal(tmp_path / "dask")[1]) < 40


def test_what_is_done_is_kept_of_a_cluster_that_is_told_to_stop(tmp_path: Path) -> None:
    """Results that wait for their turn when Ctrl-C comes."""

    class Done:
        """A trial's future; every second is done."""

        def __init__(self, trial: Trial) -> None:
            self.trial, self.status = trial, "finished" if trial.index % 2 else "cancelled"

        def result(self) -> dict[str, Any]:
            return rig.result(self.trial)

        def add_done_callback(self, put: Callable[[object], None]) -> None:
            put(self)

    class FakeClient:
        """A cluster that did them at once."""

        given_up = 0

        def __enter__(self) -> "FakeClient":
            return self

        def __exit__(self, *_: object) -> None: ...

        def submit(self, _do: object, trial: Trial, *_: object, **__: object) -> Done:
            return Done(trial)

        def cancel(self, futures: list[Done], *, force: bool) -> None:
            self.given_up = len(futures)

    client, trials = FakeClient(), rig.trials_of(tmp_path)[:6]
    found = run_on_dask(client, trials, limits=Limits(), stop=lambda: True, work=rig.made_up)
    assert [index for index, _ in found] == [1, 3, 5] and client.given_up == 3


def test_a_worker_without_trials_keeps_no_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is ended some time after the last trial, not before, and begun again for another."""
    monkeypatch.setattr(cluster, "_given_up", lambda: lambda: False)
    monkeypatch.setattr(cluster, "IDLE", 0.6)
    trial, limits = rig.trials_of(tmp_path, wall_time=300.0)[0], Limits()

    def pid() -> int:
        isolated = cluster._own.isolated
        return -1 if isolated._process is None else int(isolated._process._process.pid)

    try:
        first = cluster.do(trial, limits, rig.made_up, "a sweep")
        begun = pid()
        assert cluster.do(trial, limits, rig.made_up, "a sweep")["outcome"] == first["outcome"]
        assert pid() == begun > 0
        cluster._own.idle.join(60.0)
        assert pid() == -1
        with pytest.raises(ProcessLookupError):
            os.kill(begun, 0)
        assert cluster.do(trial, limits, rig.made_up, "a sweep")["outcome"] == first["outcome"]
        assert pid() not in (-1, begun)
        other = pid()
        cluster.do(trial, limits, rig.made_up, "another sweep")
        assert pid() not in (-1, other)
    finally:
        cluster._own.idle.cancel()
        cluster._own.isolated.end()


def test_nobody_at_the_address_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It names the option and the address, before any trial."""
    rig.study_file(tmp_path)
    monkeypatch.setattr(cluster, "CONNECT_TIME", 0.3)
    for address in ("tcp://127.0.0.1:1", "tls://127.0.0.1:1", ""):
        with pytest.raises(InputError) as caught:
            connect(address)
        assert "\n" not in str(caught.value)
        assert "--dask" in str(caught.value) and address in str(caught.value)
    line = refused(drake_quad("sweep", "study.yaml", "--dask", "nonsense", cwd=tmp_path))
    assert "--dask" in line and "nonsense" in line
    assert not (tmp_path / "sweeps").exists()


def test_a_sweep_that_is_refused_leaves_no_connection(tmp_path: Path) -> None:
    """A directory that holds another sweep is told after the cluster was reached: it is let go."""
    study = rig.study_file(tmp_path)

    def refuse() -> None:
        raise InputError(source="--out", field="directory", value="x", remedy="holds a sweep")

    with LocalCluster(n_workers=0, processes=False, dashboard_address=None) as local:
        asked = SweepRequest(study, tmp_path / "x", workers=1, dask=local.scheduler_address)
        with pytest.raises(InputError, match="holds a sweep"):
            run_sweep(asked, Console(quiet=True), lambda: False, refuse)
        until = time.monotonic() + 10.0
        while local.scheduler.clients.keys() - {"fire-and-forget"} and time.monotonic() < until:
            time.sleep(0.05)
        assert not local.scheduler.clients.keys() - {"fire-and-forget"}
