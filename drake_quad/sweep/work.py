"""One trial in a process of its own: what comes of it, whatever that is, as plain values."""

import ctypes
import logging
import math
import os
import resource
import signal
import sys
import time
from collections.abc import Callable
from typing import Any

from drake_quad.errors import MACHINE_FAULTS, InputError, MachineError, PlanningError
from drake_quad.sweep.trials import Trial

GIB = 1 << 30
GRACE = 30.0  # [s] beyond a trial's time after which its process ends itself
PR_SET_PDEATHSIG = 1  # Linux: prctl(2)
# Words by which a run says that it ran out of memory: Python's, C++'s and the dynamic linker's.
NO_MEMORY = (
    "MemoryError", "bad_alloc", "Unable to allocate", "Cannot allocate memory",
    "failed to map segment",
)  # fmt: skip
FAULTS = tuple(os.strerror(code) for code in MACHINE_FAULTS)  # by which a run says of these
MACHINE = "machine"  # an outcome that is no finding: it ends the sweep
BASIS = ("sources", "versions", "robot")  # what a result is of, beside its trial

Result = dict[str, Any]


def begin_process() -> None:
    """Prepares a worker: it is to end with the process that began it."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    # What a run says of itself is in its result; lines of several processes would only mix.
    logging.getLogger("drake_quad").setLevel(logging.CRITICAL)


def guarded(work: Callable[[Trial], Result], trial: Trial) -> Result:
    """Does `work` within the trial's bounds of memory and time.

    Returns:
        What `work` does; or what says that it raised, as plain values: whatever an exception holds
        on to is let go of before anything more is done.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    bound = int(trial.memory * GIB)
    if hard != resource.RLIM_INFINITY:  # a lower one than the trial's, which may not be raised
        bound = min(bound, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (bound, hard))
    # A process that nobody watches any more ends all the same: the default of SIGALRM kills.
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
    """What any result of this process is of, whatever becomes of its trial."""
    from drake_quad.sweep.provenance import own_sources, own_versions

    return {"sources": own_sources(), "versions": own_versions()}


def lost(trial: Trial, outcome: str, reason: str) -> Result:
    """The result of a trial that gave none."""
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
        is no such scenario; memory), `reason`, `success`, `mode`,
        `figures` by name, None where not measured, `scenario` as it was run, with its gait if that
        was designed, and digests of BASIS.
        Under `clock` all that is another in each run: seconds, memory, process.

    Raises:
        MachineError: If what keeps the trial from being carried out is this machine's fault.
    """
    # Here: a process that only reads results need not wait for these.
    from drake_quad.robot.robot_digest import robot_digest
    from drake_quad.scenario import scenario_text
    from drake_quad.simulation import run
    from drake_quad.sweep.designs import designed

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
        result = run(scenario, source=source)
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
    """What of its bounds the trial did not keep, in words."""
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
