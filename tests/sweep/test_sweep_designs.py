"""Trials alike in robot and course share a design, and none can tell."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import sweep_rig as rig

from drake_quad.errors import PlanningError
from drake_quad.gait_design.designer import design_scenario
from drake_quad.scenario.config import MissionElement, Scenario
from drake_quad.scenario.load import parse_scenario, scenario_text
from drake_quad.sweep.trials import KEPT, UNREAD, Designs, make_trials, work
from drake_quad.terrain.elements import Element

TEXT = """
robot: {model: paper_quadruped}
course:
  - {kind: floor, length: 3.0, width: 2.0}
  - {kind: stairs, going: up, rise: 0.12, run: 0.32, count: 2, width: 2.0}
  - {kind: floor, length: 3.0, width: 2.0}
"""


EXTRA: dict[str, Any] = {
    "course": Element(kind="floor"),
    "mission": MissionElement(kind="stand"),
}


def trial(**more: Any) -> Scenario:
    return replace(parse_scenario(TEXT, source="here"), **more)


def test_a_shared_design_is_the_one_that_a_trial_would_have_made() -> None:
    """With another world, friction, sensors and pushes: word for word, and made once."""
    designs = Designs()
    first = designs(trial(), "here")
    other = trial(description="another")
    other.world.rise_error, other.simulation.friction = 0.01, 0.5
    other.estimator.kind, other.disturbances.mass_factor = "ekf", 1.1
    second = designs(other, "here")
    assert designs.made == 1
    assert scenario_text(second) == scenario_text(design_scenario(other).scenario)
    assert scenario_text(second) != scenario_text(first) != scenario_text(trial())
    assert other.design == "auto"  # what was given is not changed


def test_what_a_design_reads_makes_another() -> None:
    """Every field but those that are named as unread is part of what it was made for."""
    designs = Designs(lambda scenario, _: scenario)
    designs(trial(), "here")
    for name in set(vars(trial())) - {*UNREAD, "design"}:
        other = trial()
        section = getattr(other, name)
        if isinstance(section, list):
            setattr(other, name, [*section, EXTRA[name]])
        elif isinstance(section, str):
            setattr(other, name, f"{section}x")
        else:
            field, value = next(iter(vars(section).items()))
            more = f"{value}x" if isinstance(value, str) else value + 1.0
            setattr(other, name, replace(section, **{field: more}))
        made = designs.made
        designs(other, "here")
        assert designs.made == made + 1, name


def test_one_design_cannot_be_changed_through_another() -> None:
    """What a trial does to its scenario is its own affair."""
    designs = Designs(lambda scenario, _: scenario)
    designs(trial(), "here").gait.stride = 99.0
    assert designs(trial(), "here").gait.stride != 99.0


def test_no_more_are_kept_than_there_is_room_for_and_a_given_gait_is_left_alone() -> None:
    """The oldest goes first; a scenario that says its gait comes back as it is."""
    designs = Designs(lambda scenario, _: scenario)
    for k in range(KEPT + 1):
        scenario = trial()
        scenario.start.distance = 1.0 + 0.01 * k
        designs(scenario, "here")
    first = trial()
    first.start.distance = 1.0
    designs(first, "here")
    assert designs.made == KEPT + 2
    given = trial(design="given")
    assert designs(given, "here") is given


def test_a_table_has_the_gait_that_walked(tmp_path: Path) -> None:
    """Not the gait that stands in a scenario which asks for a design."""
    text = rig.PLUMBING.replace("set:\n", "set:\n  - design=auto\n").split("  - {path: gait")[0]
    result = work(rig.trials_of(tmp_path, text)[0])
    assert result["outcome"] == "goal_reached", result["reason"]
    walked = parse_scenario(result["scenario"], source="table")
    asked = trial_base(tmp_path, text)
    assert asked.design == "auto" and walked.design != "auto"
    assert walked.gait == design_scenario(asked).scenario.gait != asked.gait


def trial_base(directory: Path, text: str) -> Scenario:
    """The scenario that the first trial of a study is to run."""
    study, base = rig.made(directory, text)
    return base.load(list(next(iter(make_trials(study, base, first=0, last=1))).overrides))


def test_what_cannot_be_designed_is_refused_each_time() -> None:
    """A refusal is not kept: it is told again."""

    def refuse(_scenario: Scenario, _source: str) -> Scenario:
        raise PlanningError("too high")

    designs = Designs(refuse)
    for _ in range(2):
        with pytest.raises(PlanningError, match="too high"):
            designs(trial(), "here")
