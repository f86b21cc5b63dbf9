"""A study's trials: what any process needs to carry one out, and the command that repeats it."""

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_quad.scenario_override import parse_override
from drake_quad.sweep.base import Base
from drake_quad.sweep.draws import Draws
from drake_quad.sweep.study import overrides_of
from drake_quad.sweep.study_config import Bound, Study

RANKED_BY = "margin.minimum"  # the least is the worst trial
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

TRIALS_DIRECTORY = "trials"  # of those that were run again


@dataclass(frozen=True)
class Trial:
    """One trial, whole: it can be sent to any process.

    Attributes:
        index: In its study, from 0.
        seed: Its `simulation.seed`: drawn, unless the study sets it.
        values: What it has of each thing that varies, in the study's order.
        base: The scenario.
        overrides: Of the scenario's fields, those of the study first.
        figures: Of summary.json, to keep.
        success: What it must keep besides reaching the goal.
        wall_time: After which it is ended [s].
        memory: Of its process [GiB].
    """

    index: int
    seed: int
    values: tuple[Any, ...]
    base: Base
    overrides: tuple[str, ...]
    figures: tuple[str, ...]
    success: tuple[Bound, ...]
    wall_time: float
    memory: float


def figures_of(study: Study) -> tuple[str, ...]:
    """The figures that the study keeps: its own, and those that it is judged and ranked by."""
    kept = dict.fromkeys(study.figures or USUAL_FIGURES)
    kept.update(dict.fromkeys(bound.figure for bound in study.success))
    kept[RANKED_BY] = None
    return tuple(kept)


def make_trials(study: Study, base: Base, *, first: int, last: int) -> Iterator[Trial]:
    """The trials from `first` until before `last`, in order, each made as it is asked for."""
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
    """Of the whole study."""
    return Draws(study).count


def directory_of(index: int, out: Path) -> Path:
    """Where the files of a trial go that is run again."""
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


def repeat_into(command: str, index: int, out: Path) -> str:
    """The same, with the directory where the sweep's report looks for it."""
    return f"{command} --out {shlex.quote(str(directory_of(index, out)))}"


def seed_in(overrides: Sequence[str]) -> int | None:
    """The `simulation.seed` that overrides set, if they do."""
    seed = None
    for text in overrides:
        if text.lstrip().startswith("simulation"):
            override = parse_override(text)
            if override.path == "simulation.seed":
                seed = override.value
            elif override.path == "simulation":  # all of it, and what was said of it before is gone
                seed = override.value.get("seed") if isinstance(override.value, dict) else None
    return seed if isinstance(seed, int) and abs(seed) < 2**63 else None
