"""Claims about scenarios: what loads, what is refused and how, and that saving loses nothing."""

import copy
import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings, strategies as st

from drake_quad.errors import InputError
from drake_quad.planning.problem import PlanSettings
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import (
    load_scenario,
    parse_scenario,
    save_scenario,
    scenario_text,
    shipped_scenarios,
)
from drake_quad.util.yaml_io import field_types

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = ("case_study", "descend", "flat_walk", "paper", "spin_both_ways")
CASE_STUDY = load_scenario("case_study")
FLOOR = "course: [{kind: floor, length: 6.0}]\n"


@pytest.mark.parametrize("name", SHIPPED)
def test_saving_and_loading_gives_an_equal_scenario(name: str, tmp_path: Path) -> None:
    """A saved scenario has every field and loads as the one that was saved."""
    scenario = load_scenario(name)
    save_scenario(scenario, tmp_path / "saved.yaml")
    assert load_scenario(tmp_path / "saved.yaml") == scenario
    saved = yaml.safe_load((tmp_path / "saved.yaml").read_text())
    assert set(saved) == {f.name for f in dataclasses.fields(Scenario)}
    assert set(saved["gait"]) == set(field_types(type(scenario.gait)) or {})


@settings(max_examples=15)
@given(
    st.floats(0.75, 0.98),
    st.floats(1e-6, 1e6),
    st.integers(0, 2**40),
    st.text(max_size=40),
    st.sampled_from(["sap", "similar", "lagged"]),
)
def test_numbers_and_text_survive_saving_to_the_bit(
    beta: float, width: float, seed: int, description: str, solver: str
) -> None:
    """Whatever the values, the text gives back just them."""
    scenario = copy.deepcopy(CASE_STUDY)
    scenario.gait.duty_factor = beta
    scenario.gait.workspace_width = width
    scenario.simulation.seed = seed
    scenario.simulation.plant.discrete_contact_approximation = solver
    scenario.description = description
    assert parse_scenario(scenario_text(scenario), source="text") == scenario


def test_equality_sees_drakes_own_fields() -> None:
    """Two scenarios that differ only in the plant's configuration are not equal."""
    a, b = load_scenario("case_study"), load_scenario("case_study")
    assert a == b
    b.simulation.plant.stiction_tolerance *= 2.0
    assert a != b


def test_shipped_scenarios_are_listed_with_descriptions() -> None:
    """All shipped scenarios load, and each says in one line what it shows."""
    listed = dict(shipped_scenarios())
    assert set(SHIPPED) <= set(listed)
    assert all(text and "\n" not in text for text in listed.values())


def test_case_study_is_the_papers() -> None:
    """Six stairs of 0.13 m by 0.50 m up, a turn by 90 degrees, six down."""
    course = course_of(load_scenario("case_study"))
    assert [lane.flights[0].going for lane in course.lanes] == ["up", "down"]
    assert len(course.nosings()) == 12
    assert list(course.turns) == pytest.approx([math.pi / 2])
    np.testing.assert_allclose(np.diff(course.lanes[0].heights)[:6], 0.13)
    np.testing.assert_allclose(np.diff(course.lanes[1].breaks)[1:7], 0.50)


def test_paper_is_table_one_on_the_same_course() -> None:
    """The paper's scenario has Table I's numbers, and the case study's course."""
    paper = load_scenario("paper")
    gait = paper.gait
    assert paper.course == load_scenario("case_study").course
    assert (gait.workspace_length, gait.workspace_width) == (0.76, 0.5)
    assert (gait.stance_length, gait.stance_width) == (0.8, 0.54)
    assert (gait.duty_factor, gait.cycle_time, gait.swing_clearance) == (0.75, 8.0, 0.02)
    assert gait.stance_stagger == 0.0 and paper.spin.duty_factor == 0.75


def test_defaults_are_the_planners() -> None:
    """A scenario that says nothing of the gait plans with the planner's own defaults."""
    assert plan_settings(Scenario()) == PlanSettings()


CHANGED: dict[str, dict[str, Any]] = {
    "gait.duty_factor=0.9": {"duty_factor": 0.9},
    "gait.pitch=slope": {"pitch_along_slope": 1.0},
    "gait.on_centre=false": {"on_centre": False},
    "spin.duty_factor=0.8": {"spin_duty_factor": 0.8},
    "spin.cycle_time=9": {"spin_cycle_time": 9.0},
    "transition.mode=still": {"body_still": True},
    "body.path=uniform": {"uniform_body": True},
    "body.zmp_margin=0.01": {"zmp_margin": 0.01},
}


@pytest.mark.parametrize("override", CHANGED)
def test_every_field_reaches_the_planner_alone(override: str) -> None:
    """Changing one field changes the planner's one setting and no other."""
    changed = plan_settings(load_scenario("case_study", [override]))
    base = plan_settings(load_scenario("case_study"))
    assert changed == dataclasses.replace(base, **CHANGED[override])
    assert changed != base


def test_only_a_spin_at_the_lanes_end_leads_onto_the_next() -> None:
    """A quarter turn half-way up the first lane does not let the robot walk the second."""
    spin = "mission=[{kind: spin, angle_deg: 90}, {kind: walk, distance: 1}]"
    with pytest.raises(InputError, match="does not head along"):
        load_scenario("case_study", [spin])


def test_a_robots_path_is_relative_to_the_scenarios_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also from another working directory the robot beside the scenario is found."""
    (tmp_path / "mine.urdf").write_text("<robot/>")
    (tmp_path / "mine.yaml").write_text(FLOOR + "robot: {model: mine.urdf}")
    monkeypatch.chdir(ROOT)
    scenario = load_scenario(tmp_path / "mine.yaml")
    assert scenario.robot.model == str(tmp_path / "mine.urdf")
    monkeypatch.chdir(tmp_path)
    assert load_scenario("flat_walk", ["robot.model=mine.urdf"]) == load_scenario(
        "flat_walk", [f"robot.model={tmp_path / 'mine.urdf'}"]
    )


def test_another_packages_robot_is_left_to_the_parser() -> None:
    """A URL of a package that is not this one's is not looked up here."""
    text = FLOOR + "robot: {model: 'package://elsewhere/dog.urdf'}"
    assert parse_scenario(text, source="text").robot.model == "package://elsewhere/dog.urdf"


def test_a_spin_by_the_turn_leads_onto_the_next_lane() -> None:
    """The case study's mission, told step by step, happens on the lanes that it should."""
    scenario = load_scenario("case_study", ["mission=[{kind: walk, distance: 8.0}, "
        "{kind: spin, angle_deg: 60}, {kind: spin, angle_deg: 30}, {kind: walk, distance: 6}, "
        "{kind: walk, distance: 0.5}, {kind: stand, duration: 2}]"])  # fmt: skip
    tasks = mission_of(scenario, course_of(scenario))
    assert [task.lane for task in tasks] == [0, 0, 0, 1, 1, 1]
    assert [task.goal for task in tasks if task.kind == "walk"] == [9.25, 6.0, 6.5]
    assert sum(task.angle for task in tasks) == pytest.approx(math.pi / 2)
    assert tasks[-1].duration == 2.0


def test_spin_both_ways_comes_back() -> None:
    """The shipped spin turns a quarter to the left and just as much back."""
    scenario = load_scenario("spin_both_ways")
    angles = [t.angle for t in mission_of(scenario, course_of(scenario)) if t.kind == "spin"]
    assert angles == [pytest.approx(math.pi / 2), pytest.approx(-math.pi / 2)]
