"""A sweep from end to end: trials, journal, tables, findings."""

import json
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow as pa

from drake_quad.errors import DrakeQuadError, InputError
from drake_quad.robot.loader import robot_digest
from drake_quad.sweep.executors import Work
from drake_quad.sweep.findings import summarize_sweep
from drake_quad.sweep.journal import Journal
from drake_quad.sweep.provenance import MODELS, commit, describe, own_versions, robots_of
from drake_quad.sweep.results import CLOCK, FINDINGS, REPORT, STUDY, TRIALS, fitting, write_tables
from drake_quad.sweep.study import Base, Study
from drake_quad.sweep.study_loading import as_plain
from drake_quad.sweep.trials import TRIALS_DIRECTORY, Trial, count_trials, make_trials, work
from drake_quad.util.files import write_whole

MADE = (TRIALS, CLOCK, FINDINGS, REPORT)  # of the journal
LEAVINGS = (*MADE, TRIALS_DIRECTORY)

CHANGED = {
    "sources": "the sources of drake_quad are others",
    "versions": "the libraries' versions are others",
    "robot": "the robot's files are others",
}

Result = dict[str, Any]
# Carries out trials: yields the index of each and what came of it, as they end.
CarryOut = Callable[[Iterable[Trial], Work], Iterator[tuple[int, Result]]]
# Told of each trial that is done: its index, what came of it, and of how many it is which.
Note = Callable[[int, Result, int, int], object]


class SourcesChangedError(DrakeQuadError):
    """Trials of two versions of the program are no study."""


def carry_out_study(
    study: Study,
    base: Base,
    out: Path,
    carry_out: CarryOut,
    *,
    resume: bool = False,
    limit: int | None = None,
    begin: Callable[[int, int, int], object] = lambda _done, _failed, _of: None,
    note: Note = lambda _index, _result, _done, _of: None,
    finish: Callable[[dict[str, Any], pa.Table], object] = lambda _findings, _trials: None,
    work: Work = work,
    command: str = "",
    files: Sequence[Path] = (),
) -> dict[str, Any]:
    """Carries out what of the study is not done, and writes its tables and findings into `out`.

    Args:
        study: Checked.
        base: Its scenario.
        out: The sweep's directory.
        carry_out: Here, or on a cluster.
        resume: Whether to go on with what is there.
        limit: Do only the study's first so many trials.
        begin: Told how many trials are done before, how many of them failed, and of how many they
            are, once nothing is refused any more.
        note: Told of each trial that is done.
        finish: Told the findings and the trials' table, while no other sweep can be at work there.
        work: Of one trial: a module's own function.
        command: That carries out the sweep, to be told with what came of it.
        files: What the findings depend on besides the program: the study's file. Where these were
            changed since the commit, the findings say so.

    Returns:
        The findings, as in sweep.json.

    Raises:
        InputError: `out` cannot be used, or holds another study's sweep.
        SourcesChangedError: The program was changed while the sweep ran; what was done is kept.
    """
    told = describe(study, base)
    made_of = commit(MODELS, *files)  # now: somebody may commit while the sweep runs
    basis = {
        "sources": [told["sources"]],
        "versions": [own_versions()],
        "robot": robots_of(study, base),
    }
    journal = Journal(out, told, LEAVINGS, fits=fitting(study))
    journal.open(resume=resume)
    begun = time.perf_counter()
    try:
        # Until all is written anew, nothing old is there that could be read as this sweep's.
        for name in MADE:
            with suppress(FileNotFoundError):
                (out / name).unlink()
        _write(out / STUDY, {"definition": as_plain(study), "base": base.name, **told})
        of = min(count_trials(study), limit or count_trials(study))
        pending = (
            trial
            for trial in make_trials(study, base, first=0, last=of)
            if trial.index not in journal.done
        )
        failed = sum(not result["success"] for result in journal.done.values())
        begin(len(journal.done), failed, max(of, len(journal.done)))
        for index, result in carry_out(pending, work):
            if result["outcome"] == "refused" and result["robot"] is None:
                _check_refusal(study, base, index, result["reason"])
            for name, own in basis.items():
                if result[name] is not None and result[name] not in own:
                    raise SourcesChangedError(
                        f"{CHANGED[name]} where trial {index} was carried out (changed since, or "
                        "another machine); what was done before is kept, and --resume goes on with "
                        "it once they are as they were"
                    )
            journal.add(index, result)
            note(index, result, len(journal.done), max(of, len(journal.done)))
        trials, clock = write_tables(study, base, journal.done, out)
        findings = {
            **summarize_sweep(study, trials, clock),
            "elapsed": time.perf_counter() - begun,
            "commit": made_of,
            "command": command,
            **told,
        }
        _write(out / FINDINGS, findings)
        finish(findings, trials)
    finally:
        journal.close()
    return findings


def _check_refusal(study: Study, base: Base, index: int, reason: str) -> None:
    """Sees whether a trial whose robot was not to be had is refused here, too.

    Raises:
        SourcesChangedError: It is not: what lacks is the other machine's, and no finding.
    """
    (trial,) = make_trials(study, base, first=index, last=index + 1)
    try:
        robot_digest(base.load(list(trial.overrides)).robot.model)
    except InputError:
        return
    raise SourcesChangedError(
        f"trial {index} was refused where it was carried out, and would not be here: {reason}; "
        "what was done before is kept, and --resume goes on with it once that is mended there"
    )


def _write(path: Path, plain: dict[str, Any]) -> None:
    text = json.dumps(plain, indent=1) + "\n"
    write_whole(path, lambda to: to.write_text(text, encoding="utf-8"))
