"""Runs the worst trials of a sweep again, each with its report, which the sweep's links to."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from drake_quad.report.build import REPORT, build_report
from drake_quad.report.scene_log import write_scene_log
from drake_quad.simulation import run, write_files
from drake_quad.sweep.study import Base
from drake_quad.sweep.study_config import Study
from drake_quad.sweep.trials import directory_of, make_trials

# Trials with these outcomes had no run, or would take this process with them.
NO_RUN = ("refused", "infeasible", "crashed", "killed", "memory", "timeout", "error")


def replay_of(index: int, out: Path) -> Path:
    """The report of a trial that was run again, if it was."""
    return directory_of(index, out) / REPORT


def make_replays(
    study: Study, base: Base, told: dict[str, Any], out: Path, count: int,
    stop: Callable[[], bool] = lambda: False,
) -> list[int]:  # fmt: skip
    """Runs the worst `count` trials again that are not there yet; the indices of those that ran.

    One that is stopped leaves nothing: its files would be taken for the trial's.

    Raises:
        InputError: If their files cannot be written.
    """
    worst = [row["index"] for row in told["worst"] if row["outcome"] not in NO_RUN][:count]
    missing = [k for k in worst if not replay_of(k, out).is_file()]
    made: list[int] = []
    for index in missing:
        (trial,) = make_trials(study, base, first=index, last=index + 1)
        result = run(base.load(list(trial.overrides)), source=base.name, stop=stop)
        if stop():
            break
        directory = directory_of(index, out)
        directory.mkdir(parents=True, exist_ok=True)
        write_files(result, result.scenario, directory)
        write_scene_log(directory)
        build_report(directory)  # the last: by it the files are taken for whole
        made.append(index)
    return made
