"""On a Dask cluster a sweep gives what it gives here, whatever becomes of workers meanwhile."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import sweep_rig as rig
from command import drake_quad, refused
from distributed import Client, LocalCluster

from drake_quad.sweep.cluster import carry_out_on, connect
from drake_quad.sweep.isolated import Work
from drake_quad.sweep.study_config import Limits

TEXT = rig.PLUMBING.replace("trials: 4", "trials: 20")


@pytest.mark.parametrize("workers", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_a_worker_that_is_killed_costs_no_trial(tmp_path: Path, workers: int) -> None:
    """Nor does one that is restarted: each is in the table once, which is that of a sweep here."""
    with LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None,
        host="127.0.0.1",
    ) as cluster:  # fmt: skip
        seen: list[int] = []

        def meddle(index: int, *_: object) -> None:
            seen.append(index)
            nannies = list(cluster.workers.values())
            if len(seen) == 8:
                os.kill(nannies[0].pid, signal.SIGKILL)
            if len(seen) == 12 and workers > 2:
                with Client(cluster.scheduler_address) as client:
                    client.restart_workers([nannies[1].worker_address])

        rig.sweep_made_up(
            tmp_path, tmp_path / "dask", TEXT, work=rig.slow, note=meddle,
            carry_out=lambda trials, work: carry_out_on(
                connect(cluster.scheduler_address), trials, limits=Limits(recycle=1000), work=work
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
    ) as cluster:

        def carried(work: Work, stop: Callable[[], bool]) -> list[tuple[int, dict[str, Any]]]:
            client = connect(cluster.scheduler_address)
            trials = rig.trials_of(tmp_path, wall_time=300.0)[:2]
            limits = Limits(recycle=1000)
            return list(carry_out_on(client, trials, limits=limits, stop=stop, work=work))

        assert len(carried(rig.made_up, lambda: False)) == 2  # the worker's process has begun
        until = time.monotonic() + 2.0
        assert carried(rig.endless, lambda: time.monotonic() > until) == []
        begun = time.monotonic()
        assert len(carried(rig.made_up, lambda: False)) == 2
        assert time.monotonic() - begun < 60.0  # the endless one would have had its 300 s


def test_nobody_at_the_address_is_one_line(tmp_path: Path) -> None:
    """It names the option and the address, before any trial."""
    rig.study_file(tmp_path)
    for address in ("tcp://127.0.0.1:1", "nonsense", "tls://127.0.0.1:1", ""):
        done = drake_quad("sweep", "study.yaml", "--dask", address, cwd=tmp_path)
        line = refused(done)
        assert "--dask" in line and address in line
