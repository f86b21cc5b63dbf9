"""The scenario that a study varies."""

import os
from dataclasses import dataclass, field
from pathlib import Path

from drake_quad.given_files import MOST_YAML, is_given, read_given_text
from drake_quad.scenario import load_scenario, parse_scenario
from drake_quad.scenario_config import Scenario
from drake_quad.sweep.study_config import Study
from drake_quad.user_path import user_path


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
