"""Claims about scenarios: what loads, what is refused and how, and that saving loses nothing."""

import dataclasses
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common.yaml import yaml_dump_typed

from drake_quad.control.settings import ControlSettings
from drake_quad.errors import InputError
from drake_quad.planning.settings import PlanSettings
from drake_quad.scenario import (
    control_settings,
    course_of,
    load_scenario,
    mission_of,
    parse_scenario,
    plan_settings,
    save_scenario,
    scenario_text,
    shipped_scenarios,
)
from drake_quad.scenario_config import Scenario
from drake_quad.scenario_config_world import DisturbancesConfig
from drake_quad.scenario_schema import field_types

ROOT = Path(__file__).resolve().parents[1]
SHIPPED = ("case_study", "descend", "flat_walk", "paper", "spin_both_ways")
FLOOR = "course: [{kind: floor, length: 6.0}]\n"


def refused(text: str, overrides: tuple[str, ...] = ()) -> InputError:
    """The error that the text is refused with, after checking its form."""
    with pytest.raises(InputError) as caught:
        parse_scenario(text, source="mine.yaml", overrides=overrides)
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith(caught.value.source) and caught.value.field in line
    assert caught.value.remedy
    return caught.value


def leaves(schema: object, path: str = "") -> dict[str, object]:
    """Every field below a scenario's schema that is no dataclass: path -> type."""
    found: dict[str, object] = {}
    for name, kind in (field_types(schema) or {}).items():
        inner = f"{path}.{name}".lstrip(".")
        found |= leaves(kind, inner) if field_types(kind) else {inner: kind}
    return found


@pytest.mark.parametrize("name", SHIPPED)
def test_saving_and_loading_gives_an_equal_scenario(name: str, tmp_path: Path) -> None:
    """A saved scenario has every field and loads as the one that was saved."""
    scenario = load_scenario(name)
    save_scenario(scenario, tmp_path / "saved.yaml")
    assert load_scenario(tmp_path / "saved.yaml") == scenario
    saved = yaml.safe_load((tmp_path / "saved.yaml").read_text())
    assert set(saved) == {f.name for f in dataclasses.fields(Scenario)}
    assert set(saved["gait"]) == set(field_types(type(scenario.gait)) or {})


@settings(max_examples=25)
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
    scenario = load_scenario("case_study")
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


def test_defaults_of_the_controller_are_its_own() -> None:
    """A scenario that says nothing of the controller has the controller's own defaults."""
    assert control_settings(Scenario()) == ControlSettings()


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


def test_overrides_reach_any_field() -> None:
    """Fields, list elements and Drake's own structs can be overridden; the rest stays."""
    scenario = load_scenario(
        "case_study",
        ["gait.duty_factor=0.8", "course[1].rise=0.2", "simulation.plant.time_step=5e-4"],
    )
    assert scenario.gait.duty_factor == 0.8
    assert scenario.course[1].rise == 0.2 and scenario.course[3].rise == 0.13
    assert scenario.simulation.plant.time_step == 5e-4
    assert scenario.simulation.plant.contact_model == "point"


def test_an_override_is_as_if_written_in_the_file() -> None:
    """Overriding to a value and writing the value give the same scenario."""
    a = parse_scenario(FLOOR, source="a", overrides=["gait.stride=0.5", "simulation.seed=3"])
    b = parse_scenario(FLOOR + "gait: {stride: 0.5}\nsimulation: {seed: 3}\n", source="b")
    assert a == b


def test_a_later_override_wins() -> None:
    """Of two overrides of one field the second counts."""
    scenario = load_scenario("case_study", ["gait.stride=0.5", "gait.stride=0.7"])
    assert scenario.gait.stride == 0.7


BAD_OVERRIDES = [
    ("gait.duty_facto=0.8", "gait.duty_facto", "did you mean duty_factor?"),
    ("gate.duty_factor=0.8", "gate.duty_factor", "did you mean gait?"),
    ("simulation.plant.timestep=1", "simulation.plant.timestep", "did you mean time_step?"),
    ("course[9].rise=0.1", "course[9].rise", "course has 5 elements"),
    ("course[5].rise=0.1", "course[5].rise", "course has 5 elements"),
    ("course.rise=0.1", "course.rise", "course has no fields"),
    ("gait[0]=1", "gait[0]", "gait is not a list"),
    ("gait.duty_factor.x=1", "gait.duty_factor.x", "no fields"),
    ("gait.duty_factor", "gait.duty_factor", "must be path=value"),
    ("=1", "", "must be path=value"),
    ("gait.stride=[1", "gait.stride", "not YAML"),
    ("gait.stride=fast", "gait.stride", "must be a number"),
    ("gait.stride=", "gait.stride", "must be a number"),
    ("gait.stride=.nan", "gait.stride", "must be finite"),
    ("gait.duty_factor=0.7", "gait.duty_factor", "[0.75, 1)"),
    ("course[1].rise=-0.1", "course[1].rise", "negative rise"),
    ("course[1]={kind: floor}", "course[1].length", "must say its length"),
    ("robot.model=nowhere.urdf", "robot.model", "no such file"),
]


@pytest.mark.parametrize(("override", "field", "remedy"), BAD_OVERRIDES)
def test_a_bad_override_is_blamed_itself(override: str, field: str, remedy: str) -> None:
    """The error names the override, not the file, and says what would be right."""
    with pytest.raises(InputError) as caught:
        load_scenario("case_study", [override])
    assert caught.value.source.startswith("override")
    assert caught.value.field == field
    assert remedy in caught.value.remedy


def test_what_an_override_spoils_elsewhere_is_said_of_the_file() -> None:
    """A new time step that no longer divides the file's own period: the period is to change."""
    with pytest.raises(InputError) as caught:
        load_scenario("case_study", ["simulation.plant.time_step=0.003"])
    assert caught.value.source == "case_study.scenario.yaml"
    assert caught.value.field == "controller.period" and "0.003 s" in caught.value.remedy


def test_an_override_into_what_is_no_mapping_is_refused() -> None:
    """Where the file has a number for a mapping there is nothing to override in."""
    error = refused(FLOOR + "gait: 3", ("gait.stride=0.5",))
    assert error.remedy == "gait is not a mapping"


def test_only_a_spin_at_the_lanes_end_leads_onto_the_next() -> None:
    """A quarter turn half-way up the first lane does not let the robot walk the second."""
    spin = "mission=[{kind: spin, angle_deg: 90}, {kind: walk, distance: 1}]"
    with pytest.raises(InputError, match="does not head along"):
        load_scenario("case_study", [spin])


NOT_SCENARIOS = [
    ("", "empty"),
    ("# only a comment\n", "empty"),
    ("- a\n- b\n", "must be a mapping"),
    ("just text", "must be a mapping"),
    ("course: [", "not YAML"),
    ("\tcourse: 1", "not YAML"),
    ("a: *nowhere", "not YAML"),
    ("a: 1\n---\nb: 2\n", "not YAML"),
    ("description: 2024-13-45", "not YAML"),
    ("? [a, b]\n: c", "not YAML"),
    ("\x01", "not YAML"),
    ("[" * 5000, "not YAML"),
    (FLOOR + "gait: {stride: 1.0, stride: 0.5}", "stride is given twice"),
    (FLOOR + FLOOR, "course is given twice"),
]


@pytest.mark.parametrize(("text", "remedy"), NOT_SCENARIOS)
def test_what_is_no_scenario_is_refused_in_a_line(text: str, remedy: str) -> None:
    """Empty, broken or ambiguous documents are one-line errors, never tracebacks."""
    assert remedy in refused(text).remedy


def test_broken_yaml_is_shown_by_line_and_column() -> None:
    """The error says where the YAML breaks."""
    assert refused("gait:\n  stride: 1\n  pitch: [\n").value == "line 4, column 1"


PUSHES, MOTORS = "disturbances: {pushes:", "disturbances: {motor_strength:"
MISFITS = [
    ("gait: {dutyfactor: 0.8}", "gait.dutyfactor", "did you mean duty_factor?"),
    ("gate: {duty_factor: 0.8}", "gate", "did you mean gait?"),
    ("1: 2", "1", "no such field"),
    ("simulation: {plant: {tim_step: 1}}", "simulation.plant.tim_step", "did you mean time_step"),
    ("simulation: {simulator: {zzz: 1}}", "simulation.simulator.zzz", "integration_scheme"),
    ("robot: !other {model: x}", "robot._tag", "no such field"),
    ("gait:", "gait", "must be a mapping"),
    ("gait: 3", "gait", "must be a mapping"),
    ("mission: {kind: walk}", "mission", "must be a list"),
    ("mission: [walk]", "mission[0]", "must be a mapping"),
    ("gait: {stride: long}", "gait.stride", "must be a number"),
    ("gait: {stride: true}", "gait.stride", "must be a number"),
    ("gait: {stride: [1.0]}", "gait.stride", "must be a number"),
    ("gait: {stride: }", "gait.stride", "must be a number"),
    ("gait: {stride: .inf}", "gait.stride", "must be finite"),
    (f"gait: {{stride: 1{'0' * 400}}}", "gait.stride", "must be finite"),
    ("gait: {stride: nan}", "gait.stride", "must be a number"),
    ("simulation: {seed: 2.0}", "simulation.seed", "must be a whole number"),
    ("simulation: {seed: true}", "simulation.seed", "must be a whole number"),
    ("gait: {on_centre: 1}", "gait.on_centre", "must be true or false"),
    ("gait: {pitch: 3}", "gait.pitch", "must be text"),
    ("gait: {pitch: lvel}", "gait.pitch", "did you mean level?"),
    ("gait: {duty_factor: 1.0}", "gait.duty_factor", "[0.75, 1)"),
    ("gait: {duty_factor: 0.74}", "gait.duty_factor", "[0.75, 1)"),
    ("spin: {duty_factor: 0.5}", "spin.duty_factor", "[0.75, 1)"),
    ("gait: {cycle_time: 0}", "gait.cycle_time", "more than 0"),
    ("spin: {cycle_time: -1}", "spin.cycle_time", "more than 0"),
    ("gait: {stance_stagger: 0.54}", "gait.stance_stagger", "less than gait.stance_width"),
    ("gait: {swing_clearance: -0.01}", "gait.swing_clearance", "not be negative"),
    ("transition: {mode: shfit}", "transition.mode", "did you mean shift?"),
    ("body: {path: best}", "body.path", "optimised or uniform"),
    ("simulation: {mode: physical}", "simulation.mode", "did you mean physics?"),
    ("simulation: {friction: 0}", "simulation.friction", "more than 0"),
    ("simulation: {seed: -1}", "simulation.seed", "not be negative"),
    ("simulation: {log_period: 0.0015}", "simulation.log_period", "whole multiple"),
    ("controller: {period: 0.0005}", "controller.period", "whole multiple"),
    (
        "simulation: {plant: {discrete_contact_approximation: tamsi}}",
        "simulation.plant.discrete_contact_approximation",
        "lagged, similar or sap",
    ),
    (
        "simulation: {plant: {contact_model: points}}",
        "simulation.plant.contact_model",
        "did you mean point?",
    ),
    (
        "simulation: {simulator: {integration_scheme: rk3}}",
        "simulation.simulator.integration_scheme",
        "runge_kutta3",
    ),
    (
        "simulation: {simulator: {target_realtime_rate: 1}}",
        "simulation.simulator.target_realtime_rate",
        "simulation.realtime_rate",
    ),
    ("start: {distance: 6.1}", "start.distance", "6 m long"),
    ("start: {distance: -0.1}", "start.distance", "not be negative"),
    ("mission: [{kind: wlak, distance: 1}]", "mission[0].kind", "did you mean walk?"),
    ("mission: [{kind: walk}]", "mission[0].distance", "must say its distance"),
    ("mission: [{kind: spin, angle_deg: 0}]", "mission[0].angle_deg", "other than 0"),
    ("mission: [{kind: stand, duration: -1}]", "mission[0].duration", "more than 0 s"),
    ("mission: [{kind: spin, distance: 1}]", "mission[0].distance", "spin has no distance"),
    ("mission: [{kind: walk, distance: 5.1}]", "mission[0].distance", "leads off the lane"),
    (
        "mission: [{kind: spin, angle_deg: 90}, {kind: walk, distance: 1}]",
        "mission[1].distance",
        "does not head along",
    ),
    (
        "mission: [{kind: walk, distance: 1}, {kind: spin, angle_deg: 180}, "
        "{kind: walk, distance: 1}]",
        "mission[2].distance",
        "does not head along",
    ),
    ("controller: {kind: ikk}", "controller.kind", "ik or whole_body; did you mean ik?"),
    ("estimator: {kind: kalman}", "estimator.kind", "truth or ekf"),
    ("sensors: {noise: some}", "sensors.noise", "none or realistic"),
    (f"{PUSHES} [{{speed: 1}}]}}", "disturbances.pushes[0].time", "must say its time"),
    (f"{PUSHES} [{{time: -1, speed: 1}}]}}", "disturbances.pushes[0].time", "not be negative"),
    (f"{PUSHES} [{{time: 1}}]}}", "disturbances.pushes[0].speed", "speed or its force"),
    (f"{PUSHES} [{{time: 1, sped: 1}}]}}", "disturbances.pushes[0].sped", "did you mean speed?"),
    (f"{PUSHES} [{{time: 1, speed: 0}}]}}", "disturbances.pushes[0].speed", "more than 0 m/s"),
    (
        f"{PUSHES} [{{time: 1, speed: 1, force: [1, 0, 0]}}]}}",
        "disturbances.pushes[0].speed",
        "not both",
    ),
    (
        f"{PUSHES} [{{time: 1, direction_deg: 9, force: [1, 0, 0]}}]}}",
        "disturbances.pushes[0].direction_deg",
        "not both",
    ),
    (f"{PUSHES} [{{time: 1, force: [1, 0]}}]}}", "disturbances.pushes[0].force", "three numbers"),
    (f"{PUSHES} [{{time: 1, force: [0, 0, 0]}}]}}", "disturbances.pushes[0].force", "not be zero"),
    (
        f"{PUSHES} [{{time: 1, force: [1, .nan, 0]}}]}}",
        "disturbances.pushes[0].force[1]",
        "finite",
    ),
    (
        f"{PUSHES} [{{time: 1, speed: 1, point: [1]}}]}}",
        "disturbances.pushes[0].point",
        "three numbers",
    ),
    (
        f"{PUSHES} [{{time: 1, speed: 1, duration: 0}}]}}",
        "disturbances.pushes[0].duration",
        "more than 0 s",
    ),
    ("disturbances: {payload: {mass: -1}}", "disturbances.payload.mass", "from 0 to"),
    ("disturbances: {payload: {z: 9}}", "disturbances.payload.z", "from -2 to 2"),
    ("disturbances: {com_offset: {x: 9}}", "disturbances.com_offset.x", "from -2 to 2"),
    (f"{MOTORS} [{{factor: 0.5}}]}}", "disturbances.motor_strength[0].joint", "which joint"),
    (f"{MOTORS} [{{joint: a}}]}}", "disturbances.motor_strength[0].factor", "its factor"),
    (f"{MOTORS} [{{joint: a, factor: 2}}]}}", "disturbances.motor_strength[0].factor", "0 to 1"),
    (
        f"{MOTORS} [{{joint: a, factor: 1}}, {{joint: a, factor: 0}}]}}",
        "disturbances.motor_strength[1].joint",
        "given twice",
    ),
    ("disturbances: {sensor_delay: 0.0015}", "disturbances.sensor_delay", "whole multiple"),
    ("disturbances: {command_delay: 0.0001}", "disturbances.command_delay", "whole multiple"),
    ("disturbances: {command_delay: -0.001}", "disturbances.command_delay", "from 0 to 1"),
    (
        "disturbances: {sensor_delay: 0.004}\nsimulation: {plant: {time_step: 0.0}}",
        "disturbances.sensor_delay",
        "needs a plant in steps",
    ),
    ("world: {rise_error: 1}", "world.rise_error", "from -0.1 to 0.1"),
    ("world: {tread_error: -0.01}", "world.tread_error", "from 0 to 0.1"),
    ("world: {yaw_error_deg: 40}", "world.yaw_error_deg", "from -20 to 20"),
    ("world: {random: 1}", "world.random", "true or false"),
    ("robot: {model: nowhere.urdf}", "robot.model", "no such file"),
    (
        "robot: {model: 'package://drake_quad_models/paper_quadrupd.urdf'}",
        "robot.model",
        "did you mean package://drake_quad_models/paper_quadruped.urdf?",
    ),
]


@pytest.mark.parametrize(("text", "field", "remedy"), MISFITS)
def test_a_misfit_is_named_by_its_path(text: str, field: str, remedy: str) -> None:
    """Unknown keys, wrong types and impossible values: exact path, value, and remedy."""
    error = refused(FLOOR + text)
    assert (error.source, error.field) == ("mine.yaml", field)
    assert remedy in error.remedy


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("description: no course at all", "course"),
        ("course: []", "course"),
        ("course: [{length: 3.0}]", "course[0].kind"),
        ("course: [{kind: floor, lenght: 3.0}]", "course[0].lenght"),
        ("course: [{kind: floor, length: 3.0, rise: 0.1}]", "course[0].rise"),
        ("course: [{kind: landing, length: 1.0, turn_deg: 90}]", "course[0].length"),
    ],
)
def test_a_wrong_course_is_named_by_its_path(text: str, field: str) -> None:
    """The course's own checks speak of the scenario's file."""
    error = refused(text)
    assert (error.source, error.field) == ("mine.yaml", field)


@pytest.mark.parametrize("path", [p for p, kind in leaves(Scenario).items() if kind is float])
def test_no_number_takes_text_nan_or_infinity(path: str) -> None:
    """Every number of a scenario, Drake's own too, refuses what is none, by its path."""
    for value in ("text", ".nan", "-.inf", "[1]"):
        with pytest.raises(InputError) as caught:
            load_scenario("flat_walk", [f"{path}={value}"])
        assert caught.value.field == path


def test_yaml_one_point_one_reads_exponents_as_text_and_still_loads() -> None:
    """1e-3, which YAML 1.1 takes for text, is the number that the person meant."""
    scenario = parse_scenario(FLOOR + "gait: {stride: 1e-1}", source="text")
    assert scenario.gait.stride == 0.1


def test_keys_with_an_underscore_hold_anchors() -> None:
    """A top-level key that begins with an underscore is no field, but may be referred to."""
    text = "_f: &f {kind: floor, length: 6.0}\ncourse: [*f, *f]\n"
    course = parse_scenario(text, source="text").course
    assert course[0] == course[1] and course[0] is not course[1]


def test_a_continuous_plant_has_no_step_to_be_a_multiple_of() -> None:
    """With time_step 0 any period is as good as another."""
    text = FLOOR + "simulation: {plant: {time_step: 0.0}, log_period: 0.0033}"
    assert parse_scenario(text, source="text").simulation.log_period == 0.0033


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("case_stdy", "did you mean case_study?"),
        ("nothing_like_it", "shipped are blind_errors, case_study"),
        ("dir/flat_walk.yaml", "no such file"),
        ("\0", "cannot be read"),
        ("x" * 5000, "cannot be read"),
    ],
)
def test_a_missing_scenario_suggests_the_nearest(name: str, remedy: str) -> None:
    """Neither file nor shipped name: one line that says what there is."""
    with pytest.raises(InputError) as caught:
        load_scenario(name)
    assert remedy in caught.value.remedy and caught.value.source == name


def test_a_directory_and_a_binary_file_are_refused(tmp_path: Path) -> None:
    """A directory is no scenario; nor are bytes that are no text."""
    with pytest.raises(InputError, match="is a directory"):
        load_scenario(tmp_path)
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(InputError, match="not a text file"):
        load_scenario(tmp_path / "binary.yaml")


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


def test_the_documentation_has_every_field_and_its_default() -> None:
    """docs/scenario.md lists each field of the schema, with the default that the code has."""
    text = (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `([\w.]+)` \| ([^|]*) \|", text, flags=re.MULTILINE))
    defaults = yaml.safe_load(yaml_dump_typed(Scenario()))
    for path in leaves(Scenario):
        if path.startswith(("simulation.plant.", "simulation.simulator.", "course", "mission")):
            continue
        value = defaults
        for name in path.split("."):
            value = value[name]
        shown = rows[path].strip().strip("`")
        assert yaml.safe_load(shown) == value or (value == "" and shown == "(none)")
    lists = [Scenario.__annotations__[name] for name in ("course", "mission")]
    lists += [DisturbancesConfig.__annotations__[name] for name in ("pushes", "motor_strength")]
    for schema in lists:
        for name in field_types(schema.__args__[0]) or {}:
            assert f"| `{name}` |" in text
