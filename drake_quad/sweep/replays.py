"""Runs the worst trials of a sweep again, each with its report, which the sweep's links to."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import pyarrow as pa

from drake_quad.errors import InputError, PlanningError
from drake_quad.report.lcm_replay import write_scene_log
from drake_quad.report.page import REPORT, write_report
from drake_quad.runs.result import write_files
from drake_quad.simulation.run import simulate
from drake_quad.sweep.findings import worst_first
from drake_quad.sweep.study import Base, Study
from drake_quad.sweep.trials import TRIALS_DIRECTORY, directory_of, make_trials
from drake_quad.util.files import MOST_JSON, plain_of, read_given

# Trials with these outcomes had no run, or would take this process with them.
NO_RUN = ("refused", "infeasible", "crashed", "killed", "memory", "timeout", "error")


def replayable(table: pa.Table, count: int) -> list[int]:
    """The worst trials that had a run, the worst first: at most so many, by their indices."""
    indices, outcomes = table["index"].to_pylist(), table["outcome"].to_pylist()
    return [indices[k] for k in worst_first(table) if outcomes[k] not in NO_RUN][:count]


def replays_in(out: Path) -> dict[int, Path]:
    """The reports of all trials that were run again, by index."""
    found = sorted((out / TRIALS_DIRECTORY).glob(f"*/{REPORT}"))
    return {int(path.parent.name): path for path in found if path.parent.name.isdecimal()}


def otherwise(table: pa.Table, out: Path) -> dict[int, str]:
    """How trials ended that were run again, of those that ended otherwise than in the sweep.

    Numerical libraries choose their instructions by the processor: on another than the sweep's the
    last digits are others, and a trial that nearly fell may fall.
    """
    ended = dict(zip(table["index"].to_pylist(), table["outcome"].to_pylist(), strict=True))
    found = {}
    for index, report in replays_in(out).items():
        summary = None
        with suppress(OSError):  # of a report alone nothing is known
            summary = plain_of(read_given(report.parent / "summary.json", most=MOST_JSON))
        outcome = (summary or {}).get("outcome")
        # A bound that is missed is the sweep's finding: the run reached its goal.
        was = ended.get(index, "").replace("bound_missed", "goal_reached")
        if isinstance(outcome, str) and outcome != was:
            found[index] = outcome
    return found


def make_replays(
    study: Study, base: Base, indices: Sequence[int], out: Path,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[list[int], dict[int, str]]:  # fmt: skip
    """Runs those of the trials again that are not there yet.

    One that is stopped leaves nothing: its files would be taken for the trial's.

    Returns:
        The indices of those that ran; and why others have no run here, by index: on another
        processor than the sweep's a plan may be missed that there just was one.

    Raises:
        InputError: If their files cannot be written.
    """
    there = replays_in(out)
    made: list[int] = []
    without: dict[int, str] = {}
    for index in indices:
        if index in there:
            continue
        (trial,) = make_trials(study, base, first=index, last=index + 1)
        try:
            result = simulate(base.load(list(trial.overrides)), source=base.name, stop=stop)
        except (InputError, PlanningError) as error:
            without[index] = str(error)
            continue
        if stop():
            break
        directory = directory_of(index, out)
        directory.mkdir(parents=True, exist_ok=True)
        write_files(result, result.scenario, directory)
        write_scene_log(directory)
        write_report(directory)  # the last: by it the files are taken for whole
        made.append(index)
    return made, without
