"""A study and its fields, and the scenario that it varies.

docs/sweeps.md lists the fields. The classes are plain dataclasses; `study_loading.py` checks them
once, and after that nothing writes to them.
"""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario, parse_scenario
from drake_quad.util.files import MOST_YAML, is_given, read_given_text, user_path


@dataclass
class Vary:
    """One thing that differs between trials, in exactly one of the ways from `uniform` to `cases`.

    Attributes:
        path: The scenario's field, for example `course[1].rise`; empty with `cases`.
        also: Further fields that get the same value.
        name: Name in reports; the path if empty.
        uniform: Lower and upper end of a uniform distribution.
        log_uniform: Lower and upper end of a distribution that is uniform in the logarithm.
        normal: Mean and standard deviation of a normal distribution, cut off at four deviations.
        integers: First and last of the whole numbers to draw from, both included.
        choice: Values to draw from, each as likely.
        values: Values of an axis of the grid.
        linspace: First value, last value and number of values of an axis of the grid.
        cases: Lists of overrides that go together, by name: an axis of the grid.
        step: Drawn numbers are rounded to whole multiples of it.
        bands: Number of bands into which reports divide drawn numbers.
    """

    path: str = ""
    also: list[str] = field(default_factory=list)
    name: str = ""
    uniform: list[float] | None = None
    log_uniform: list[float] | None = None
    normal: list[float] | None = None
    integers: list[int] | None = None
    choice: list[Any] | None = None
    values: list[Any] | None = None
    linspace: list[float] | None = None
    cases: dict[str, list[str]] | None = None
    step: float | None = None
    bands: int = 5

    @property
    def title(self) -> str:
        """Its name in reports."""
        return self.name or self.path


@dataclass
class SuccessBound:
    """A bound on a figure that a trial must keep to count as a success.

    Attributes:
        figure: Dotted path in summary.json, for example `margin.minimum`.
        least: Smallest value that counts as success.
        most: Largest value that counts as success.
    """

    figure: str = ""
    least: float | None = None
    most: float | None = None


@dataclass
class Limits:
    """Limits at which a trial is ended, and counted as a timeout or as out of memory.

    Attributes:
        wall_time: Wall time of a trial [s].
        memory: Memory of a trial's process [GiB].
        retries: How often a trial is tried again if its process was ended from outside.
        recycle: Number of trials after which a process is replaced by a new one.
    """

    wall_time: float = 1800.0
    memory: float = 4.0
    retries: int = 3
    recycle: int = 25


@dataclass
class Gate:
    """What the study must reach for `drake-quad sweep` to exit with 0.

    Attributes:
        rate: Smallest rate of success that passes, in [0, 1]; None if there is no gate.
        each: Name or path of what varies: each of its bands must reach the rate. None if the rate
            is that of all trials.
    """

    rate: float | None = None
    each: str | None = None


@dataclass
class Study:
    """Which runs to carry out, and what counts as success.

    Attributes:
        description: The question of the study, in a line.
        scenario: A shipped scenario's name, or a file, relative to the study's.
        set: Overrides of every trial, `path=value` each.
        vary: What differs between trials.
        trials: Number of trials in each cell of the grid; in all if there is no grid.
        seed: Seed of all draws.
        sampling: `random`, or `sobol` for draws that fill their space evenly.
        draws: `independent`, or `common`: each cell of the grid has the same draws and seeds.
        success: Bounds that a trial must keep besides reaching the goal.
        figures: Figures of summary.json that the table keeps, by dotted path.
        maps: Pairs of what varies, by path or name, to draw a heat map of.
        limits: Limits of each trial.
        gate: Rate of success that the whole study must reach.
    """

    description: str = ""
    scenario: str = ""
    set: list[str] = field(default_factory=list)
    vary: list[Vary] = field(default_factory=list)
    trials: int = 1
    seed: int = 0
    sampling: str = "random"
    draws: str = "independent"
    success: list[SuccessBound] = field(default_factory=list)
    figures: list[str] = field(default_factory=list)
    maps: list[list[str]] = field(default_factory=list)
    limits: Limits = field(default_factory=Limits)
    gate: Gate = field(default_factory=Gate)

    def by_name(self) -> dict[str, Vary]:
        """What varies, by name and by path."""
        return {name: vary for vary in self.vary for name in (vary.path, vary.title) if name}


@dataclass(frozen=True)
class Base:
    """The scenario that a study varies, in a form that any process can load.

    Attributes:
        name: Name or file, as on the command line.
        text: Text of the file; None if the scenario is a shipped one.
        directory: Directory that a robot's file in the scenario is relative to.
        here: Directory that a robot's file in an override is relative to.
    """

    name: str
    text: str | None = None
    directory: str | None = None
    here: str = field(default_factory=os.getcwd)

    def load(self, overrides: list[str]) -> Scenario:
        """The scenario with these overrides.

        Raises:
            InputError: If it cannot be used.
        """
        here = Path(self.here)
        if self.text is None:
            return load_scenario(self.name, overrides, here=here)
        directory = None if self.directory is None else Path(self.directory)
        return parse_scenario(
            self.text, source=self.name, base=directory, overrides=overrides, here=here
        )


def find_base(study: Study, *, directory: Path) -> Base:
    """The study's scenario: a file relative to the study's, or a shipped one."""
    path = directory / user_path(study.scenario)
    try:
        if not is_given(path):
            return Base(study.scenario)
        text = read_given_text(path, most=MOST_YAML)
    except (OSError, ValueError):
        return Base(str(path))  # loading it will say what is wrong
    return Base(str(path), text, str(path.parent.resolve()))
