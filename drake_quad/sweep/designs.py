"""Designs made in this process: trials alike in robot and course need not be designed anew."""

import copy
from collections.abc import Callable
from dataclasses import replace

from drake_quad.designer import design_scenario
from drake_quad.scenario import Scenario, scenario_text

# Sections that no design reads: what its controller is not told, and what is measured how.
UNREAD = (
    "description", "estimator", "sensors", "disturbances", "world", "monitor", "certify",
    "simulation",
)  # fmt: skip
KEPT = 32  # designs

Make = Callable[[Scenario, str], Scenario]


def _make(scenario: Scenario, source: str) -> Scenario:
    return design_scenario(scenario, source=source).scenario


class Designs:
    """Designs by what they were made for.

    Attributes:
        made: How many were made.
    """

    def __init__(self, make: Make = _make) -> None:
        self._make, self._found = make, dict[str, Scenario]()
        self.made = 0

    def __call__(self, scenario: Scenario, source: str) -> Scenario:
        """The scenario with its gait designed if it asks for that: as if it were designed alone.

        Args:
            scenario: Of a trial.
            source: What an error names.

        Raises:
            InputError: If robot or course cannot be used.
            PlanningError: If no gait climbs it.
        """
        if scenario.design != "auto":
            return scenario
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
"""Of this process."""
