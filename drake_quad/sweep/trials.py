"""A trial: what it is, how a process carries it out, and the designs that trials share."""

import copy
import ctypes
import logging
import math
import os
import resource
import shlex
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drake_quad.errors import MACHINE_FAULTS, InputError, MachineError, PlanningError
from drake_quad.gait_design.quicken import design_preferred
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import parse_override, scenario_text
from drake_quad.sweep.sampling import Draws
from drake_quad.sweep.study import Base, Study, SuccessBound
from drake_quad.sweep.study_loading import overrides_of

RANKED_BY = "margin.minimum"  # the worst trial is the one with the smallest
USUAL_FIGURES = (
    RANKED_BY,
    "zmp_margin.minimum",
    "base_error_max",
    "torque_ratio_max",
    "slip_max",
    "nonfoot_contact_samples",
    "nonfoot_force_max",
    "clock_waited",
    "simulated_time",
)

TRIALS_DIRECTORY = "trials"  # holds the files of trials that were run again

GIB = 1 << 30
GRACE = 30.0  # [s] beyond the time limit of a trial, after which its process ends itself
PR_SET_PDEATHSIG = 1  # Linux: prctl(2)
# Words in messages of Python, C++ and the dynamic linker about a lack of memory.
NO_MEMORY = (
    "MemoryError", "bad_alloc", "Unable to allocate", "Cannot allocate memory",
    "failed to map segment",
)  # fmt: skip
FAULTS = tuple(os.strerror(code) for code in MACHINE_FAULTS)  # words of their messages
MACHINE = "machine"  # outcome for a fault of the machine: no finding, it ends the sweep
BASIS = ("sources", "versions", "robot")  # what a result depends on besides its trial

Result = dict[str, Any]

# Sections that no design reads.
UNREAD = (
    "description", "estimator", "sensors", "disturbances", "world", "monitor", "certify",
    "perception", "simulation",
)  # fmt: skip
KEPT = 32  # designs that are remembered

Make = Callable[[Scenario, str], Scenario]


@dataclass(frozen=True)
class Trial:
    """One trial, with all that a process needs to carry it out.

    Attributes:
        index: Number of the trial in its study, from 0.
        seed: Value of `simulation.seed`: drawn, unless the study sets it.
        values: Value of each thing that varies, in the study's order.
        base: The scenario.
        overrides: Overrides of the scenario's fields, those of the study first.
        figures: Figures of summary.json to keep.
        success: Bounds that it must keep besides reaching the goal.
        wall_time: Wall time after which it is ended [s].
        memory: Largest memory of its process [GiB].
    """

    index: int
    seed: int
    values: tuple[Any, ...]
    base: Base
    overrides: tuple[str, ...]
    figures: tuple[str, ...]
    success: tuple[SuccessBound, ...]
    wall_time: float
    memory: float


def figures_of(study: Study) -> tuple[str, ...]:
    """The figures that the study keeps: those it lists, and those it judges and ranks by."""
    kept = dict.fromkeys(study.figures or USUAL_FIGURES)
    kept.update(dict.fromkeys(bound.figure for bound in study.success))
    kept[RANKED_BY] = None
    return tuple(kept)


def make_trials(study: Study, base: Base, *, first: int, last: int) -> Iterator[Trial]:
    """The trials from `first` until before `last`, in order."""
    draws, figures = Draws(study), figures_of(study)
    for index in range(first, min(last, draws.count)):
        values = draws.values(index)
        overrides = list(study.set)
        for vary, value in zip(study.vary, values, strict=True):
            overrides += overrides_of(vary, value)
        seed = seed_in(overrides)
        if seed is None:
            seed = draws.seed(index)
            overrides.append(f"simulation.seed={seed}")
        yield Trial(
            index=index,
            seed=seed,
            values=tuple(values),
            base=base,
            overrides=tuple(overrides),
            figures=figures,
            success=tuple(study.success),
            wall_time=study.limits.wall_time,
            memory=study.limits.memory,
        )


def count_trials(study: Study) -> int:
    """The number of trials of the whole study."""
    return Draws(study).count


def directory_of(index: int, out: Path) -> Path:
    """The directory for the files of a trial that is run again."""
    return out / TRIALS_DIRECTORY / f"{index:06d}"


def repeat(trial: Trial) -> str:
    """The command that runs the trial again, with its report."""
    return run_command(trial.base.name, trial.overrides)


def run_command(base: str, overrides: Sequence[str]) -> str:
    """The command that runs a scenario with overrides, quoted for a shell."""
    words = ["drake-quad", "run", base]
    for override in overrides:
        words += ["--set", override]
    return shlex.join(words)


def sweep_command(study: str | Path, limit: int | None) -> str:
    """The command that carries out a study, or its first `limit` trials."""
    limited = [] if limit is None else ["--limit", str(limit)]
    return shlex.join(["drake-quad", "sweep", str(study), *limited])


def repeat_into(command: str, index: int, out: Path) -> str:
    """The command with the directory in which the sweep's report looks for the run."""
    return f"{command} --out {shlex.quote(str(directory_of(index, out)))}"


def seed_in(overrides: Sequence[str]) -> int | None:
    """The `simulation.seed` that overrides set; None if they set none."""
    seed = None
    for text in overrides:
        if text.lstrip().startswith("simulation"):
            override = parse_override(text)
            if override.path == "simulation.seed":
                seed = override.value
            elif override.path == "simulation":  # replaces the whole section
                seed = override.value.get("seed") if isinstance(override.value, dict) else None
    return seed if isinstance(seed, int) and abs(seed) < 2**63 else None


def begin_process() -> None:
    """Prepares a worker process: it ends when the process that began it ends."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    # A run's messages are in its result; printed lines of several processes would only mix.
    logging.getLogger("drake_quad").setLevel(logging.CRITICAL)


def guarded(work: Callable[[Trial], Result], trial: Trial) -> Result:
    """Does `work` within the trial's limits of memory and time.

    Returns:
        The result of `work`; or one that says what it raised, as plain values, so that nothing
        keeps the exception and what it refers to alive.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    bound = int(trial.memory * GIB)
    if hard != resource.RLIM_INFINITY:  # it cannot be raised
        bound = min(bound, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (bound, hard))
    # A process that nobody watches any more ends all the same: SIGALRM kills by default.
    signal.setitimer(signal.ITIMER_REAL, trial.wall_time + GRACE)
    try:
        return work(trial)
    except MemoryError:
        outcome, reason = "memory", ""
    except MachineError as error:
        outcome, reason = MACHINE, str(error)
    except Exception as error:  # a trial that cannot be carried out is a finding too
        outcome, reason = "error", f"{type(error).__name__}: {error}"
        if any(word in reason for word in NO_MEMORY):
            outcome, reason = "memory", ""
        elif isinstance(error, OSError) and error.errno in MACHINE_FAULTS:
            outcome = MACHINE
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
    return lost(trial, outcome, reason or f"took more than {bound / GIB:g} GiB")


def own_basis() -> Result:
    """Digests of the sources and library versions of this process."""
    from drake_quad.sweep.provenance import own_sources, own_versions

    return {"sources": own_sources(), "versions": own_versions()}


def lost(trial: Trial, outcome: str, reason: str) -> Result:
    """The result of a trial that ended without one."""
    return {
        "outcome": outcome,
        "reason": " ".join(reason.split()),
        "success": False,
        "mode": None,
        "figures": dict.fromkeys(trial.figures),
        "scenario": None,
        **dict.fromkeys(BASIS),
        "clock": {
            "wall": None,
            "simulating": None,
            "memory": None,
            "process": os.getpid(),
            "tried": 1,
        },
    }


def work(trial: Trial) -> Result:
    """Runs the trial.

    Returns:
        `outcome` (goal_reached, fell, stopped; infeasible, if there is no plan; refused, if there
        is no such scenario; memory), `reason`, `success`, `mode`, `figures` by name, None where
        not measured, `scenario` as it was run, with its gait if that was designed, and the digests
        of BASIS. `clock` holds all that differs from run to run: seconds, memory, process.

    Raises:
        MachineError: If the trial cannot be carried out because of this machine.
    """
    # Imported here, so that a process that only reads results need not wait.
    from drake_quad.robot.digest import robot_digest
    from drake_quad.scenario.load import scenario_text
    from drake_quad.simulation.run import simulate

    begun = time.perf_counter()
    summary: dict[str, Any] = {}
    text = robot = None
    try:
        scenario = trial.base.load(list(trial.overrides))
        text = scenario_text(scenario)
        robot = robot_digest(scenario.robot.model)
        source = trial.base.name
        scenario = designed(scenario, source)
        text = scenario_text(scenario)  # with the gait that walks
        result = simulate(scenario, source=source)
        summary, outcome, reason = result.summary, result.outcome, result.reason
        if outcome == "stopped" and any(word in reason for word in NO_MEMORY):
            outcome = "memory"
        if outcome == "stopped" and "OSError" in reason and any(w in reason for w in FAULTS):
            raise MachineError(source=source, field="trial", value=trial.index, remedy=reason)
    except MachineError as error:
        if not any(word in str(error) for word in NO_MEMORY):
            raise
        outcome, reason = "memory", str(error)
    except InputError as error:
        outcome, reason = "refused", str(error)
    except PlanningError as error:
        outcome, reason = "infeasible", error.reason
    figures = {name: figure_at(summary, name) for name in trial.figures}
    missed = [] if outcome != "goal_reached" else missed_bounds(trial, figures)
    if missed:
        outcome, reason = "bound_missed", "; ".join(missed)
    return {
        "outcome": outcome,
        "reason": " ".join(reason.split()),
        "success": outcome == "goal_reached",
        "mode": summary.get("simulation"),
        "figures": figures,
        "scenario": text,
        **own_basis(),
        "robot": robot,
        "clock": {
            "wall": time.perf_counter() - begun,
            "simulating": summary.get("wall_time"),
            "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIB,
            "process": os.getpid(),
        },
    }


def figure_at(summary: dict[str, Any], path: str) -> float | None:
    """The figure at a dotted path as a number; None if there is none."""
    value: Any = summary
    for step in path.split("."):
        value = value.get(step) if isinstance(value, dict) else None
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def missed_bounds(trial: Trial, figures: dict[str, float | None]) -> list[str]:
    """The bounds that the trial did not keep, in words."""
    missed = []
    for bound in trial.success:
        value = figures[bound.figure]
        if value is None:
            missed.append(f"{bound.figure} was not measured")
        elif bound.least is not None and value < bound.least:
            missed.append(f"{bound.figure} is {value:.4g}, less than {bound.least:g}")
        elif bound.most is not None and value > bound.most:
            missed.append(f"{bound.figure} is {value:.4g}, more than {bound.most:g}")
    return missed


def _make(scenario: Scenario, source: str) -> Scenario:
    return design_preferred(scenario, source=source).scenario


class Designs:
    """Gait designs made in this process, so that trials alike in robot and course share one.

    Attributes:
        made: Number of designs that were made.
    """

    def __init__(self, make: Make = _make) -> None:
        self._make, self._found = make, dict[str, Scenario]()
        self.made = 0

    def __call__(self, scenario: Scenario, source: str) -> Scenario:
        """The scenario with its gait designed, if it asks for that.

        The gait is the same as if no other trial had been designed before.

        Args:
            scenario: A trial's scenario.
            source: What an error names as the scenario.

        Raises:
            InputError: If robot or course cannot be used.
            PlanningError: If no gait climbs it.
        """
        if scenario.design != "auto" or scenario.perception.map == "seen":
            return scenario  # what is seen is not known yet
        usual = Scenario()
        asked = replace(scenario, **{name: getattr(usual, name) for name in UNREAD})
        key = scenario_text(asked)
        if key not in self._found:
            if len(self._found) == KEPT:
                self._found.pop(next(iter(self._found)))
            self._found[key] = self._make(asked, source)
            self.made += 1
        own = {name: getattr(scenario, name) for name in UNREAD}
        return replace(copy.deepcopy(self._found[key]), **own)


designed = Designs()
"""The designs of this process."""
