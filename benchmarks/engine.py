"""The engine of `drake_quad.sweep` for the trials of benchmarks.

A trial is done in a process of its own with limits of time and memory, is tried again if somebody
else ends that, and is a line of a journal once it is done. `--resume` goes on with a journal of the
same study, options, sources and libraries, and refuses any other.
"""

import argparse
import hashlib
import threading
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks.study import Result
from drake_quad.errors import InputError
from drake_quad.sweep import provenance
from drake_quad.sweep.executors import Work, run_local
from drake_quad.sweep.journal import Journal
from drake_quad.sweep.run import Bar, SourcesChangedError
from drake_quad.sweep.study import Base, Study
from drake_quad.sweep.trials import Trial
from drake_quad.util.versions import versions

BENCHMARKS = Path(__file__).resolve().parent


def basis(libraries: Sequence[str]) -> dict[str, Any]:
    """What results depend on besides their study, read anew each time.

    Args:
        libraries: Besides those of every trial.
    """
    digest = hashlib.sha256()
    for path in sorted(BENCHMARKS.glob("*.py")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    usual = versions()
    names = [name for name in (*usual, *libraries) if name != "python"]
    return {
        "sources": provenance.sources_digest(),
        "benchmarks": digest.hexdigest()[:16],
        "versions": {**usual, **{name: version(name) for name in names}},
    }


def carry_on(
    study: Study,
    base: Base,
    trials: Sequence[Trial],
    work: Work,
    *,
    names: Sequence[str],
    chosen: dict[str, Any],
    options: argparse.Namespace,
    libraries: Sequence[str] = (),
) -> list[Result]:
    """Carries out the trials that are not done, and shows on stderr how far it is.

    Args:
        study: Study of all trials.
        base: Its scenario.
        trials: Trials in the order in which they are begun.
        work: Function that carries out a trial, at the top of a module.
        names: Names of the trials' values.
        chosen: What else the trials depend on: with another, records are refused.
        options: `lines`, `resume`, `workers` and `recycle`.
        libraries: Libraries that results depend on besides the usual ones.

    Returns:
        Of each trial its `number`, values, `scenario`, `overrides`, `outcome`, `reason` and
        figures; those are None where a trial gave no result.

    Raises:
        InputError: The records are another study's, or cannot be written.
        SourcesChangedError: Sources or libraries were changed meanwhile; what was done is kept.
    """
    lines: Path = options.lines
    if lines.is_dir():
        remedy = "is a directory; give a file in it"
        raise InputError(source="--lines", field="file", value=str(lines), remedy=remedy)
    before = basis(libraries)
    told = {"study": provenance.study_digest(study, base), "options": chosen, **before}
    journal = Journal(lines.parent, told, name=lines.name, option="--lines")
    by_index = {trial.index: trial for trial in trials}
    limits = replace(study.limits, recycle=options.recycle)
    bar = Bar(Console(stderr=True))
    ended = threading.Event()
    journal.open(resume=options.resume)
    try:
        pending = [trial for trial in trials if trial.index not in journal.done]
        done, of = len(trials) - len(pending), len(trials)
        failed = sum(
            not journal.done[t.index]["success"] for t in trials if t.index in journal.done
        )
        bar.begin(done, failed, of)
        for index, result in run_local(
            pending, workers=options.workers, limits=limits, stop=ended.is_set, work=work
        ):
            if result["sources"] != before["sources"] or basis(libraries) != before:
                raise SourcesChangedError(
                    "sources or libraries were changed while the study ran: what was done before "
                    "is kept, and --resume goes on with it once they are as they were"
                )
            values = _values(by_index[index], names)
            journal.add(index, {**values, **result})
            done += 1
            which = ", ".join(f"{name} {value}" for name, value in values.items())
            bar.note(index, {**result, "reason": f"{result['reason']} ({which})"}, done, of)
    finally:
        ended.set()  # an interrupt ends the processes, too
        bar.end()
        journal.close()
    return [_flat(trial, journal.done[trial.index], names) for trial in trials]


def _values(trial: Trial, names: Sequence[str]) -> Result:
    return dict(zip(names, trial.values, strict=True))


def _flat(trial: Trial, done: Result, names: Sequence[str]) -> Result:
    figures = {name.removesuffix(".minimum"): value for name, value in done["figures"].items()}
    return {
        "number": trial.index,
        **_values(trial, names),
        "scenario": trial.base.name,
        "overrides": list(trial.overrides),
        "outcome": done["outcome"],
        "reason": done["reason"],
        **figures,
    }
