"""On a Dask cluster a sweep gives what it gives here, whatever becomes of workers meanwhile."""

import os
import signal
from pathlib import Path

import sweep_rig as rig
from command import drake_quad, refused
from distributed import LocalCluster

from drake_quad.sweep.cluster import carry_out_on, connect
from drake_quad.sweep.study_config import Limits

TEXT = rig.PLUMBING.replace("trials: 4", "trials: 20")


def test_a_worker_that_is_killed_costs_no_trial(tmp_path: Path) -> None:
    """Each trial is in the table once, and the table is that of a sweep by one process here."""
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        host="127.0.0.1",
    ) as cluster:  # fmt: skip
        seen: list[int] = []

        def kill_one(index: int, *_: object) -> None:
            seen.append(index)
            if len(seen) == 8:
                os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)

        rig.sweep_made_up(
            tmp_path, tmp_path / "dask", TEXT, work=rig.slow, note=kill_one,
            carry_out=lambda trials, work: carry_out_on(
                connect(cluster.scheduler_address), trials, limits=Limits(recycle=1000), work=work
            ),
        )  # fmt: skip
    assert sorted(seen) == list(range(40))
    rig.sweep_made_up(tmp_path, tmp_path / "here", TEXT)
    names = [tmp_path / name / "trials.parquet" for name in ("dask", "here")]
    assert names[0].read_bytes() == names[1].read_bytes()


def test_nobody_at_the_address_is_one_line(tmp_path: Path) -> None:
    """It names the option and the address, before any trial."""
    rig.study_file(tmp_path)
    for address in ("tcp://127.0.0.1:1", "nonsense"):
        done = drake_quad("sweep", "study.yaml", "--dask", address, cwd=tmp_path)
        line = refused(done)
        assert "--dask" in line and address in line
