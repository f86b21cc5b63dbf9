"""Made-up trials for the tests of sweeps: functions of a module, so that any process finds them."""

import errno
import os
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.sweep.executors import Work, run_local
from drake_quad.sweep.provenance import own_sources
from drake_quad.sweep.study import Base, Limits, Study
from drake_quad.sweep.study_loading import load_study_and_base
from drake_quad.sweep.trials import Trial, make_trials

# A stand of 0.4 s, moved along its plan: the whole way of a trial, in a tenth of a second.
PLUMBING = """\
description: Nothing but plumbing
scenario: flat_walk
set:
  - simulation.mode=kinematic
  - "mission=[{kind: stand, duration: 0.4}]"
trials: 4
vary:
  - {path: simulation.friction, uniform: [0.5, 1.25]}
  - {path: gait.cycle_time, values: [7.0, 8.0]}
"""


def study_file(directory: Path, text: str = PLUMBING) -> Path:
    path = directory / "study.yaml"
    path.write_text(text)
    return path


def made(directory: Path, text: str = PLUMBING) -> tuple[Study, Base]:
    return load_study_and_base(study_file(directory, text))


def trials_of(directory: Path, text: str = PLUMBING, **limits: Any) -> list[Trial]:
    study, base = made(directory, text)
    for name, value in limits.items():
        setattr(study.limits, name, value)
    return list(make_trials(study, base, first=0, last=1000))


def here(workers: int = 1, stop: Callable[[], bool] = lambda: False, **limits: Any) -> Any:
    """Carries out on this machine."""

    def all_of(trials: Iterable[Trial], work: Work) -> Any:
        given = Limits(**{"recycle": 1000, **limits})
        return run_local(trials, workers=workers, limits=given, stop=stop, work=work)

    return all_of


def at_once(trials: Iterable[Trial], work: Work) -> Iterator[tuple[int, dict[str, Any]]]:
    """Carries out in the test's own process: where no more than findings is asked for."""
    for trial in trials:
        result = work(trial)
        yield trial.index, {**result, "clock": {**result["clock"], "tried": 1}}


def sweep_made_up(directory: Path, out: Path, text: str = PLUMBING, **more: Any) -> dict[str, Any]:
    """Sweeps with `made_up` in place of runs; in this very process unless told otherwise."""
    from drake_quad.sweep.run import carry_out_study  # which processes that do trials do not need

    study, base = made(directory, text)
    more = {"work": made_up, **more}
    return carry_out_study(study, base, out, more.pop("carry_out", at_once), **more)


def result(trial: Trial, outcome: str = "goal_reached", reason: str = "") -> dict[str, Any]:
    figures = dict.fromkeys(trial.figures, 0.5 / (1 + trial.index))
    clock = {"wall": 0.01, "simulating": 0.009, "memory": 0.1, "process": os.getpid()}
    return {
        "outcome": outcome,
        "reason": reason,
        "success": outcome == "goal_reached",
        "mode": "physics",
        "figures": figures,
        "scenario": f"simulation: {{seed: {trial.seed}}}\n",
        "sources": own_sources(),
        "versions": None,
        "robot": None,
        "clock": clock,
    }


def made_up(trial: Trial) -> dict[str, Any]:
    """Falls on slippery ground."""
    friction = float(trial.values[0])
    if friction < 0.7:
        return result(trial, "fell", f"the trunk is tilted by {40 * friction:.1f}°")
    return result(trial)


def some_fell(trial: Trial) -> dict[str, Any]:
    """Every third, the first too."""
    return result(trial) if trial.index % 3 else result(trial, "fell", "the trunk is tilted by 40°")


def endless(trial: Trial) -> dict[str, Any]:
    """Nothing comes of it."""
    time.sleep(1000.0)
    return result(trial)


def slow(trial: Trial) -> dict[str, Any]:
    """The same, with time to be killed in."""
    time.sleep(0.03)
    return made_up(trial)


def mishap(trial: Trial) -> dict[str, Any]:
    """What a trial can do to its process; by its index."""
    what = ("well", "raise", "abort", "hang", "hog", "spin", "well", "exit")[trial.index % 8]
    if what == "raise":
        raise ValueError("no\nplan")
    if what == "abort":
        os.abort()
    if what == "hang":
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
        time.sleep(1000.0)
    if what == "spin":  # holds the interpreter, so that nothing of Python's can end it
        sum(range(10**12))
    if what == "hog":
        held = []
        while True:
            held.append(np.zeros(1 << 26, dtype=np.uint8))  # untouched: to fill it takes a while
    if what == "exit":
        os._exit(3)
    return result(trial)


HELD: list[int] = []  # in a process that does trials: which it did


def hungry(trial: Trial) -> dict[str, Any]:
    """Has no memory where a trial was before; the trial 3 has not enough anywhere."""
    HELD.append(trial.index)
    if len(HELD) > 1 or trial.index == 3:
        raise MemoryError
    return result(trial)


def full_disk(trial: Trial) -> dict[str, Any]:
    """Keeps nothing any more from the trial 2 on."""
    if trial.index >= 2:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "a kernel")
    return result(trial)


def frail(trial: Trial) -> dict[str, Any]:
    """Ends its process where a trial was before; the trial 3 does so anywhere."""
    HELD.append(trial.index)
    if len(HELD) > 1 or trial.index == 3:
        os._exit(3) if trial.index % 2 else os.abort()
    return result(trial)


def no_server(_pipe: object) -> None:
    """A process that ends before it has a trial, as of sources with a mistake in them."""
    os._exit(5)


def killed_once(trial: Trial) -> dict[str, Any]:
    """The first try of the trial 1 is killed from outside; `seed` of it is the parent's file."""
    mark = Path(os.environ["SWEEP_TEST_MARK"])
    if trial.index == 1 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return result(trial)


def killed_always(trial: Trial) -> dict[str, Any]:
    """Whoever tries the trial 1 is killed from outside."""
    if trial.index == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return result(trial)
