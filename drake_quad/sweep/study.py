"""A study and its fields, and the scenario that it varies.

docs/sweeps.md lists them. Plain dataclasses, checked by `study_loading.py` once; after that nobody
writes to them.
"""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario, parse_scenario
from drake_quad.util.files import MOST_YAML, is_given, read_given_text, user_path

# ------------------------------------------------------------------------------------------------
# A study's fields, as its YAML file fills them: what varies, how often, and what counts.
# ------------------------------------------------------------------------------------------------


@dataclass
class Vary:
    """One thing that differs between trials: exactly one of the ways from `uniform` to `cases`.

    Attributes:
        path: The scenario's field, for example `course[1].rise`; none with `cases`.
        also: Further fields that get the same value.
        name: What reports call it; the path if none.
        uniform: Drawn evenly between two numbers.
        log_uniform: The same, but evenly in the logarithm.
        normal: Drawn by mean and standard deviation, within four of them.
        integers: A whole number, from the first to the last, both counted.
        choice: One of these, each as likely.
        values: All of these in turn: an axis of the grid.
        linspace: From, to, how many: an axis of the grid.
        cases: By name, overrides that go together: an axis of the grid.
        step: A drawn number is rounded to whole multiples of it.
        bands: Into how many bands a drawn number is parted in reports.
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
        """What to call it."""
        return self.name or self.path


@dataclass
class SuccessBound:
    """A bound on a figure that a trial must keep to count as a success.

    Attributes:
        figure: Dotted path in summary.json, for example `margin.minimum`.
        least: It must be at least this.
        most: It must be at most this.
    """

    figure: str = ""
    least: float | None = None
    most: float | None = None


@dataclass
class Limits:
    """What a trial may take before it is ended, and counted as such.

    Attributes:
        wall_time: [s]
        memory: Of its process [GiB].
        retries: How often a trial is tried again whose process somebody else ended.
        recycle: After so many trials a process is replaced by a new one.
    """

    wall_time: float = 1800.0
    memory: float = 4.0
    retries: int = 3
    recycle: int = 25


@dataclass
class Gate:
    """What `drake-quad sweep` asks of the study to exit with 0.

    Attributes:
        rate: Least part of the trials that succeed, in [0, 1]; none: nothing is asked.
        each: Name or path of what varies, of each of whose bands that is asked; none: of all.
    """

    rate: float | None = None
    each: str | None = None


@dataclass
class Study:
    """Which runs, and what of them counts.

    Attributes:
        description: What it asks, in a line.
        scenario: A shipped scenario's name, or a file, relative to the study's.
        set: Overrides of every trial, `path=value` each.
        vary: What differs between trials.
        trials: How many to each cell of the grid; in all if there is no grid.
        seed: Of all draws.
        sampling: `random`, or `sobol` for draws that fill their space evenly.
        draws: `independent`, or `common`: each cell of the grid has the same draws and seeds.
        success: What a trial must keep besides reaching the goal.
        figures: Which figures of summary.json the table keeps, by dotted path.
        maps: Pairs of what varies, by path or name, to draw a heat map of.
        limits: Of each trial.
        gate: Of the whole study.
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
        """What varies, by its names and its paths."""
        return {name: vary for vary in self.vary for name in (vary.path, vary.title) if name}


# ------------------------------------------------------------------------------------------------
# The scenario that a study varies.
# ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Base:
    """The scenario that a study varies, so that any process has it.

    Attributes:
        name: As on the command line.
        text: The file's; None of a shipped scenario.
        directory: From which the robot's file is looked up.
        here: The same, where an override names it: as on the command line.
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
        return Base(str(path))  # whose loading says what is wrong with it
    return Base(str(path), text, str(path.parent.resolve()))
